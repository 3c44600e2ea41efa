//! The cylinder.

use serde::Serialize;
use stagger_coupling::{SolveError, math};

use super::{Vec3, finite, shape::across, unit};
use crate::common::checks;

/// A cylinder: infinite and touched from one side, or a thin tube with open ends that is touched from everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cylinder {
    /// A point on its axis, in m; for a tube the middle of its first end.
    pub through_m: [f64; 3],
    /// Unit vector along its axis; for a tube towards its second end.
    pub axis: [f64; 3],
    /// Radius, in m.
    pub radius_m: f64,
    /// Where the particles are. Says nothing of a tube, which they may enter and leave.
    pub particles: Side,
    /// Length of a tube, in m; `None` is infinite.
    pub length_m: Option<f64>,
}

/// A side of a closed surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Within it.
    Inside,
    /// Around it.
    Outside,
}

impl Cylinder {
    pub(super) fn check(&self, wall: &str) -> Result<(), SolveError> {
        finite(wall, "a point on its axis", &self.through_m)?;
        unit(wall, "the length of its axis' direction", &self.axis)?;
        checks::positive(wall, "the radius of its cylinder", self.radius_m)?;
        self.length_m.map_or(Ok(()), |length_m| checks::positive(wall, "the length of its cylinder", length_m))
    }

    /// Unit normal from the surface to a point, and the signed distance in m.
    ///
    /// On the axis, where every direction across it is as good, the same one is taken every time.
    pub(super) fn distance(&self, position: &Vec3) -> (Vec3, f64) {
        let axis = Vec3::from(self.axis);
        let from_point = position - Vec3::from(self.through_m);
        let along = from_point.dot(&axis);
        let across_once = from_point - axis * along;
        // Near the axis rounding along it is as large as the rest; taken off again, it is not.
        let radial = across_once - axis * across_once.dot(&axis);
        let off_axis = radial.norm();
        let outwards = if off_axis > 0.0 { radial / off_axis } else { across(&axis)[0] };
        // How far outside the surface.
        let beyond = off_axis - self.radius_m;
        let Some(length_m) = self.length_m else {
            return match self.particles {
                Side::Inside => (-outwards, -beyond),
                Side::Outside => (outwards, beyond),
            };
        };
        let past_end = along - along.clamp(0.0, length_m);
        let distance = math::hypot(beyond, past_end);
        // Inside a tube's length the division would only add rounding.
        if past_end == 0.0 || distance <= 0.0 {
            return (if beyond < 0.0 { -outwards } else { outwards }, beyond.abs());
        }
        ((outwards * beyond + axis * past_end) / distance, distance)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn cylinder(particles: Side, length_m: Option<f64>) -> Cylinder {
        let axis = (Vec3::new(2.0, -1.0, 2.0) / 3.0).into();
        Cylinder { through_m: [0.1, -0.2, 0.3], axis, radius_m: 0.5, particles, length_m }
    }

    /// A point by its distance from the axis, the angle about it and the height along it.
    fn at(cylinder: &Cylinder, off_axis: f64, angle: f64, along: f64) -> Vec3 {
        let axis = Vec3::from(cylinder.axis);
        let [u, v] = across(&axis);
        Vec3::from(cylinder.through_m) + axis * along + (u * angle.cos() + v * angle.sin()) * off_axis
    }

    proptest! {
        #[test]
        fn a_point_s_distance_is_that_of_its_radius(off_axis in 0.0f64..2.0, angle in 0.0f64..6.0, along in -9.0f64..9.0) {
            for (particles, sign) in [(Side::Inside, -1.0), (Side::Outside, 1.0)] {
                let cylinder = cylinder(particles, None);
                let position = at(&cylinder, off_axis, angle, along);
                let (normal, distance) = cylinder.distance(&position);
                // Coordinates of order 10 round to 1e-15.
                prop_assert!((distance - sign * (off_axis - 0.5)).abs() < 1e-14);
                prop_assert!((normal.norm() - 1.0).abs() < 1e-14);
                // The foot of the normal lies on the surface.
                prop_assert!(cylinder.distance(&(position - normal * distance)).1.abs() < 1e-13);
            }
        }

        #[test]
        fn no_point_of_a_tube_is_nearer(off_axis in 0.0f64..1.5, angle in 0.0f64..6.0, along in -1.0f64..2.0) {
            let tube = cylinder(Side::Inside, Some(0.8));
            let position = at(&tube, off_axis, angle, along);
            let (normal, distance) = tube.distance(&position);
            let mut sampled = f64::INFINITY;
            for i in 0..=40 {
                for j in 0..160 {
                    let point = at(&tube, 0.5, f64::from(j) * (6.3 / 160.0), 0.02 * f64::from(i));
                    sampled = sampled.min((point - position).norm());
                }
            }
            // Samples are at most 0.02 along and 0.02 around from every point of the tube: within 0.0141 of it.
            prop_assert!(distance <= sampled + 1e-14 && sampled <= distance + 0.0142);
            prop_assert!((normal.norm() - 1.0).abs() < 1e-13);
            prop_assert!(tube.distance(&(position - normal * distance)).1 < 1e-13);
        }
    }

    #[test]
    fn the_axis_has_a_normal_too() {
        // The second is off the axis by rounding alone, which is not at right angles to it.
        for along in [0.0, 1.5024321133029799] {
            for tube in [cylinder(Side::Inside, None), cylinder(Side::Inside, Some(2.0))] {
                let (normal, distance) = tube.distance(&at(&tube, 0.0, 0.0, along));
                assert!((distance - 0.5).abs() < 1e-15 && (normal.norm() - 1.0).abs() < 1e-15);
                assert!(normal.dot(&Vec3::from(tube.axis)).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_radius_out_of_range_is_named() {
        let wrong = Cylinder { radius_m: 0.0, ..cylinder(Side::Inside, None) }.check("wall `pipe`").unwrap_err();
        assert_eq!(wrong.to_string(), "wall `pipe`: the radius of its cylinder is 0, but must be positive and finite");
    }
}
