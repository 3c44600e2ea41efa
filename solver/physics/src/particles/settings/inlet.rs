//! A dispenser of particles: what it pours, where, and when.

use serde::Serialize;
use stagger_coupling::{SolveError, math};
use stagger_messages::Shown;

use crate::{
    common::{Vec3, checks},
    particles::settings::Radius,
};

/// A dispenser: what it pours, where, and when.
///
/// Particle `n` of a dispenser, counted from 0, has a radius and a sequence of places to try that follow from the seed,
/// the dispenser's name and `n` alone: what is poured does not depend on windows, restarts, or threads. Particles come
/// in the order of their numbers; one that finds no room waits, and those behind it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pour {
    /// Name in the scene.
    pub name: String,
    /// Where particles appear; they lie wholly inside.
    pub region: PourRegion,
    /// Particles per second; positive.
    pub rate_1_s: f64,
    /// When it opens, in s.
    pub from_s: f64,
    /// When it closes, in s; infinity is never.
    pub until_s: f64,
    /// Most particles in all; `None` is no limit.
    pub limit: Option<u64>,
    /// Radii R.
    pub radius: Radius,
    /// Their material, as an index into [`Settings::materials`](crate::particles::settings::Settings::materials).
    pub material: u16,
    /// Velocity of every particle, in m/s.
    pub velocity_m_s: [f64; 3],
    /// Seed of radii and places.
    pub seed: u64,
}

/// Where a dispenser puts its particles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PourRegion {
    /// An axis-aligned box.
    Box {
        /// Lower corner, in m.
        lower_m: [f64; 3],
        /// Upper corner, in m.
        upper_m: [f64; 3],
    },
    /// A flat horizontal disc: the centres lie in its plane.
    Disc {
        /// Centre, in m.
        centre_m: [f64; 3],
        /// Radius, in m.
        radius_m: f64,
    },
}

impl PourRegion {
    /// A place for the centre of a sphere of `radius_m`, from three numbers in [0, 1); uniform over the places there are.
    /// Where the sphere is as large as the region, that is its middle.
    pub(crate) fn place(&self, radius_m: f64, random: [f64; 3]) -> Vec3 {
        match *self {
            Self::Box { lower_m, upper_m } => Vec3::from_fn(|axis, _| {
                let room = (upper_m[axis] - lower_m[axis] - 2.0 * radius_m).max(0.0);
                0.5 * (lower_m[axis] + upper_m[axis]) + (random[axis] - 0.5) * room
            }),
            Self::Disc { centre_m, radius_m: disc_m } => {
                let distance = (disc_m - radius_m).max(0.0) * random[0].sqrt();
                let (sine, cosine) = math::sin_cos(std::f64::consts::TAU * random[1]);
                Vec3::from(centre_m) + Vec3::new(distance * cosine, distance * sine, 0.0)
            }
        }
    }

    /// The corners of a box around every centre.
    pub(crate) fn bounds_m(&self) -> [Vec3; 2] {
        match *self {
            Self::Box { lower_m, upper_m } => [lower_m, upper_m].map(Vec3::from),
            Self::Disc { centre_m, radius_m } => {
                let (centre, reach) = (Vec3::from(centre_m), Vec3::new(radius_m, radius_m, 0.0));
                [centre - reach, centre + reach]
            }
        }
    }

    /// The corners of that box, all eight.
    pub fn corners_m(&self) -> [Vec3; 8] {
        let bounds = self.bounds_m();
        std::array::from_fn(|corner| Vec3::from_fn(|axis, _| bounds[corner >> axis & 1][axis]))
    }
}

impl Pour {
    /// Checks ranges; there are `materials` of them.
    ///
    /// # Errors
    /// [`SolveError::Mismatch`] names the dispenser and the first setting that is not in its range.
    pub(crate) fn check(&self, materials: usize) -> Result<(), SolveError> {
        let name = format!("dispenser `{}`", self.name);
        let Self { rate_1_s, from_s, until_s, material, .. } = *self;
        checks::positive(&name, "its rate", rate_1_s)?;
        checks::setting(&name, "the time it opens", from_s, from_s.is_finite(), "finite")?;
        let after = format!("after it opens, {} s", Shown(from_s));
        checks::setting(&name, "the time it closes", until_s, until_s > from_s, &after)?;
        let known = usize::from(material) < materials;
        checks::setting(&name, "its material", material.into(), known, &format!("one of the {materials} there are"))?;
        let [lower, upper] = self.region.bounds_m();
        let numbers = lower.iter().chain(&upper).chain(&self.velocity_m_s);
        let wrong = numbers.copied().find(|number| !number.is_finite());
        wrong.map_or(Ok(()), |wrong| checks::setting(&name, "its place or velocity", wrong, false, "finite"))
    }
}
