//! Where and when a field is there.

use stagger_coupling::SolveError;

use crate::{
    common::{
        Vec3,
        checks::{reached, setting},
    },
    particles::settings::{FieldRegion, Presence},
};

impl Presence {
    /// Whether the field is switched on.
    #[inline]
    pub(super) fn is_on(&self, t_s: f64) -> bool {
        reached(t_s, self.starts_s) && !reached(t_s, self.ends_s)
    }

    /// Whether a place lies in the field's region; its bounds belong to it.
    #[inline]
    pub(super) fn reaches(&self, position: &Vec3) -> bool {
        match &self.region {
            FieldRegion::Everywhere => true,
            FieldRegion::HalfSpace { through_m, normal } => {
                (position - Vec3::from(*through_m)).dot(&Vec3::from(*normal)) >= 0.0
            }
            FieldRegion::Box { lower_m, upper_m } => {
                (0..3).all(|axis| lower_m[axis] <= position[axis] && position[axis] <= upper_m[axis])
            }
        }
    }

    /// How much of a way of `length_m` from a place along a unit vector lies in the field's region, in m.
    pub(super) fn way_m(&self, from: &Vec3, along: &Vec3, length_m: f64) -> f64 {
        let (mut enters, mut leaves) = (0.0f64, length_m);
        // Cut by the side where `inside` + `slope` s ≥ 0.
        let mut cut = |inside: f64, slope: f64| {
            if slope > 0.0 {
                enters = enters.max(-inside / slope);
            } else if slope < 0.0 {
                leaves = leaves.min(-inside / slope);
            } else if inside < 0.0 {
                leaves = 0.0;
            }
        };
        match &self.region {
            FieldRegion::Everywhere => {}
            FieldRegion::HalfSpace { through_m, normal } => {
                let normal = Vec3::from(*normal);
                cut((from - Vec3::from(*through_m)).dot(&normal), along.dot(&normal));
            }
            FieldRegion::Box { lower_m, upper_m } => {
                for axis in 0..3 {
                    cut(from[axis] - lower_m[axis], along[axis]);
                    cut(upper_m[axis] - from[axis], -along[axis]);
                }
            }
        }
        (leaves - enters).max(0.0)
    }

    pub(super) fn check(&self, of: &str) -> Result<(), SolveError> {
        let numbers = |what: &str, values: &[f64; 3]| finite(&format!("{what} of the {of}'s region"), values);
        match &self.region {
            FieldRegion::Everywhere => {}
            FieldRegion::HalfSpace { through_m, normal } => {
                numbers("point", through_m)?;
                numbers("normal", normal)?;
            }
            FieldRegion::Box { lower_m, upper_m } => {
                numbers("lower corner", lower_m)?;
                numbers("upper corner", upper_m)?;
            }
        }
        let lasts = self.ends_s > self.starts_s;
        setting("particles", &format!("the {of}'s end"), self.ends_s, lasts, "after its start")
    }
}

/// Refuses a vector of settings that is not finite.
pub(super) fn finite(what: &str, values: &[f64; 3]) -> Result<(), SolveError> {
    values.iter().try_for_each(|&value| setting("particles", what, value, value.is_finite(), "finite"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_counts_where_it_lies_in_the_region() {
        let way = |region, from: [f64; 3], along: [f64; 3]| {
            let presence = Presence { region, ..Presence::default() };
            presence.way_m(&Vec3::from(from), &Vec3::from(along), 10.0)
        };
        let (x, z) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let half = FieldRegion::HalfSpace { through_m: [2.0, 0.0, 0.0], normal: [-3.0, 0.0, 0.0] };
        let inside = FieldRegion::Box { lower_m: [1.0, -1.0, -1.0], upper_m: [4.0, 1.0, 1.0] };
        for (region, from, along, expected) in [
            (FieldRegion::Everywhere, [0.0; 3], x, 10.0),
            (half, [0.0; 3], x, 2.0),
            (half, [5.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 7.0),
            (half, [5.0, 0.0, 0.0], x, 0.0),
            (half, [5.0, 0.0, 0.0], z, 0.0),
            (half, [1.0, 0.0, 0.0], z, 10.0),
            (inside, [0.0; 3], x, 3.0),
            (inside, [0.0, 2.0, 0.0], x, 0.0),
            (inside, [2.0, 0.0, 0.0], z, 1.0),
        ] {
            assert!((way(region, from, along) - expected).abs() < 1e-14, "{region:?} {from:?} {along:?}");
        }
    }
}
