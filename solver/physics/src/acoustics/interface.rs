//! The surface between a fluid and the particles in it: how much of a sound wave it reflects (Zohdi 2018, eqs. 11.2–11.6).

use nalgebra::Vector3;
use serde::Serialize;
use stagger_coupling::{SolveError, math};

use super::NODE;
use crate::common::checks::positive;

/// The surface between a fluid and the particles in it, for sound.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interface {
    /// Density ρ_i of the fluid, in kg/m³.
    pub fluid_density_kg_m3: f64,
    /// Speed of sound c_i in the fluid, in m/s.
    pub fluid_sound_speed_m_s: f64,
    /// Density ρ_t of the particles, in kg/m³.
    pub density_kg_m3: f64,
    /// Speed of sound c_t in the particles, in m/s.
    pub sound_speed_m_s: f64,
}

impl Interface {
    /// Refuses settings outside their range.
    pub(super) fn check(&self) -> Result<(), SolveError> {
        positive(NODE, "density of the fluid", self.fluid_density_kg_m3)?;
        positive(NODE, "speed of sound in the fluid", self.fluid_sound_speed_m_s)?;
        positive(NODE, "density of the particles", self.density_kg_m3)?;
        positive(NODE, "speed of sound in the particles", self.sound_speed_m_s)
    }

    /// c̃ = c_i/c_t.
    #[must_use]
    pub fn speed_ratio(&self) -> f64 {
        self.fluid_sound_speed_m_s / self.sound_speed_m_s
    }

    /// Acoustic impedance ρ_t c_t of the particles, in Pa s/m.
    #[must_use]
    pub fn impedance_pa_s_m(&self) -> f64 {
        self.density_kg_m3 * self.sound_speed_m_s
    }

    /// Cosine of the angle of transmission, sinθ_t = sinθ_i/c̃ (Zohdi 2018, eq. 11.2); `None` beyond the critical angle.
    fn transmitted_cosine(&self, cosine: f64) -> Option<f64> {
        let squared = 1.0 - (1.0 - cosine * cosine) / math::powi(self.speed_ratio(), 2);
        (squared > 0.0).then(|| squared.sqrt())
    }

    /// Share R of a ray's intensity that is reflected at the angle of incidence with this cosine:
    /// ((Â cosθ_i − cosθ_t)/(Â cosθ_i + cosθ_t))² with Â = ρ_t c_t/(ρ_i c_i), and 1 where sinθ_i ≥ c̃ (Zohdi 2018,
    /// eqs. 11.2–11.6).
    ///
    /// The monograph's eq. 11.11 prints R = 0.944 for Â = 18 at normal incidence; ((18 − 1)/(18 + 1))² is 0.8006.
    #[must_use]
    pub fn reflectance(&self, cosine: f64) -> f64 {
        let ratio = self.impedance_pa_s_m() / (self.fluid_density_kg_m3 * self.fluid_sound_speed_m_s);
        match self.transmitted_cosine(cosine) {
            Some(transmitted) if cosine > 0.0 => {
                let incident = ratio * cosine;
                math::powi((incident - transmitted) / (incident + transmitted), 2)
            }
            _ => 1.0,
        }
    }

    /// Unit vector along which a ray in `direction` goes on inside a particle with this outward normal, by Snell's law;
    /// `None` beyond the critical angle.
    #[must_use]
    pub fn transmitted(&self, direction: &Vector3<f64>, normal: &Vector3<f64>, cosine: f64) -> Option<Vector3<f64>> {
        let transmitted = self.transmitted_cosine(cosine)?;
        let bend = 1.0 / self.speed_ratio();
        Some(direction * bend + normal * (bend * cosine - transmitted))
    }
}
