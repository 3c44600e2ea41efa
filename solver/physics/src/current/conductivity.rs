//! Electrical conductivity by temperature and electric field (Zohdi 2018, eq. 8.17).

use serde::Serialize;
use stagger_coupling::math;

/// Electrical conductivity by temperature and electric field (Zohdi 2018, eq. 8.17):
///
/// σ(θ, E) = σ_R \[1 + K₁/(1 + e^{−γ₁ (θ − θ_R)}) + K₂/(1 + e^{−γ₂ (E − E_R)})\]
///
/// As printed, so that σ_R is the value far below both transitions (for positive γ), not at the references. The monograph
/// writes ‖E − E_R‖; particles know the magnitude of their field only, and take the difference of magnitudes with its sign.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Conductivity {
    /// σ_R in S/m; positive.
    pub reference_s_m: f64,
    /// K₁, γ₁ in 1/K, θ_R in K; `None` where temperature changes nothing.
    pub by_temperature: Option<Transition>,
    /// K₂, γ₂ in m/V, E_R in V/m; `None` where the field changes nothing.
    pub by_field: Option<Transition>,
}

/// A smooth step from 0 to `gain`, centred at `reference`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Transition {
    /// Its height K, a share of the reference conductivity; above −1.
    pub gain: f64,
    /// Its rate γ.
    pub rate: f64,
    /// Where half of it is reached.
    pub reference: f64,
}

impl Transition {
    /// K/(1 + e^{−γ (x − x_R)}), between 0 and K for every finite x: an exponential beyond all numbers gives 0.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        self.gain / (1.0 + math::exp(-self.rate * (x - self.reference)))
    }
}

impl Conductivity {
    /// The same at every temperature and field.
    #[must_use]
    pub fn constant(reference_s_m: f64) -> Self {
        Self { reference_s_m, by_temperature: None, by_field: None }
    }

    /// σ in S/m at a temperature in K and a field in V/m.
    #[must_use]
    pub fn at(&self, temperature_k: f64, field_v_m: f64) -> f64 {
        let share = |transition: Option<Transition>, x: f64| transition.map_or(0.0, |transition| transition.at(x));
        self.reference_s_m * (1.0 + share(self.by_temperature, temperature_k) + share(self.by_field, field_v_m))
    }

    /// Least and greatest σ in S/m over all temperatures and fields.
    #[must_use]
    pub fn range_s_m(&self) -> [f64; 2] {
        let highest = |transition: Option<Transition>| transition.map_or(0.0, |transition| transition.gain.max(0.0));
        let most = 1.0 + highest(self.by_temperature) + highest(self.by_field);
        [self.least_share(), most].map(|share| self.reference_s_m * share)
    }

    /// σ/σ_R where it is least.
    pub(super) fn least_share(&self) -> f64 {
        let lowest = |transition: Option<Transition>| transition.map_or(0.0, |transition| transition.gain.min(0.0));
        1.0 + lowest(self.by_temperature) + lowest(self.by_field)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_transition_adds_half_its_gain_at_its_reference_and_none_or_all_far_away() {
        let conductivity = Conductivity {
            reference_s_m: 10.0,
            by_temperature: Some(Transition { gain: 2.0, rate: 0.1, reference: 500.0 }),
            by_field: Some(Transition { gain: -0.5, rate: 1e-3, reference: 1e4 }),
        };
        // 1 + 2/2 − 0.5/2, exactly: e⁰ is 1.
        assert!((conductivity.at(500.0, 1e4) - 17.5).abs() < 1e-14);
        // e^{±1000} and beyond: nothing or all, and no NaN.
        assert!((conductivity.at(-1e300, -1e300) - 10.0).abs() < 1e-14);
        assert!((conductivity.at(1e300, 1e300) - 25.0).abs() < 1e-14);
        assert!((conductivity.least_share() - 0.5).abs() < f64::EPSILON);
    }
}
