//! The accepted steps of a run, put together from its messages.

use std::collections::BTreeMap;

use stagger_messages::{Field, Fields, Supports, Verdict, Version, codec::Received};

use crate::{Body, DecisionLog, History, Message, Outcome, statistics::decision_log::asks};

/// Follows the messages of a run and puts together what it accepted.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    decisions: DecisionLog,
    /// By name, and `node/name` for the second and later writers of one name.
    fields: BTreeMap<String, History<Field>>,
    /// Who was first to write each name.
    writers: BTreeMap<String, String>,
    supports: Supports,
    /// Version, time reached and window size of the last accepted step, or of the start.
    at: (Version, f64, f64),
    /// Whether field messages of that version were seen.
    recorded: bool,
    started: bool,
    late: bool,
}

/// The state of a run at the end of an accepted step, or at its start.
#[derive(Clone, Debug)]
pub struct Step {
    /// The accepted version; where a run starts, the version it starts from.
    pub version: Version,
    /// Simulated time reached, in s.
    pub t_s: f64,
    /// Size of the window just accepted, in s; 0 at the start.
    pub dt_s: f64,
    /// Every field at that time, by name.
    pub fields: Fields,
    /// What the rows of the fields are in space.
    pub supports: Supports,
    /// False where the recording holds no fields of this step: they are those of an earlier one.
    pub recorded: bool,
}

/// What one message brought about.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    /// An iteration was decided about.
    pub outcome: Option<Outcome>,
    /// A state was reached.
    pub step: Option<Step>,
}

impl Steps {
    /// Takes the next message.
    pub fn take(&mut self, message: Message) -> Progress {
        match message.body {
            Body::Field(received) => self.field(received),
            Body::Report(report) => self.decisions.report(&report),
            Body::Checkpoint(checkpoint) => self.decisions.checkpoint(&checkpoint),
            Body::Manifest(manifest) => self.supports.take(&manifest),
            Body::Directive(directive) => {
                let outcome = self.decisions.directive(&directive);
                let mut step = None;
                if asks(&directive) && !self.started {
                    self.started = true;
                    step = Some(self.step());
                }
                if let Some(outcome) = &outcome {
                    match outcome.decision.verdict() {
                        Verdict::Accept => {
                            self.accept(outcome);
                            step = Some(self.step());
                        }
                        Verdict::Reject => {
                            self.fields.values_mut().for_each(|history| history.reject(outcome.version));
                        }
                        Verdict::Iterate | Verdict::None => {}
                    }
                }
                return Progress { outcome, step };
            }
        }
        Progress::default()
    }

    /// At the end of the messages: the last state again, where fields of it came after its acceptance.
    pub fn end(&mut self) -> Option<Step> {
        std::mem::take(&mut self.late).then(|| self.step())
    }

    /// Decisions, reports and energies so far.
    #[must_use]
    pub fn decisions(&self) -> &DecisionLog {
        &self.decisions
    }

    fn field(&mut self, received: Received) {
        let version = received.envelope.version.unwrap_or_default();
        // What the coordinator publishes is a guess for the next iteration, not a state.
        if received.envelope.sender == "coordinator" {
            return;
        }
        let sender = received.envelope.sender;
        let writer = self.writers.entry(received.name.clone()).or_insert_with(|| sender.clone());
        let name = if *writer == sender { received.name } else { format!("{sender}/{}", received.name) };
        let history = self.fields.entry(name).or_default();
        match (received.field, received.same_as) {
            (Some(field), _) => history.insert(version, field),
            (None, Some(same_as)) => {
                history.refer(version, same_as);
            }
            (None, None) => {}
        }
        if !self.started {
            self.at = (version, received.envelope.t_s, 0.0);
            self.recorded = true;
        } else if version == self.at.0 {
            // Seen behind its acceptance: the last step of a thinned recording, or a physics that only reads.
            history.accept(version);
            (self.recorded, self.late) = (true, true);
        }
    }

    fn accept(&mut self, outcome: &Outcome) {
        let version = outcome.version;
        self.recorded = self.fields.values().any(|history| history.get(version).is_some());
        self.fields.values_mut().for_each(|history| history.accept(version));
        self.at = (version, outcome.decision.t_s, outcome.decision.dt_s);
        self.late = false;
    }

    fn step(&self) -> Step {
        let (version, t_s, dt_s) = self.at;
        let newest = |(name, history): (&String, &History<Field>)| Some((name.clone(), history.newest()?.clone()));
        let fields = self.fields.iter().filter_map(newest).collect();
        Step { version, t_s, dt_s, fields, supports: self.supports.clone(), recorded: self.recorded }
    }
}
