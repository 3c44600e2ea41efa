//! The law of the normal force as a scene chooses it at run time.

use stagger_coupling::math;

use super::{
    hertz::Hertz,
    linear::Linear,
    normal::{Normal, NormalStiffness, reduced},
    overlap::Overlap,
};
use crate::{common::simd::Real, particles::settings::ContactLaw};

/// Law of the normal force.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    Overlap(Overlap),
    Hertz(Hertz),
    Linear(Linear),
}

impl From<ContactLaw> for Law {
    fn from(law: ContactLaw) -> Self {
        match law {
            ContactLaw::Overlap { exponent, .. } => Self::Overlap(Overlap::new(exponent)),
            ContactLaw::Hertz { .. } => Self::Hertz(Hertz),
            ContactLaw::Linear { .. } => Self::Linear(Linear),
        }
    }
}

/// Calls a method of the law that is held.
macro_rules! of_law {
    ($law:expr, $held:ident => $call:expr) => {
        match $law {
            Law::Overlap($held) => $call,
            Law::Hertz($held) => $call,
            Law::Linear($held) => $call,
        }
    };
}

impl Normal for Law {
    fn power(self) -> f64 {
        of_law!(self, law => law.power())
    }

    fn pair_modulus<R: Real>(self, modulus_i: R, modulus_j: R) -> R {
        of_law!(self, law => law.pair_modulus(modulus_i, modulus_j))
    }

    fn pair<R: Real>(self, overlap: R, distance: R, radius_i: R, radius_j: R) -> NormalStiffness<R> {
        of_law!(self, law => law.pair(overlap, distance, radius_i, radius_j))
    }

    fn wall<R: Real>(self, overlap: R, radius: R) -> NormalStiffness<R> {
        of_law!(self, law => law.wall(overlap, radius))
    }
}

impl Law {
    /// Elastic energy of two particles over their modulus: in m³, or m² where the modulus is N/m.
    pub fn pair_energy(self, overlap: f64, radius_i: f64, radius_j: f64) -> f64 {
        match self {
            Self::Overlap(law) => law.pair_energy(overlap, radius_i, radius_j),
            Self::Hertz(_) => Hertz::pair_energy(overlap, radius_i, radius_j),
            Self::Linear(_) => 0.5 * overlap * overlap,
        }
    }

    /// Elastic energy of a particle at a wall over its modulus, likewise.
    pub fn wall_energy(self, overlap: f64, radius: f64) -> f64 {
        match self {
            Self::Overlap(law) => law.wall_energy(overlap, radius),
            Self::Hertz(_) => Hertz::wall_energy(overlap, radius),
            Self::Linear(_) => 0.5 * overlap * overlap,
        }
    }

    /// c and q of the force c E* δ^{q−1} that the law tends to at small overlap, for two particles.
    pub fn small_pair(self, radius_i: f64, radius_j: f64) -> (f64, f64) {
        self.small(reduced(radius_i, radius_j), radius_i + radius_j)
    }

    /// The same for a particle at a wall.
    pub fn small_wall(self, radius: f64) -> (f64, f64) {
        self.small(radius, radius)
    }

    fn small(self, reduced_radius: f64, length: f64) -> (f64, f64) {
        let c = match self {
            // A → 2π R* δ.
            Self::Overlap(law) => std::f64::consts::TAU * reduced_radius / math::powf(length, law.exponent()),
            Self::Hertz(_) => 4.0 / 3.0 * reduced_radius.sqrt(),
            Self::Linear(_) => 1.0,
        };
        (c, self.power())
    }
}
