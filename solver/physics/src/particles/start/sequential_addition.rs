//! Random sequential addition of spheres (Widom 1966).

use rand_chacha::rand_core::RngCore;
use stagger_coupling::SolveError;
use stagger_messages::Shown;

use super::{cells::Cells, radii::volume};
use crate::{
    common::{Vec3, random::uniform},
    particles::settings::StartRegion,
};

/// Packing fraction at which random sequential addition of equal spheres jams (Zhang & Torquato 2013: 0.3841).
const JAMMING_FRACTION: f64 = 0.38;

/// Attempts a particle that make a start up to about nine tenths of jamming, and the least in all.
const ATTEMPTS_PER_PARTICLE: u64 = 5_000;
const ATTEMPTS_AT_LEAST: u64 = 1_000_000;

/// What is to be placed, in m.
pub(super) struct SequentialAddition<'a> {
    pub region: &'a StartRegion,
    /// Largest first.
    pub radii: &'a [f64],
}

impl SequentialAddition<'_> {
    /// Positions wholly inside the region, without overlap, in the order of the radii.
    ///
    /// # Errors
    /// [`SolveError::Start`] where the particles do not fit into the region within the bounded number of attempts.
    pub fn place(&self, random: &mut impl RngCore) -> Result<Vec<Vec3>, SolveError> {
        let Some(&largest) = self.radii.first() else { return Ok(Vec::new()) };
        let (lower, upper) = self.region.bounds();
        let lower = Vec3::from(lower);
        let extent = Vec3::from(upper) - lower;
        if !extent.iter().all(|&side| side >= 2.0 * largest) {
            return Err(SolveError::Start(format!(
                "particles: a sphere of radius {:e} m does not fit into the start region of \
                 {:e} x {:e} x {:e} m; use a larger one or smaller particles",
                Shown(largest),
                Shown(extent.x),
                Shown(extent.y),
                Shown(extent.z)
            )));
        }
        // Attempts in proportion to a number that cannot fit would only take long.
        if volume(self.radii) > self.region.volume_m3() {
            return Err(self.jammed(0));
        }
        let mut cells = Cells::new(lower, extent, 2.0 * largest, self.radii.len());
        let mut positions: Vec<Vec3> = Vec::with_capacity(self.radii.len());
        let mut attempts = ATTEMPTS_AT_LEAST + ATTEMPTS_PER_PARTICLE * self.radii.len() as u64;
        for (i, &radius) in self.radii.iter().enumerate() {
            let position = loop {
                if attempts == 0 {
                    return Err(self.jammed(i));
                }
                attempts -= 1;
                let room = extent.map(|side| side - 2.0 * radius);
                let shift = Vec3::from_fn(|axis, _| radius + room[axis] * uniform(random));
                let candidate = lower + shift;
                if self.region.holds(&candidate, radius) && cells.free(&candidate, radius, &positions, self.radii) {
                    break candidate;
                }
            };
            cells.insert(&position, i);
            positions.push(position);
        }
        Ok(positions)
    }

    fn jammed(&self, placed: usize) -> SolveError {
        SolveError::Start(format!(
            "particles: random sequential addition placed {placed} of {} particles and found no room for more: the \
             packing fraction asked for is {:.3}, and random sequential addition jams near {JAMMING_FRACTION}; use a \
             larger region, fewer particles, or the start `growth`",
            self.radii.len(),
            volume(self.radii) / self.region.volume_m3()
        ))
    }
}
