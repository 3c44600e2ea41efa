//! Where particles are at t = 0: how each kind of start places them.

mod cells;
mod growth;
mod lattice;
mod placed;
mod radii;
mod sequential_addition;
mod settle;

use stagger_coupling::SolveError;

pub use self::placed::Placed;
use self::{growth::Growth, sequential_addition::SequentialAddition, settle::Settle};
use crate::{
    common::{Vec3, random::random},
    particles::{
        model::Model,
        settings::{Settings, Start, validate},
    },
};

/// Places the particles of `settings`, of all groups jointly, largest first. The same seed gives the same numbers on every
/// machine; given particles keep their order.
///
/// # Errors
/// [`SolveError::Start`] where the particles do not fit, or not within the bounded effort of the method, or where they are so
/// far from the origin that rounding moves them by more than a ten-thousandth of their radius.
pub fn place(settings: &Settings) -> Result<Placed, SolveError> {
    placed::exact(place_by_kind(settings)?)
}

/// Checks `settings`, places the particles, and derives what does not change during a run.
///
/// # Errors
/// [`SolveError::Start`] where the start cannot be made, [`SolveError::Mismatch`] where a setting is out of its range; the
/// message names the setting.
pub(super) fn model(settings: Settings) -> Result<Model, SolveError> {
    validate::settings(&settings)?;
    let placed = place(&settings)?;
    placed::model(settings, placed)
}

fn place_by_kind(settings: &Settings) -> Result<Placed, SolveError> {
    let mut random = random(settings.seed);
    let bodies = radii::draw(&settings.groups, &mut random);
    let (positions, velocity) = match &settings.start {
        Start::SequentialAddition { region, velocity_m_s } => {
            (SequentialAddition { region, radii: &bodies.radii }.place(&mut random)?, *velocity_m_s)
        }
        Start::Lattice { region, lattice, spacing, jitter, velocity_m_s } => {
            (lattice.place(region, &bodies, *spacing, *jitter, &mut random)?, *velocity_m_s)
        }
        Start::Growth { lower_m, upper_m, velocity_m_s } => {
            let (lower, upper) = (Vec3::from(*lower_m), Vec3::from(*upper_m));
            (Growth { lower, upper, radii: &bodies.radii }.place(&mut random)?, *velocity_m_s)
        }
        Start::Settle { region, until, damping, longest_s } => {
            let settle = Settle { until: *until, damping: *damping, longest_s: *longest_s };
            (settle.place(settings, region, &bodies, &mut random)?, [0.0; 3])
        }
        Start::Given { positions_m, velocities_m_s, radii_m, materials, spins_rad_s } => {
            let spins = if spins_rad_s.is_empty() { vec![[0.0; 3]; positions_m.len()] } else { spins_rad_s.clone() };
            return Ok(Placed {
                spins,
                positions: positions_m.clone(),
                velocities: velocities_m_s.clone(),
                radii: radii_m.clone(),
                materials: materials.clone(),
            });
        }
    };
    Ok(Placed {
        spins: vec![[0.0; 3]; positions.len()],
        velocities: vec![velocity; positions.len()],
        positions: positions.into_iter().map(Into::into).collect(),
        radii: bodies.radii,
        materials: bodies.materials,
    })
}

#[cfg(test)]
mod tests;
