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

/// After how long an unanswered question is put again, at first; then after twice as long each time.
const ASK_AGAIN: Duration = Duration::from_secs(2);
/// The same for the plan.
const PLAN_AGAIN: Duration = Duration::from_millis(250);
/// How long a node may work on one answer before it is taken for dead.
const NO_ANSWER: Duration = Duration::from_secs(600);
/// How long a user who wants the run to end waits for the step under way.
const INTERRUPTED: Duration = Duration::from_secs(10);
/// How long nodes have to leave.
const FAREWELL: Duration = Duration::from_secs(5);
/// How long last words may come after the end of their node's token.
const OVERTAKEN: Duration = Duration::from_millis(300);
/// How often they are told.
const STOP_AGAIN: Duration = Duration::from_secs(1);

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
    /// A node that is there but gives no answer.
    #[error("node `{node}` has not answered for {} s, in {at}", .patience.as_secs())]
    Silent {
        /// The node.
        node: String,
        /// What it was asked for.
        at: String,
        /// How long it had.
        patience: Duration,
    },
    /// The user asked to stop before the first step, or the step under way does not end.
    #[error("interrupted")]
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
    order: Vec<String>,
    farewells: BTreeMap<String, Vec<FieldSummary>>,
    finished: bool,
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
            order: Vec::new(),
            farewells: BTreeMap::new(),
            finished: false,
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

    /// Nodes that ended without a word about their fields.
    #[must_use]
    pub fn without_farewell(&self) -> Vec<String> {
        self.nodes.iter().filter(|node| !self.farewells.contains_key(*node)).cloned().collect()
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
        let directive =
            Directive { envelope: Some(envelope), decision: decision.cloned(), task: Some(task), checkpoint: false };
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

    /// Whether all nodes have answered, or all before one that failed: those after it may wait for its fields.
    fn complete(&self, outcomes: &BTreeMap<String, Outcome>) -> bool {
        let answers = self.order.iter().map(|node| outcomes.get(node));
        for answer in answers {
            match answer {
                None => return false,
                Some(outcome) if outcome.result.is_err() => return true,
                Some(_) => {}
            }
        }
        true
    }

    fn check_silence(&self, since: Instant, answered: impl Fn(&str) -> bool, at: &str) -> Result<(), RunError> {
        if since.elapsed() < NO_ANSWER {
            return Ok(());
        }
        let silent = self.order.iter().find(|node| !answered(node)).cloned().unwrap_or_default();
        Err(RunError::Silent { node: silent, at: at.into(), patience: NO_ANSWER })
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
        self.order.clone_from(&plan.order);
        let mut ready: BTreeMap<String, Ready> = BTreeMap::new();
        let mut patience = PLAN_AGAIN;
        let begun = Instant::now();
        while ready.len() < self.nodes.len() {
            if self.keeper.interrupted() {
                return Err(RunError::Interrupted);
            }
            self.check_silence(begun, |node| ready.contains_key(node), "its start")?;
            let about = Envelope { version: Some(Version::INITIAL), ..Envelope::default() };
            self.direct(about, None, directive::Task::Plan(plan.clone()))?;
            let again = Instant::now() + patience;
            patience = (2 * patience).min(ASK_AGAIN);
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
        let ask =
            |again| directive::Task::Iterate(Iterate { committed: Some(task.committed), again, ..Iterate::default() });
        self.direct(about.clone(), before, ask(false))?;
        let mut outcomes: BTreeMap<String, Outcome> = BTreeMap::new();
        let begun = Instant::now();
        let (mut patience, mut interrupted) = (ASK_AGAIN, None);
        while !self.complete(&outcomes) {
            let Some((node, body)) = self.hear(task.version, patience.min(ASK_AGAIN))? else {
                if self.keeper.interrupted() && interrupted.get_or_insert_with(Instant::now).elapsed() > INTERRUPTED {
                    return Err(RunError::Interrupted);
                }
                self.check_silence(begun, |node| outcomes.contains_key(node), &task.version.to_string())?;
                if begun.elapsed() >= patience {
                    // A node that still solves takes this for later; one whose message was lost sends it again.
                    self.direct(about.clone(), before, ask(true))?;
                    patience *= 2;
                }
                continue;
            };
            let result = match body {
                report::Body::Done(done) => Ok(done),
                report::Body::Failure(failure) => Err(failure),
                report::Body::Ready(_) | report::Body::Farewell(_) => continue,
            };
            outcomes.insert(node.clone(), Outcome { node, result });
        }
        // Up to the first failure in the order of solving, whoever answered first: the same decision every time.
        let mut in_order = Vec::new();
        for node in &self.order {
            let Some(outcome) = outcomes.remove(node) else { break };
            let failed = outcome.result.is_err();
            in_order.push(outcome);
            if failed {
                break;
            }
        }
        Ok(in_order)
    }

    fn finish(&mut self, last: Option<&Decision>, completed: bool, reason: &str) -> Result<(), RunError> {
        if std::mem::replace(&mut self.finished, true) {
            return Ok(());
        }
        let version = last.and_then(|decision| decision.version);
        let about = Envelope { version: version.or(Some(Version::INITIAL)), ..Envelope::default() };
        let stop = directive::Task::Stop(Stop { completed, reason: reason.into() });
        self.direct(about.clone(), last, stop.clone())?;
        let mut deadline = Instant::now() + FAREWELL;
        while self.farewells.len() < self.nodes.len() && Instant::now() < deadline {
            if self.alive.iter().all(|node| self.farewells.contains_key(node)) {
                // A token's end may overtake the node's last words.
                deadline = deadline.min(Instant::now() + OVERTAKEN);
            }
            let left = deadline.saturating_duration_since(Instant::now());
            let arrival = match self.events.recv_timeout(STOP_AGAIN.min(left)) {
                Ok(Event::Report(arrival)) => arrival,
                Ok(Event::Alive(key, alive)) => {
                    self.hear_life(&key, alive);
                    continue;
                }
                Err(_) => {
                    self.direct(about.clone(), last, stop.clone())?;
                    continue;
                }
            };
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
