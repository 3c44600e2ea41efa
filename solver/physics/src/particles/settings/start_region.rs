//! Where the regions that particles start in are, and what they hold.

use std::f64::consts::PI;

use stagger_coupling::math;

use crate::{common::Vec3, particles::settings::StartRegion};

impl StartRegion {
    /// Lower and upper corner of the axis-aligned box around it, in m.
    #[must_use]
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        match *self {
            Self::Box { lower_m, upper_m } => (lower_m, upper_m),
            Self::Cylinder { base_m, axis, radius_m, height_m } => {
                let (mut lower, mut upper) = (base_m.map(|x| x - radius_m), base_m.map(|x| x + radius_m));
                (lower[axis], upper[axis]) = (base_m[axis], base_m[axis] + height_m);
                (lower, upper)
            }
            Self::Sphere { centre_m, radius_m } => (centre_m.map(|x| x - radius_m), centre_m.map(|x| x + radius_m)),
        }
    }

    /// Volume, in m³.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        match *self {
            Self::Box { lower_m, upper_m } => (0..3).map(|axis| upper_m[axis] - lower_m[axis]).product(),
            Self::Cylinder { radius_m, height_m, .. } => PI * radius_m * radius_m * height_m,
            Self::Sphere { radius_m, .. } => 4.0 / 3.0 * PI * math::powi(radius_m, 3),
        }
    }

    /// The least of p·n over its points p, in the unit of n times m.
    #[must_use]
    pub fn lowest_along(&self, normal: [f64; 3]) -> f64 {
        let dot = |point: [f64; 3]| (0..3).map(|axis| point[axis] * normal[axis]).sum::<f64>();
        match *self {
            Self::Box { lower_m, upper_m } => {
                dot(std::array::from_fn(|axis| if normal[axis] > 0.0 { lower_m[axis] } else { upper_m[axis] }))
            }
            Self::Cylinder { base_m, axis, radius_m, height_m } => {
                let square: f64 = (0..3).filter(|&other| other != axis).map(|other| math::powi(normal[other], 2)).sum();
                dot(base_m) + (height_m * normal[axis]).min(0.0) - radius_m * square.sqrt()
            }
            Self::Sphere { centre_m, radius_m } => {
                dot(centre_m) - radius_m * normal.iter().map(|component| component * component).sum::<f64>().sqrt()
            }
        }
    }

    /// Whether a sphere inside the bounds lies wholly inside the region too, rounding forgiven.
    pub(crate) fn holds(&self, centre: &Vec3, radius: f64) -> bool {
        let within = |distance: f64, limit: f64| distance <= (limit - radius) + 1e-12 * limit;
        match *self {
            Self::Box { .. } => true,
            Self::Cylinder { base_m, axis, radius_m, .. } => {
                let mut across = centre - Vec3::from(base_m);
                across[axis] = 0.0;
                within(across.norm(), radius_m)
            }
            Self::Sphere { centre_m, radius_m } => within((centre - Vec3::from(centre_m)).norm(), radius_m),
        }
    }
}
