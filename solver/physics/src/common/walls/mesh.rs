//! Surfaces of triangles: what they are made from, and where a sphere touches them.

mod patch;

use rstar::{AABB, RTree, primitives::GeomWithData, primitives::Rectangle};
use serde::{Serialize, Serializer, ser::SerializeStruct};
use stagger_coupling::math;

use self::patch::{Cap, Shares, shares};
use super::{
    Vec3, stl,
    surface::Touch,
    triangle::{Nearest, Triangle},
};

/// A thin surface of triangles, touched from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    triangles: Vec<Triangle>,
    /// Points nearer than this are one: the rounding of STL's binary32 coordinates, in m.
    rounding_m: f64,
}

/// Why there is no mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// Neither form of STL.
    #[error(
        "not an STL file: binary STL of {count} triangles has {expected} bytes, not {found}, and ASCII STL begins with \
         `solid`"
    )]
    NotStl {
        /// Triangles by the count in the place where binary STL has it.
        count: u32,
        /// Bytes that many would take.
        expected: u64,
        /// Bytes there are.
        found: usize,
    },
    /// Binary STL with more behind its triangles than could be left over.
    #[error(
        "binary STL whose count says {count} triangles, with {more} bytes behind them, where others may stand; mend the \
         count or cut the file"
    )]
    MoreThanCounted {
        /// Triangles by its count.
        count: u32,
        /// Bytes behind them.
        more: usize,
    },
    /// A word of ASCII STL that does not belong there.
    #[error("line {line} of ASCII STL: expected {expected}, found {found}")]
    Unexpected {
        /// The line, from 1.
        line: usize,
        /// What should stand there.
        expected: &'static str,
        /// What does.
        found: String,
    },
    /// A coordinate that is not finite.
    #[error("triangle {triangle} has a corner that is not finite")]
    NotFinite {
        /// The triangle, from 1.
        triangle: usize,
    },
    /// Nothing to touch.
    #[error("no triangle with an area ({0} without)")]
    Empty(usize),
    /// More than 32-bit indices can name.
    #[error("{0} triangles are more than 32-bit indices can name")]
    TooMany(usize),
}

impl Mesh {
    /// The surface of the triangles with these corners, in m. Those without an area are left out: their edges are their
    /// neighbours'.
    ///
    /// # Errors
    /// A coordinate that is not finite, no triangle with an area, or more than 2³² of them.
    pub fn new(corners: &[[[f64; 3]; 3]]) -> Result<Self, MeshError> {
        if u32::try_from(corners.len()).is_err() {
            return Err(MeshError::TooMany(corners.len()));
        }
        let not_finite = |triangle: &[[f64; 3]; 3]| triangle.as_flattened().iter().any(|value| !value.is_finite());
        if let Some(at) = corners.iter().position(not_finite) {
            return Err(MeshError::NotFinite { triangle: at + 1 });
        }
        let triangles: Vec<_> = corners.iter().filter_map(|triangle| Triangle::new(triangle.map(Vec3::from))).collect();
        if triangles.is_empty() {
            return Err(MeshError::Empty(corners.len()));
        }
        let coordinates = corners.as_flattened().as_flattened();
        let largest = coordinates.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        Ok(Self { triangles, rounding_m: largest * f64::from(f32::EPSILON) })
    }

    /// Reads binary or ASCII STL; the normals in the file are not used.
    ///
    /// One unit of the file is `unit_m` m; its origin comes to `at_m`, in m.
    ///
    /// # Errors
    /// Bytes that are no STL, and what [`Self::new`] refuses.
    pub fn from_stl(bytes: &[u8], unit_m: f64, at_m: [f64; 3]) -> Result<Self, MeshError> {
        let mut corners = stl::read(bytes)?;
        for corner in corners.as_flattened_mut() {
            *corner = corner.map(|coordinate| coordinate * unit_m);
        }
        let mut mesh = Self::new(&corners)?;
        let at = Vec3::from(at_m);
        for corner in mesh.triangles.iter_mut().flat_map(|triangle| &mut triangle.corners) {
            *corner += at;
        }
        Ok(mesh)
    }

    /// Corners of its triangles, in m.
    #[must_use]
    pub fn corners(&self) -> Vec<[[f64; 3]; 3]> {
        self.triangles.iter().map(|triangle| triangle.corners.map(Into::into)).collect()
    }

    /// Its lowest and highest coordinates, in m.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let corners = || self.triangles.iter().flat_map(|triangle| triangle.corners);
        let lower = corners().fold(Vec3::repeat(f64::INFINITY), |lower, corner| lower.inf(&corner));
        let upper = corners().fold(Vec3::repeat(f64::NEG_INFINITY), |upper, corner| upper.sup(&corner));
        [lower.into(), upper.into()]
    }
}

/// A summary: the triangles themselves are those of its file.
impl Serialize for Mesh {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let [lower_m, upper_m] = self.bounds();
        let mut summary = serializer.serialize_struct("Mesh", 3)?;
        summary.serialize_field("triangles", &self.triangles.len())?;
        summary.serialize_field("lower_m", &lower_m)?;
        summary.serialize_field("upper_m", &upper_m)?;
        summary.end()
    }
}

/// Points of a surface nearer to each other than this share of the sphere's radius are one contact. The nearest points of
/// two triangles with a common edge agree to √ε ≈ 1.5e-8 only, as a distance is stationary at its least.
const SAME_POINT: f64 = 1e-6;

/// A triangle that comes less ahead of a contact's plane than this share of the overlap lies in it.
const SAME_PLANE: f64 = 1e-6;

/// A mesh prepared for contact search.
#[derive(Clone, Debug)]
pub(super) struct MeshSurface {
    /// q of the force ∝ δ^(q − 1) that contacts share.
    power: f64,
    triangles: Vec<Triangle>,
    rounding_m: f64,
    tree: RTree<GeomWithData<Rectangle<[f64; 3]>, u32>>,
}

impl MeshSurface {
    pub fn new(mesh: &Mesh, power: f64) -> Self {
        let boxed = |(index, triangle): (u32, &Triangle)| {
            let [a, b, c] = triangle.corners;
            let (lower, upper) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            GeomWithData::new(Rectangle::from_corners(lower.into(), upper.into()), index)
        };
        let tree = RTree::bulk_load((0..).zip(&mesh.triangles).map(boxed).collect());
        Self { power, triangles: mesh.triangles.clone(), rounding_m: mesh.rounding_m, tree }
    }

    /// Appends the triangles within `reach` of a position, in ascending order.
    pub fn near(&self, position: &Vec3, reach: f64, features: &mut Vec<u32>) {
        let start = features.len();
        let around = AABB::from_corners(position.add_scalar(-reach).into(), position.add_scalar(reach).into());
        let boxed = self.tree.locate_in_envelope_intersecting(around).map(|boxed| boxed.data);
        features.extend(boxed.filter(|&index| self.within(index, position, reach).is_some()));
        features[start..].sort_unstable();
    }

    /// The nearest point of a triangle, where it is nearer than `reach`.
    fn within(&self, index: u32, position: &Vec3, reach: f64) -> Option<Nearest> {
        let triangle = &self.triangles[index as usize];
        if triangle.height(position).abs() >= reach {
            return None;
        }
        Some(triangle.nearest(position)).filter(|nearest| nearest.distance < reach)
    }

    /// Appends the contacts of a sphere with the listed triangles.
    ///
    /// A contact stands where the distance from the surface has a local minimum: at the nearest point of a triangle,
    /// unless that point belongs to another triangle that comes nearer to the centre elsewhere. So a face rules out the
    /// edges and corners around it, an edge its two ends, and what neighbours share counts once, however the surface is
    /// cut into triangles. Beside a concave edge a triangle whose own nearest point is on the edge has a contact too, with
    /// its plane, as far as it is over the triangle. What contacts near each other have of their force is in
    /// [`mod@patch`].
    pub fn touch(&self, position: &Vec3, radius: f64, features: &[u32], touches: &mut Vec<Touch>) {
        let start = touches.len();
        for (entry, &index) in (0..).zip(features) {
            if let Some(Nearest { normal, distance }) = self.within(index, position, radius) {
                touches.push(Touch::alone(entry, normal, distance));
            }
        }
        if touches.len() < start + 2 {
            return;
        }
        let candidates = touches.split_off(start);
        let triangle = |touch: &Touch| &self.triangles[features[touch.entry as usize] as usize];
        let same_point = SAME_POINT * radius + self.rounding_m;
        let is_local_minimum = |touch: &Touch| {
            let point = position - touch.normal * touch.distance;
            let nearer = |other: &&Touch| (other.distance, other.entry) < (touch.distance, touch.entry);
            let holds_point = |other: &Touch| {
                let triangle = triangle(other);
                triangle.height(&point).abs() <= same_point && triangle.nearest(&point).distance <= same_point
            };
            !candidates.iter().filter(nearer).any(holds_point)
        };
        let minima: Vec<bool> = candidates.iter().map(is_local_minimum).collect();
        let stands = |(touch, minimum): (&Touch, &bool)| minimum.then_some(*touch);
        let standing: Vec<Touch> = candidates.iter().zip(&minima).filter_map(stands).collect();
        let mut caps = Vec::new();
        for (touch, minimum) in candidates.iter().zip(&minima) {
            if *minimum {
                caps.push(Cap { normal: touch.normal, distance: touch.distance, outline: None });
                touches.push(*touch);
            } else if let Some(cap) = self.ahead(triangle(touch), position, radius, &standing) {
                caps.push(cap);
                touches.push(Touch::alone(touch.entry, cap.normal, cap.distance));
            }
        }
        if caps.len() < 2 {
            return;
        }
        let shares = shares(&caps, radius, self.power);
        let mut kept = shares.iter().map(|shares| shares.force > 0.0);
        for (touch, Shares { force, energy }) in touches[start..].iter_mut().zip(&shares) {
            (touch.share, touch.energy_share) = (*force, *energy);
        }
        let mut index = 0;
        touches.retain(|_| {
            index += 1;
            index <= start || kept.next().unwrap_or(true)
        });
        self.crowd(radius, &mut touches[start..]);
    }

    /// The plane of a triangle that comes ahead of the planes of all `standing` contacts somewhere, as beyond a concave edge.
    fn ahead(&self, triangle: &Triangle, position: &Vec3, radius: f64, standing: &[Touch]) -> Option<Cap> {
        let height = triangle.height(position);
        let normal = if height < 0.0 { -triangle.normal } else { triangle.normal };
        let corners = triangle.corners.map(|corner| corner - position);
        let is_ahead = |touch: &Touch| {
            let least = SAME_PLANE * (radius - touch.distance) + self.rounding_m;
            corners.iter().any(|corner| touch.normal.dot(corner) + touch.distance > least)
        };
        standing.iter().all(is_ahead).then_some(Cap { normal, distance: height.abs(), outline: Some(corners) })
    }

    /// How stiff all contacts together are along the normal of each, over its own stiffness.
    fn crowd(&self, radius: f64, touches: &mut [Touch]) {
        for k in 0..touches.len() {
            let own = touches[k];
            let along = |other: &Touch| {
                let stiffer = math::powf((radius - other.distance) / (radius - own.distance), self.power - 2.0);
                other.share / own.share * stiffer * own.normal.dot(&other.normal).max(0.0)
            };
            let others = touches.iter().enumerate().filter(|(j, _)| *j != k);
            touches[k].crowd = 1.0 + others.map(|(_, other)| along(other)).sum::<f64>();
        }
    }
}

#[cfg(test)]
mod tests;
