//! Distributions of the particles' radii, and how a radius is drawn from them.

use rand_chacha::rand_core::RngCore;
use serde::Serialize;
use stagger_coupling::math;

use crate::common::random::uniform;

/// Draws of a log-normal radius after which its nearest limit is taken, should hardly any fall between the limits.
const DRAWS: u32 = 1000;

/// Log-normal radii are rounded to this part of their mean: the functions that make them differ in the last digits from one
/// machine to another, and a start must not.
const FINENESS: f64 = (1u64 << 30) as f64;

/// Distribution of radii R.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Radius {
    /// Uniform in mean ± spread.
    Uniform {
        /// Mean, in m; positive.
        mean_m: f64,
        /// Half width, in m; less than the mean.
        spread_m: f64,
    },
    /// Log-normal, cut: what falls outside the limits is drawn again.
    LogNormal {
        /// Mean before the cut, in m; positive.
        mean_m: f64,
        /// Standard deviation before the cut, in m.
        deviation_m: f64,
        /// Smallest radius, in m; positive, below the mean.
        minimum_m: f64,
        /// Largest radius, in m; above the mean.
        maximum_m: f64,
    },
}

impl Radius {
    /// One radius, in m.
    pub(crate) fn draw(&self, random: &mut impl RngCore) -> f64 {
        match *self {
            Self::Uniform { mean_m, spread_m } => mean_m + spread_m * (2.0 * uniform(random) - 1.0),
            Self::LogNormal { mean_m, deviation_m, minimum_m, maximum_m } => {
                // Mean and deviation of ln R from those of R (Johnson, Kotz & Balakrishnan 1994, ch. 14).
                let variance = math::ln(1.0 + math::powi(deviation_m / mean_m, 2));
                let (location, scale) = (math::ln(mean_m) - 0.5 * variance, variance.sqrt());
                let mut radius = mean_m;
                for _ in 0..DRAWS {
                    let drawn = math::exp(location + scale * normal(random)) / mean_m;
                    radius = mean_m * (drawn * FINENESS).round() / FINENESS;
                    if (minimum_m..=maximum_m).contains(&radius) {
                        return radius;
                    }
                }
                radius.clamp(minimum_m, maximum_m)
            }
        }
    }

    /// The largest radius it can give, in m.
    #[must_use]
    pub fn largest_m(&self) -> f64 {
        match *self {
            Self::Uniform { mean_m, spread_m } => mean_m + spread_m,
            Self::LogNormal { maximum_m, .. } => maximum_m,
        }
    }

    /// The smallest radius it can give, in m.
    #[must_use]
    pub fn smallest_m(&self) -> f64 {
        match *self {
            Self::Uniform { mean_m, spread_m } => mean_m - spread_m,
            Self::LogNormal { minimum_m, .. } => minimum_m,
        }
    }

    /// The radius that a twentieth of those it gives are below, in m; of a log-normal distribution before limits cut it, or its
    /// smallest radius.
    #[must_use]
    pub fn small_m(&self) -> f64 {
        match *self {
            Self::Uniform { mean_m, spread_m } => mean_m - 0.9 * spread_m,
            Self::LogNormal { mean_m, deviation_m, minimum_m, .. } => {
                // ln R is normal with this variance and mean; 1.645 of its deviations below lies a twentieth.
                let variance = math::ln_1p(math::powi(deviation_m / mean_m, 2));
                minimum_m.max(mean_m * math::exp(-0.5 * variance - 1.645 * variance.sqrt()))
            }
        }
    }

    /// Its mean, before limits cut it, in m.
    #[must_use]
    pub fn mean_m(&self) -> f64 {
        match *self {
            Self::Uniform { mean_m, .. } | Self::LogNormal { mean_m, .. } => mean_m,
        }
    }
}

/// A number of the standard normal distribution (Box & Muller 1958).
fn normal(random: &mut impl RngCore) -> f64 {
    // 1 − u lies in (0, 1], so that the logarithm is finite.
    let radius = (-2.0 * math::ln(1.0 - uniform(random))).sqrt();
    radius * math::cos(std::f64::consts::TAU * uniform(random))
}
