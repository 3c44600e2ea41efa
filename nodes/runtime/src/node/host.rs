//! A node: hosts one participant, freezes the fields it reads, solves trials, publishes its fields.
//!
//! Callbacks only enqueue; one thread does the rest in the order of arrival.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, Sender},
    },
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use bytes::Bytes;
use prost::Message as _;
use stagger_coupling::{Answer, COORDINATOR, FrozenFields, Participant, Window, resting, same, window_of};
use stagger_messages::{
    Decision, Directive, Done, Envelope, Failure, Field, Fields, FinalReport, Iterate, Manifest, Plan, Ready, Report,
    SCHEMA_VERSION, Snapshot, Stop, Verdict, Version, codec, directive, keys, report,
};

use crate::{
    link::{Declaration, Link, LinkError, Publisher, Sample},
    run::summary,
};

/// Fields kept until the plan comes; what is left out is sent again with the next one.
const EARLY_FIELDS: usize = 1000;
/// How many steps beyond the last one accepted here a field may be of: this node may yet have to hear that one more was
/// accepted, and of the question about the step after it.
const AHEAD: u64 = 2;
/// How long a node waits for the state it is to go on from.
const RESTORE: Duration = Duration::from_secs(30);

/// Who a node is.
#[derive(Clone, Debug)]
pub struct Identity {
    /// Run it takes part in.
    pub run: String,
    /// Its name.
    pub node: String,
    /// Hash of the scene it was built from.
    pub scene_hash: u64,
}

/// How a node ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NodeEnd {
    /// The coordinator said so.
    Stopped {
        /// Whether the run was completed.
        completed: bool,
        /// Why it ended, in words.
        reason: String,
    },
    /// The coordinator is gone.
    Abandoned,
}

/// Why a node cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Its physics cannot start.
    #[error("node `{node}` cannot start: {message}")]
    Start {
        /// The node.
        node: String,
        /// Why.
        message: String,
    },
    /// It was told to commit what it does not hold, or its state cannot be encoded.
    #[error("node `{node}` cannot commit: {message}")]
    Commit {
        /// The node.
        node: String,
        /// Why.
        message: String,
    },
}

/// What a node is told.
#[derive(Debug)]
pub enum Event {
    /// By the coordinator.
    Directive(Sample),
    /// By another node.
    Field(Sample),
    /// That the coordinator is gone.
    Abandoned,
}

/// A node and everything it knows of its run.
pub struct Host {
    identity: Identity,
    participant: Box<dyn Participant>,
    events: (Sender<Event>, Receiver<Event>),
    link: Link,
    publishers: BTreeMap<String, Publisher>,
    report: Publisher,
    snapshot: Publisher,
    _declared: Vec<Declaration>,
    frozen_fields: FrozenFields,
    /// Its fields that other nodes read.
    read: BTreeSet<String>,
    epoch: Option<u32>,
    /// Fields that came before the plan of their epoch: the nodes hear of it at different moments.
    early: Vec<Sample>,
    /// The version the epoch starts from, what the node holds then, and whether the coordinator waits to hear it.
    ready: (Version, Ready, bool),
    pending: Option<(Envelope, Iterate, Instant)>,
    /// The last answer and the one before it, for whoever missed them.
    answered: Option<(Envelope, Fields, Done)>,
    before: Option<(Envelope, Fields)>,
    /// The last trial that was asked of others only.
    rested: Option<Version>,
    /// What readers hold of each field, and the version they know it by.
    sent: BTreeMap<String, (Version, Field)>,
    /// The same, whole, for whoever comes late and asks.
    latest: Arc<Mutex<BTreeMap<String, (Envelope, Field)>>>,
    /// What this node committed last.
    committed: (Version, Fields),
    /// What the run accepted last.
    accepted: Version,
    sequence: u64,
    refused: u64,
}

impl Host {
    /// Declares the node's keys; its token, which says that it is ready to be asked, comes last.
    ///
    /// # Errors
    /// The link fails.
    pub fn new(link: &Link, identity: Identity, participant: Box<dyn Participant>) -> Result<Self, LinkError> {
        let Identity { run, node, scene_hash } = identity.clone();
        let events = std::sync::mpsc::channel();
        // A clock before 1970 still tells two processes of one number apart by that number.
        let started = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let instance = format!("{}-{}", std::process::id(), started.as_nanos());
        let ports = participant.ports();
        let mut publishers = BTreeMap::new();
        for port in &ports.writes {
            publishers.insert(port.field.clone(), link.publisher(keys::field(&run, &node, &port.field))?);
        }
        let report = link.publisher(keys::report(&run, &node))?;
        let snapshot = link.publisher_by_socket(keys::snapshot(&run, &node))?;
        let manifest = Manifest {
            run: run.clone(),
            schema: SCHEMA_VERSION,
            node: node.clone(),
            instance: instance.clone(),
            program: concat!("stagger ", env!("CARGO_PKG_VERSION")).into(),
            pid: std::process::id(),
            ports: Some(ports),
            scene_hash,
        };
        let manifest = Sample {
            key: keys::manifest(&run, &node),
            attachment: Bytes::new(),
            payload: manifest.encode_to_vec().into(),
        };
        let latest = Arc::new(Mutex::new(BTreeMap::<String, (Envelope, Field)>::new()));
        let asked = Arc::clone(&latest);
        let to_host = events.0.clone();
        // A host that has ended needs no more events.
        let directives = link.subscribe(&keys::directive(&run), move |sample| {
            let _ = to_host.send(Event::Directive(sample));
        })?;
        let to_host = events.0.clone();
        let coordinator = link.watch(&keys::live(&run, COORDINATOR, "*"), move |_, alive| {
            if !alive {
                let _ = to_host.send(Event::Abandoned);
            }
        })?;
        let mut declarations = vec![directives, coordinator];
        for port in &participant.ports().reads {
            let to_host = events.0.clone();
            declarations.push(link.subscribe(&keys::field(&run, "*", &port.field), move |sample| {
                let _ = to_host.send(Event::Field(sample));
            })?);
        }
        declarations.extend([
            link.queryable(&keys::field(&run, &node, "*"), move || {
                // Encoded only when somebody asks; the lock is held for the copies of references alone.
                let latest = asked.lock().unwrap_or_else(PoisonError::into_inner).clone();
                let whole = latest.into_values().map(|(envelope, field)| Sample {
                    key: keys::field(&envelope.run, &envelope.sender, field.name()),
                    attachment: codec::field_attachment(&envelope, &field, None).into(),
                    payload: field.values().bytes().clone(),
                });
                whole.collect()
            })?,
            link.queryable(&keys::manifest(&run, &node), move || vec![manifest.clone()])?,
            link.announce(&keys::live(&run, &node, &instance))?,
        ]);
        Ok(Self {
            identity,
            participant,
            events,
            link: link.clone(),
            publishers,
            report,
            snapshot,
            _declared: declarations,
            frozen_fields: FrozenFields::default(),
            read: BTreeSet::new(),
            epoch: None,
            early: Vec::new(),
            ready: (Version::INITIAL, Ready::default(), false),
            pending: None,
            answered: None,
            before: None,
            rested: None,
            sent: BTreeMap::new(),
            latest,
            committed: (Version::INITIAL, Fields::new()),
            accepted: Version::INITIAL,
            sequence: 0,
            refused: 0,
        })
    }

    /// A way to tell the node from outside, such as that its parent process is gone.
    #[must_use]
    pub fn sender(&self) -> Sender<Event> {
        self.events.0.clone()
    }

    /// Takes part in the run until it ends.
    ///
    /// # Errors
    /// The link fails, or the physics cannot start.
    pub fn run(mut self) -> Result<NodeEnd, HostError> {
        loop {
            // It holds a sender itself, so that the channel cannot close.
            let Ok(event) = self.events.1.recv() else { return Ok(NodeEnd::Abandoned) };
            match event {
                Event::Abandoned => return Ok(NodeEnd::Abandoned),
                Event::Field(sample) => self.receive_field(sample),
                Event::Directive(sample) => {
                    if let Some(end) = self.receive_directive(&sample)? {
                        return Ok(end);
                    }
                }
            }
            self.try_solve()?;
            self.try_ready()?;
        }
    }

    /// Whether a message belongs here. Before its first plan a node hears of any epoch, in `new_epoch` of a later one.
    fn accepts(&mut self, envelope: Option<&Envelope>, new_epoch: bool) -> bool {
        let fits = envelope.is_some_and(|envelope| {
            envelope.run == self.identity.run
                && envelope.schema == SCHEMA_VERSION
                && envelope.version.is_some()
                && (new_epoch && self.epoch.is_none_or(|epoch| envelope.epoch >= epoch)
                    || self.epoch == Some(envelope.epoch))
        });
        if !fits {
            self.refused += 1;
        }
        fits
    }

    fn receive_field(&mut self, sample: Sample) {
        let Ok(received) = codec::decode_field(&sample.attachment, sample.payload.clone()) else {
            self.refused += 1;
            return;
        };
        if self.epoch.is_none_or(|epoch| received.envelope.epoch > epoch) {
            if self.early.len() < EARLY_FIELDS {
                self.early.push(sample);
            }
            return;
        }
        if !self.accepts(Some(&received.envelope), false) {
            return;
        }
        let version = received.envelope.version.unwrap_or_default();
        if !self.may_be_read(version) || !self.frozen_fields.receive(received) {
            self.refused += 1;
        }
    }

    /// Whether a field of that version may be one that this node reads. Nobody goes beyond the start before all are ready.
    fn may_be_read(&self, version: Version) -> bool {
        let (from, _, starts) = &self.ready;
        if *starts { version <= *from } else { version.step <= self.accepted.step.saturating_add(AHEAD) }
    }

    /// Whether a question is older than one that was answered or is in work, or a plan comes after its questions: somebody
    /// repeats what was said before.
    fn is_over(&self, envelope: &Envelope, is_plan: bool) -> bool {
        let answered = self.answered.as_ref().and_then(|(answered, ..)| answered.version);
        let pending = self.pending.as_ref().and_then(|(pending, ..)| pending.version);
        let newest = answered.max(pending).max(self.rested).max(Some(self.accepted));
        if is_plan {
            self.epoch == Some(envelope.epoch) && newest > Some(self.ready.0)
        } else {
            // What was accepted is over; what was answered or rests may be asked for again.
            envelope.version <= Some(self.accepted) || envelope.version < newest
        }
    }

    fn receive_directive(&mut self, sample: &Sample) -> Result<Option<NodeEnd>, HostError> {
        let Ok(directive) = codec::decode::<Directive>("directive", &sample.payload) else {
            self.refused += 1;
            return Ok(None);
        };
        // A run may end before this node has heard of its plan.
        let is_plan = matches!(directive.task, Some(directive::Task::Plan(_)));
        let is_early_stop = matches!(directive.task, Some(directive::Task::Stop(_))) && self.epoch.is_none();
        if !self.accepts(directive.envelope.as_ref(), is_plan || is_early_stop) {
            return Ok(None);
        }
        if directive.envelope.as_ref().is_none_or(|envelope| envelope.sender != COORDINATOR) {
            self.refused += 1;
            return Ok(None);
        }
        let envelope = directive.envelope.unwrap_or_default();
        // What an epoch decided that this node knows nothing of is not its concern.
        let knows = self.epoch == Some(envelope.epoch);
        if let Some(decision) = directive.decision.filter(|_| knows) {
            self.conclude(&decision, &envelope)?;
        }
        if directive.checkpoint && knows {
            self.hand_over(&envelope)?;
        }
        match directive.task {
            Some(directive::Task::Plan(_)) if self.is_over(&envelope, true) => self.refused += 1,
            Some(directive::Task::Plan(plan)) => self.start(&envelope, plan)?,
            // It is late: what is over is not solved again.
            Some(directive::Task::Iterate(_)) if self.is_over(&envelope, false) => self.refused += 1,
            Some(directive::Task::Iterate(iterate)) => {
                self.link.asked(iterate.again);
                if iterate.again {
                    self.answer_again(&envelope)?;
                }
                if resting(&self.identity.node, &iterate).is_some() {
                    self.rested = envelope.version;
                    // An earlier trial that it still waited for was given up.
                    self.pending.take_if(|(pending, ..)| pending.version < envelope.version);
                } else if self.answered.as_ref().is_none_or(|(answered, ..)| answered.version != envelope.version) {
                    self.pending = Some((envelope, iterate, Instant::now()));
                }
            }
            Some(directive::Task::Stop(Stop { completed, reason })) => {
                self.report_final_fields()?;
                return Ok(Some(NodeEnd::Stopped { completed, reason }));
            }
            None => self.refused += 1,
        }
        Ok(None)
    }

    /// Commits an accepted version, once, where this node solved it; forgets a rejected attempt.
    fn conclude(&mut self, decision: &Decision, envelope: &Envelope) -> Result<(), HostError> {
        let version = decision.version.unwrap_or_default();
        if decision.verdict() == Verdict::Reject {
            self.frozen_fields.rejected(version);
        }
        if decision.verdict() != Verdict::Accept || version <= self.accepted {
            return Ok(());
        }
        let answer = self.answered.as_ref().filter(|(answered, ..)| answered.version == Some(version));
        if let Some((_, fields, _)) = answer {
            let fields = fields.clone();
            if let Err(error) = self.participant.commit(version) {
                return self.cannot_commit(envelope, error.to_string());
            }
            self.committed = (version, fields);
            self.frozen_fields.commit();
        } else if self.rested != Some(version) {
            return self.cannot_commit(envelope, format!("asked to commit {version}, which it has not solved"));
        }
        self.accepted = version;
        self.frozen_fields.accepted(version);
        Ok(())
    }

    fn cannot_commit(&mut self, envelope: &Envelope, message: String) -> Result<(), HostError> {
        self.fail(envelope, message.clone(), false)?;
        Err(HostError::Commit { node: self.identity.node.clone(), message })
    }

    /// Puts everything it needs to go on from its committed version.
    fn hand_over(&mut self, envelope: &Envelope) -> Result<(), HostError> {
        let about = Envelope {
            run: self.identity.run.clone(),
            schema: SCHEMA_VERSION,
            epoch: self.epoch.unwrap_or_default(),
            sender: self.identity.node.clone(),
            version: Some(self.accepted),
            ..Envelope::default()
        };
        match stagger_coupling::snapshot(self.participant.as_ref(), &self.frozen_fields, &self.committed, about) {
            Ok(snapshot) => Ok(self.snapshot.put(None, snapshot.encode_to_vec().into())?),
            Err(error) => self.cannot_commit(envelope, error.to_string()),
        }
    }

    fn start(&mut self, envelope: &Envelope, plan: Plan) -> Result<(), HostError> {
        let from = plan.from.unwrap_or(Version::INITIAL);
        if self.epoch != Some(envelope.epoch) {
            self.epoch = Some(envelope.epoch);
            self.sequence = 0;
            self.sent.clear();
            let node = self.identity.node.clone();
            self.link.share_memory(&plan);
            let sources = plan.nodes.iter().flat_map(|part| &part.sources);
            self.read = sources.filter(|source| source.writer == node).map(|source| source.field.clone()).collect();
            let Some(mine) = plan.nodes.into_iter().find(|part| part.node == node) else {
                let message = format!("the run has no node of this name, but {}", plan.order.join(", "));
                return Err(HostError::Start { node, message });
            };
            self.participant.set_sources(&mine.sources);
            self.frozen_fields = FrozenFields::new(mine.sources);
            let begun = if from == Version::INITIAL { self.initial() } else { self.restore() };
            if let Err(message) = begun {
                self.fail(&Envelope { version: Some(from), ..Envelope::default() }, message.clone(), false)?;
                return Err(HostError::Start { node: self.identity.node.clone(), message });
            }
            self.accepted = from;
            (self.ready.0, self.ready.2) = (from, true);
            (self.pending, self.answered, self.before, self.rested) = (None, None, None, None);
            for sample in std::mem::take(&mut self.early) {
                self.receive_field(sample);
            }
        }
        // The coordinator asks again until all are ready, so that a reader that came late gets the values too.
        let (version, fields) = self.committed.clone();
        self.publish(&Envelope { version: Some(version), ..envelope.clone() }, &fields, true)?;
        self.ready.2 = true;
        self.try_ready()
    }

    fn initial(&mut self) -> Result<(), String> {
        let (fields, ready) = self.participant.initial().map_err(|error| error.to_string())?;
        self.committed = (Version::INITIAL, fields);
        self.ready.1 = ready;
        Ok(())
    }

    /// Goes on from what the coordinator kept of this node.
    fn restore(&mut self) -> Result<(), String> {
        let key = keys::restore(&self.identity.run, &self.identity.node);
        let answers = self.link.query(&key, RESTORE).map_err(|error| error.to_string())?;
        let answer = answers.first().ok_or("the coordinator has no state for it to go on from")?;
        let snapshot = codec::decode::<Snapshot>("snapshot", &answer.payload).map_err(|error| error.to_string())?;
        let restored = stagger_coupling::restore(self.participant.as_mut(), &mut self.frozen_fields, snapshot);
        self.committed = restored.map_err(|error| error.to_string())?;
        self.ready.1 = Ready::default();
        Ok(())
    }

    /// Reports Ready once a value to start from has come of every field read; again whenever the plan is sent again.
    fn try_ready(&mut self) -> Result<(), HostError> {
        if !self.ready.2 || !self.frozen_fields.begin() {
            return Ok(());
        }
        self.ready.2 = false;
        let envelope = Envelope { version: Some(self.ready.0), ..Envelope::default() };
        self.tell(&envelope, report::Body::Ready(self.ready.1.clone()))
    }

    fn try_solve(&mut self) -> Result<(), HostError> {
        let Some((envelope, iterate, asked)) = &self.pending else { return Ok(()) };
        let version = envelope.version.unwrap_or_default();
        let frozen = match self.frozen_fields.freeze(version, iterate) {
            Ok(Some(frozen)) => frozen,
            Ok(None) => return Ok(()),
            Err(error) => {
                let envelope = envelope.clone();
                self.pending = None;
                return self.fail(&envelope, error.to_string(), error.retry());
            }
        };
        let run_window = Window { t_s: envelope.t_s, dt_s: envelope.dt_s };
        let window = window_of(&self.identity.node, run_window, iterate);
        let envelope = Envelope { t_s: window.t_s, dt_s: window.dt_s, ..envelope.clone() };
        let wait_s = asked.elapsed().as_secs_f64();
        self.pending = None;
        let begun = Instant::now();
        match self.participant.solve(version, window, &frozen) {
            Err(error) => self.fail(&envelope, error.to_string(), error.retry()),
            Ok(Answer { fields, mut done }) => {
                done.solve_s = begun.elapsed().as_secs_f64();
                done.wait_s = wait_s;
                done.refused = self.refused;
                let (count, bytes) = self.publish(&envelope, &fields, false)?;
                (done.fields, done.bytes) = (count, bytes);
                self.tell(&envelope, report::Body::Done(done.clone()))?;
                self.before = self.answered.take().map(|(envelope, fields, _)| (envelope, fields));
                self.answered = Some((envelope, fields, done));
                Ok(())
            }
        }
    }

    /// Publishes once more, whole, what a trial rests on and what this node answered: somebody lacks a field of this
    /// iteration or of the one before it, or the coordinator a reply.
    fn answer_again(&mut self, asked: &Envelope) -> Result<(), HostError> {
        let version = asked.version.unwrap_or_default();
        let (committed, fields) = self.committed.clone();
        self.publish(&Envelope { version: Some(committed), ..asked.clone() }, &fields, true)?;
        let same_attempt = |envelope: &Envelope| {
            envelope.version.is_some_and(|at| (at.step, at.attempt) == (version.step, version.attempt))
        };
        if let Some((envelope, fields)) = self.before.clone().filter(|(envelope, _)| same_attempt(envelope)) {
            self.publish(&envelope, &fields, true)?;
        }
        if let Some((envelope, fields, done)) = self.answered.clone().filter(|(envelope, ..)| same_attempt(envelope)) {
            self.publish(&envelope, &fields, true)?;
            if envelope.version == asked.version {
                self.tell(&envelope, report::Body::Done(done))?;
            }
        }
        Ok(())
    }

    /// Publishes fields; one whose values readers hold already is sent as a reference, unless `whole`.
    fn publish(&mut self, envelope: &Envelope, fields: &Fields, whole: bool) -> Result<(u32, u64), HostError> {
        let version = envelope.version.unwrap_or_default();
        let (mut count, mut bytes) = (0, 0);
        let latest = &self.latest;
        let remember = |name: &String, header: Envelope, field: &Field| {
            latest.lock().unwrap_or_else(PoisonError::into_inner).insert(name.clone(), (header, field.clone()));
        };
        for (name, field) in fields {
            let Some(publisher) = self.publishers.get(name) else { continue };
            // What no node reads is for a recorder or a viewer, and stays here where there is none.
            if !whole && !self.read.contains(name) && !publisher.has_reader()? {
                self.sent.remove(name);
                let header = Self::stamp(&self.identity, self.epoch, &mut 0, envelope);
                remember(name, header, field);
                continue;
            }
            // A rejected attempt is forgotten by everyone: its values are no reference.
            let kept = |at: &Version| at.step < version.step || at.attempt == version.attempt;
            let known = self.sent.get(name).filter(|(at, sent)| !whole && kept(at) && same(sent, field));
            let known = known.map(|(at, _)| *at);
            let header = Self::stamp(&self.identity, self.epoch, &mut self.sequence, envelope);
            let payload = if known.is_some() { Bytes::new() } else { field.values().bytes().clone() };
            count += 1;
            bytes += payload.len() as u64;
            publisher.put_field(codec::field_attachment(&header, field, known), payload, whole)?;
            remember(name, header, field);
            self.sent.insert(name.clone(), (version, field.clone()));
        }
        Ok((count, bytes))
    }

    fn fail(&mut self, envelope: &Envelope, message: String, retry: bool) -> Result<(), HostError> {
        self.tell(envelope, report::Body::Failure(Failure { message, retry }))
    }

    fn report_final_fields(&mut self) -> Result<(), HostError> {
        let (version, fields) = &self.committed;
        let fields = fields.values().map(summary::of_field).collect();
        let envelope = Envelope { version: Some(*version), ..Envelope::default() };
        self.tell(&envelope, report::Body::FinalReport(FinalReport { fields }))
    }

    fn tell(&mut self, envelope: &Envelope, body: report::Body) -> Result<(), HostError> {
        let envelope = Self::stamp(&self.identity, self.epoch, &mut self.sequence, envelope);
        let report = Report { envelope: Some(envelope), body: Some(body) };
        Ok(self.report.put(None, report.encode_to_vec().into())?)
    }

    fn stamp(identity: &Identity, epoch: Option<u32>, sequence: &mut u64, about: &Envelope) -> Envelope {
        let envelope = Envelope {
            run: identity.run.clone(),
            schema: SCHEMA_VERSION,
            epoch: epoch.unwrap_or_default(),
            sender: identity.node.clone(),
            sequence: *sequence,
            version: about.version,
            t_s: about.t_s,
            dt_s: about.dt_s,
        };
        *sequence += 1;
        envelope
    }
}
