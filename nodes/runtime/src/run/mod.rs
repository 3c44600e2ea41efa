//! `stagger run`: the whole scene, from the launch of its nodes to the summary.

pub mod in_process;
pub mod interrupt;
pub mod outputs;
pub mod records;
pub mod resume;
pub mod scene_files;
pub mod summary;
pub mod view;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use stagger_coupling::{COORDINATOR, End, Participant};
use stagger_messages::{Checkpoint, keys};
use stagger_recordings::{RecordingError, RunInfo};
use stagger_scene::{ParticipantError, Scene};

use crate::{
    coordinator::{
        Conditions, Coordinator, RunError, Supervisor,
        sinks::{Sink, Sinks},
    },
    diagnostics,
    launch::{
        Common, Launcher,
        roster::{Runs, roster},
    },
    link::{
        Link, LinkError, Role, Sample,
        endpoint::{Endpoint, EndpointError},
    },
    node::recorded::{Replayed, ReplayedError, Replays},
    run::{
        in_process::Threads,
        outputs::OutputError,
        records::{Recording, Target},
        summary::{FinalField, Summary},
    },
};

/// How long nodes that somebody starts by hand have to announce themselves.
const PATIENCE_BY_HAND: Duration = Duration::from_secs(600);
/// How long another coordinator may take to answer that it has the run's name.
const TAKEN: Duration = Duration::from_secs(2);

/// What is asked for beside the scene.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// File of the scene, for the nodes.
    pub scene: PathBuf,
    /// `--set` values.
    pub overrides: Vec<(String, String)>,
    /// Recording that holds the scene's files where they are not beside it.
    pub files: Option<PathBuf>,
    /// Whether the nodes cannot read the scene and its files themselves: it came from a pipe.
    pub hand_over: bool,
    /// Recording to write; `None` writes none.
    pub record: Option<Target>,
    /// Nodes as threads instead of processes.
    pub in_process: bool,
    /// Threads of each node.
    pub threads: Option<usize>,
    /// Nodes replaced by commands.
    pub commands: BTreeMap<String, Vec<String>>,
    /// Nodes replaced by recorded ones.
    pub replays: Replays,
    /// The bridge to show the run in while it goes on.
    pub view: Option<PathBuf>,
    /// Where nodes started by hand are met; `None` starts them all here.
    pub by_hand: Option<Role>,
    /// Name of the run; `None` makes one.
    pub name: Option<String>,
    /// Zenoh configuration file.
    pub config: Option<PathBuf>,
    /// The checkpoint to go on from; `None` starts at t = 0.
    pub resume: Option<Checkpoint>,
}

/// Why a run did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum Failed {
    /// The run itself.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The link.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A node that cannot be built.
    #[error(transparent)]
    Participant(#[from] ParticipantError),
    /// A recorded node that cannot stand in.
    #[error(transparent)]
    Replayed(#[from] ReplayedError),
    /// The recording's file.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The hub's endpoint.
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    /// The viewer.
    #[error(transparent)]
    View(#[from] view::ViewError),
    /// Another coordinator of the same name, behind the same router.
    #[error("run `{0}` has a coordinator already\nhint: give this one another name with --run")]
    Taken(String),
    /// A file or a process.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// What the system said.
        source: std::io::Error,
    },
}

fn io(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> Failed {
    move |source| Failed::Io { what: what.into(), source }
}

/// A run that did not come to its end.
#[derive(Debug)]
pub struct Stopped {
    /// Why.
    pub why: Failed,
    /// Where it is recorded until then; `None` where it had not begun, or is not recorded.
    pub recording: Option<PathBuf>,
}

/// Runs a scene. `interrupted` ends it after the current step.
///
/// # Errors
/// A node, the link or the recording fails. What was recorded until then is kept.
pub fn run(scene: &Scene, options: Options, interrupted: &Arc<AtomicBool>) -> Result<Summary, Stopped> {
    let mut recording = None;
    go(scene, options, interrupted, &mut recording).map_err(|why| Stopped { why, recording })
}

fn go(
    scene: &Scene,
    options: Options,
    interrupted: &Arc<AtomicBool>,
    recorded_in: &mut Option<PathBuf>,
) -> Result<Summary, Failed> {
    let mut nodes = roster(scene);
    nodes.extend(options.commands.iter().map(|(node, command)| (node.clone(), Runs::Command(command.clone()))));
    nodes.extend(options.replays.files.iter().map(|(node, file)| (node.clone(), Runs::Recorded(file.clone()))));
    let run = options.name.clone().unwrap_or_else(|| run_name(&options.scene));
    let (role, mut endpoint) = match &options.by_hand {
        Some(role) => (role.clone(), Endpoint::elsewhere("")),
        None => {
            let endpoint = Endpoint::new(&run)?;
            (Role::Hub { listen: vec![endpoint.name.clone()] }, endpoint)
        }
    };
    let own_name = matches!(role, Role::Node { .. }).then_some(COORDINATOR);
    let link = Link::open_as(&role, options.config.as_deref(), own_name)?;
    endpoint.listened();
    // It is there until the run is over, whoever else holds it.
    let endpoint = Arc::new(Mutex::new(endpoint));
    if matches!(role, Role::Node { .. }) && !link.query(&keys::manifest(&run, "coordinator"), TAKEN)?.is_empty() {
        return Err(Failed::Taken(run));
    }
    let info = run_info(&run, scene, &options);
    let mut recording = match &options.record {
        Some(target) => Some(Recording::start(target, &info, scene, interrupted)?),
        None => None,
    };
    let mut viewer = match &options.view {
        Some(bridge) => Some(view::Stream::start(bridge, &info, &[], false)?),
        None => None,
    };
    let file = recording.as_mut().map(|recording| recording as &mut dyn Sink);
    let shown = viewer.as_mut().map(|viewer| viewer as &mut dyn Sink);
    let sinks = Sinks::attach(&link, &run, file.into_iter().chain(shown).collect())?;
    let about = Sample {
        key: keys::manifest(&run, COORDINATOR),
        attachment: bytes::Bytes::new(),
        payload: serde_json::to_vec(&info).map_err(std::io::Error::from).map_err(io("cannot describe the run"))?.into(),
    };
    let _about = link.queryable(&about.key.clone(), move || vec![about.clone()])?;
    let by_hand = options.by_hand.is_some();
    let conditions = Conditions {
        run: run.clone(),
        nodes: nodes.keys().cloned().collect(),
        patience: if by_hand { PATIENCE_BY_HAND } else { Duration::from_secs_f64(scene.recovery.start_s) },
        resume: options.resume.clone(),
        schedule: options.replays.schedule.clone(),
        interrupted: Arc::clone(interrupted),
    };
    let mut supervisor = start_nodes(scene, &options, &run, &nodes, &link, &role, &endpoint, interrupted)?;
    let ended = Coordinator::new(scene, link.clone(), supervisor.as_mut(), sinks, conditions)?.run();
    *recorded_in = recording.as_ref().and_then(Recording::path).cloned();
    // All has been heard: the file is whole before anything that may take its time.
    if let Some(viewer) = viewer {
        viewer.finish_or_warn();
    }
    let recording = recording.map_or(Ok(None), |recording| recording.finish(ended.waited));
    drop(supervisor);
    let closed = link.close();
    let end = ended.result.map_err(|error| match error {
        RunError::Output(error) => Failed::Output(error),
        error => Failed::Run(error),
    })?;
    if let Err(error) = closed {
        // A reader that takes nothing, such as a stopped viewer: the run is complete without it.
        diagnostics::warn(&format!("{error}: a reader of the run does not answer; nothing of the run is missing"));
    }
    let monitor = ended.monitor;
    Ok(Summary {
        format: summary::FORMAT,
        run,
        title: scene.title.clone(),
        completed: end == End::Completed,
        wall_s: ended.wall_s,
        exchanges: monitor.nodes.values().map(|work| work.exchanges).sum(),
        bytes: monitor.nodes.values().map(|work| work.bytes).sum(),
        refused: ended.refused + monitor.nodes.values().map(|work| work.refused).sum::<u64>(),
        imbalance: monitor.ledger.imbalances(),
        on_the_way: monitor.ledger.on_the_way(),
        ledger: monitor.ledger.nodes().clone(),
        steps: monitor.steps,
        nodes: monitor.nodes,
        hash: summary::hash(&ended.fields),
        fields: ended.fields.iter().map(FinalField::from).collect(),
        missing: ended.missing,
        restarts: ended.restarts,
        recording: recording?,
    })
}

/// Starts the nodes, or what there is of them: those that somebody starts by hand come by themselves.
fn start_nodes(
    scene: &Scene,
    options: &Options,
    run: &str,
    nodes: &BTreeMap<String, Runs>,
    link: &Link,
    role: &Role,
    endpoint: &Arc<Mutex<Endpoint>>,
    interrupted: &Arc<AtomicBool>,
) -> Result<Box<dyn Supervisor>, Failed> {
    let mut participants: BTreeMap<String, Box<dyn Participant>> = BTreeMap::new();
    if options.in_process {
        for (node, runs) in nodes {
            let participant = match runs {
                Runs::Physics(kind) => scene.participant(node, kind)?,
                Runs::Recorded(file) => Box::new(Replayed::open(file, node)?),
                Runs::Command(_) => return Err(ParticipantError::Command(node.clone()).into()),
            };
            participants.insert(node.clone(), participant);
        }
        return Ok(Box::new(Threads::start(link, run, scene.hash, participants, Arc::clone(interrupted))?));
    }
    if options.by_hand.is_some() {
        // Those of recordings need no process of their own.
        for (node, file) in &options.replays.files {
            participants.insert(node.clone(), Box::new(Replayed::open(file, node)?));
        }
        let awaited: Vec<_> =
            nodes.keys().filter(|name| !participants.contains_key(*name)).map(String::as_str).collect();
        diagnostics::note(&format!("run {run} waits on {} for {}", role.endpoints(), awaited.join(", ")));
        let recorded = Threads::start(link, run, scene.hash, participants, Arc::clone(interrupted))?;
        return Ok(Box::new(ByHand { interrupted: Arc::clone(interrupted), recorded }));
    }
    let (connect, handed_over) = {
        let mut endpoint = endpoint.lock().unwrap_or_else(PoisonError::into_inner);
        (endpoint.name.clone(), if options.hand_over { endpoint.hand_over(scene)? } else { None })
    };
    let common = Common {
        run: run.to_owned(),
        connect,
        scene: handed_over.as_ref().map_or(&options.scene, |handed| &handed.scene).clone(),
        overrides: options.overrides.clone(),
        files: handed_over.and_then(|handed| handed.files).or(options.files.clone()),
        scene_hash: scene.hash,
        threads: options.threads,
    };
    let launcher = Launcher::start(nodes, common, Arc::clone(endpoint), Arc::clone(interrupted));
    Ok(Box::new(launcher.map_err(io("cannot start the nodes"))?))
}

/// Nodes started by somebody else, and those of recordings.
struct ByHand {
    interrupted: Arc<AtomicBool>,
    recorded: Threads,
}

impl Supervisor for ByHand {
    fn why_it_ended(&mut self, node: &str) -> String {
        if self.recorded.has(node) {
            return self.recorded.why_it_ended(node);
        }
        "it was started by hand: look at its own messages".into()
    }

    fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn ended_early(&mut self) -> Option<String> {
        self.recorded.ended_early()
    }

    fn restart(&mut self, node: &str) -> Result<(), String> {
        if self.recorded.has(node) {
            return self.recorded.restart(node);
        }
        diagnostics::note(&format!("waiting for `{node}` to be started again by hand"));
        Ok(())
    }
}

/// `<scene>-<unix seconds>-<process>`: unique on this host, and legal in a key.
fn run_name(scene: &Path) -> String {
    let stem = scene.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let legal: String = stem
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '-' })
        .take(32)
        .collect();
    // A name that begins with `-` is an option to every program it is given to.
    let legal = match legal.trim_start_matches('-') {
        "" => "run",
        legal => legal,
    };
    format!("{legal}-{}-{}", unix_time().as_secs(), std::process::id())
}

fn unix_time() -> Duration {
    // A clock before 1970 is wrong anyway.
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

fn run_info(run: &str, scene: &Scene, options: &Options) -> RunInfo {
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    RunInfo {
        run: run.into(),
        scene_file: options.scene.display().to_string(),
        scene_text: scene.text.clone(),
        files: scene.files.clone(),
        scene_hash: scene.hash,
        overrides: options.overrides.clone(),
        replayed: options.replays.files.iter().map(|(node, file)| (node.clone(), file.display().to_string())).collect(),
        commands: options.commands.iter().map(|(node, words)| (node.clone(), words.join(" "))).collect(),
        seed: scene.seed,
        program: concat!("stagger ", env!("CARGO_PKG_VERSION")).into(),
        started_unix_ns: u64::try_from(unix_time().as_nanos()).unwrap_or(u64::MAX),
        machine: BTreeMap::from([
            ("os".into(), std::env::consts::OS.into()),
            ("architecture".into(), std::env::consts::ARCH.into()),
            ("cores".into(), cores.to_string()),
        ]),
    }
}
