//! Shapes of walls, in the wall's own frame.

use std::sync::Arc;

use serde::Serialize;
use stagger_coupling::{SolveError, math};

use super::{Cylinder, Mesh, Vec3, finite, unit};
use crate::common::checks;

/// Surface of a wall, in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// An infinite plane.
    Plane(Plane),
    /// The planes of an axis-aligned box, with the particles inside. Each goes on beyond the box's edges.
    Box {
        /// Lower corner, in m.
        lower_m: [f64; 3],
        /// Upper corner, in m; above the lower one along every axis.
        upper_m: [f64; 3],
        /// Faces left out.
        open: Vec<Face>,
    },
    /// A cylinder.
    Cylinder(Cylinder),
    /// A thin surface of triangles, touched from both sides.
    Mesh(Arc<Mesh>),
}

/// An infinite plane; particles stay on the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Plane {
    /// A point on it, in m.
    pub through: [f64; 3],
    /// Unit normal.
    pub normal: [f64; 3],
}

/// A face of an axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Face {
    /// Axis it is normal to: 0, 1 or 2.
    pub axis: usize,
    /// Whether it is the one at the upper corner.
    pub upper: bool,
}

impl Face {
    /// All six, lower and upper along each axis in turn.
    pub const ALL: [Self; 6] = [
        Self { axis: 0, upper: false },
        Self { axis: 0, upper: true },
        Self { axis: 1, upper: false },
        Self { axis: 1, upper: true },
        Self { axis: 2, upper: false },
        Self { axis: 2, upper: true },
    ];
}

/// Straight pieces that a circle is drawn with.
const PIECES: u32 = 48;

impl Shape {
    /// A plane through a point, in m, with a unit normal.
    #[must_use]
    pub fn plane(through: [f64; 3], normal: [f64; 3]) -> Self {
        Self::Plane(Plane { through, normal })
    }

    /// The half-spaces that hold the particles: one plane, or those of a box in the order of [`Face::ALL`]; none for other
    /// shapes.
    #[must_use]
    pub fn planes(&self) -> Vec<Plane> {
        match self {
            Self::Plane(plane) => vec![*plane],
            Self::Box { lower_m, upper_m, open } => {
                let closed = Face::ALL.into_iter().filter(|face| !open.contains(face));
                let plane = |face: Face| {
                    let mut normal = [0.0; 3];
                    normal[face.axis] = if face.upper { -1.0 } else { 1.0 };
                    Plane { through: if face.upper { *upper_m } else { *lower_m }, normal }
                };
                closed.map(plane).collect()
            }
            Self::Cylinder(_) | Self::Mesh(_) => Vec::new(),
        }
    }

    /// Farthest distance in m of its surface from an axis through a point; infinite where it has no end, and zero where turning
    /// about the axis turns it into itself.
    #[must_use]
    pub(super) fn reach_m(&self, through: &Vec3, axis: &Vec3) -> f64 {
        let off_axis = |point: Vec3| axis.cross(&(point - through)).norm();
        // Rounding of directions given in decimals.
        let along = |direction: [f64; 3]| axis.cross(&Vec3::from(direction)).norm() < 1e-9;
        match self {
            Self::Plane(plane) if along(plane.normal) => 0.0,
            Self::Plane(_) | Self::Box { .. } => f64::INFINITY,
            Self::Cylinder(cylinder) => {
                let near = Vec3::from(cylinder.through_m);
                if along(cylinder.axis) && off_axis(near) <= 1e-9 * cylinder.radius_m {
                    return 0.0;
                }
                let ends = cylinder.length_m.map(|length_m| [near, near + Vec3::from(cylinder.axis) * length_m]);
                ends.map_or(f64::INFINITY, |ends| {
                    ends.map(off_axis).into_iter().fold(0.0, f64::max) + cylinder.radius_m
                })
            }
            Self::Mesh(mesh) => {
                let [lower, upper] = mesh.bounds();
                let corner = |index: usize| Vec3::from_fn(|k, _| if index >> k & 1 == 0 { lower[k] } else { upper[k] });
                (0..8).map(|index| off_axis(corner(index))).fold(0.0, f64::max)
            }
        }
    }

    /// Triangles to draw, as corners in m in the wall's own frame. What is infinite is cut to about the box between the
    /// corners `lower_m` and `upper_m`.
    #[must_use]
    pub fn triangles(&self, lower_m: [f64; 3], upper_m: [f64; 3]) -> Vec<[[f64; 3]; 3]> {
        let (lower, upper) = (Vec3::from(lower_m), Vec3::from(upper_m));
        let (centre, half) = ((lower + upper) / 2.0, (upper - lower).norm() / 2.0);
        match self {
            Self::Plane(plane) => {
                let normal = Vec3::from(plane.normal);
                let [u, v] = across(&normal).map(|side| side * half);
                let middle = centre - normal * (centre - Vec3::from(plane.through)).dot(&normal);
                quad([middle - u - v, middle + u - v, middle + u + v, middle - u + v]).into()
            }
            Self::Box { lower_m, upper_m, open } => {
                let closed = Face::ALL.into_iter().filter(|face| !open.contains(face));
                let face = |face: Face| {
                    let [u, v] = [(face.axis + 1) % 3, (face.axis + 2) % 3];
                    let corner = |[at_u, at_v]: [bool; 2]| {
                        let mut corner = if face.upper { *upper_m } else { *lower_m };
                        corner[u] = if at_u { upper_m[u] } else { lower_m[u] };
                        corner[v] = if at_v { upper_m[v] } else { lower_m[v] };
                        Vec3::from(corner)
                    };
                    quad([[false, false], [true, false], [true, true], [false, true]].map(corner))
                };
                closed.flat_map(face).collect()
            }
            Self::Cylinder(cylinder) => {
                let axis = Vec3::from(cylinder.axis);
                let through = Vec3::from(cylinder.through_m);
                let (bottom, top) = match cylinder.length_m {
                    Some(length_m) => (through, through + axis * length_m),
                    None => {
                        let middle = through + axis * (centre - through).dot(&axis);
                        (middle - axis * half, middle + axis * half)
                    }
                };
                let [u, v] = across(&axis);
                let radial = |piece: u32| {
                    let angle = f64::from(piece % PIECES) * (std::f64::consts::TAU / f64::from(PIECES));
                    (u * math::cos(angle) + v * math::sin(angle)) * cylinder.radius_m
                };
                let piece = |piece: u32| {
                    let (from, to) = (radial(piece), radial(piece + 1));
                    quad([bottom + from, bottom + to, top + to, top + from])
                };
                (0..PIECES).flat_map(piece).collect()
            }
            Self::Mesh(mesh) => mesh.corners(),
        }
    }

    /// Checks ranges; `wall` names the wall.
    pub(super) fn check(&self, wall: &str) -> Result<(), SolveError> {
        match self {
            Self::Plane(plane) => {
                finite(wall, "a point on its plane", &plane.through)?;
                unit(wall, "the length of its plane's normal", &plane.normal)
            }
            Self::Box { lower_m, upper_m, .. } => {
                finite(wall, "a corner of its box", lower_m)?;
                finite(wall, "a corner of its box", upper_m)?;
                (0..3).try_for_each(|axis| {
                    let edge = upper_m[axis] - lower_m[axis];
                    checks::positive(wall, "an edge of its box", edge)
                })
            }
            Self::Cylinder(cylinder) => cylinder.check(wall),
            // A mesh is checked where it is made.
            Self::Mesh(_) => Ok(()),
        }
    }
}

/// Two unit vectors at right angles to a unit vector and to each other.
pub(super) fn across(axis: &Vec3) -> [Vec3; 2] {
    // The coordinate axis that is the furthest from parallel.
    let other = Vec3::ith(axis.iamin(), 1.0);
    let u = axis.cross(&other).normalize();
    [u, axis.cross(&u)]
}

fn quad([a, b, c, d]: [Vec3; 4]) -> [[[f64; 3]; 3]; 2] {
    [[a, b, c].map(Into::into), [a, c, d].map(Into::into)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::walls::{Side, Surface};

    /// Every triangle that is drawn lies on the surface that is touched.
    fn corners_lie_on(shape: &Shape, tolerance: f64) {
        let surface = Surface::new(shape, 2.0);
        let drawn = shape.triangles([-1.0, -1.0, -1.0], [2.0, 2.0, 2.0]);
        assert!(!drawn.is_empty());
        for corner in drawn.into_iter().flatten().map(Vec3::from) {
            let (mut near, mut touches) = (Vec::new(), Vec::new());
            surface.near(&corner, 1.0, &mut near);
            surface.touch(&corner, 1.0, &near, &mut touches);
            let nearest = touches.iter().map(|touch| touch.distance.abs()).fold(f64::INFINITY, f64::min);
            assert!(nearest < tolerance, "{corner} is {nearest} m from {shape:?}");
        }
    }

    #[test]
    fn what_is_drawn_lies_on_what_is_touched() {
        let slanted = Vec3::new(1.0, 2.0, 2.0) / 3.0;
        let cylinder = |length_m| Cylinder {
            through_m: [0.1, 0.2, 0.3],
            axis: slanted.into(),
            radius_m: 0.4,
            particles: Side::Inside,
            length_m,
        };
        corners_lie_on(&Shape::plane([0.0, 0.0, 0.5], slanted.into()), 1e-14);
        corners_lie_on(&Shape::Box { lower_m: [-0.5; 3], upper_m: [1.0; 3], open: vec![Face::ALL[5]] }, 1e-14);
        corners_lie_on(&Shape::Cylinder(cylinder(None)), 1e-14);
        corners_lie_on(&Shape::Cylinder(cylinder(Some(0.7))), 1e-14);
    }

    #[test]
    fn an_open_face_is_left_out_and_the_others_face_inwards() {
        let open = vec![Face { axis: 2, upper: true }];
        let planes = Shape::Box { lower_m: [0.0; 3], upper_m: [1.0, 2.0, 3.0], open }.planes();
        assert_eq!(planes.len(), 5);
        assert!(planes.iter().all(|plane| plane.normal != [0.0, 0.0, -1.0]));
        let inside = |plane: &Plane| (Vec3::repeat(0.5) - Vec3::from(plane.through)).dot(&Vec3::from(plane.normal));
        assert!(planes.iter().all(|plane| inside(plane) > 0.0));
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let plane = Shape::plane([0.0; 3], [0.0, 0.0, 2.0]).check("wall `floor`").unwrap_err();
        assert_eq!(plane.to_string(), "wall `floor`: the length of its plane's normal is 2, but must be 1");
        let flat = Shape::Box { lower_m: [0.0; 3], upper_m: [1.0, 1.0, 0.0], open: Vec::new() };
        let flat = flat.check("wall `box`").unwrap_err();
        assert_eq!(flat.to_string(), "wall `box`: an edge of its box is 0, but must be positive and finite");
        let nowhere = Shape::plane([f64::NAN, 0.0, 0.0], [0.0, 0.0, 1.0]).check("wall `floor`").unwrap_err();
        assert_eq!(nowhere.to_string(), "wall `floor`: a point on its plane is NaN, but must be finite");
    }
}
