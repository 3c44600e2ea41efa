//! Particles that stay where they are: nothing is integrated, contacts and forces follow the temperature alone.

use super::{
    Particles,
    forces::{At, Evaluator},
    outside::Outside,
    state::{Advanced, Dissipation, State},
};
use stagger_coupling::{SolveError, Window};

/// The window's end: the motion of its start, and the forces there, which nobody gives way to.
pub(super) fn advance(
    particles: &Particles,
    state: &State,
    outside: &Outside,
    window: Window,
) -> Result<Advanced, SolveError> {
    let mut evaluator = Evaluator::new(particles, state, outside);
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
