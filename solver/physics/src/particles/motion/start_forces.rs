//! The forces at the start of a window.

use stagger_coupling::SolveError;

use super::forces::{At, Evaluator};
use crate::particles::{
    model::{
        Model,
        state::{Forces, Motion, State},
    },
    settings::Friction,
};

/// Forces at the window's start `t_s` with friction's step. The evaluation stretches the springs by half of it, so that
/// it takes them half of it behind.
pub fn forces_at_start(
    state: &State,
    evaluator: &mut Evaluator<'_>,
    t_s: f64,
    step_s: f64,
    forces: &mut Forces,
) -> Result<(), SolveError> {
    let Motion { positions, velocities, spins } = &state.motion;
    let at = At { positions, velocities, spins, turning: spins, walls: &state.walls, t_s, fraction: 0.0, step_s };
    evaluator.lead(t_s, -step_s)?;
    evaluator.evaluate(at, forces)
}

/// Forces at the window's start: those of the state, or new ones where friction depends on a step that has changed. What
/// contacts remember is put ahead by half of the new step.
pub fn start_forces(
    model: &Model,
    state: &State,
    evaluator: &mut Evaluator<'_>,
    t_s: f64,
    step_s: f64,
) -> Result<Forces, SolveError> {
    let mut forces = state.forces.clone();
    let depends = matches!(model.settings.friction, Some(Friction::Regularised { .. }))
        || model.settings.bond.is_some()
        || model.contact.surface.rolls;
    // The push of sound is another one in every window.
    if evaluator.is_pushed() || depends && forces.step_s.to_bits() != step_s.to_bits() {
        forces_at_start(state, evaluator, t_s, step_s, &mut forces)?;
    }
    evaluator.lead(t_s, step_s)?;
    Ok(forces)
}
