//! One window by the scene's integrator.

use stagger_coupling::{NotConverged, Reply, SolveError, Window};

use super::{finish::finish, fixed, trapezoidal::Trapezoidal, verlet};
use crate::particles::{
    exchange::external_fields::ExternalFields,
    model::{
        Model,
        state::{State, Trial},
    },
    settings::Integrator,
};

/// The state at the end of `window` and what is said about it, or why the window is not solved.
///
/// # Errors
/// A force, a field or an energy is not finite, or a list is refused.
pub fn integrate(
    model: &Model,
    state: &State,
    external: &ExternalFields,
    window: Window,
) -> Result<Result<(State, Reply), NotConverged>, SolveError> {
    let end_s = window.t_s + window.dt_s;
    match model.settings.integrator {
        Integrator::Verlet { .. } => verlet::solve(model, state, external, window),
        Integrator::Held => {
            let advanced = fixed::advance(model, state, external, window)?;
            Ok(Ok(finish(model, state, advanced, external, end_s)?))
        }
        Integrator::Trapezoidal { phi, tolerance, iterations, anderson_depth } => {
            let rule = Trapezoidal { phi, tolerance, iterations, anderson_depth };
            match rule.advance(model, state, external, window)? {
                Trial::Converged(advanced) => Ok(Ok(finish(model, state, *advanced, external, end_s)?)),
                Trial::NotConverged(reason) => Ok(Err(reason)),
            }
        }
    }
}
