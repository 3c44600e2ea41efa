//! Contact search: where a sphere touches a wall.

use super::{Cylinder, Shape, Vec3, mesh::MeshSurface};

/// A shape prepared for contact search; all coordinates are in the wall's own frame.
#[derive(Clone, Debug)]
pub struct Surface {
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Planes(Vec<HalfSpace>),
    Cylinder(Cylinder),
    Mesh(MeshSurface),
}

#[derive(Clone, Copy, Debug)]
struct HalfSpace {
    through: Vec3,
    normal: Vec3,
}

impl HalfSpace {
    /// Signed distance in m; negative behind the plane.
    #[inline]
    fn distance(&self, position: &Vec3) -> f64 {
        (position - self.through).dot(&self.normal)
    }
}

/// A contact of a sphere with a feature of a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Index of the feature in the list that was searched.
    pub entry: u32,
    /// Unit normal, from the wall into the sphere.
    pub normal: Vec3,
    /// Signed distance from the surface to the centre, in m; less than the radius, negative behind a one-sided wall.
    pub distance: f64,
    /// Share of the contact's force that is its own; the rest is that of other contacts with the same patch.
    pub share: f64,
    /// The same of its elastic energy.
    pub energy_share: f64,
    /// Stiffness along the normal of all the sphere's contacts with this surface, over that of this one.
    pub crowd: f64,
}

impl Touch {
    /// A contact that shares nothing.
    #[must_use]
    pub fn alone(entry: u32, normal: Vec3, distance: f64) -> Self {
        Self { entry, normal, distance, share: 1.0, energy_share: 1.0, crowd: 1.0 }
    }
}

impl Surface {
    /// Prepares a shape that [`super::Wall::check`] has accepted, for contacts whose force goes as δ^(`power` − 1) at small
    /// overlap δ.
    #[must_use]
    pub fn new(shape: &Shape, power: f64) -> Self {
        let kind = match shape {
            Shape::Plane(_) | Shape::Box { .. } => Kind::Planes(
                (shape.planes().iter())
                    .map(|plane| HalfSpace {
                        through: plane.through.into(),
                        normal: Vec3::from(plane.normal).normalize(),
                    })
                    .collect(),
            ),
            Shape::Cylinder(cylinder) => {
                Kind::Cylinder(Cylinder { axis: Vec3::from(cylinder.axis).normalize().into(), ..*cylinder })
            }
            Shape::Mesh(mesh) => Kind::Mesh(MeshSurface::new(mesh, power)),
        };
        Self { kind }
    }

    /// Appends the features (planes, the cylinder, triangles of a mesh) that a sphere of radius `reach`, in m, about a
    /// position may touch, in ascending order.
    pub fn near(&self, position: &Vec3, reach: f64, features: &mut Vec<u32>) {
        match &self.kind {
            Kind::Planes(planes) => {
                let listed = (0..).zip(planes).filter(|(_, plane)| plane.distance(position) < reach);
                features.extend(listed.map(|(index, _)| index));
            }
            Kind::Cylinder(cylinder) => {
                if cylinder.distance(position).1 < reach {
                    features.push(0);
                }
            }
            Kind::Mesh(mesh) => mesh.near(position, reach, features),
        }
    }

    /// Appends the contacts of a sphere with the listed features, in their order.
    ///
    /// The list must hold every feature the sphere touches, as [`Self::near`] makes it: neighbouring triangles decide
    /// together which of them has the contact.
    #[inline]
    pub fn touch(&self, position: &Vec3, radius: f64, features: &[u32], touches: &mut Vec<Touch>) {
        match &self.kind {
            Kind::Planes(planes) => {
                for (entry, &feature) in (0..).zip(features) {
                    let plane = &planes[feature as usize];
                    let distance = plane.distance(position);
                    if distance < radius {
                        touches.push(Touch::alone(entry, plane.normal, distance));
                    }
                }
            }
            Kind::Cylinder(cylinder) => {
                if !features.is_empty() {
                    let (normal, distance) = cylinder.distance(position);
                    if distance < radius {
                        touches.push(Touch::alone(0, normal, distance));
                    }
                }
            }
            Kind::Mesh(mesh) => mesh.touch(position, radius, features, touches),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::common::walls::{Face, Side};

    fn contacts(surface: &Surface, position: Vec3, radius: f64, skin: f64) -> Vec<(u32, Vec3, f64)> {
        let (mut features, mut touches) = (Vec::new(), Vec::new());
        surface.near(&position, radius + skin, &mut features);
        assert!(features.is_sorted());
        surface.touch(&position, radius, &features, &mut touches);
        touches.iter().map(|touch| (features[touch.entry as usize], touch.normal, touch.distance)).collect()
    }

    #[test]
    fn a_plane_s_distance_is_signed() {
        let surface = Surface::new(&Shape::plane([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), 2.0);
        for (height, expected) in [(3.0, None), (1.5, Some(0.5)), (0.75, Some(-0.25))] {
            let found = contacts(&surface, Vec3::new(7.0, -3.0, height), 1.0, 0.0);
            assert_eq!(found.first().copied(), expected.map(|distance| (0, Vec3::z(), distance)));
        }
    }

    #[test]
    fn a_corner_of_a_box_has_three_contacts_and_an_open_face_none() {
        let shape = |open| Shape::Box { lower_m: [0.0; 3], upper_m: [4.0; 3], open };
        let corner = Vec3::new(0.5, 3.75, 0.5);
        let found = contacts(&Surface::new(&shape(Vec::new()), 2.0), corner, 1.0, 0.25);
        assert_eq!(found, [(0, Vec3::x(), 0.5), (3, -Vec3::y(), 0.25), (4, Vec3::z(), 0.5)]);
        let found = contacts(&Surface::new(&shape(vec![Face { axis: 1, upper: true }]), 2.0), corner, 1.0, 0.25);
        assert_eq!(found, [(0, Vec3::x(), 0.5), (3, Vec3::z(), 0.5)]);
    }

    #[test]
    fn a_cylinder_is_touched_from_within_or_from_around() {
        let cylinder = |particles| {
            let (through_m, axis) = ([0.0; 3], [0.0, 0.0, 1.0]);
            Surface::new(&Shape::Cylinder(Cylinder { through_m, axis, radius_m: 2.0, particles, length_m: None }), 2.0)
        };
        let inside = contacts(&cylinder(Side::Inside), Vec3::new(1.5, 0.0, 9.0), 1.0, 0.0);
        assert_eq!(inside, [(0, -Vec3::x(), 0.5)]);
        assert_eq!(contacts(&cylinder(Side::Inside), Vec3::new(0.5, 0.0, 9.0), 1.0, 0.0), []);
        let around = contacts(&cylinder(Side::Outside), Vec3::new(0.0, -2.5, -9.0), 1.0, 0.0);
        assert_eq!(around, [(0, -Vec3::y(), 0.5)]);
        assert_eq!(contacts(&cylinder(Side::Outside), Vec3::new(0.0, -3.5, -9.0), 1.0, 0.5), []);
    }

    proptest! {
        #[test]
        fn a_list_with_a_skin_finds_what_all_features_do(
            position in [0.0f64..4.0, 0.0f64..4.0, 0.0f64..4.0], skin in 0.0f64..1.0,
        ) {
            let surface = Surface::new(&Shape::Box { lower_m: [0.0; 3], upper_m: [4.0; 3], open: Vec::new() }, 2.0);
            let position = Vec3::from(position);
            let mut all = Vec::new();
            surface.touch(&position, 1.0, &[0, 1, 2, 3, 4, 5], &mut all);
            let all: Vec<_> = all.iter().map(|touch| (touch.entry, touch.normal, touch.distance)).collect();
            prop_assert_eq!(contacts(&surface, position, 1.0, skin), all);
        }
    }
}
