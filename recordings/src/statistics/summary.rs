//! What happened in a recorded run, as numbers and as JSON.

use std::collections::BTreeMap;

use stagger_coupling::Account;
use stagger_messages::{Directive, FieldError, Ports, Report, Supports, Told, Verdict, directive, report};

use crate::{
    Body, DecisionLog, Outcome, Recording, RecordingError,
    container::Event,
    display,
    read::recording::{self, END, FIELD},
    statistics::window_history::WindowHistory,
};

/// Name and version of the summary as JSON (docs/summary.md).
const FORMAT: &str = "stagger-info/1";
/// Parts into which the history of window sizes is divided.
const HISTORY: usize = 60;

/// What happened in a recorded run.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Summary {
    /// Name and version of this summary as JSON.
    pub format: &'static str,
    /// Name of the run.
    pub run: String,
    /// The scene's file name.
    pub scene_file: String,
    /// Program that recorded.
    pub program: String,
    /// Nodes that answered as in a recording, and its file.
    pub replayed: BTreeMap<String, String>,
    /// Nodes whose own physics was replaced by a program, and its command line.
    pub commands: BTreeMap<String, String>,
    /// False where the file was cut off or is damaged.
    pub complete: bool,
    /// Whether its run still writes it.
    pub being_written: bool,
    /// Why the file cannot be read to its end; what is told here precedes that point.
    pub damage: Option<String>,
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
    /// Mean accepted windows over up to 60 equal parts of the run's steps, in their order, in s.
    pub dt_history_s: Vec<f64>,
    /// Relative errors of the measured fields in the accepted iterations.
    pub errors: BTreeMap<String, FieldErrors>,
    /// Attempts rejected, by the field that had not converged; `""` where a node asked for a smaller step.
    pub rejected_by: BTreeMap<String, u64>,
    /// Why the last attempt was rejected, in words.
    pub last_rejection: Option<String>,
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
    /// The supports that the nodes' fields stand on, with what their rows are in space.
    pub supports: BTreeMap<String, Told>,
    /// What each topic holds.
    pub topics: BTreeMap<String, TopicSummary>,
    /// Imbalance of each node and of each exchange between two, as a share of the energy turned over.
    pub imbalance: BTreeMap<String, f64>,
    /// Energy between two nodes that solve at different rates, given by the one and not yet taken by the other, in J.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub on_the_way: BTreeMap<String, f64>,
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
    /// Median, in s: of an even number the upper one of the two in the middle. Beyond some thousand steps, that of the
    /// means over as many equal parts of them.
    pub median_s: f64,
    /// Largest, in s.
    pub max_s: f64,
}

/// How well a field converged: its relative error in accepted iterations, where that is finite.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct FieldErrors {
    /// The tolerance it had.
    pub tolerance: f64,
    /// Mean error.
    pub mean: f64,
    /// Largest error.
    pub largest: f64,
    /// Iterations these are taken over.
    pub count: u64,
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
    /// Reads a recording through; fields are counted, not decoded. Where the file is damaged, it is read to there. Memory
    /// does not grow with the file, but for eight bytes for each checkpoint.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn of(recording: &Recording) -> Result<Self, RecordingError> {
        let mut summary = Self {
            format: FORMAT,
            run: recording.info.run.clone(),
            scene_file: recording.info.scene_file.clone(),
            program: recording.info.program.clone(),
            replayed: recording.info.replayed.clone(),
            commands: recording.info.commands.clone(),
            complete: recording.complete,
            being_written: recording.being_written,
            ..Self::default()
        };
        let mut tally = Tally::default();
        let mut events = recording.events()?;
        for event in events.by_ref() {
            match event {
                Err(error) => (summary.complete, summary.damage) = (false, Some(error.to_string())),
                Ok(Event::Metadata { name, map }) if name == END => {
                    summary.lost = map.get("lost").and_then(|value| value.parse().ok());
                }
                Ok(Event::Message { topic, schema, data, .. }) => {
                    // One line for all that is only shown to other programs.
                    let topic = if topic.starts_with(display::TOPICS) { "display" } else { &topic };
                    let entry = summary.topics.entry(topic.to_string()).or_default();
                    entry.messages += 1;
                    entry.bytes += data.len() as u64;
                    if &*schema != FIELD {
                        summary.control(&schema, &data, &mut tally);
                    }
                }
                Ok(_) => {}
            }
        }
        summary.complete = summary.damage.is_none() && events.complete();
        summary.dt = tally.windows.sizes();
        summary.dt_history_s = tally.windows.parts(HISTORY);
        summary.supports = Supports::told(tally.ports.values());
        let (rates, count) = tally.rates;
        summary.contraction = (count > 0).then(|| rates / count as f64);
        summary.iterations = tally.decisions.iterations();
        summary.imbalance = tally.decisions.ledger().imbalances();
        summary.on_the_way = tally.decisions.ledger().on_the_way();
        for (node, ledger) in tally.decisions.ledger().nodes() {
            summary.nodes.entry(node.clone()).or_default().ledger = ledger.clone();
        }
        summary.refused = summary.nodes.values().map(|node| node.refused).sum();
        Ok(summary)
    }

    fn control(&mut self, schema: &str, data: &[u8], tally: &mut Tally) {
        match recording::body(schema, data) {
            Ok(Some(Body::Report(report))) => {
                tally.decisions.report(&report);
                self.report(&report);
            }
            Ok(Some(Body::Manifest(manifest))) => {
                tally.ports.insert(manifest.node, manifest.ports.unwrap_or_default());
            }
            Ok(Some(Body::Directive(directive))) => self.directive(&directive, tally),
            Ok(Some(Body::Checkpoint(checkpoint))) => {
                tally.decisions.checkpoint(&checkpoint);
                self.checkpoints.push(checkpoint.version().step);
            }
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
            Some(report::Body::Ready(_) | report::Body::FinalReport(_)) | None => {}
        }
    }

    fn directive(&mut self, message: &Directive, tally: &mut Tally) {
        // Each restart is an epoch.
        let epoch = message.envelope.as_ref().map_or(1, |envelope| envelope.epoch);
        self.restarts = self.restarts.max(epoch.saturating_sub(1));
        if let Some(Outcome { decision, version, .. }) = tally.decisions.directive(message) {
            match decision.verdict() {
                Verdict::Accept => {
                    self.steps_accepted += 1;
                    self.simulated_time_s = decision.t_s;
                    tally.windows.push(decision.dt_s);
                    self.converged(&decision.errors);
                    if !decision.sensitive.is_empty() {
                        *self.sensitive.entry(decision.sensitive).or_default() += 1;
                    }
                    if decision.contraction > 0.0 {
                        tally.rates = (tally.rates.0 + decision.contraction, tally.rates.1 + 1);
                    }
                }
                Verdict::Reject => {
                    self.steps_rejected += 1;
                    *self.rejected_by.entry(decision.limiting).or_default() += 1;
                    self.last_rejection = Some(format!("{version}: {}", decision.reason));
                }
                Verdict::Iterate | Verdict::None => {}
            }
        }
        if let Some(directive::Task::Stop(stop)) = &message.task {
            self.completed = Some(stop.completed);
            self.reason.clone_from(&stop.reason);
        }
    }

    fn converged(&mut self, errors: &[FieldError]) {
        for FieldError { field, error, tolerance, .. } in errors.iter().filter(|it| it.error.is_finite()) {
            let sums = self.errors.entry(field.clone()).or_default();
            sums.count += 1;
            sums.tolerance = *tolerance;
            sums.mean += (error - sums.mean) / sums.count as f64;
            sums.largest = sums.largest.max(*error);
        }
    }
}

/// What a summary is made of on the way.
#[derive(Default)]
struct Tally {
    decisions: DecisionLog,
    windows: WindowHistory,
    /// Sum and number of the contraction rates that are known.
    rates: (f64, u64),
    /// Ports by node.
    ports: BTreeMap<String, Ports>,
}
