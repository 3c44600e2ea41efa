//! Thermal radiation of grey bodies.

use stagger_coupling::math;

/// Stefan–Boltzmann constant σ_SB in W/(m² K⁴) (CODATA 2018, exact).
pub(crate) const STEFAN_BOLTZMANN_W_M2_K4: f64 = 5.670_374_419e-8;

/// θ⁴, with the sign of θ: an iterate below 0 K is drawn back instead of emitting.
pub(crate) fn fourth_power(temperature_k: f64) -> f64 {
    temperature_k * math::powi(temperature_k.abs(), 3)
}
