//! The first state of the particles, and one window from state to state: who comes and goes, what other physics do, and the
//! motion.

use stagger_coupling::{Frozen, Reply, SolveError, Window};
use stagger_messages::Energy;

use crate::particles::{
    exchange::{
        external_fields::external_fields,
        reply::{reply, vectors},
    },
    insertion::renewed::{Booked, renewed},
    model::{Model, state::State},
    motion::{integrate::integrate, state_at::state_at_start},
};

/// The state at t = 0 and its fields.
///
/// # Errors
/// A list is refused, or an energy is not finite.
pub fn initial(model: &Model) -> Result<(State, Reply), SolveError> {
    let state = state_at_start(model)?;
    let reply = reply(model, &state)?;
    Ok((state, reply))
}

/// The state at the end of `window` and its fields; where the window is not solved, those of its start and the reason.
///
/// # Errors
/// [`SolveError::Mismatch`] for a window of no length or a frozen field of another support; [`SolveError::NotFinite`].
pub fn solve(model: &Model, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
    if !(window.dt_s > 0.0 && window.dt_s.is_finite()) {
        return Err(SolveError::Mismatch(format!("particles: a window of {} s cannot be solved", window.dt_s)));
    }
    let (renewed, booked) = renewed(model, state, frozen, window)?.unzip();
    let before = state;
    let state = renewed.as_ref().unwrap_or(state);
    let external = external_fields(model, (frozen, window), state)?;
    match integrate(model, state, &external, window)? {
        Ok((state, mut reply)) => {
            if let Some(renewed) = &renewed {
                // What the iteration measures its changes from stands on the new rows.
                let positions = vectors(&model.ports.positions, renewed, &renewed.motion.positions)?;
                reply.start.insert(positions.name().into(), positions);
            }
            if model.come_and_go() {
                let Booked { poured_j, removed_j } = booked.unwrap_or_default();
                reply.ledger.push(Energy::gained("poured", poured_j));
                reply.ledger.push(Energy::lost("removed", removed_j));
                reply.figures.insert("particles".into(), state.bodies.len() as f64);
            }
            Ok((state, reply))
        }
        // The fields of the window's start, so that the reply is whole; nobody may accept them.
        Err(reason) => Ok((before.clone(), Reply { not_converged: Some(reason), ..reply(model, before)? })),
    }
}
