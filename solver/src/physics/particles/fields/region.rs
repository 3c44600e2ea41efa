//! Where and when a field is there.

use crate::{
    SolveError,
    physics::{
        checks::setting,
        particles::{FieldRegion, Presence, Vec3},
    },
};

impl Presence {
    /// Whether the field is switched on.
    #[inline]
    pub(super) fn is_on(&self, t_s: f64) -> bool {
        self.starts_s <= t_s && t_s < self.ends_s
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
