//! How long within a window each particle is there, before it has boiled.

use crate::common::enthalpy_curve::Curve;

/// Rounds in which the shares are sought; what they leave is booked.
const ROUNDS: u32 = 40;
/// Rounds after which a share moves half of the way only.
const DAMPED: u32 = 10;
/// Roundings of what a particle holds.
const ROUNDINGS: f64 = 16.0;

/// Shares of a window for which the particles are there: 1 but for those that are vapour before its end.
///
/// A particle that has boiled takes no more light, current or heat: it is gone, though its row stays to the window's end. With
/// its enthalpy h_v at the end of boiling, and the mean W of all that heats it while it is there,
///
/// s = m (h_v − h(t))/(W Δt)
///
/// where that is less than 1. W depends on the other particles' temperatures and shares, so that s is sought by inserting it. A
/// contact conducts for as long as both partners are there, so that what one gains the other loses.
pub(super) struct Presence {
    /// `None` while all are there throughout.
    shares: Option<Vec<f64>>,
    round: u32,
}

/// What a particle has at the window's start and can have at most, in J.
pub(super) struct Boiling<'a> {
    pub(super) masses_kg: &'a [f64],
    pub(super) start_j_kg: &'a [f64],
    /// Tolerance of the window's equations, as a share of the temperatures.
    pub(super) tolerance: f64,
    /// The curve of each particle.
    pub(super) curve: &'a dyn Fn(usize) -> &'a Curve,
}

impl Boiling<'_> {
    /// Held at the start and at the end of boiling; `None` for what never boils.
    fn ends_j(&self, i: usize) -> Option<[f64; 2]> {
        let vapour_j_kg = (self.curve)(i).vapour()?;
        Some([self.start_j_kg[i], vapour_j_kg].map(|specific| self.masses_kg[i] * specific))
    }

    /// To this a particle's energy shall be that of the end of boiling, in J.
    fn tolerance_j(&self, start_j: f64, vapour_j: f64) -> f64 {
        self.tolerance * (vapour_j - start_j) + ROUNDINGS * f64::EPSILON * (start_j.abs() + vapour_j.abs())
    }
}

impl Presence {
    /// Those that are vapour at the start are not there at all.
    pub(super) fn at_start(boiling: &Boiling<'_>) -> Self {
        let gone = |i: usize| boiling.ends_j(i).is_some_and(|[start_j, vapour_j]| start_j >= vapour_j);
        let rows = boiling.masses_kg.len();
        let any = (0..rows).any(gone);
        let share = |i: usize| if gone(i) { 0.0 } else { 1.0 };
        Self { shares: any.then(|| (0..rows).map(share).collect()), round: 0 }
    }

    /// The share of particle `i`.
    pub(super) fn of(&self, i: usize) -> f64 {
        self.shares.as_ref().map_or(1.0, |shares| shares[i])
    }

    /// All of them; `None` where every one is 1.
    pub(super) fn shares(&self) -> Option<&[f64]> {
        self.shares.as_deref()
    }

    /// Corrects the shares by what they led to; false where they stand, or have been sought for long.
    pub(super) fn improve(&mut self, boiling: &Boiling<'_>, energies_j: &[f64]) -> bool {
        self.round += 1;
        if self.round >= ROUNDS {
            return false;
        }
        let mut stands = true;
        for (i, &energy_j) in energies_j.iter().enumerate() {
            let share = self.of(i);
            let Some([start_j, vapour_j]) = boiling.ends_j(i) else { continue };
            if start_j >= vapour_j || (share >= 1.0 && energy_j <= vapour_j) {
                continue;
            }
            if (energy_j - vapour_j).abs() <= boiling.tolerance_j(start_j, vapour_j) {
                continue;
            }
            let (gained_j, wanted_j) = (energy_j - start_j, vapour_j - start_j);
            let found = if gained_j > 0.0 { (share * wanted_j / gained_j).min(1.0) } else { 1.0 };
            let found = if self.round > DAMPED { 0.5 * (share + found) } else { found };
            if found != share {
                self.shares.get_or_insert_with(|| vec![1.0; energies_j.len()])[i] = found;
                stands = false;
            }
        }
        !stands
    }

    /// What particle `i` keeps of the energy that was found, in J: what goes beyond the end of boiling, or is within the
    /// tolerance of it, is set to that end.
    pub(super) fn kept_j(&self, boiling: &Boiling<'_>, i: usize, energy_j: f64) -> f64 {
        match boiling.ends_j(i) {
            Some([start_j, vapour_j])
                if energy_j >= vapour_j
                    || (self.of(i) < 1.0 && vapour_j - energy_j <= boiling.tolerance_j(start_j, vapour_j)) =>
            {
                vapour_j.max(start_j)
            }
            _ => energy_j,
        }
    }
}
