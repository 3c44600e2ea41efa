//! `stagger verify`: solves every node again from the recorded frozen fields and compares with what it answered.

mod plugged;

use std::collections::{BTreeMap, BTreeSet};

use stagger_config::Problems;
use stagger_coupling::{FrozenFields, Participant, SolveError, Window, resting, restore, same, window_of};
use stagger_messages::{
    Checkpoint, Decision, Directive, Envelope, Field, Iterate, MessageError, Plan, Snapshot, Verdict, Version,
    codec::{self, Received},
    directive,
};
use stagger_recordings::{Body, Recording, RecordingError};
use stagger_runtime::{
    launch::roster::{Runs, roster},
    run::summary,
};
use stagger_scene::{ParticipantError, Scene};

use plugged::Plugged;

use crate::conformance::heard::Fault;

/// Why a recording cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Its scene cannot be read by this version.
    #[error("the recorded scene is not valid here:\n{0}")]
    Scene(#[from] Problems),
    /// A node of it cannot be built.
    #[error(transparent)]
    Participant(#[from] ParticipantError),
    /// A physics fails where it did not when recorded.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A field holds another type.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// It has no node of that name.
    #[error(
        "the recording has no node `{0}` that can be solved here: it has {1}; --with COMMAND solves one by another program"
    )]
    NoNode(String, String),
    /// The program in the place of a node does not answer as one.
    #[error("`{node}` by its own program, at {at}: expected {}; found {}", .fault.expected, .fault.found)]
    Plugged {
        /// The node.
        node: String,
        /// What it was asked for.
        at: String,
        /// What is wrong.
        fault: Fault,
    },
    /// Fields of an iteration are not in it.
    #[error(
        "`{node}` cannot be solved again for {version}: the recording lacks a field it read or wrote. Only a recording at level \
         \"all\", of all fields and every step, can be verified: leave record.fields out and record.every at 1"
    )]
    Thinned {
        /// The node.
        node: String,
        /// The trial.
        version: Version,
    },
}

/// The first exchange that differs.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Difference {
    /// The node.
    pub node: String,
    /// The field.
    pub field: String,
    /// Step, attempt and iteration.
    pub at: String,
    /// Index of the first value that differs.
    pub index: usize,
    /// The recorded value.
    pub recorded: String,
    /// The value computed here.
    pub computed: String,
}

/// What `verify` found.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Verified {
    /// Trials solved again, by node.
    pub trials: BTreeMap<String, u64>,
    /// Fields compared.
    pub fields: u64,
    /// Steps accepted in the recording.
    pub steps: u64,
    /// The first exchange that differs, if any.
    pub difference: Option<Difference>,
    /// Nodes that were not solved again, by name, and why.
    pub unchecked: BTreeMap<String, String>,
    /// What answered in the place of a node's own physics when it was recorded, by node.
    pub answered_by: BTreeMap<String, String>,
    /// Hash of the final fields, where all nodes were solved.
    pub hash: Option<String>,
    /// Whether the recording reaches the end of its run.
    pub complete: bool,
    /// Why the recording cannot be read to its end: what precedes that point is verified.
    pub damage: Option<String>,
}

/// Verifies a recording: every node, or only `node`; `tolerance` is the largest relative difference, 0 for equal bits.
///
/// # Errors
/// The recording cannot be read or its nodes not be built. A difference is no error but a result.
pub fn verify(recording: &Recording, node: Option<&str>, tolerance: f64) -> Result<Verified, VerifyError> {
    let scene = recording.info.scene()?;
    let mut replay = Replay::new(&scene, tolerance);
    let nodes = roster(&scene);
    for (name, runs) in &nodes {
        if node.is_some_and(|only| only != name) {
            continue;
        }
        match runs {
            Runs::Physics(kind) => {
                replay.solvers.insert(name.clone(), Solver::Here(scene.participant(name, kind)?));
            }
            Runs::Command(words) => {
                let why = format!(
                    "a program of your own, `{}`; --node {name} --with COMMAND has it answer again",
                    words.join(" ")
                );
                replay.result.unchecked.insert(name.clone(), why);
            }
            Runs::Recorded(file) => {
                replay.result.unchecked.insert(name.clone(), format!("it answered from {}", file.display()));
            }
        }
    }
    let solved = |name: &str| replay.solvers.contains_key(name);
    let info = &recording.info;
    let commands = info.commands.iter().map(|(node, command)| (node.clone(), format!("`{command}`")));
    let replayed = info.replayed.iter().map(|(node, file)| (node.clone(), format!("the recording {file}")));
    replay.result.answered_by = commands.chain(replayed).filter(|(node, _)| solved(node)).collect();
    if let (Some(node), true) = (node, replay.solvers.is_empty()) {
        return Err(no_node(node, nodes.keys()));
    }
    replay.run(recording)?;
    if replay.solvers.len() == nodes.len() {
        let fields = replay.fields.iter().map(|((node, _), field)| (node.as_str(), vec![summary::of_field(field)]));
        let fields = summary::told_apart(fields);
        replay.result.hash = Some(summary::hash(&fields));
    }
    Ok(replay.result)
}

/// Verifies the node `node` of a recording with the program `command` in its place, started as in a run. Everything that
/// the recorded node was told goes to it over Zenoh.
///
/// # Errors
/// As [`verify`]; or the program does not keep the protocol.
pub fn verify_with(
    recording: &Recording,
    node: &str,
    command: Vec<String>,
    tolerance: f64,
) -> Result<Verified, VerifyError> {
    let scene = recording.info.scene()?;
    let mut replay = Replay::new(&scene, tolerance);
    let plugged = Plugged::start(recording, scene, node, command).map_err(at(node, "its start".into()))?;
    replay.solvers.insert(node.into(), Solver::Plugged(Box::new(plugged)));
    replay.run(recording)?;
    Ok(replay.result)
}

fn at(node: &str, at: String) -> impl FnOnce(Fault) -> VerifyError {
    let node = node.to_owned();
    move |fault| VerifyError::Plugged { node, at, fault }
}

fn no_node<'n>(node: &str, nodes: impl Iterator<Item = &'n String>) -> VerifyError {
    let names: Vec<_> = nodes.map(String::as_str).collect();
    VerifyError::NoNode(node.into(), names.join(", "))
}

/// What solves a node again.
enum Solver {
    /// Its physics, in this process.
    Here(Box<dyn Participant>),
    /// A program of its own.
    Plugged(Box<Plugged>),
}

#[derive(Default)]
struct Replay {
    solvers: BTreeMap<String, Solver>,
    /// What each of them reads, as recorded.
    frozen_fields: BTreeMap<String, FrozenFields>,
    /// Fields recorded before the first trial.
    early: Vec<(String, Version, Field)>,
    /// Everything recorded of the step under way.
    recorded: FrozenFields,
    plan: Plan,
    /// The first checkpoint in the file: where the run went on from one, that is it.
    from: Option<Checkpoint>,
    started: bool,
    committed: Version,
    /// The trial asked for, not yet solved here: its fields are recorded after it.
    task: Option<(Envelope, Iterate)>,
    /// The newest version each node was asked for, and solved for.
    asked: BTreeMap<String, Version>,
    solved: BTreeMap<String, Version>,
    /// Computed fields at the newest version, by node and name.
    newest: BTreeMap<(String, String), Field>,
    /// Computed fields at the committed version.
    fields: BTreeMap<(String, String), Field>,
    tolerance: f64,
    /// The fields that were recorded; `None` where all were.
    kept: Option<BTreeSet<String>>,
    result: Verified,
}

impl Replay {
    fn new(scene: &Scene, tolerance: f64) -> Self {
        let kept = scene.record.fields.clone().map(BTreeSet::from_iter);
        Self { tolerance, kept, ..Self::default() }
    }

    /// Compares what was computed with what was recorded.
    fn compare(&mut self, node: &str, version: Version, computed: &Field) -> Result<(), VerifyError> {
        let recorded = self.recorded.get(node, computed.name(), version);
        if recorded.is_none() && self.kept.as_ref().is_some_and(|kept| !kept.contains(computed.name())) {
            return Err(VerifyError::Thinned { node: node.into(), version });
        }
        compare(node, version, computed, recorded, self.tolerance, &mut self.result)
    }

    fn run(&mut self, recording: &Recording) -> Result<(), VerifyError> {
        let mut messages = recording.messages()?;
        for message in messages.by_ref() {
            let message = match message {
                Ok(message) => message,
                Err(RecordingError::Damaged(why)) => {
                    self.result.damage = Some(why);
                    break;
                }
                Err(error) => return Err(error.into()),
            };
            match message.body {
                Body::Field(received) => self.receive(received)?,
                Body::Directive(directive) => self.follow(directive)?,
                Body::Checkpoint(checkpoint) => self.from = self.from.take().or(Some(checkpoint)),
                Body::Report(_) | Body::Manifest(_) => {}
            }
            if self.result.difference.is_some() {
                break;
            }
        }
        self.result.complete = messages.complete();
        Ok(())
    }

    fn receive(&mut self, received: Received) -> Result<(), VerifyError> {
        let (sender, version) = (received.envelope.sender, received.envelope.version.unwrap_or_default());
        let field = match (received.field, received.same_as) {
            (Some(field), _) => field,
            (None, Some(same_as)) => match self.recorded.get(&sender, &received.name, same_as) {
                Some(field) => field.clone(),
                None => return Ok(()),
            },
            (None, None) => return Ok(()),
        };
        if self.started {
            self.deliver(&sender, version, &field)?;
        } else {
            self.early.push((sender.clone(), version, field.clone()));
        }
        self.recorded.insert(&sender, version, field);
        Ok(())
    }

    fn deliver(&mut self, sender: &str, version: Version, field: &Field) -> Result<(), VerifyError> {
        for (node, frozen_fields) in
            self.frozen_fields.iter_mut().filter(|(_, frozen_fields)| frozen_fields.reads(sender, field.name()))
        {
            let Some(solver) = self.solvers.get_mut(node) else { continue };
            frozen_fields.insert(sender, version, field.clone());
            if let Solver::Plugged(plugged) = solver {
                plugged.give(sender, version, field).map_err(at(node, version.to_string()))?;
            }
        }
        Ok(())
    }

    fn follow(&mut self, directive: Directive) -> Result<(), VerifyError> {
        if let Some(directive::Task::Plan(plan)) = directive.task {
            // One that comes later follows a restart, after which the run went on as if there had been none.
            if !self.started {
                self.plan = plan;
            }
            return Ok(());
        }
        // By the time of the next directive every exchange of the trial before it is recorded.
        if let Some((envelope, iterate)) = self.task.take() {
            self.solve(&envelope, &iterate)?;
        }
        if let Some(decision) = &directive.decision {
            self.conclude(decision)?;
        }
        self.start()?;
        if let Some(directive::Task::Iterate(iterate)) = directive.task.clone() {
            for (node, solver) in &mut self.solvers {
                if let Solver::Plugged(plugged) = solver {
                    plugged.direct(&directive).map_err(at(node, self.committed.to_string()))?;
                }
            }
            self.task = directive.envelope.map(|envelope| (envelope, iterate));
        }
        Ok(())
    }

    fn start(&mut self) -> Result<(), VerifyError> {
        if std::mem::replace(&mut self.started, true) {
            return Ok(());
        }
        let from = self.plan.from.unwrap_or(Version::INITIAL);
        self.committed = from;
        let nodes = self.plan.nodes.iter();
        self.frozen_fields = nodes.map(|plan| (plan.node.clone(), FrozenFields::new(plan.sources.clone()))).collect();
        if let Some(node) = self.solvers.keys().find(|node| !self.frozen_fields.contains_key(*node)) {
            return Err(no_node(node, self.frozen_fields.keys()));
        }
        self.leave_out_replaced();
        let checkpoint = self.from.take().filter(|_| from != Version::INITIAL).unwrap_or_default();
        let snapshot = |node: &str| {
            let sent = |snapshot: &&Snapshot| snapshot.envelope.as_ref().is_some_and(|it| it.sender == node);
            checkpoint.nodes.iter().find(sent)
        };
        for (node, solver) in &mut self.solvers {
            if let Solver::Plugged(plugged) = solver {
                plugged.plan(&self.plan, snapshot(node)).map_err(at(node, from.to_string()))?;
            }
        }
        for (sender, version, field) in std::mem::take(&mut self.early) {
            self.deliver(&sender, version, &field)?;
        }
        let mut starts = Vec::new();
        for plan in &self.plan.nodes {
            let node = &plan.node;
            let Some(frozen_fields) = self.frozen_fields.get_mut(node) else { continue };
            let snapshot = snapshot(node);
            let (version, fields) = match (self.solvers.get_mut(node), snapshot) {
                (Some(Solver::Here(participant)), snapshot) => {
                    participant.set_sources(&plan.sources);
                    match snapshot {
                        Some(snapshot) => restore(participant.as_mut(), frozen_fields, snapshot.clone())?,
                        None => (Version::INITIAL, participant.initial()?.0),
                    }
                }
                (Some(Solver::Plugged(plugged)), snapshot) => {
                    for message in snapshot.into_iter().flat_map(|snapshot| snapshot.frozen.clone()) {
                        frozen_fields.receive(codec::field_of(message)?);
                    }
                    let version = snapshot.and_then(|snapshot| snapshot.committed).unwrap_or_default();
                    (version, plugged.ready(from, version).map_err(at(node, from.to_string()))?)
                }
                (None, _) => continue,
            };
            for field in fields.into_values() {
                starts.push((node.clone(), version, field));
            }
            frozen_fields.begin();
        }
        for (node, version, field) in starts {
            self.compare(&node, version, &field)?;
            self.newest.insert((node, field.name().into()), field);
        }
        self.fields.clone_from(&self.newest);
        Ok(())
    }

    /// A program in the place of a physics may have read less than that does: what was not sent cannot be frozen.
    fn leave_out_replaced(&mut self) {
        for (node, what) in self.result.answered_by.clone() {
            let Some(Solver::Here(participant)) = self.solvers.get(&node) else { continue };
            let plan = self.plan.nodes.iter().find(|plan| plan.node == node);
            let read = |field: &str| plan.is_some_and(|plan| plan.sources.iter().any(|source| source.field == field));
            let Some(port) = participant.ports().reads.into_iter().find(|port| !port.optional && !read(&port.field))
            else {
                continue;
            };
            let why = format!(
                "{what} answered when it was recorded, and did not read `{}` as the physics does; --node {node} --with COMMAND \
                 has a program answer again",
                port.field
            );
            self.solvers.remove(&node);
            self.result.answered_by.remove(&node);
            self.result.unchecked.insert(node, why);
        }
    }

    fn solve(&mut self, envelope: &Envelope, iterate: &Iterate) -> Result<(), VerifyError> {
        let version = envelope.version.unwrap_or_default();
        let run_window = Window { t_s: envelope.t_s, dt_s: envelope.dt_s };
        for (node, frozen_fields) in &mut self.frozen_fields {
            let Some(solver) = self.solvers.get_mut(node) else { continue };
            if resting(node, iterate).is_some() || self.solved.get(node) == Some(&version) {
                continue;
            }
            self.asked.insert(node.clone(), version);
            // A node that failed or never answered has no fields of this version.
            let wrote = match solver {
                Solver::Here(participant) => participant.ports().writes,
                Solver::Plugged(plugged) => plugged.writes(),
            };
            if !wrote.iter().all(|port| self.recorded.get(node, &port.field, version).is_some()) {
                continue;
            }
            let Some(frozen) = frozen_fields.freeze(version, iterate)? else {
                return Err(VerifyError::Thinned { node: node.clone(), version });
            };
            let fields = match solver {
                Solver::Here(participant) => {
                    participant.solve(version, window_of(node, run_window, iterate), &frozen)?.fields
                }
                Solver::Plugged(plugged) => plugged.answer(version).map_err(at(node, version.to_string()))?,
            };
            self.solved.insert(node.clone(), version);
            *self.result.trials.entry(node.clone()).or_default() += 1;
            for field in fields.into_values() {
                let recorded = self.recorded.get(node, field.name(), version);
                // All that it wrote is there.
                compare(node, version, &field, recorded, self.tolerance, &mut self.result)?;
                self.newest.insert((node.clone(), field.name().into()), field);
            }
        }
        Ok(())
    }

    fn conclude(&mut self, decision: &Decision) -> Result<(), VerifyError> {
        let version = decision.version.unwrap_or_default();
        if decision.verdict() == Verdict::Reject {
            self.recorded.rejected(version);
            self.frozen_fields.values_mut().for_each(|frozen_fields| frozen_fields.rejected(version));
        }
        if decision.verdict() != Verdict::Accept || version <= self.committed {
            return Ok(());
        }
        for (node, solver) in &mut self.solvers {
            if self.solved.get(node) == Some(&version) {
                match solver {
                    Solver::Here(participant) => participant.commit(version)?,
                    Solver::Plugged(plugged) => plugged.accepted(version),
                }
                let own = self.newest.iter().filter(|((writer, _), _)| writer == node);
                self.fields.extend(own.map(|(key, field)| (key.clone(), field.clone())).collect::<Vec<_>>());
            } else if self.asked.get(node) == Some(&version) {
                return Err(VerifyError::Thinned { node: node.clone(), version });
            }
        }
        for (node, frozen_fields) in &mut self.frozen_fields {
            if self.solved.get(node) == Some(&version) {
                frozen_fields.commit();
            }
            frozen_fields.accepted(version);
        }
        self.recorded.accepted(version);
        self.committed = version;
        self.result.steps += 1;
        Ok(())
    }
}

fn compare(
    node: &str,
    version: Version,
    computed: &Field,
    recorded: Option<&Field>,
    tolerance: f64,
    result: &mut Verified,
) -> Result<(), VerifyError> {
    result.fields += 1;
    if result.difference.is_some() || recorded.is_some_and(|recorded| same(recorded, computed)) {
        return Ok(());
    }
    let mut found = Difference {
        node: node.into(),
        field: computed.name().into(),
        at: version.to_string(),
        index: 0,
        recorded: "nothing".into(),
        computed: format!("{} values", computed.rows() * computed.components()),
    };
    let Some(recorded) = recorded else {
        result.difference = Some(found);
        return Ok(());
    };
    if recorded.support != computed.support {
        let rows = |field: &Field| format!("{} rows of revision {}", field.rows(), field.support.revision);
        (found.recorded, found.computed) = (rows(recorded), rows(computed));
        result.difference = Some(found);
        return Ok(());
    }
    let index = match (computed.f64(), recorded.f64()) {
        (Ok(new), Ok(old)) if new.len() == old.len() => {
            let scale = old.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            let differs = |(a, b): (&f64, &f64)| {
                if tolerance > 0.0 { (a - b).abs() > tolerance * scale } else { a.to_bits() != b.to_bits() }
            };
            let Some(index) = new.iter().zip(old).position(differs) else { return Ok(()) };
            (found.recorded, found.computed) = (format!("{:e}", old[index]), format!("{:e}", new[index]));
            index
        }
        _ => {
            let (new, old) = (computed.values().bytes(), recorded.values().bytes());
            let byte = new.iter().zip(old.iter()).position(|(a, b)| a != b).unwrap_or(new.len().min(old.len()));
            found.recorded = format!("{} values", recorded.rows() * recorded.components());
            byte / computed.port.kind().bytes().max(1)
        }
    };
    found.index = index;
    result.difference = Some(found);
    Ok(())
}

impl std::fmt::Display for Verified {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (node, trials) in &self.trials {
            writeln!(f, "  {node:<12} {trials} trials solved again")?;
        }
        writeln!(f, "  {} fields compared over {} accepted steps", self.fields, self.steps)?;
        if let Some(Difference { node, field, at, index, recorded, computed }) = &self.difference {
            return write!(
                f,
                "  first difference: {node}, {field}, {at}, value {index}: {recorded} recorded, {computed} computed"
            );
        }
        for (node, why) in &self.unchecked {
            writeln!(f, "  {node:<12} not checked: {why}")?;
        }
        for (node, what) in &self.answered_by {
            writeln!(f, "  {node:<12} solved by its own physics; when it was recorded {what} answered")?;
        }
        match (self.trials.is_empty(), self.unchecked.is_empty()) {
            (false, true) => write!(f, "  no difference")?,
            (false, false) => write!(f, "  no difference in what was solved again")?,
            (true, _) => write!(f, "  nothing was solved again")?,
        }
        if let Some(hash) = &self.hash {
            write!(f, "\n  hash of the final fields  {hash}")?;
        }
        Ok(())
    }
}
