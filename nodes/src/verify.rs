//! `stagger verify`: solves every node again from the recorded frozen fields and compares with what it answered.

use std::collections::BTreeMap;

use stagger_messages::{
    Checkpoint, Decision, Directive, Envelope, Field, Iterate, MessageError, Plan, Snapshot, Verdict, Version,
    codec::Received, directive,
};
use stagger_recordings::{Body, Recording, RecordingError};
use stagger_solver::{
    SolveError,
    coupling::{Inbox, Participant, Window, resting, restore, same, window_of},
    scene::Problems,
};

use crate::{
    roster::{RosterError, Runs, participant, roster},
    scene_files, summary,
};

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
    Roster(#[from] RosterError),
    /// A physics fails where it did not when recorded.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A field holds another type.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// It has no node of that name.
    #[error("the recording has no node `{0}` that can be solved here: it has {1}")]
    NoNode(String, String),
    /// The frozen fields of an iteration are not in it.
    #[error(
        "`{node}` cannot be solved again for {version}: the recording lacks a field it read. \
         Only a recording at level \"all\" can be verified"
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
    /// Hash of the final fields, where all nodes were solved.
    pub hash: Option<String>,
    /// Whether the recording reaches the end of its run.
    pub complete: bool,
}

/// Verifies a recording: every node, or only `node`; `tolerance` is the largest relative difference, 0 for equal bits.
///
/// # Errors
/// The recording cannot be read or its nodes not be built. A difference is no error but a result.
pub fn verify(recording: &Recording, node: Option<&str>, tolerance: f64) -> Result<Verified, VerifyError> {
    let info = &recording.info;
    let scene = scene_files::recorded(info)?;
    let mut replay = Replay { tolerance, ..Replay::default() };
    let nodes = roster(&scene);
    for (name, runs) in &nodes {
        if let (Runs::Physics(kind), true) = (runs, node.is_none_or(|only| only == name)) {
            replay.participants.insert(name.clone(), participant(&scene, name, kind)?);
        }
    }
    if let (Some(node), true) = (node, replay.participants.is_empty()) {
        let names: Vec<_> = nodes.keys().map(String::as_str).collect();
        return Err(VerifyError::NoNode(node.into(), names.join(", ")));
    }
    let mut messages = recording.messages()?;
    for message in messages.by_ref() {
        match message?.body {
            Body::Field(received) => replay.receive(received),
            Body::Directive(directive) => replay.follow(directive)?,
            Body::Checkpoint(checkpoint) => replay.from = replay.from.take().or(Some(checkpoint)),
            Body::Report(_) | Body::Manifest(_) => {}
        }
        if replay.result.difference.is_some() {
            break;
        }
    }
    replay.result.complete = messages.complete();
    if replay.participants.len() == nodes.len() {
        let fields = replay.fields.iter().map(|((node, _), field)| (node.as_str(), vec![summary::of_field(field)]));
        let fields = summary::told_apart(fields);
        replay.result.hash = Some(summary::hash(&fields));
    }
    Ok(replay.result)
}

#[derive(Default)]
struct Replay {
    participants: BTreeMap<String, Box<dyn Participant>>,
    /// What each of them reads, as recorded.
    inboxes: BTreeMap<String, Inbox>,
    /// Fields recorded before the first trial.
    early: Vec<(String, Version, Field)>,
    /// Everything recorded of the step under way.
    recorded: Inbox,
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
    result: Verified,
}

impl Replay {
    fn receive(&mut self, received: Received) {
        let (sender, version) = (received.envelope.sender, received.envelope.version.unwrap_or_default());
        let field = match (received.field, received.same_as) {
            (Some(field), _) => field,
            (None, Some(same_as)) => match self.recorded.get(&sender, &received.name, same_as) {
                Some(field) => field.clone(),
                None => return,
            },
            (None, None) => return,
        };
        if self.started {
            self.deliver(&sender, version, &field);
        } else {
            self.early.push((sender.clone(), version, field.clone()));
        }
        self.recorded.insert(&sender, version, field);
    }

    fn deliver(&mut self, sender: &str, version: Version, field: &Field) {
        for inbox in self.inboxes.values_mut().filter(|inbox| inbox.reads(sender, field.name())) {
            inbox.insert(sender, version, field.clone());
        }
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
        if let Some(directive::Task::Iterate(iterate)) = directive.task {
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
        self.inboxes = nodes.map(|plan| (plan.node.clone(), Inbox::new(plan.sources.clone()))).collect();
        for (sender, version, field) in std::mem::take(&mut self.early) {
            self.deliver(&sender, version, &field);
        }
        let checkpoint = self.from.take().filter(|_| from != Version::INITIAL).unwrap_or_default();
        for plan in &self.plan.nodes {
            let Some(inbox) = self.inboxes.get_mut(&plan.node) else { continue };
            if let Some(participant) = self.participants.get_mut(&plan.node) {
                participant.set_sources(&plan.sources);
                let sent = |node: &&Snapshot| node.envelope.as_ref().is_some_and(|it| it.sender == plan.node);
                let (version, fields) = match checkpoint.nodes.iter().find(sent) {
                    Some(snapshot) => restore(participant.as_mut(), inbox, snapshot.clone())?,
                    None => (Version::INITIAL, participant.initial()?.0),
                };
                for field in fields.into_values() {
                    let recorded = self.recorded.get(&plan.node, field.name(), version);
                    compare(&plan.node, version, &field, recorded, self.tolerance, &mut self.result)?;
                    self.newest.insert((plan.node.clone(), field.name().into()), field);
                }
            }
            inbox.begin();
        }
        self.fields.clone_from(&self.newest);
        Ok(())
    }

    fn solve(&mut self, envelope: &Envelope, iterate: &Iterate) -> Result<(), VerifyError> {
        let version = envelope.version.unwrap_or_default();
        let run_window = Window { t_s: envelope.t_s, dt_s: envelope.dt_s };
        for (node, inbox) in &mut self.inboxes {
            let Some(participant) = self.participants.get_mut(node) else { continue };
            if resting(node, iterate).is_some() || self.solved.get(node) == Some(&version) {
                continue;
            }
            self.asked.insert(node.clone(), version);
            // A node that failed or never answered has no fields of this version.
            let wrote = participant.ports().writes;
            if !wrote.iter().all(|port| self.recorded.get(node, &port.field, version).is_some()) {
                continue;
            }
            let Some(frozen) = inbox.freeze(version, iterate)? else {
                return Err(VerifyError::Thinned { node: node.clone(), version });
            };
            let answer = participant.solve(version, window_of(node, run_window, iterate), &frozen)?;
            self.solved.insert(node.clone(), version);
            *self.result.trials.entry(node.clone()).or_default() += 1;
            for field in answer.fields.into_values() {
                let recorded = self.recorded.get(node, field.name(), version);
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
            self.inboxes.values_mut().for_each(|inbox| inbox.rejected(version));
        }
        if decision.verdict() != Verdict::Accept || version <= self.committed {
            return Ok(());
        }
        for (node, participant) in &mut self.participants {
            if self.solved.get(node) == Some(&version) {
                participant.commit(version)?;
                let own = self.newest.iter().filter(|((writer, _), _)| writer == node);
                self.fields.extend(own.map(|(key, field)| (key.clone(), field.clone())).collect::<Vec<_>>());
            } else if self.asked.get(node) == Some(&version) {
                return Err(VerifyError::Thinned { node: node.clone(), version });
            }
        }
        for (node, inbox) in &mut self.inboxes {
            if self.solved.get(node) == Some(&version) {
                inbox.commit();
            }
            inbox.accepted(version);
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
        write!(f, "  no difference")?;
        if let Some(hash) = &self.hash {
            write!(f, "\n  hash of the final fields  {hash}")?;
        }
        Ok(())
    }
}
