use stagger_messages::{Decision, Plan, Ready, Verdict, Version};

use super::{ControlError, Outcome, StepControl, Window};

/// What the nodes are asked to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Task {
    /// The trial.
    pub version: Version,
    /// Its window.
    pub window: Window,
    /// The version all nodes committed last: the values at the window's start.
    pub committed: Version,
}

/// All nodes of a run, wherever they are.
pub trait Ensemble {
    /// What can go wrong in reaching the nodes.
    type Error: From<ControlError>;

    /// Tells the nodes who reads from whom and waits until each holds the initial fields it reads.
    ///
    /// # Errors
    /// A node cannot start or cannot be reached.
    fn start(&mut self, plan: &Plan) -> Result<Vec<(String, Ready)>, Self::Error>;

    /// Tells the nodes what was decided about the iteration before (they commit where it was accepted), and has them
    /// solve the next one.
    ///
    /// # Errors
    /// A node is lost. A node that answers that it cannot is an [`Outcome`].
    fn iterate(&mut self, before: Option<&Decision>, task: &Task) -> Result<Vec<Outcome>, Self::Error>;

    /// Tells the nodes the last decision and that the run is over.
    ///
    /// # Errors
    /// A node is lost.
    fn finish(&mut self, last: Option<&Decision>, completed: bool, reason: &str) -> Result<(), Self::Error>;
}

/// Told of everything that happens in a run; may ask to stop it after the current step.
pub trait Observer {
    /// The nodes are ready; the energy each holds at t = 0.
    fn started(&mut self, ready: &[(String, Ready)]);

    /// An iteration was decided. Returning `false` ends the run when the step is complete.
    fn decided(&mut self, decision: &Decision, outcomes: &[Outcome]) -> bool;
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It reached its duration.
    Completed,
    /// The observer asked to stop.
    Interrupted,
}

/// Runs the staggered iteration from t = 0 to the end.
///
/// # Errors
/// A node is lost or fails, or the step falls under Δt_min. The nodes are told in each case.
pub fn drive<E: Ensemble>(
    ensemble: &mut E,
    plan: &Plan,
    control: &mut StepControl,
    observer: &mut impl Observer,
) -> Result<End, E::Error> {
    let ready = ensemble.start(plan)?;
    observer.started(&ready);
    let mut before: Option<Decision> = None;
    while !control.finished() {
        let task = Task { version: control.version(), window: control.window(), committed: control.committed() };
        let outcomes = ensemble.iterate(before.as_ref(), &task)?;
        let decision = match control.judge(&outcomes) {
            Ok(decision) => decision,
            Err(error) => {
                ensemble.finish(None, false, &error.to_string())?;
                return Err(error.into());
            }
        };
        let go_on = observer.decided(&decision, &outcomes);
        let between_steps = decision.verdict() != Verdict::Iterate;
        before = Some(decision);
        if !go_on && between_steps {
            ensemble.finish(before.as_ref(), false, "interrupted")?;
            return Ok(End::Interrupted);
        }
    }
    ensemble.finish(before.as_ref(), true, "completed")?;
    Ok(End::Completed)
}
