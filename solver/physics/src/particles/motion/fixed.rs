//! Particles that stay where they are: nothing is integrated, contacts and forces follow the temperature alone.

use stagger_coupling::{SolveError, Window};

use super::forces::{At, Evaluator};
use crate::particles::{
    exchange::external_fields::ExternalFields,
    model::{
        Model,
        state::{Advanced, Dissipation, State},
    },
};

/// The window's end: the motion of its start, and the forces there, which nobody gives way to.
pub fn advance(
    model: &Model,
    state: &State,
    external: &ExternalFields,
    window: Window,
) -> Result<Advanced, SolveError> {
    let mut evaluator = Evaluator::new(model, state, external);
    let mut forces = state.forces.clone();
    let motion = &state.motion;
    let at = At {
        positions: &motion.positions,
        velocities: &motion.velocities,
        spins: &motion.spins,
        turning: &motion.spins,
        walls: &state.walls,
        t_s: window.t_s + window.dt_s,
        fraction: 1.0,
        step_s: 0.0,
    };
    evaluator.evaluate(at, &mut forces)?;
    Ok(evaluator.end((motion.clone(), state.walls.clone()), forces, Dissipation::default(), (0, 0.0)))
}
