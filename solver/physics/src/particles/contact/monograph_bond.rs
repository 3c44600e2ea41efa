//! The monograph's bond of particles that overlap (Zohdi 2018, eqs. 6.16–6.17).

use super::tangential::Slip;
use crate::{
    common::{
        quadrature,
        simd::{Real, Triple},
    },
    particles::settings::OverlapBond,
};

/// The monograph's bond of particles that overlap (Zohdi 2018, eqs. 6.16–6.17), without a memory: it forms and breaks with the
/// overlap strain E.
#[derive(Clone, Copy, Debug)]
pub struct MonographBond {
    pub settings: OverlapBond,
}

impl MonographBond {
    /// Normal attraction K_nb |E|^{p_b} A in N and tangential force K_rb ‖v_τ‖ A Δt along the sliding; both zero below the
    /// strain E* at which the bond forms.
    #[inline(always)]
    pub fn force<R: Real>(&self, strain: R, slip: &Slip<R>) -> (R, Triple<R>) {
        let OverlapBond { shear_stiffness_n_m3, strain: threshold, .. } = self.settings;
        let zero = strain.all(0.0);
        let open = strain.below(strain.all(threshold));
        let attraction_n = R::choose(open, zero, self.attraction(strain, slip.area_m2));
        let shear = strain.all(shear_stiffness_n_m3) * slip.area_m2 * slip.step_s;
        (attraction_n, slip.velocity * R::choose(open, zero, shear))
    }

    #[inline(always)]
    fn attraction<R: Real>(&self, strain: R, area_m2: R) -> R {
        let OverlapBond { stiffness_pa, exponent, .. } = self.settings;
        let square = (exponent - 2.0).abs() < f64::EPSILON;
        let power = if square { strain * strain } else { strain.power(exponent) };
        strain.all(stiffness_pa) * power * area_m2
    }

    /// Potential of the attraction in J, negative where bonded: −∫ K_nb |E|^{p_b} A dδ from E* on; `length` is δ/E,
    /// `area` A(δ). Eight Gauss points.
    pub fn energy(&self, overlap: f64, length: f64, area: impl Fn(f64) -> f64) -> f64 {
        let start = self.settings.strain * length;
        let depth = overlap - start;
        if depth <= 0.0 {
            return 0.0;
        }
        let force = |share: f64| {
            let delta = start + share * depth;
            self.attraction(delta / length, area(delta))
        };
        -depth * quadrature::over_unit_interval(force)
    }
}
