//! The coordinator's side of the link: finds the nodes, checks that they fit together, has them iterate.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::mpsc::{Receiver, RecvTimeoutError},
    time::{Duration, Instant},
};

use prost::Message as _;
use stagger_messages::{
    Decision, Directive, Envelope, FieldSummary, Iterate, Manifest, MessageError, Plan, Ports, Ready, Report,
    SCHEMA_VERSION, Stop, Version, codec, directive, keys, report,
};
use stagger_solver::coupling::{ControlError, Ensemble, Outcome, PlanError, Task};

use crate::link::{Arrival, Declared, Link, LinkError, Outlet};

/// How often an unanswered question is put again.
const ASK_AGAIN: Duration = Duration::from_secs(2);
/// How often the plan is put until all nodes are ready.
const PLAN_AGAIN: Duration = Duration::from_millis(250);
/// How long nodes have to leave.
const FAREWELL: Duration = Duration::from_secs(5);

/// Why a run ended before its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The step control gave up, or a node cannot go on.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The nodes do not fit together.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A message that should have been one of ours.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// Nodes that never announced themselves.
    #[error("{} did not announce themselves within {} s: look at their messages above", .nodes.join(", "), .patience.as_secs())]
    Absent {
        /// The nodes.
        nodes: Vec<String>,
        /// How long they had.
        patience: Duration,
    },
    /// A node of another scene or another version.
    #[error("node `{node}` does not belong to this run: {difference}")]
    Foreign {
        /// The node.
        node: String,
        /// What differs.
        difference: String,
    },
    /// A node that ended.
    #[error("node `{node}` is gone, in {at}: {last_words}")]
    Lost {
        /// The node.
        node: String,
        /// What it was asked for.
        at: String,
        /// The last it said.
        last_words: String,
    },
    /// A node failed before its start.
    #[error("node `{node}` cannot start: {message}")]
    Start {
        /// The node.
        node: String,
        /// Its words.
        message: String,
    },
    /// The user asked to stop before the first step.
    #[error("interrupted before the start")]
    Interrupted,
}

/// What the coordinator hears.
enum Event {
    Report(Arrival),
    Alive(String, bool),
}

/// What the coordinator needs from who started the nodes.
pub trait Keeper {
    /// What a node said last, for the message about its end.
    fn last_words(&mut self, node: &str) -> String;
    /// Whether the user wants the run to end.
    fn interrupted(&self) -> bool;
    /// A node whose process has ended before it announced itself.
    fn ended_early(&mut self) -> Option<String>;
}

/// The nodes of a run at the other end of the link.
pub struct Remote<'a> {
    link: Link,
    run: String,
    epoch: u32,
    sequence: u64,
    directives: Outlet,
    events: Receiver<Event>,
    keeper: &'a mut dyn Keeper,
    nodes: BTreeSet<String>,
    alive: BTreeSet<String>,
    farewells: BTreeMap<String, Vec<FieldSummary>>,
    refused: u64,
    _declared: Vec<Declared>,
}

impl<'a> Remote<'a> {
    /// Listens for the nodes of `run`.
    ///
    /// # Errors
    /// The link fails.
    pub fn new(link: Link, run: &str, nodes: BTreeSet<String>, keeper: &'a mut dyn Keeper) -> Result<Self, LinkError> {
        let (sender, events) = std::sync::mpsc::channel();
        let reports = sender.clone();
        // A coordinator that has ended needs no more events.
        let declared = vec![
            link.subscribe(&keys::reports(run), move |arrival| {
                let _ = reports.send(Event::Report(arrival));
            })?,
            link.watch(&keys::live_all(run), move |key, alive| {
                let _ = sender.send(Event::Alive(key, alive));
            })?,
            link.announce(&keys::live(run, "coordinator", &std::process::id().to_string()))?,
        ];
        let directives = link.publisher(keys::directive(run))?;
        Ok(Self {
            link,
            run: run.into(),
            epoch: 1,
            sequence: 0,
            directives,
            events,
            keeper,
            nodes,
            alive: BTreeSet::new(),
            farewells: BTreeMap::new(),
            refused: 0,
            _declared: declared,
        })
    }

    /// Waits until every node has announced itself, and asks each for its ports.
    ///
    /// # Errors
    /// A node does not come, or belongs to another run.
    pub fn gather(&mut self, scene_hash: u64, patience: Duration) -> Result<BTreeMap<String, Manifest>, RunError> {
        let begun = Instant::now();
        while !self.nodes.is_subset(&self.alive) {
            if self.keeper.interrupted() {
                return Err(RunError::Interrupted);
            }
            if let Some(node) = self.keeper.ended_early() {
                return Err(self.lost(node, "its start".into()));
            }
            if begun.elapsed() > patience {
                let nodes = self.nodes.difference(&self.alive).map(|node| format!("`{node}`")).collect();
                return Err(RunError::Absent { nodes, patience });
            }
            match self.events.recv_timeout(Duration::from_millis(50)) {
                Ok(Event::Alive(key, alive)) => self.hear_life(&key, alive),
                // Nothing is asked yet, so no report can be an answer.
                Ok(Event::Report(_)) => self.refused += 1,
                Err(_) => {}
            }
        }
        let mut manifests = BTreeMap::new();
        for node in &self.nodes {
            let answer = self.link.ask(&keys::manifest(&self.run, node), patience)?;
            let Some(answer) = answer.first() else {
                return Err(RunError::Absent { nodes: vec![format!("`{node}`")], patience });
            };
            let manifest: Manifest = codec::decode("manifest", &answer.payload)?;
            if let Some(difference) = difference(&manifest, &self.run, scene_hash) {
                return Err(RunError::Foreign { node: node.clone(), difference });
            }
            manifests.insert(node.clone(), manifest);
        }
        Ok(manifests)
    }

    /// What the fields held at the end, as the nodes said when they left.
    #[must_use]
    pub fn final_fields(&self) -> Vec<FieldSummary> {
        let mut fields: Vec<_> = self.farewells.values().flatten().cloned().collect();
        fields.sort_by(|a, b| a.field.cmp(&b.field));
        fields
    }

    /// Messages refused so far.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    fn hear_life(&mut self, key: &str, alive: bool) {
        let node = keys::parse_live(key).map(|(node, _)| node).filter(|node| self.nodes.contains(*node));
        if let Some(node) = node {
            if alive {
                self.alive.insert(node.into());
            } else {
                self.alive.remove(node);
            }
        }
    }

    fn lost(&mut self, node: String, at: String) -> RunError {
        let last_words = self.keeper.last_words(&node);
        RunError::Lost { node, at, last_words }
    }

    fn direct(&mut self, about: Envelope, decision: Option<&Decision>, task: directive::Task) -> Result<(), LinkError> {
        let envelope = Envelope {
            run: self.run.clone(),
            schema: SCHEMA_VERSION,
            epoch: self.epoch,
            sender: "coordinator".into(),
            sequence: self.sequence,
            ..about
        };
        self.sequence += 1;
        let directive = Directive { envelope: Some(envelope), decision: decision.cloned(), task: Some(task) };
        self.directives.put(None, directive.encode_to_vec().into())
    }

    /// The next report of this epoch about `version`, or `None` when none comes in time.
    fn hear(&mut self, version: Version, patience: Duration) -> Result<Option<(String, report::Body)>, RunError> {
        let deadline = Instant::now() + patience;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(left) {
                Ok(Event::Report(arrival)) => match codec::decode::<Report>("report", &arrival.payload) {
                    Ok(Report { envelope: Some(envelope), body: Some(body) }) if self.expects(&envelope) => {
                        if envelope.version == Some(version) {
                            return Ok(Some((envelope.sender, body)));
                        }
                    }
                    _ => self.refused += 1,
                },
                Ok(Event::Alive(key, alive)) => {
                    self.hear_life(&key, alive);
                    if let Some(node) = self.nodes.difference(&self.alive).next().cloned() {
                        return Err(self.lost(node, version.to_string()));
                    }
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return Ok(None),
            }
        }
    }

    fn expects(&self, envelope: &Envelope) -> bool {
        envelope.run == self.run
            && envelope.schema == SCHEMA_VERSION
            && envelope.epoch == self.epoch
            && self.nodes.contains(&envelope.sender)
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

/// Ports by node.
#[must_use]
pub fn ports(manifests: &BTreeMap<String, Manifest>) -> BTreeMap<String, Ports> {
    manifests.iter().map(|(node, manifest)| (node.clone(), manifest.ports.clone().unwrap_or_default())).collect()
}

impl Ensemble for Remote<'_> {
    type Error = RunError;

    fn start(&mut self, plan: &Plan) -> Result<Vec<(String, Ready)>, RunError> {
        let mut ready: BTreeMap<String, Ready> = BTreeMap::new();
        while ready.len() < self.nodes.len() {
            if self.keeper.interrupted() {
                return Err(RunError::Interrupted);
            }
            let about = Envelope { version: Some(Version::INITIAL), ..Envelope::default() };
            self.direct(about, None, directive::Task::Plan(plan.clone()))?;
            let again = Instant::now() + PLAN_AGAIN;
            while ready.len() < self.nodes.len() && Instant::now() < again {
                match self.hear(Version::INITIAL, again.saturating_duration_since(Instant::now()))? {
                    Some((node, report::Body::Ready(body))) => {
                        ready.insert(node, body);
                    }
                    Some((node, report::Body::Failure(failure))) => {
                        return Err(RunError::Start { node, message: failure.message });
                    }
                    Some(_) | None => {}
                }
            }
        }
        Ok(plan.order.iter().filter_map(|node| Some((node.clone(), ready.remove(node)?))).collect())
    }

    fn iterate(&mut self, before: Option<&Decision>, task: &Task) -> Result<Vec<Outcome>, RunError> {
        let about = Envelope {
            version: Some(task.version),
            t_s: task.window.t_s,
            dt_s: task.window.dt_s,
            ..Envelope::default()
        };
        let ask = |again| directive::Task::Iterate(Iterate { committed: Some(task.committed), again });
        self.direct(about.clone(), before, ask(false))?;
        let mut outcomes: BTreeMap<String, Outcome> = BTreeMap::new();
        while outcomes.len() < self.nodes.len() {
            let Some((node, body)) = self.hear(task.version, ASK_AGAIN)? else {
                // A node that still solves ignores this; one whose reply was lost gives it again.
                self.direct(about.clone(), before, ask(true))?;
                continue;
            };
            let result = match body {
                report::Body::Done(done) => Ok(done),
                report::Body::Failure(failure) => Err(failure),
                report::Body::Ready(_) | report::Body::Farewell(_) => continue,
            };
            let failed = result.is_err();
            outcomes.insert(node.clone(), Outcome { node, result });
            if failed {
                // Nodes further on wait for fields that will not come; the next directive finds them waiting.
                break;
            }
        }
        Ok(outcomes.into_values().collect())
    }

    fn finish(&mut self, last: Option<&Decision>, completed: bool, reason: &str) -> Result<(), RunError> {
        let version = last.and_then(|decision| decision.version);
        let about = Envelope { version: version.or(Some(Version::INITIAL)), ..Envelope::default() };
        let stop = Stop { completed, reason: reason.into() };
        self.direct(about, last, directive::Task::Stop(stop))?;
        let deadline = Instant::now() + FAREWELL;
        while self.farewells.len() < self.alive.len() && Instant::now() < deadline {
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(event) = self.events.recv_timeout(left) else { break };
            let Event::Report(arrival) = event else { continue };
            let Ok(report) = codec::decode::<Report>("report", &arrival.payload) else { continue };
            if let (Some(envelope), Some(report::Body::Farewell(farewell))) = (report.envelope, report.body)
                && self.expects(&envelope)
            {
                self.farewells.insert(envelope.sender, farewell.fields);
            }
        }
        Ok(())
    }
}
