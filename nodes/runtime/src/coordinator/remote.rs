//! The nodes of a run at the other end of the link: who is there, what they are told and what they say.
//!
//! What they send is sorted in [`events`](super::events); they are asked for trials in [`ensemble`](super::ensemble).

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        PoisonError,
        mpsc::{Receiver, Sender},
    },
    time::{Duration, Instant},
};

use stagger_coupling::{COORDINATOR, FrozenFields};
use stagger_messages::{
    Checkpoint, Envelope, Field, FieldSummary, Iterate, Manifest, SCHEMA_VERSION, Version, codec, keys,
};

use super::{RunError, Supervisor, backpressure::Backpressure, checkpoints::Checkpoints};
use crate::{
    diagnostics,
    link::{Declaration, Link, LinkError, Publisher, Sample},
    run::summary,
};

/// How often it is told which nodes are still waited for.
const REMIND: Duration = Duration::from_secs(30);

/// What the coordinator hears.
pub(super) enum Event {
    Report(Sample),
    Field(Sample),
    Snapshot(Sample),
    Alive(String, bool),
}

/// The nodes of a run at the other end of the link.
pub struct Remote<'a> {
    pub(super) link: Link,
    pub(super) run: String,
    pub(super) epoch: u32,
    pub(super) sequence: u64,
    pub(super) directives: Publisher,
    pub(super) event_sender: Sender<Event>,
    pub(super) events: Receiver<Event>,
    pub(super) supervisor: &'a mut dyn Supervisor,
    pub(super) nodes: BTreeSet<String>,
    /// Processes by node; one that was given up is not among them.
    pub(super) alive: BTreeMap<String, BTreeSet<String>>,
    pub(super) evicted: BTreeSet<(String, String)>,
    /// The process of each node that takes part: another of its name may be there before this one's end is seen.
    pub(super) current: BTreeMap<String, String>,
    pub(super) order: Vec<String>,
    /// How long a node may work on one answer.
    pub(super) hang: Duration,
    /// Answers of accelerated fields.
    pub(super) frozen_fields: FrozenFields,
    /// What was published instead of them last.
    pub(super) published: (Version, BTreeMap<String, Field>),
    pub(super) publishers: BTreeMap<String, Publisher>,
    /// What the nodes were asked last, in the form in which it is asked again.
    pub(super) asked: Option<(Envelope, Iterate)>,
    pub(super) checkpoints: Checkpoints,
    pub(super) final_reports: BTreeMap<String, Vec<FieldSummary>>,
    pub(super) finished: bool,
    pub(super) refused: u64,
    /// What the run waits for between iterations, where it is recorded.
    pub(super) backpressure: Option<Backpressure>,
    pub(super) declarations: Vec<Declaration>,
}

impl<'a> Remote<'a> {
    /// Listens for the nodes of `run`. A node that works on one answer for longer than `hang` is taken for dead. Where
    /// the run goes on from a checkpoint, the nodes are given that.
    ///
    /// # Errors
    /// The link fails.
    pub fn new(
        link: Link,
        run: &str,
        nodes: BTreeSet<String>,
        hang: Duration,
        resume: Option<Checkpoint>,
        supervisor: &'a mut dyn Supervisor,
    ) -> Result<Self, LinkError> {
        let (event_sender, events) = std::sync::mpsc::channel();
        let (reports, snapshots, life) = (event_sender.clone(), event_sender.clone(), event_sender.clone());
        let mut checkpoints = Checkpoints::new(link.publisher_by_socket(keys::checkpoint(run))?);
        if let Some(mut checkpoint) = resume {
            // It was another run's; now it is the point this one starts from.
            let envelope = checkpoint.envelope.get_or_insert_default();
            (envelope.run, envelope.epoch) = (run.into(), 1);
            checkpoints.keep(checkpoint)?;
        }
        // A coordinator that has ended needs no more events.
        let mut declarations = vec![
            link.subscribe(&keys::reports(run), move |sample| {
                let _ = reports.send(Event::Report(sample));
            })?,
            link.subscribe(&keys::snapshot(run, "*"), move |sample| {
                let _ = snapshots.send(Event::Snapshot(sample));
            })?,
            link.watch(&keys::live_all(run), move |key, alive| {
                let _ = life.send(Event::Alive(key, alive));
            })?,
        ];
        for node in &nodes {
            let (key, node, states) = (keys::restore(run, node), node.clone(), checkpoints.states());
            declarations.push(link.queryable(&key.clone(), move || {
                let states = states.lock().unwrap_or_else(PoisonError::into_inner);
                let sample = |payload| Sample { key: key.clone(), attachment: bytes::Bytes::new(), payload };
                states.get(&node).cloned().map(sample).into_iter().collect()
            })?);
        }
        declarations.push(link.announce(&keys::live(run, COORDINATOR, &std::process::id().to_string()))?);
        let directives = link.publisher(keys::directive(run))?;
        Ok(Self {
            link,
            run: run.into(),
            epoch: 1,
            sequence: 0,
            directives,
            event_sender,
            events,
            supervisor,
            nodes,
            alive: BTreeMap::new(),
            evicted: BTreeSet::new(),
            current: BTreeMap::new(),
            order: Vec::new(),
            hang,
            frozen_fields: FrozenFields::default(),
            published: (Version::INITIAL, BTreeMap::new()),
            publishers: BTreeMap::new(),
            asked: None,
            checkpoints,
            final_reports: BTreeMap::new(),
            finished: false,
            refused: 0,
            backpressure: None,
            declarations,
        })
    }

    /// Has the run wait between iterations until its recording has caught up.
    #[must_use]
    pub fn with_backpressure(self, backpressure: Option<Backpressure>) -> Self {
        Self { backpressure, ..self }
    }

    /// How long the run has waited for its recording.
    #[must_use]
    pub fn waited(&self) -> Duration {
        self.backpressure.as_ref().map_or(Duration::ZERO, |backpressure| backpressure.waited)
    }

    /// Whether a node that is gone, in its start or later, would only end the same way again.
    pub fn is_hopeless(&mut self, node: &str, at_start: bool) -> bool {
        self.supervisor.is_hopeless(node, at_start)
    }

    /// The last whole checkpoint, or the one the run goes on from, with its version.
    #[must_use]
    pub fn last_checkpoint(&self) -> Option<(Version, &Checkpoint)> {
        self.checkpoints.last().map(|checkpoint| (checkpoint.version(), checkpoint))
    }

    /// Gives a node up and has it started again. What follows is a new epoch.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn restart(&mut self, node: &str) -> Result<(), RunError> {
        let current = self.current.remove(node);
        for instance in self.alive.get(node).cloned().unwrap_or_default() {
            // Before the first handshake nobody is current, and whoever is there is given up.
            if current.as_ref().is_none_or(|current| *current == instance) {
                self.liveliness_changed(&keys::live(&self.run, node, &instance), false);
                self.evicted.insert((node.into(), instance));
            }
        }
        self.epoch += 1;
        self.sequence = 0;
        self.checkpoints.drop_unfinished();
        self.supervisor.restart(node).map_err(|message| RunError::Restart { node: node.into(), message })
    }

    /// Waits until every node has announced itself, and asks each for its ports.
    ///
    /// # Errors
    /// A node does not come, or belongs to another run.
    pub fn gather(&mut self, scene_hash: u64, patience: Duration) -> Result<BTreeMap<String, Manifest>, RunError> {
        let begun = Instant::now();
        let mut remind = begun + REMIND;
        while self.nodes.iter().any(|node| !self.alive.contains_key(node)) {
            if Instant::now() >= remind {
                remind += REMIND;
                let absent: Vec<_> = self.nodes.iter().filter(|node| !self.alive.contains_key(*node)).collect();
                let names = absent.into_iter().map(String::as_str).collect::<Vec<_>>().join(", ");
                diagnostics::note(&format!("still waiting for {names}, of whom nothing has been heard"));
            }
            if self.supervisor.interrupted() {
                return Err(RunError::Interrupted);
            }
            if let Some(node) = self.supervisor.ended_early() {
                return Err(self.lost(node, "its start".into()));
            }
            if begun.elapsed() > patience {
                let absent = self.nodes.iter().filter(|node| !self.alive.contains_key(*node));
                let nodes = absent.map(|node| format!("`{node}`")).collect();
                return Err(RunError::Absent { nodes, patience });
            }
            match self.events.recv_timeout(Duration::from_millis(50)) {
                Ok(Event::Alive(key, alive)) => self.liveliness_changed(&key, alive),
                // Nothing is asked of the epoch to come, so nothing can be an answer.
                Ok(Event::Report(_) | Event::Field(_) | Event::Snapshot(_)) => self.refused += 1,
                Err(_) => {}
            }
        }
        let mut manifests = BTreeMap::new();
        for node in &self.nodes.clone() {
            let answer = self.link.query(&keys::manifest(&self.run, node), patience)?;
            // It was here; whoever of it is left does not hear.
            let Some(answer) = answer.first() else { return Err(self.lost(node.clone(), "its start".into())) };
            let manifest: Manifest = codec::decode("manifest", &answer.payload)?;
            if let Some(difference) = difference(&manifest, &self.run, scene_hash) {
                return Err(RunError::Foreign { node: node.clone(), difference });
            }
            self.current.insert(node.clone(), manifest.instance.clone());
            manifests.insert(node.clone(), manifest);
        }
        Ok(manifests)
    }

    /// What the fields held at the end, as the nodes said when they left.
    #[must_use]
    pub fn final_fields(&self) -> Vec<FieldSummary> {
        summary::told_apart(self.final_reports.iter().map(|(node, fields)| (node.as_str(), fields.clone())))
    }

    /// Nodes that ended without a word about their fields.
    #[must_use]
    pub fn without_final_report(&self) -> Vec<String> {
        self.nodes.iter().filter(|node| !self.final_reports.contains_key(*node)).cloned().collect()
    }

    /// Messages refused so far.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }
}

fn difference(manifest: &Manifest, run: &str, scene_hash: u64) -> Option<String> {
    if manifest.schema != SCHEMA_VERSION {
        Some(format!("it speaks schema {}, this coordinator {SCHEMA_VERSION}", manifest.schema))
    } else if manifest.run != run {
        Some(format!("it takes part in run `{}`", manifest.run))
    } else if manifest.scene_hash != scene_hash {
        Some("it was started with another scene or other --set values".into())
    } else {
        None
    }
}
