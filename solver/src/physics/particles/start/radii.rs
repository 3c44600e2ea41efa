use rand_chacha::rand_core::RngCore;

use super::{
    super::{Group, Radius},
    normal, uniform,
};

/// Draws of a log-normal radius after which its nearest limit is taken, should hardly any fall between the limits.
const DRAWS: u32 = 1000;

/// What is to be placed, largest first.
pub(super) struct Bodies {
    /// Radii, in m.
    pub radii: Vec<f64>,
    /// Materials by index.
    pub materials: Vec<u16>,
}

/// Radii of all groups, in the groups' order, then sorted; equal ones keep their order.
pub(super) fn draw(groups: &[Group], random: &mut impl RngCore) -> Bodies {
    let mut bodies = Vec::with_capacity(groups.iter().map(|group| group.count).sum());
    for group in groups {
        bodies.extend((0..group.count).map(|_| (group.radius.draw(random), group.material)));
    }
    bodies.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (radii, materials) = bodies.into_iter().unzip();
    Bodies { radii, materials }
}

impl Radius {
    /// One radius, in m.
    pub(in super::super) fn draw(&self, random: &mut impl RngCore) -> f64 {
        match *self {
            Self::Uniform { mean_m, spread_m } => mean_m + spread_m * (2.0 * uniform(random) - 1.0),
            Self::LogNormal { mean_m, deviation_m, minimum_m, maximum_m } => {
                // Mean and deviation of ln R from those of R (Johnson, Kotz & Balakrishnan 1994, ch. 14).
                let variance = (1.0 + (deviation_m / mean_m).powi(2)).ln();
                let (location, scale) = (mean_m.ln() - 0.5 * variance, variance.sqrt());
                let mut radius = mean_m;
                for _ in 0..DRAWS {
                    radius = (location + scale * normal(random)[0]).exp();
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

    /// Its mean, before limits cut it, in m.
    #[must_use]
    pub fn mean_m(&self) -> f64 {
        match *self {
            Self::Uniform { mean_m, .. } | Self::LogNormal { mean_m, .. } => mean_m,
        }
    }
}
