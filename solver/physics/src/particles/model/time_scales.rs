//! Time scales of the hardest impacts that a scene lets expect.

use stagger_coupling::math;

use crate::common::quadrature;

/// A force c δ^{q−1} in an elastic impact.
#[derive(Clone, Copy, Debug)]
pub struct Impact {
    /// c, in N/m^{q−1}.
    pub c: f64,
    pub q: f64,
    /// ∫₀¹ dx/√(1 − x^q).
    pub integral: f64,
}

impl Impact {
    pub fn new(c: f64, q: f64) -> Self {
        // x = 1 − u² takes the root singularity away.
        let integral = quadrature::over_unit_interval(|u| 2.0 * u / (1.0 - math::powf(1.0 - u * u, q)).sqrt());
        Self { c, q, integral }
    }

    /// Duration in s and largest overlap in m.
    ///
    /// Energy: ½ m v² = c δ^q/q at the largest overlap; the duration is 2 (δ/v) ∫₀¹ dx/√(1 − x^q), which for Hertz
    /// (q = 5/2) is 2.94328 δ/v (Johnson 1985, eq. 11.24). A linear spring's, π √(m/c), is that of no speed at all, too.
    pub fn of(&self, mass_kg: f64, speed_m_s: f64) -> (f64, f64) {
        let Self { c, q, integral } = *self;
        if q <= 2.0 {
            let inverse_1_s = (mass_kg / c).sqrt();
            return (2.0 * integral * inverse_1_s, speed_m_s * inverse_1_s);
        }
        if speed_m_s <= 0.0 {
            return (f64::INFINITY, 0.0);
        }
        let overlap = math::powf(0.5 * q * mass_kg * speed_m_s * speed_m_s / c, 1.0 / q);
        (2.0 * overlap / speed_m_s * integral, overlap)
    }
}

/// What the start of a scene lets expect.
#[derive(Clone, Copy, Debug)]
pub struct StartScales {
    /// The hardest impacts of the start and of what is poured.
    pub hardest: Option<Hardest>,
    /// Shortest expected contact, in s.
    pub contact_s: f64,
    /// Longest substep of the Verlet integrator, in s: the scene's own, or that of the speeds which the start lets expect.
    pub substep_s: f64,
}

impl StartScales {
    /// Before anything is known of the start.
    pub const UNKNOWN: Self = Self { hardest: None, contact_s: f64::INFINITY, substep_s: f64::INFINITY };
}

/// Time scales of the smallest particle, of the start or of a dispenser, at a speed.
#[derive(Clone, Copy, Debug)]
pub struct TimeScales {
    /// Shortest contact, in s; infinite where nothing moves.
    pub contact_s: f64,
    /// Substep that resolves contact, damping, friction and drag, in s; infinite where nothing acts.
    pub substep_s: f64,
}

impl TimeScales {
    /// Of no particles.
    pub const NONE: Self = Self { contact_s: f64::INFINITY, substep_s: f64::INFINITY };
}

/// The hardest impacts of a scene: those of its smallest and stiffest particle, of the start or of a dispenser.
#[derive(Clone, Copy, Debug)]
pub struct Hardest {
    pub radius_m: f64,
    pub mass_kg: f64,
    /// On a particle like it; `None` where there is only one.
    pub pair: Option<Impact>,
    /// On a wall; `None` without walls.
    pub wall: Option<Impact>,
    /// Substep in s that resolves the fields, whatever the speed.
    pub fields_s: f64,
}

#[cfg(test)]
mod tests {
    use super::Impact;

    #[test]
    fn hertz_impact_lasts_as_in_the_literature() {
        let (time, overlap) = Impact::new(5e6, 2.5).of(2.0, 3.0);
        // 2.94328 is given to six digits.
        assert!((time * 3.0 / overlap - 2.943_28).abs() < 1e-5);
        for speed in [0.0, 3.0] {
            let (time, overlap) = Impact::new(5e6, 2.0).of(2.0, speed);
            // A linear spring: half a period, π √(m/c), whatever the speed.
            assert!((time / (std::f64::consts::PI * (2.0f64 / 5e6).sqrt()) - 1.0).abs() < 1e-9);
            assert!((overlap - speed * (2.0f64 / 5e6).sqrt()).abs() < 1e-15);
        }
        assert!(Impact::new(1.0, 2.5).of(1.0, 0.0).0.is_infinite());
    }
}
