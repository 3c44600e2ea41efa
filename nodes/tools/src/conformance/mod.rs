//! `stagger conformance`: drives any node through the protocol and gives a verdict for each rule of it.
//!
//! The conformance process is the coordinator, and solves the other nodes of a scene itself, so that what the node
//! under test freezes is genuine. One process of the node goes through a *reference run*; each rule then repeats it in
//! a process of its own, with one disturbance that must make no difference, or one question that has one answer.

pub(crate) mod heard;
mod messages;
mod recovery;
mod reference;
mod report;
pub(crate) mod session;
mod start;
mod trials;

use stagger_runtime::launch::roster::{Runs, roster};
use std::{collections::BTreeMap, path::PathBuf, time::Duration};

use stagger_coupling::Participant;
use stagger_messages::Manifest;
use stagger_scene::{ParticipantError, Scene};

use crate::check;
use heard::Fault;
use reference::Reference;
pub use report::{Finding, Findings, Ruling};
use session::Session;

/// The scene that is played where none is given.
pub const SCENE: &str = include_str!("scene.toml");

/// What is checked, and in which scene.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The scene.
    pub scene: Scene,
    /// Its file; `None` where one is to be made of its text.
    pub scene_file: Option<PathBuf>,
    /// Recording that holds the scene's files where they are not beside it.
    pub files: Option<PathBuf>,
    /// The node's name.
    pub node: String,
    /// What runs it.
    pub runs: Runs,
    /// Name of the runs it takes part in.
    pub run: String,
    /// How long it may take to come and to answer.
    pub patience: Duration,
}

/// Why a node cannot be checked.
#[derive(Debug, thiserror::Error)]
pub enum ConformanceError {
    /// Another node of the scene cannot be built here.
    #[error(transparent)]
    Participant(#[from] ParticipantError),
    /// Another node of the scene is a command.
    #[error(
        "node `{0}` of the scene is a command of its own, but the other nodes are solved here: choose a scene of \
         built-in physics beside the node that is checked"
    )]
    Command(String),
    /// There is nothing to start.
    #[error("`{0}` is no built-in node of the scene: give its command after `--`")]
    NoCommand(String),
    /// Neither a name nor a command.
    #[error("say which node: --node NAME for one of the scene, or its command after `--`")]
    Nothing,
}

/// A rule of the protocol.
pub(crate) struct Rule {
    /// Its name.
    name: &'static str,
    /// What a node does that keeps it.
    sentence: &'static str,
    /// Rules without which it cannot be told.
    rests_on: &'static [&'static str],
    /// Tells whether a node keeps it.
    check: fn(&Bench, &Reference) -> Result<Kept, Fault>,
}

/// A rule that is not broken.
pub(crate) enum Kept {
    /// The node keeps it.
    Yes,
    /// It says nothing about this node, for this reason.
    NotApplicable(&'static str),
}

impl Bench {
    /// The node `name` of `scene`, run by `command`, or by what the scene says where there is none. Without a name it is
    /// the node of the scene whose fields the command writes, or else a new one.
    ///
    /// # Errors
    /// There is nothing to start, or another node of the scene cannot be built here.
    pub fn new(
        scene: Scene,
        scene_file: Option<PathBuf>,
        name: Option<String>,
        command: Vec<String>,
        patience: Duration,
    ) -> Result<Self, ConformanceError> {
        let nodes = roster(&scene);
        let runs = match (&name, command.is_empty()) {
            (_, false) => Runs::Command(command),
            (Some(name), true) => nodes.get(name).cloned().ok_or_else(|| ConformanceError::NoCommand(name.clone()))?,
            (None, true) => return Err(ConformanceError::Nothing),
        };
        let run = format!("conformance-{}", std::process::id());
        let mut bench = Self {
            scene,
            scene_file,
            files: None,
            node: name.clone().unwrap_or_else(|| "node".into()),
            runs,
            run,
            patience,
        };
        if name.is_none()
            && let Ok(session) = Session::start(&bench)
            && let Some(node) = bench.place_of(&session.manifest)?
        {
            bench.node = node;
        }
        bench.others()?;
        Ok(bench)
    }

    /// The node of the scene that writes a field this one writes.
    fn place_of(&self, manifest: &Manifest) -> Result<Option<String>, ConformanceError> {
        let ports = manifest.ports.as_ref().map(|ports| ports.writes.as_slice()).unwrap_or_default();
        let (nodes, _) = check::ports(&self.scene)?;
        let writes = |of: &stagger_messages::Ports| {
            of.writes.iter().any(|port| ports.iter().any(|ours| ours.field == port.field))
        };
        Ok(nodes.into_iter().find(|(_, ports)| writes(ports)).map(|(name, _)| name))
    }

    /// The other nodes of the scene.
    fn others(&self) -> Result<BTreeMap<String, Box<dyn Participant>>, ConformanceError> {
        let mut others = BTreeMap::new();
        for (name, runs) in roster(&self.scene) {
            match runs {
                _ if name == self.node => {}
                Runs::Physics(kind) => {
                    let built = self.scene.participant(&name, &kind)?;
                    others.insert(name, built);
                }
                Runs::Command(_) | Runs::Recorded(_) => return Err(ConformanceError::Command(name)),
            }
        }
        Ok(others)
    }

    /// Checks every rule; `told` hears each verdict as it is found.
    ///
    /// # Errors
    /// Another node of the scene cannot be built or started here. What the node under test does wrong is a finding.
    pub fn check(&self, mut told: impl FnMut(&Finding)) -> Result<Findings, ConformanceError> {
        let mut findings = Findings::new(self);
        let mut tell = |findings: &mut Findings, finding: Finding| {
            told(&finding);
            findings.rules.push(finding);
        };
        let reference = start::check(self, &mut |finding| tell(&mut findings, finding))?;
        for rule in [trials::RULES, messages::RULES, recovery::RULES].into_iter().flatten() {
            let failed = rule.rests_on.iter().find(|name| !findings.holds(name)).copied();
            let ruling = match (&reference, failed) {
                (None, _) => Ruling::NotApplicable { because: "the rules above come first".into() },
                (_, Some(name)) => Ruling::NotApplicable { because: format!("it rests on `{name}`") },
                (Some(reference), None) => (rule.check)(self, reference).into(),
            };
            tell(&mut findings, Finding { rule: rule.name, sentence: rule.sentence, ruling });
        }
        Ok(findings)
    }
}
