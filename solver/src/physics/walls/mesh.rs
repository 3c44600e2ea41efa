//! Surfaces of triangles: what they are made from, and where a sphere touches them.

use rstar::{AABB, RTree, primitives::GeomWithData, primitives::Rectangle};
use serde::{Serialize, Serializer, ser::SerializeStruct};

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
    /// ASCII STL that is no text.
    #[error("ASCII STL expected, but line {line} is not text")]
    NotText {
        /// The line, from 1.
        line: usize,
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

/// A mesh prepared for contact search.
#[derive(Clone, Debug)]
pub(super) struct MeshSurface {
    triangles: Vec<Triangle>,
    rounding_m: f64,
    tree: RTree<GeomWithData<Rectangle<[f64; 3]>, u32>>,
}

impl MeshSurface {
    pub fn new(mesh: &Mesh) -> Self {
        let boxed = |(index, triangle): (u32, &Triangle)| {
            let [a, b, c] = triangle.corners;
            let (lower, upper) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            GeomWithData::new(Rectangle::from_corners(lower.into(), upper.into()), index)
        };
        let tree = RTree::bulk_load((0..).zip(&mesh.triangles).map(boxed).collect());
        Self { triangles: mesh.triangles.clone(), rounding_m: mesh.rounding_m, tree }
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
    /// cut into triangles.
    pub fn touch(&self, position: &Vec3, radius: f64, features: &[u32], touches: &mut Vec<Touch>) {
        let start = touches.len();
        for (entry, &index) in (0..).zip(features) {
            if let Some(Nearest { normal, distance }) = self.within(index, position, radius) {
                touches.push(Touch { entry, normal, distance });
            }
        }
        if touches.len() < start + 2 {
            return;
        }
        let same_point = SAME_POINT * radius + self.rounding_m;
        let candidates = touches[start..].to_vec();
        let is_local_minimum = |touch: &Touch| {
            let point = position - touch.normal * touch.distance;
            let nearer = |other: &&Touch| (other.distance, other.entry) < (touch.distance, touch.entry);
            let holds_point = |other: &Touch| {
                let triangle = &self.triangles[features[other.entry as usize] as usize];
                triangle.height(&point).abs() <= same_point && triangle.nearest(&point).distance <= same_point
            };
            !candidates.iter().filter(nearer).any(holds_point)
        };
        let mut candidate = 0;
        touches.retain(|touch| {
            candidate += 1;
            candidate <= start || is_local_minimum(touch)
        });
    }
}

#[cfg(test)]
mod tests;
