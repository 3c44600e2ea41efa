//! The half-space's own coordinates: x and y along its surface, z into it.

use nalgebra::{Matrix3, Vector3};
use stagger_coupling::SolveError;

use super::{NODE, point_load::COMPONENTS};
use crate::common::walls::Plane;

type Vec3 = Vector3<f64>;

/// Share of its distance from the scene's origin by which a point may lie outside the surface and count as on it.
const ROUNDING: f64 = 1e-9;

/// Coordinates of a half-space, whose surface is a plane with the particles on the side of its normal.
#[derive(Clone, Debug)]
pub(super) struct HalfSpace {
    through: Vec3,
    /// Its axes as rows.
    axes: Matrix3<f64>,
}

impl HalfSpace {
    pub fn new(plane: &Plane) -> Self {
        let z = -Vec3::from(plane.normal).normalize();
        // The scene's axis that is nearest to the surface, so that a level plate keeps x.
        let along = if z.x.abs() <= 0.9 { Vec3::x() } else { Vec3::y() };
        let x = (along - z * along.dot(&z)).normalize();
        let y = z.cross(&x);
        Self { through: plane.through.into(), axes: Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]) }
    }

    /// A vector of the scene in these coordinates.
    pub fn vector(&self, vector: &Vec3) -> Vec3 {
        self.axes * vector
    }

    /// A position of the scene, in m, in these coordinates.
    pub fn position(&self, position_m: &Vec3) -> Vec3 {
        self.vector(&(position_m - self.through))
    }

    /// A point of the scene, in m, that must lie in the half-space, in these coordinates.
    pub fn within(&self, point_m: &[f64; 3]) -> Result<[f64; 3], SolveError> {
        let point = Vec3::from(*point_m);
        let Vec3 { data, .. } = self.position(&point);
        let [[x, y, z]] = data.0;
        if z < -ROUNDING * (point.norm() + self.through.norm()) {
            return Err(SolveError::Start(format!(
                "{NODE}: the point ({}, {}, {}) m lies {} m above the surface: expected points on it or below",
                point_m[0], point_m[1], point_m[2], -z
            )));
        }
        Ok([x, y, z.max(0.0)])
    }

    /// A tensor of these coordinates in the scene's, both as xx, yy, zz, xy, yz, zx.
    pub fn to_scene(&self, [xx, yy, zz, xy, yz, zx]: [f64; COMPONENTS]) -> [f64; COMPONENTS] {
        let tensor = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
        let turned = self.axes.transpose() * tensor * self.axes;
        [turned.m11, turned.m22, turned.m33, turned.m12, turned.m23, turned.m31]
    }
}
