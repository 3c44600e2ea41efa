//! A scene run from start to end in this process: the smallest way to results, without files and without Zenoh.

use std::{collections::BTreeMap, ops::ControlFlow};

use stagger_coupling::{
    CouplingController, End, Ensemble, InProcess, InProcessError, Ledger, Listener, Outcome, PlanError, Task, measured,
    plan, run_loop,
};
use stagger_messages::{Decision, Field, Fields, Plan, Ready, Source, Verdict, Version};

use crate::{ParticipantError, Scene};

/// Why a scene cannot be run in this process.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A node that is a command, or cannot be built.
    #[error(transparent)]
    Participant(#[from] ParticipantError),
    /// The physics do not fit together.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A physics failed, or the step fell under its minimum.
    #[error(transparent)]
    Run(#[from] InProcessError),
}

/// An accepted step.
pub struct Step<'r> {
    /// Its number, from 1.
    pub number: u64,
    /// Simulated time at its end, in s.
    pub t_s: f64,
    /// Its length, in s.
    pub dt_s: f64,
    ensemble: &'r InProcess,
}

impl Step<'_> {
    /// All fields at its end, by name.
    #[must_use]
    pub fn fields(&self) -> Fields {
        self.ensemble.fields()
    }
}

/// What a run ended with.
#[derive(Debug)]
pub struct Run {
    /// All fields at the end, by name.
    pub fields: Fields,
    /// The energy of the run.
    pub ledger: Ledger,
    /// Accepted steps.
    pub steps: u64,
    /// Simulated time reached, in s.
    pub t_s: f64,
    /// Whether that is the scene's duration.
    pub completed: bool,
}

/// Runs a scene to its end, or until `on_step`, which is shown each accepted step, breaks off.
///
/// The numbers are those of `stagger run`, to the last bit. Nothing is recorded.
///
/// # Errors
/// A node is a command, the physics do not fit together, one of them fails, or the step falls under its minimum.
pub fn run_in_process(scene: &Scene, on_step: impl FnMut(&Step<'_>) -> ControlFlow<()>) -> Result<Run, RunError> {
    let ensemble = InProcess::new(scene.participants()?);
    let ports = ensemble.ports();
    let plan = plan(&ports, &scene.coupling)?;
    let mut controller = CouplingController::new(&scene.coupling, &plan, &measured(&ports, &plan), scene.duration_s);
    let mut watched = Watched { ensemble, on_step, broke_off: false };
    let mut books = Books::default();
    let end = match run_loop(&mut watched, &plan, &mut controller, 0, &mut books) {
        Ok(end) => end,
        Err(Stopped::BrokeOff) => End::Interrupted,
        Err(Stopped::Failed(error)) => return Err(error.into()),
    };
    let Books { ledger, steps, t_s } = books;
    Ok(Run { fields: watched.ensemble.fields(), ledger, steps, t_s, completed: end == End::Completed })
}

/// An ensemble whose accepted steps are shown to somebody.
struct Watched<F> {
    ensemble: InProcess,
    on_step: F,
    broke_off: bool,
}

/// Why the loop ends early.
enum Stopped {
    /// Whoever watched has seen enough.
    BrokeOff,
    Failed(InProcessError),
}

impl<E: Into<InProcessError>> From<E> for Stopped {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

impl<F: FnMut(&Step<'_>) -> ControlFlow<()>> Watched<F> {
    fn show(&mut self, decision: Option<&Decision>) {
        let Some(decision) = decision.filter(|decision| decision.verdict() == Verdict::Accept) else { return };
        let number = decision.version.unwrap_or_default().step;
        let step = Step { number, t_s: decision.t_s, dt_s: decision.dt_s, ensemble: &self.ensemble };
        self.broke_off |= (self.on_step)(&step).is_break();
    }
}

impl<F: FnMut(&Step<'_>) -> ControlFlow<()>> Ensemble for Watched<F> {
    type Error = Stopped;

    fn start(&mut self, plan: &Plan) -> Result<Vec<(String, Ready)>, Stopped> {
        Ok(self.ensemble.start(plan)?)
    }

    fn iterate(&mut self, before: Option<&Decision>, task: &Task) -> Result<Vec<Outcome>, Stopped> {
        let outcomes = self.ensemble.iterate(before, task)?;
        self.show(before);
        if self.broke_off { Err(Stopped::BrokeOff) } else { Ok(outcomes) }
    }

    fn answered(&mut self, source: &Source, version: Version) -> Result<Field, Stopped> {
        Ok(self.ensemble.answered(source, version)?)
    }

    fn publish(&mut self, version: Version, fields: &BTreeMap<String, Field>) -> Result<(), Stopped> {
        Ok(self.ensemble.publish(version, fields)?)
    }

    fn checkpoint(&mut self, version: Version, t_s: f64, controller: Vec<u8>) {
        self.ensemble.checkpoint(version, t_s, controller);
    }

    fn finish(&mut self, last: Option<&Decision>, completed: bool, reason: &str) -> Result<(), Stopped> {
        self.ensemble.finish(last, completed, reason)?;
        self.show(last);
        Ok(())
    }
}

/// Counts steps and sums the energy.
#[derive(Default)]
struct Books {
    ledger: Ledger,
    steps: u64,
    t_s: f64,
}

impl Listener for Books {
    fn started(&mut self, ready: &[(String, Ready)]) {
        ready.iter().for_each(|(node, ready)| self.ledger.start(node, &ready.ledger));
    }

    fn decided(&mut self, decision: &Decision, outcomes: &[Outcome]) -> bool {
        if decision.verdict() == Verdict::Accept {
            (self.steps, self.t_s) = (self.steps + 1, decision.t_s);
            for Outcome { node, result } in outcomes {
                let Ok(done) = result else { continue };
                self.ledger.book_until(node, &done.ledger, decision.t_s);
            }
        }
        true
    }

    fn ledger(&self) -> Ledger {
        self.ledger.clone()
    }
}
