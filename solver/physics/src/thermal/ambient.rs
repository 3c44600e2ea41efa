//! Heat that particles exchange with their surroundings by convection and radiation.

use stagger_coupling::{SolveError, math};
use std::f64::consts::PI;

use super::{Ambient, NODE};
use crate::common::{
    checks::setting,
    radiation::{STEFAN_BOLTZMANN_W_M2_K4, fourth_power},
};

/// What particles exchange with their surroundings: h A_s (θ_∞ − θ) and ε_r σ_SB A_s (θ_∞⁴ − θ⁴).
#[derive(Clone)]
pub(super) struct Exchange {
    temperature_k: f64,
    /// h A_s of each particle, in W/K.
    convection_w_k: Vec<f64>,
    /// ε_r σ_SB A_s of each particle, in W/K⁴.
    radiation_w_k4: Vec<f64>,
}

/// What all particles lose to their surroundings, in W or J.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lost {
    pub(super) convected: f64,
    pub(super) radiated: f64,
}

impl Ambient {
    /// Refuses a setting outside its range.
    pub(super) fn check(&self) -> Result<(), SolveError> {
        let Self { temperature_k, convection_w_m2_k, emissivity, exposed } = *self;
        let not_negative = |value: f64| value.is_finite() && value >= 0.0;
        setting(NODE, "temperature of the ambient", temperature_k, not_negative(temperature_k), "at least 0 K")?;
        setting(NODE, "convection", convection_w_m2_k, not_negative(convection_w_m2_k), "at least 0 W/(m² K)")?;
        setting(NODE, "emissivity", emissivity, (0.0..=1.0).contains(&emissivity), "from 0 to 1")?;
        setting(NODE, "exposed share", exposed, (0.0..=1.0).contains(&exposed), "from 0 to 1")
    }

    /// The exchange of particles of the given radii.
    pub(super) fn exchange(&self, radii_m: &[f64]) -> Exchange {
        let of = |per_area: f64| {
            radii_m.iter().map(|&radius_m| per_area * self.exposed * 4.0 * PI * radius_m * radius_m).collect()
        };
        Exchange {
            temperature_k: self.temperature_k,
            convection_w_k: of(self.convection_w_m2_k),
            radiation_w_k4: of(self.emissivity * STEFAN_BOLTZMANN_W_M2_K4),
        }
    }
}

impl Exchange {
    /// Adds what flows into each particle to `into_w`; returns what all lose.
    pub(super) fn add(&self, temperatures_k: &[f64], into_w: &mut [f64]) -> Lost {
        let ambient_k4 = fourth_power(self.temperature_k);
        let mut lost = Lost::default();
        for (i, &temperature_k) in temperatures_k.iter().enumerate() {
            let convected_w = self.convection_w_k[i] * (temperature_k - self.temperature_k);
            let radiated_w = self.radiation_w_k4[i] * (fourth_power(temperature_k) - ambient_k4);
            into_w[i] -= convected_w + radiated_w;
            lost.convected += convected_w;
            lost.radiated += radiated_w;
        }
        lost
    }

    /// The same where each particle is there for a share of the time only.
    pub(super) fn lasting(&self, shares: &[f64]) -> Self {
        let of = |per_kelvin: &[f64]| per_kelvin.iter().zip(shares).map(|(own, share)| share * own).collect();
        Self {
            temperature_k: self.temperature_k,
            convection_w_k: of(&self.convection_w_k),
            radiation_w_k4: of(&self.radiation_w_k4),
        }
    }

    /// θ_∞ in K.
    pub(super) fn temperature_k(&self) -> f64 {
        self.temperature_k
    }

    /// What particle `i` loses over its difference from the surroundings, in W/K: θ⁴ − θ_∞⁴ = (θ² + θ_∞²) (θ + θ_∞) (θ − θ_∞).
    pub(super) fn secant(&self, i: usize, temperature_k: f64) -> f64 {
        let ambient_k = self.temperature_k;
        let radiated = (temperature_k * temperature_k + ambient_k * ambient_k) * (temperature_k.abs() + ambient_k);
        self.convection_w_k[i] + self.radiation_w_k4[i] * radiated
    }

    /// What particle `i` loses more for each kelvin it is hotter, in W/K.
    pub(super) fn slope(&self, i: usize, temperature_k: f64) -> f64 {
        self.convection_w_k[i] + 4.0 * self.radiation_w_k4[i] * math::powi(temperature_k.abs(), 3)
    }
}
