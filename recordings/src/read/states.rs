//! The accepted states of a run, each with all that belongs to it.

use std::collections::BTreeMap;

use stagger_coupling::Ledger;
use stagger_messages::{Decision, Done, FieldError, Report, Verdict, report};

use crate::{Body, Message, Outcome, Step, Steps};

/// Hands out the accepted states of a run one by one, each when all that belongs to it has been seen: fields and replies may
/// stand behind the decision that accepts them.
#[derive(Clone, Debug, Default)]
pub struct States {
    steps: Steps,
    pending: Option<State>,
    under_way: Work,
}

/// An accepted state, or the start, with what led to it.
#[derive(Clone, Debug)]
pub struct State {
    /// Its fields.
    pub step: Step,
    /// The decision that accepted it; `None` for the start.
    pub decision: Option<Decision>,
    /// What was done since the state before.
    pub work: Work,
    /// The last reply of each node that solved for this state.
    pub replies: BTreeMap<String, Done>,
    /// The energy balance up to it.
    pub ledger: Ledger,
}

/// What was done from one accepted state to the next, rejected attempts included.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Work {
    /// Iterations.
    pub iterations: u32,
    /// Attempts rejected.
    pub rejections: u32,
    /// Time each node spent in solve, in s.
    pub solve_s: BTreeMap<String, f64>,
    /// Time each node waited for frozen fields, in s.
    pub wait_s: BTreeMap<String, f64>,
    /// Convergence in the first iteration of the last attempt.
    pub first_errors: Vec<FieldError>,
}

/// What one message brought about.
#[derive(Clone, Debug, Default)]
pub struct Taken {
    /// An iteration was decided about.
    pub outcome: Option<Outcome>,
    /// A state is complete: nothing of it follows.
    pub state: Option<State>,
}

impl Work {
    fn count(&mut self, outcome: &Outcome) {
        self.iterations += 1;
        self.rejections += u32::from(outcome.decision.verdict() == Verdict::Reject);
        if outcome.version.iteration == 1 {
            self.first_errors.clone_from(&outcome.decision.errors);
        }
        outcome.reports.iter().for_each(|(node, done)| self.time(node, done));
    }

    fn time(&mut self, node: &str, done: &Done) {
        *self.solve_s.entry(node.into()).or_default() += done.solve_s;
        *self.wait_s.entry(node.into()).or_default() += done.wait_s;
    }
}

impl States {
    /// Takes the next message.
    pub fn take(&mut self, message: Message) -> Taken {
        match &message.body {
            Body::Report(report) => self.late(report),
            // What came behind the acceptance belongs to the state that waits, not to the next one.
            Body::Directive(_) => self.settle(),
            Body::Field(_) | Body::Manifest(_) | Body::Checkpoint(_) => {}
        }
        let progress = self.steps.take(message);
        if let Some(outcome) = &progress.outcome {
            self.under_way.count(outcome);
        }
        let Some(step) = progress.step else { return Taken { outcome: progress.outcome, state: None } };
        let mut next = State {
            step,
            decision: None,
            work: std::mem::take(&mut self.under_way),
            replies: BTreeMap::new(),
            ledger: self.steps.decisions().ledger().clone(),
        };
        if let Some(outcome) = &progress.outcome {
            next.decision = Some(outcome.decision.clone());
            next.replies.clone_from(&outcome.reports);
        }
        Taken { outcome: progress.outcome, state: self.pending.replace(next) }
    }

    /// The last state, at the end of the messages.
    pub fn end(&mut self) -> Option<State> {
        self.settle();
        self.pending.take()
    }

    fn late(&mut self, report: &Report) {
        let (Some(pending), Some(report::Body::Done(done))) = (&mut self.pending, &report.body) else { return };
        let Some(envelope) = &report.envelope else { return };
        // A reply may come twice.
        if envelope.version == Some(pending.step.version) && !pending.replies.contains_key(&envelope.sender) {
            pending.work.time(&envelope.sender, done);
            pending.replies.insert(envelope.sender.clone(), done.clone());
        }
    }

    fn settle(&mut self) {
        let Some(pending) = &mut self.pending else { return };
        if let Some(step) = self.steps.end() {
            pending.step = step;
        }
        pending.ledger = self.steps.decisions().ledger().clone();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{
        Directive, Energy, Envelope, Field, Iterate, Measure, Port, Version, codec::Received, directive,
    };

    use super::*;

    fn message(body: Body) -> Message {
        Message { topic: String::new(), log_time_ns: 0, publish_time_ns: 0, bytes: 0, body }
    }

    fn envelope(sender: &str, version: Version) -> Option<Envelope> {
        Some(Envelope { sender: sender.into(), version: Some(version), ..Envelope::default() })
    }

    fn field(sender: &str, name: &str, version: Version, value: f64) -> Message {
        let port = Arc::new(Port::f64(name, "K", "particles", 1, Measure::None));
        let field = Field::new(&port, 0, vec![value]).unwrap();
        let (name, support) = (name.to_owned(), field.support.clone());
        let envelope = envelope(sender, version).unwrap();
        message(Body::Field(Received { envelope, field: Some(field), name, port, support, same_as: None }))
    }

    fn done(sender: &str, version: Version) -> Message {
        let ledger = vec![Energy::gained("light", 2.0)];
        let done = Done { solve_s: 0.5, wait_s: 0.25, ledger, ..Done::default() };
        message(Body::Report(Report { envelope: envelope(sender, version), body: Some(report::Body::Done(done)) }))
    }

    fn directive(version: Version, verdict: Verdict) -> Message {
        let decision = Decision { version: Some(version), verdict: verdict.into(), ..Decision::default() };
        let task = Some(directive::Task::Iterate(Iterate::default()));
        let (envelope, decision) = (envelope("coordinator", version), Some(decision));
        message(Body::Directive(Directive { envelope, decision, task, checkpoint: false }))
    }

    #[test]
    fn a_state_holds_what_came_behind_its_acceptance_and_all_work_that_led_to_it() {
        let (first, rejected) = (Version::first(1), Version::first(2));
        let second = rejected.next_attempt();
        let mut states = States::default();
        let mut found = Vec::new();
        for message in [
            field("thermal", "temperature", Version::INITIAL, 0.0),
            directive(Version::INITIAL, Verdict::None),
            field("thermal", "temperature", first, 1.0),
            done("thermal", first),
            directive(first, Verdict::Accept),
            // A physics that only reads; its reply comes twice.
            field("probe", "stress", first, 10.0),
            done("probe", first),
            done("probe", first),
            done("thermal", rejected),
            directive(rejected, Verdict::Reject),
            field("thermal", "temperature", second, 2.0),
            done("thermal", second),
            directive(second, Verdict::Accept),
            field("probe", "stress", second, 20.0),
            done("probe", second),
        ] {
            found.extend(states.take(message).state);
        }
        found.extend(states.end());
        assert!(states.end().is_none());
        let value = |state: &State, name: &str| state.step.fields.get(name).map(|field| field.f64().unwrap()[0]);
        let told: Vec<_> = found
            .iter()
            .map(|state| (state.step.version.step, value(state, "temperature"), value(state, "stress")))
            .collect();
        assert_eq!(told, [(0, Some(0.0), None), (1, Some(1.0), Some(10.0)), (2, Some(2.0), Some(20.0))]);
        let work: Vec<_> = found.iter().map(|state| (state.work.iterations, state.work.rejections)).collect();
        assert_eq!(work, [(0, 0), (1, 0), (2, 1)]);
        for (state, gained) in found[1..].iter().zip([2.0, 4.0]) {
            assert_eq!(state.work.solve_s["probe"], 0.5);
            assert_eq!(state.replies.keys().collect::<Vec<_>>(), ["probe", "thermal"]);
            assert_eq!(state.ledger.nodes()["probe"].gained["light"], gained);
            assert_eq!(state.ledger.nodes()["thermal"].gained["light"], gained);
        }
        assert_eq!(found[2].work.solve_s["thermal"], 1.0);
    }
}
