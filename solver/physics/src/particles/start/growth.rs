//! Spheres that move and grow until they fill a share of a box: the event-driven algorithm of Lubachevsky & Stillinger,
//! J. Stat. Phys. 60 (1990) 561, between hard walls.
//!
//! Every radius is a share s(t) of its final value, the same for all. Spheres fly freely from one event to the next: they
//! bounce off each other and off the walls, or cross into another cell of the search grid. Small ones are placed at random; they
//! are done when s reaches 1. Spheres that jam before are given back a little room, and grow again more slowly: the slower, the
//! denser they arrange themselves.

mod event;
mod flight;

use rand_chacha::rand_core::RngCore;
use stagger_coupling::{SolveError, math};

use self::flight::{Flight, OVERSHOOT};
use super::{radii::volume, sequential_addition::SequentialAddition};
use crate::{
    common::{Vec3, random::uniform},
    particles::settings::StartRegion,
};

/// Packing fraction that random sequential addition makes without effort.
const LOOSE: f64 = 0.25;
/// No packing of spheres that differ little is denser than 0.7405 (Hales 2005); one of few sizes can be a little more.
const DENSEST: f64 = 0.80;
/// Growth of a diameter over the distance flown: at first, and from one try to the next.
const FASTEST: f64 = 0.03;
const SLOWER: f64 = 0.25;
/// Collisions of a particle while it flies its diameter, above which the spheres are jammed.
const JAMMED: f64 = 1000.0;
/// Share of their size that jammed spheres are given back to.
const LOOSENED: f64 = 0.97;
/// Collisions of each particle between two looks, and in all.
const EPOCH: usize = 10;
const EPOCHS: usize = 300;

/// What is to be packed, in m.
pub(super) struct Growth<'a> {
    pub lower: Vec3,
    pub upper: Vec3,
    /// Final radii, largest first.
    pub radii: &'a [f64],
}

impl Growth<'_> {
    /// Positions in the order of the radii, wholly inside the box, without overlap.
    ///
    /// # Errors
    /// [`SolveError::Start`] where the spheres jam before they have their final radii, within a bounded number of events.
    pub fn place(&self, random: &mut impl RngCore) -> Result<Vec<Vec3>, SolveError> {
        let extent = self.upper - self.lower;
        let fraction = volume(self.radii) / extent.product();
        if fraction > DENSEST {
            return Err(SolveError::Start(format!(
                "particles: the packing fraction asked for is {fraction:.3}, and no spheres pack denser than about 0.74; \
                 use a larger box or fewer particles"
            )));
        }
        // To three digits: another machine's cube root may differ in the last one, and collisions would amplify that.
        let share = (math::cbrt(LOOSE / fraction).min(1.0) * 1000.0).floor() / 1000.0;
        let region = StartRegion::Box { lower_m: self.lower.into(), upper_m: self.upper.into() };
        let small: Vec<f64> = self.radii.iter().map(|radius| share * radius).collect();
        let positions = SequentialAddition { region: &region, radii: &small }.place(random)?;
        if share >= 1.0 {
            return Ok(positions);
        }
        // In units of the mean final diameter, so that speeds of order one are neither tiny nor huge.
        let unit = 2.0 * self.radii.iter().sum::<f64>() / self.radii.len() as f64;
        // Collisions soon make a Maxwell distribution of them.
        let velocities = positions.iter().map(|_| Vec3::from_fn(|_, _| 2.0 * uniform(random) - 1.0)).collect();
        let mut flight = Flight::new(
            extent / unit,
            self.radii.iter().map(|radius| radius / unit).collect(),
            positions.iter().map(|position| (position - self.lower) / unit).collect(),
            velocities,
            share,
        );
        let (mut rate, mut densest) = (FASTEST, share);
        for _ in 0..EPOCHS {
            let before = flight.share;
            flight.renew(rate);
            if flight.run(1.0 + OVERSHOOT, EPOCH * self.radii.len()) {
                return Ok(flight.positions.iter().map(|position| self.lower + position * unit).collect());
            }
            densest = densest.max(flight.share);
            if rate * EPOCH as f64 > JAMMED * (flight.share - before) {
                flight.share *= LOOSENED;
                rate *= SLOWER;
            }
        }
        Err(SolveError::Start(format!(
            "particles: growth reached a packing fraction of {:.3}, where {fraction:.3} is asked for, and the spheres are \
             jammed; use a larger box or fewer particles",
            fraction * math::powi(densest, 3)
        )))
    }
}
