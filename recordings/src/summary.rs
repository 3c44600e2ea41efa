use std::collections::BTreeMap;

use stagger_messages::{Directive, Report, Verdict, directive, report};
use stagger_solver::coupling::Account;

use crate::{
    Accounts, Body, Recording, RecordingError,
    container::Event,
    display,
    recording::{self, END},
};

/// What happened in a recorded run.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Summary {
    /// Name of the run.
    pub run: String,
    /// The scene's file name.
    pub scene_file: String,
    /// Program that recorded.
    pub program: String,
    /// False where the file was cut off.
    pub complete: bool,
    /// Whether the run reached its end; `None` where the recording does not say.
    pub completed: Option<bool>,
    /// Why the run ended, in words; empty where the recording does not say.
    pub reason: String,
    /// Steps accepted.
    pub steps_accepted: u64,
    /// Attempts rejected.
    pub steps_rejected: u64,
    /// Iterations, those of rejected attempts included.
    pub iterations: u64,
    /// Simulated time reached, in s.
    pub simulated_time_s: f64,
    /// Sizes of the accepted windows; `None` where none was accepted.
    pub dt: Option<WindowSizes>,
    /// Mean over accepted steps of the contraction rate of the field that decided; `None` where none is known.
    pub contraction: Option<f64>,
    /// How often each field was the most sensitive one of an accepted step: the one that set the size of the next.
    pub sensitive: BTreeMap<String, u64>,
    /// Steps at which the run can go on from this file.
    pub checkpoints: Vec<u64>,
    /// Times that nodes were started again.
    pub restarts: u32,
    /// What each node did.
    pub nodes: BTreeMap<String, NodeSummary>,
    /// What each topic holds.
    pub topics: BTreeMap<String, TopicSummary>,
    /// Imbalance of each node and of each exchange between two, as a share of its throughput.
    pub imbalance: BTreeMap<String, f64>,
    /// Messages refused by the nodes: foreign run, old epoch, other schema, malformed.
    pub refused: u64,
    /// Messages that were sent but not recorded; `None` where the recording was not closed.
    pub lost: Option<u64>,
    /// Messages in the file that do not decode.
    pub malformed: u64,
}

/// Sizes of the accepted windows.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct WindowSizes {
    /// Smallest, in s.
    pub min_s: f64,
    /// Median, in s: of an even number the upper one of the two in the middle.
    pub median_s: f64,
    /// Largest, in s.
    pub max_s: f64,
}

/// What a node did in a run.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct NodeSummary {
    /// Trials solved.
    pub solves: u64,
    /// Trials answered with the reply before, as nothing frozen had changed.
    pub reused: u64,
    /// Time spent in solve, in s.
    pub solve_s: f64,
    /// Time spent waiting for frozen fields, in s.
    pub wait_s: f64,
    /// Trials that ended in a failure.
    pub failures: u64,
    /// Its last failure, in words.
    pub last_failure: Option<String>,
    /// Messages it refused.
    pub refused: u64,
    /// Its energies over the accepted steps.
    pub ledger: Account,
}

/// What a topic holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct TopicSummary {
    /// Messages.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
}

impl Summary {
    /// Reads a recording through; fields are counted, not decoded.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged before its end.
    pub fn of(recording: &Recording) -> Result<Self, RecordingError> {
        let mut summary = Self {
            run: recording.info.run.clone(),
            scene_file: recording.info.scene_file.clone(),
            program: recording.info.program.clone(),
            complete: recording.complete,
            ..Self::default()
        };
        let mut accounts = Accounts::default();
        let (mut windows, mut rates) = (Vec::new(), Vec::new());
        let mut events = recording.events()?;
        for event in events.by_ref() {
            match event? {
                Event::Metadata { name, map } if name == END => {
                    summary.lost = map.get("lost").and_then(|value| value.parse().ok());
                }
                Event::Message { topic, schema, data, .. } => {
                    // One line for all that is only shown to other programs.
                    let topic = if topic.starts_with(display::TOPICS) { "display" } else { &topic };
                    let entry = summary.topics.entry(topic.to_string()).or_default();
                    entry.messages += 1;
                    entry.bytes += data.len() as u64;
                    if &*schema != "stagger.v1.FieldMessage" {
                        summary.control(&schema, &data, &mut accounts, &mut windows, &mut rates);
                    }
                }
                _ => {}
            }
        }
        summary.complete = events.complete();
        summary.dt = sizes(windows);
        summary.contraction = (!rates.is_empty()).then(|| rates.iter().sum::<f64>() / rates.len() as f64);
        summary.iterations = accounts.iterations();
        summary.imbalance = accounts.ledger().imbalances();
        for (node, ledger) in accounts.ledger().nodes() {
            summary.nodes.entry(node.clone()).or_default().ledger = ledger.clone();
        }
        summary.refused = summary.nodes.values().map(|node| node.refused).sum();
        Ok(summary)
    }

    fn control(
        &mut self,
        schema: &str,
        data: &[u8],
        accounts: &mut Accounts,
        windows: &mut Vec<f64>,
        rates: &mut Vec<f64>,
    ) {
        match recording::body(schema, data) {
            Ok(Some(Body::Report(report))) => {
                accounts.report(&report);
                self.report(&report);
            }
            Ok(Some(Body::Directive(directive))) => self.directive(&directive, accounts, windows, rates),
            Ok(Some(Body::Checkpoint(checkpoint))) => self.checkpoints.push(checkpoint.version().step),
            Ok(_) => {}
            Err(_) => self.malformed += 1,
        }
    }

    fn report(&mut self, message: &Report) {
        let Some(envelope) = &message.envelope else { return };
        let node = self.nodes.entry(envelope.sender.clone()).or_default();
        match &message.body {
            Some(report::Body::Done(done)) => {
                if done.reused {
                    node.reused += 1;
                } else {
                    node.solves += 1;
                }
                node.solve_s += done.solve_s;
                node.wait_s += done.wait_s;
                // A running count; it starts anew when the node is restarted.
                node.refused = node.refused.max(done.refused);
            }
            Some(report::Body::Failure(failure)) => {
                node.failures += 1;
                node.last_failure = Some(failure.message.clone());
            }
            Some(report::Body::Ready(_) | report::Body::Farewell(_)) | None => {}
        }
    }

    fn directive(
        &mut self,
        message: &Directive,
        accounts: &mut Accounts,
        windows: &mut Vec<f64>,
        rates: &mut Vec<f64>,
    ) {
        // Each restart is an epoch.
        let epoch = message.envelope.as_ref().map_or(1, |envelope| envelope.epoch);
        self.restarts = self.restarts.max(epoch.saturating_sub(1));
        if let Some(outcome) = accounts.directive(message) {
            match outcome.decision.verdict() {
                Verdict::Accept => {
                    self.steps_accepted += 1;
                    self.simulated_time_s = outcome.decision.t_s;
                    windows.push(outcome.decision.dt_s);
                    if !outcome.decision.sensitive.is_empty() {
                        *self.sensitive.entry(outcome.decision.sensitive.clone()).or_default() += 1;
                    }
                    rates.extend((outcome.decision.contraction > 0.0).then_some(outcome.decision.contraction));
                }
                Verdict::Reject => self.steps_rejected += 1,
                Verdict::Iterate | Verdict::None => {}
            }
        }
        if let Some(directive::Task::Stop(stop)) = &message.task {
            self.completed = Some(stop.completed);
            self.reason.clone_from(&stop.reason);
        }
    }
}

fn sizes(mut windows: Vec<f64>) -> Option<WindowSizes> {
    windows.sort_by(f64::total_cmp);
    let (min_s, max_s) = (*windows.first()?, *windows.last()?);
    Some(WindowSizes { min_s, median_s: windows[windows.len() / 2], max_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_sizes_do_not_depend_on_their_order() {
        let expected = WindowSizes { min_s: 1.0, median_s: 2.0, max_s: 9.0 };
        assert_eq!(sizes(vec![9.0, 1.0, 2.0]), Some(expected));
        assert_eq!(sizes(Vec::new()), None);
    }
}
