//! What bonds are made of, and when they form and break: settings in their ranges.

use stagger_coupling::SolveError;

use crate::{
    common::checks::{positive, setting},
    particles::settings::{BondSettings, BondStiffness},
};

/// What bonds are made of, and when they form and break.
#[derive(Clone, Copy, Debug)]
pub struct BondModel {
    pub(super) settings: BondSettings,
}

impl BondModel {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`SolveError::Start`] names the setting that is out of its range.
    pub fn new(settings: BondSettings) -> Result<Self, SolveError> {
        let named = |what: &str| format!("the bonds' {what}");
        let more_than_0 = |what: &str, value: f64| positive("particles", &named(what), value);
        match settings.stiffness {
            BondStiffness::PerArea { normal_n_m3, shear_n_m3 } => {
                more_than_0("normal stiffness", normal_n_m3)?;
                more_than_0("shear stiffness", shear_n_m3)?;
            }
            BondStiffness::Beam { young_pa, ratio } => {
                more_than_0("Young's modulus", young_pa)?;
                more_than_0("stiffness ratio", ratio)?;
            }
        }
        let share = settings.radius_share;
        setting("particles", &named("radius"), share, share > 0.0 && share <= 1.0, "above 0 and at most 1")?;
        settings.tensile_strength_pa.map_or(Ok(()), |strength| more_than_0("tensile strength", strength))?;
        settings.shear_strength_pa.map_or(Ok(()), |strength| more_than_0("shear strength", strength))?;
        for (what, value) in
            [("gap", settings.gap_share), ("strain", settings.strain), ("damping", Some(settings.damping))]
        {
            let value = value.unwrap_or(0.0);
            setting("particles", &named(what), value, value >= 0.0 && value.is_finite(), "finite and not negative")?;
        }
        Ok(Self { settings })
    }

    /// Normal and shear stiffness per area of a bond of this length, in N/m³.
    pub(super) fn stiffness(&self, rest_m: f64) -> (f64, f64) {
        match self.settings.stiffness {
            BondStiffness::PerArea { normal_n_m3, shear_n_m3 } => (normal_n_m3, shear_n_m3),
            BondStiffness::Beam { young_pa, ratio } => (young_pa / rest_m, young_pa / (rest_m * ratio)),
        }
    }
}
