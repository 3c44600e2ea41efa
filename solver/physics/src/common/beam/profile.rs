//! The beam over its cross-section.

use stagger_coupling::{SolveError, math};
use std::f64::consts::PI;

use super::Profile;
use crate::common::checks::positive;

impl Profile {
    /// Refuses settings outside their range, as those of `node`.
    pub(super) fn check(&self, node: &str) -> Result<(), SolveError> {
        match *self {
            Self::TopHat { radius_m } | Self::Gaussian { radius_m } => positive(node, "beam radius", radius_m),
            Self::Exponential { decay_1_m } => positive(node, "beam decay", decay_1_m),
        }
    }

    /// Irradiance at distance `d_m` from the axis as a share of the power, in 1/m²; integrates to 1 over the plane.
    ///
    /// Zohdi 2018, eq. 6.43 for the exponential; ISO 11146-1's radius w for the Gaussian.
    pub fn irradiance_1_m2(&self, d_m: f64) -> f64 {
        match *self {
            Self::TopHat { radius_m } if d_m <= radius_m => 1.0 / (PI * radius_m * radius_m),
            Self::TopHat { .. } => 0.0,
            Self::Gaussian { radius_m } => {
                2.0 / (PI * radius_m * radius_m) * math::exp(-2.0 * math::powi(d_m / radius_m, 2))
            }
            Self::Exponential { decay_1_m } => decay_1_m * decay_1_m / (2.0 * PI) * math::exp(-decay_1_m * d_m),
        }
    }

    /// Distance from the axis in m within which the share `q` of the power lies; `q` in [0, 1).
    pub fn quantile_m(&self, q: f64) -> f64 {
        match *self {
            Self::TopHat { radius_m } => radius_m * q.sqrt(),
            Self::Gaussian { radius_m } => radius_m * (-0.5 * math::ln_1p(-q)).sqrt(),
            // 1 − (1 + x) e^{−x} = q has no closed solution; what is left of the power lies beyond x = 750 in no binary64.
            Self::Exponential { decay_1_m } => {
                let within = |x: f64| -math::exp_m1(-x) - x * math::exp(-x);
                let (mut low, mut high) = (0.0, 750.0);
                // Halved until neither end moves any more.
                loop {
                    let middle = 0.5 * (low + high);
                    if middle <= low || middle >= high {
                        break high / decay_1_m;
                    }
                    if within(middle) < q { low = middle } else { high = middle }
                }
            }
        }
    }

    /// Distance between lines that sample a narrow beam, in m: a twelfth of the radius within which half of the power lies.
    ///
    /// What lies on one side of an edge across the beam is then right within 0.5 % of the power for the Gaussian, 0.8 % for the
    /// top hat and 0.6 % for the exponential, wherever the edge crosses (`beer_lambert.rs` tests it).
    pub fn sampling_m(&self) -> f64 {
        self.quantile_m(0.5) / 12.0
    }

    /// Radius R, w or 1/b that the beam is named by, in m.
    pub fn radius_m(&self) -> f64 {
        match *self {
            Self::TopHat { radius_m } | Self::Gaussian { radius_m } => radius_m,
            Self::Exponential { decay_1_m } => 1.0 / decay_1_m,
        }
    }

    /// Distance from the axis beyond which the beam is taken as dark, in m: at most 1e-6 of the power lies there.
    pub(crate) fn cut_m(&self) -> f64 {
        match *self {
            Self::TopHat { radius_m } => radius_m,
            // e^{−2 x²} = 1e-6 beyond x = d/w.
            Self::Gaussian { radius_m } => 2.6283 * radius_m,
            // (1 + x) e^{−x} = 1e-6 beyond x = b d.
            Self::Exponential { decay_1_m } => 16.6884 / decay_1_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_within_the_cut_is_all_but_a_millionth() {
        for (profile, beyond) in [
            (Profile::TopHat { radius_m: 3e-4 }, 0.0),
            (Profile::Gaussian { radius_m: 3e-4 }, 1e-6),
            (Profile::Exponential { decay_1_m: 2e4 }, 1e-6),
        ] {
            // Midpoint rule over rings: its error, of order (2.6/n)² and (17/n)², is 3e-9 at most for n = 300 000.
            let n = 300_000;
            let width_m = profile.cut_m() / f64::from(n);
            let ring = |k| {
                let d_m = (f64::from(k) + 0.5) * width_m;
                profile.irradiance_1_m2(d_m) * 2.0 * PI * d_m * width_m
            };
            let within: f64 = (0..n).map(ring).sum();
            assert!((1.0 - within - beyond).abs() < 1e-8, "{profile:?}: {within}");
        }
    }

    #[test]
    fn a_quantile_holds_its_share_of_the_power() {
        for profile in [
            Profile::TopHat { radius_m: 3e-4 },
            Profile::Gaussian { radius_m: 3e-4 },
            Profile::Exponential { decay_1_m: 2e4 },
        ] {
            for q in [1e-6, 0.1, 0.5, 0.99, 1.0 - 1e-9] {
                // Midpoint rule over rings up to the quantile; second order in 1/n, the factor is at most 40.
                let (n, radius_m) = (200_000, profile.quantile_m(q));
                let width_m = radius_m / f64::from(n);
                let ring = |k| {
                    let d_m = (f64::from(k) + 0.5) * width_m;
                    profile.irradiance_1_m2(d_m) * 2.0 * PI * d_m * width_m
                };
                let within: f64 = (0..n).map(ring).sum();
                assert!((within / q - 1.0).abs() < 1e-7, "{profile:?}: {within} within the quantile {q}");
            }
        }
        assert!(Profile::Exponential { decay_1_m: 1.0 }.quantile_m(0.0) < 1e-300);
    }
}
