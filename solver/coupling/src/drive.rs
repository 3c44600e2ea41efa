//! The loop of a run over an ensemble of nodes, wherever they are.

use std::collections::BTreeMap;

use stagger_messages::{Decision, Field, Iterate, Plan, Ready, Source, Verdict, Version};

use super::{
    ControlError, Course, Ledger, Outcome, Turn, Window,
    vetting::{vet, vet_start},
};
use crate::SolveError;

/// What the nodes are asked to solve.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// The trial.
    pub version: Version,
    /// Its window.
    pub window: Window,
    /// Who takes part, and what the nodes committed last: the values at the window's start.
    pub iterate: Iterate,
}

impl Task {
    /// Whether a node is to answer.
    #[must_use]
    pub fn asks(&self, node: &str) -> bool {
        super::resting(node, &self.iterate).is_none()
    }

    /// The window of a node that may have a clock of its own.
    #[must_use]
    pub fn window_of(&self, node: &str) -> Window {
        window_of(node, self.window, &self.iterate)
    }
}

/// The window of a node: that of the run, where `iterate` does not name another.
#[must_use]
pub fn window_of(node: &str, window: Window, iterate: &Iterate) -> Window {
    let part = iterate.parts.iter().find(|part| part.node == node);
    part.map_or(window, |part| Window { t_s: part.t_s, dt_s: part.dt_s })
}

/// All nodes of a run, wherever they are.
pub trait Ensemble {
    /// What can go wrong in reaching the nodes.
    type Error: From<ControlError> + From<SolveError>;

    /// Tells the nodes who reads from whom and waits until each holds the fields it starts from.
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

    /// What a node answered to the trial `version`, or committed at it. Asked for accelerated fields only.
    ///
    /// # Errors
    /// A node is lost.
    fn answered(&mut self, source: &Source, version: Version) -> Result<Field, Self::Error>;

    /// Gives the readers of these fields what they freeze in the iteration after `version` instead of the answers.
    ///
    /// # Errors
    /// The nodes cannot be reached.
    fn publish(&mut self, version: Version, fields: &BTreeMap<String, Field>) -> Result<(), Self::Error>;

    /// Has the nodes hand over their states with the next decision, which accepts `version` at time `t_s`; `course` is
    /// the coordinator's part.
    fn checkpoint(&mut self, version: Version, t_s: f64, course: Vec<u8>);

    /// Tells the nodes the last decision and that the run is over.
    ///
    /// # Errors
    /// A node is lost.
    fn finish(&mut self, last: Option<&Decision>, completed: bool, reason: &str) -> Result<(), Self::Error>;
}

/// Told of everything that happens in a run; may ask to stop it after the current step.
pub trait Observer {
    /// The nodes are ready; the energy each holds at t = 0, empty where a run goes on from a checkpoint.
    fn started(&mut self, ready: &[(String, Ready)]);

    /// An iteration was decided. Returning `false` ends the run when the step is complete.
    fn decided(&mut self, decision: &Decision, outcomes: &[Outcome]) -> bool;

    /// The run's energy so far, for a checkpoint; nothing where it keeps no books.
    fn ledger(&self) -> Ledger {
        Ledger::default()
    }

    /// What else it knows, as bytes, for a checkpoint.
    fn save(&self) -> Vec<u8> {
        Vec::new()
    }
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It reached its duration.
    Completed,
    /// The observer asked to stop.
    Interrupted,
}

/// Runs the staggered iteration to the end, from t = 0 or from where `plan` and `course` go on; a checkpoint is taken
/// every `checkpoint_steps` accepted steps (0: none) and where the observer asks to stop.
///
/// # Errors
/// A node is lost or fails, or the step falls under Δt_min. The nodes are told in each case but the first.
pub fn drive<E: Ensemble>(
    ensemble: &mut E,
    plan: &Plan,
    course: &mut Course,
    checkpoint_steps: u64,
    observer: &mut impl Observer,
) -> Result<End, E::Error> {
    let mut ready = ensemble.start(plan)?;
    if let Err(error) = vet_start(&mut ready) {
        ensemble.finish(None, false, &error.to_string())?;
        return Err(error.into());
    }
    let fresh = plan.from.is_none_or(|from| from == Version::INITIAL);
    observer.started(if fresh { &ready } else { &[] });
    course.begin(ensemble)?;
    let mut before: Option<Decision> = None;
    while !course.control.finished() {
        let task = course.task(Turn::Iterating);
        let (version, last) = (task.version, course.control.is_last());
        let mut outcomes = ensemble.iterate(before.as_ref(), &task)?;
        course.residuals(ensemble, version, &mut outcomes)?;
        if course.reads_now(&outcomes) {
            outcomes.extend(ensemble.iterate(None, &course.task(Turn::Reading))?);
        }
        let judged = vet(&mut outcomes).and_then(|()| course.control.judge(&outcomes));
        let decision = match judged {
            Ok(decision) => decision,
            Err(error) => {
                ensemble.finish(None, false, &error.to_string())?;
                return Err(error.into());
            }
        };
        course.follow(ensemble, &decision, version, last)?;
        let accepted = decision.verdict() == Verdict::Accept;
        let go_on = observer.decided(&decision, &outcomes);
        let due = checkpoint_steps > 0 && version.step.is_multiple_of(checkpoint_steps);
        if accepted && !course.control.finished() && (due || (!go_on && checkpoint_steps > 0)) {
            ensemble.checkpoint(version, decision.t_s, course.save(observer.ledger(), observer.save())?);
        }
        before = Some(decision);
        if !go_on && accepted {
            ensemble.finish(before.as_ref(), false, "interrupted")?;
            return Ok(End::Interrupted);
        }
    }
    ensemble.finish(before.as_ref(), true, "completed")?;
    Ok(End::Completed)
}
