//! What a report tells of a recording, gathered in one pass. Memory holds the newest state, a dozen snapshots of what
//! has a place, and curves of bounded length.

use std::collections::BTreeMap;

use stagger_coupling::Ledger;
use stagger_messages::{Directive, Fields, Report, Verdict, directive, geometry::Shape, report};
use stagger_recordings::{Body, Message, Outcome, Recording, RecordingError, RunInfo, State, States, Step};

use super::{
    plot::Thinned,
    snapshots::{Pictures, Snapshots},
};

/// Problems that are told in words; more are counted.
const TOLD: usize = 8;
/// Numbers without a place in one field that are plotted, at most.
const GLOBALS: usize = 14;

/// What a recording says.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// The run.
    pub info: RunInfo,
    /// Whether the file was closed, and read to its end without fault.
    pub complete: bool,
    /// Whether its run still wrote it.
    pub being_written: bool,
    /// What could not be read, in words.
    pub problems: Vec<String>,
    /// How many problems there were.
    pub problem_count: u64,
    /// Whether the run reached its end and why it ended, where the recording says.
    pub end: Option<(bool, String)>,
    /// Steps accepted.
    pub accepted: u64,
    /// Attempts rejected.
    pub rejected: u64,
    /// Iterations, those of rejected attempts included.
    pub iterations: u64,
    /// Simulated time at the first state, in s.
    pub start_s: f64,
    /// Simulated time reached, in s.
    pub t_s: f64,
    /// Smallest and largest accepted window, in s.
    pub dt_s: Option<[f64; 2]>,
    /// Steps at which the run can go on from this file.
    pub checkpoints: u64,
    /// What each node did.
    pub nodes: BTreeMap<String, NodeWork>,
    /// Messages and bytes of each topic.
    pub topics: BTreeMap<String, [u64; 2]>,
    /// The energy balance at the end.
    pub ledger: Ledger,
    /// What is plotted over simulated time.
    pub curves: Curves,
    /// Start, middle and end of everything that has a place.
    pub pictures: Pictures,
    /// The fields of the last state.
    pub fields: Fields,
}

/// What a node did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeWork {
    /// Trials solved.
    pub solves: u64,
    /// Trials answered with the reply before.
    pub reused: u64,
    /// Trials that ended in a failure.
    pub failures: u64,
    /// Time in solve, in s.
    pub solve_s: f64,
    /// Time waiting for frozen fields, in s.
    pub wait_s: f64,
    /// Quantities of the physics in its last accepted window.
    pub figures: BTreeMap<String, f64>,
}

/// What is plotted over simulated time, with a point for each accepted step.
#[derive(Clone, Debug, Default)]
pub struct Curves {
    /// Size of the window, in s.
    pub dt_s: Thinned,
    /// Size of windows that were rejected, in s.
    pub rejected_dt_s: Thinned,
    /// Iterations, rejected attempts included.
    pub iterations: Thinned,
    /// Contraction rate.
    pub contraction: Thinned,
    /// Error of each field over its tolerance in the accepted iteration.
    pub accepted_errors: BTreeMap<String, Thinned>,
    /// Error of each field over its tolerance in the first iteration.
    pub first_errors: BTreeMap<String, Thinned>,
    /// Time each node spent in solve, in s.
    pub solve_s: BTreeMap<String, Thinned>,
    /// Numbers without a place, by field.
    pub globals: BTreeMap<String, Global>,
    /// Energies of each node in J, by what they are.
    pub energies_j: BTreeMap<String, BTreeMap<String, Thinned>>,
}

/// The curves of a field without a place: one for each row and component.
#[derive(Clone, Debug, Default)]
pub struct Global {
    /// SI unit.
    pub unit: String,
    /// Values per row.
    pub components: usize,
    /// The curves, row by row.
    pub curves: Vec<Thinned>,
}

impl Gathered {
    /// Reads a recording through. What cannot be read is told in the result.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn from(recording: &Recording) -> Result<Self, RecordingError> {
        let being_written = recording.being_written;
        let mut gathered = Self { info: recording.info.clone(), being_written, ..Self::default() };
        let (mut states, mut snapshots) = (States::default(), Snapshots::default());
        let mut messages = recording.messages()?;
        for message in messages.by_ref() {
            let message = match message {
                Ok(message) => message,
                Err(error) => {
                    gathered.problem(&error);
                    continue;
                }
            };
            gathered.message(&message);
            let taken = states.take(message);
            if let Some(outcome) = &taken.outcome {
                gathered.outcome(outcome);
            }
            if let Some(state) = taken.state {
                gathered.state(state, &mut snapshots);
            }
        }
        if let Some(state) = states.end() {
            gathered.state(state, &mut snapshots);
        }
        gathered.complete = recording.complete && messages.complete() && gathered.problem_count == 0;
        gathered.pictures = snapshots.finish();
        Ok(gathered)
    }

    fn problem(&mut self, error: &RecordingError) {
        self.problem_count += 1;
        if self.problems.len() < TOLD {
            self.problems.push(error.to_string());
        }
    }

    fn message(&mut self, message: &Message) {
        let [messages, bytes] = self.topics.entry(message.topic.clone()).or_default();
        *messages += 1;
        *bytes += message.bytes;
        match &message.body {
            Body::Report(report) => self.report(report),
            Body::Directive(Directive { task: Some(directive::Task::Stop(stop)), .. }) => {
                self.end = Some((stop.completed, stop.reason.clone()));
            }
            Body::Checkpoint(_) => self.checkpoints += 1,
            Body::Directive(_) | Body::Field(_) | Body::Manifest(_) => {}
        }
    }

    fn report(&mut self, message: &Report) {
        let Some(envelope) = &message.envelope else { return };
        let node = self.nodes.entry(envelope.sender.clone()).or_default();
        match &message.body {
            Some(report::Body::Done(done)) => {
                *(if done.reused { &mut node.reused } else { &mut node.solves }) += 1;
                node.solve_s += done.solve_s;
                node.wait_s += done.wait_s;
            }
            Some(report::Body::Failure(_)) => node.failures += 1,
            Some(report::Body::Ready(_) | report::Body::FinalReport(_)) | None => {}
        }
    }

    fn outcome(&mut self, outcome: &Outcome) {
        let decision = &outcome.decision;
        self.iterations += 1;
        match decision.verdict() {
            Verdict::Accept => {
                self.accepted += 1;
                self.t_s = decision.t_s;
                let [low, high] = self.dt_s.unwrap_or([decision.dt_s; 2]);
                self.dt_s = Some([low.min(decision.dt_s), high.max(decision.dt_s)]);
            }
            Verdict::Reject => {
                self.rejected += 1;
                self.curves.rejected_dt_s.push(decision.t_s, decision.dt_s);
            }
            Verdict::Iterate | Verdict::None => {}
        }
    }

    fn state(&mut self, state: State, snapshots: &mut Snapshots) {
        for (node, done) in &state.replies {
            self.nodes.entry(node.clone()).or_default().figures.extend(done.figures.clone());
        }
        if state.decision.is_none() {
            self.start_s = state.step.t_s;
        }
        self.curves.take(&state);
        snapshots.take(&state.step);
        self.ledger = state.ledger;
        self.fields = state.step.fields;
    }
}

impl Curves {
    fn take(&mut self, state: &State) {
        let t_s = state.step.t_s;
        for (node, account) in state.ledger.nodes() {
            let curves = self.energies_j.entry(node.clone()).or_default();
            for (kind, entries) in [("held", &account.stored), ("gained", &account.gained), ("lost", &account.lost)] {
                for (name, joule) in entries {
                    curves.entry(format!("{name}, {kind}")).or_default().push(t_s, *joule);
                }
            }
        }
        if state.step.recorded {
            self.globals(&state.step);
        }
        let Some(decision) = &state.decision else { return };
        self.dt_s.push(t_s, decision.dt_s);
        self.iterations.push(t_s, state.work.iterations.into());
        if decision.contraction > 0.0 {
            self.contraction.push(t_s, decision.contraction);
        }
        for (curves, errors) in
            [(&mut self.accepted_errors, &decision.errors), (&mut self.first_errors, &state.work.first_errors)]
        {
            for error in errors.iter().filter(|error| error.tolerance > 0.0) {
                curves.entry(error.field.clone()).or_default().push(t_s, error.error / error.tolerance);
            }
        }
        for (node, seconds) in &state.work.solve_s {
            self.solve_s.entry(node.clone()).or_default().push(t_s, *seconds);
        }
    }

    fn globals(&mut self, step: &Step) {
        let shapes = step.supports.shapes(&step.fields);
        for (name, field) in &step.fields {
            let is_global = matches!(shapes.get(&field.port.support), Some(Shape::Global(_)));
            let (Ok(values), true) = (field.f64(), is_global) else { continue };
            // More numbers are a list, of which curves would tell nothing.
            if values.is_empty() || values.len() > GLOBALS {
                continue;
            }
            let global = self.globals.entry(name.clone()).or_default();
            (global.unit, global.components) = (field.port.unit.clone(), field.components());
            global.curves.resize_with(values.len().max(global.curves.len()), Thinned::default);
            global.curves.iter_mut().zip(values).for_each(|(curve, value)| curve.push(step.t_s, *value));
        }
    }

    /// Whether any curve was thinned.
    #[must_use]
    pub fn thinned(&self) -> bool {
        let of_fields =
            [&self.accepted_errors, &self.first_errors, &self.solve_s].into_iter().flat_map(BTreeMap::values);
        let energies = self.energies_j.values().flat_map(BTreeMap::values);
        let globals = self.globals.values().flat_map(|global| &global.curves);
        let alone = [&self.dt_s, &self.rejected_dt_s, &self.iterations, &self.contraction];
        alone.into_iter().chain(of_fields).chain(energies).chain(globals).any(Thinned::is_thinned)
    }
}
