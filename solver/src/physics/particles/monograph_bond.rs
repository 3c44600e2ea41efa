use super::{Vec3, contact::Slip, quadrature, settings::OverlapBond};

/// The monograph's bond of particles that overlap (Zohdi 2018, eqs. 6.16–6.17), without a memory: it forms and breaks with the
/// overlap strain E.
#[derive(Clone, Copy, Debug)]
pub(super) struct MonographBond {
    pub settings: OverlapBond,
}

impl MonographBond {
    /// Normal attraction K_nb |E|^{p_b} A in N; `None` below the strain E* at which the bond forms.
    #[inline(always)]
    pub fn attraction(&self, strain: f64, area_m2: f64) -> Option<f64> {
        let OverlapBond { stiffness_pa, exponent, strain: threshold, .. } = self.settings;
        (strain >= threshold).then(|| {
            let power = if (exponent - 2.0).abs() < f64::EPSILON { strain * strain } else { strain.powf(exponent) };
            stiffness_pa * power * area_m2
        })
    }

    /// Tangential force K_rb ‖v_τ‖ A Δt along the sliding, in N.
    #[inline(always)]
    pub fn shear(&self, slip: &Slip) -> Vec3 {
        slip.velocity * (self.settings.shear_stiffness_n_m3 * slip.area_m2 * slip.step_s)
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
            self.attraction(delta / length, area(delta)).unwrap_or(0.0)
        };
        -depth * quadrature::over_unit_interval(force)
    }
}
