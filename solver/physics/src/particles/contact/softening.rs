//! Thermal softening of the contacts' moduli (Zohdi 2018, eqs. 6.33 and 7.2).

use stagger_coupling::math;

use super::hertz::Hertz;
use crate::particles::settings::{ContactLaw, Material, Settings};

/// Thermal softening K(θ) = max(K_0 e^{−a(θ/θ* − 1)}, K_lim) (Zohdi 2018, eqs. 6.33, 7.2).
#[derive(Clone, Copy, Debug)]
pub struct Softening {
    /// Modulus at the reference temperature: of K_0, or of Young's modulus.
    pub reference_modulus: f64,
    /// Rate a.
    pub rate: f64,
    /// Reference temperature θ* in K; positive.
    pub reference_k: f64,
    /// Its floor, of K_lim.
    pub floor_modulus: f64,
}

impl Softening {
    /// Softening of the modulus of a material; one of its own stiffness softens to the same share of it.
    pub fn of(settings: &Settings, material: &Material) -> Self {
        let contact = &settings.contact;
        let (stiffness, factor) = match contact.law {
            ContactLaw::Overlap { stiffness_pa, .. } => (stiffness_pa, 1.0),
            ContactLaw::Hertz { young_pa, poisson } => {
                (young_pa, Hertz::modulus(1.0, material.poisson.unwrap_or(poisson)))
            }
            ContactLaw::Linear { stiffness_n_m } => (stiffness_n_m, 1.0),
        };
        let own = material.stiffness.unwrap_or(stiffness);
        let floor = contact.softening_floor_pa * own / stiffness;
        Self {
            reference_modulus: own * factor,
            rate: contact.softening_rate,
            reference_k: contact.softening_reference_k,
            floor_modulus: floor * factor,
        }
    }

    /// The modulus at `temperature_k`.
    #[inline]
    pub fn stiffness(&self, temperature_k: f64) -> f64 {
        (self.reference_modulus * math::exp(-self.rate * (temperature_k / self.reference_k - 1.0)))
            .max(self.floor_modulus)
    }
}

#[cfg(test)]
mod tests {
    use super::Softening;

    #[test]
    fn falls_exponentially_to_the_floor() {
        let softening = Softening { reference_modulus: 1e7, rate: 2.0, reference_k: 300.0, floor_modulus: 1e6 };
        assert!((softening.stiffness(300.0) - 1e7).abs() < 1e-6);
        // One reference temperature above: e^{−2}, to rounding.
        assert!((softening.stiffness(600.0) / 1e7 - (-2.0f64).exp()).abs() < 1e-15);
        assert!((softening.stiffness(3000.0) - 1e6).abs() < f64::EPSILON);
    }
}
