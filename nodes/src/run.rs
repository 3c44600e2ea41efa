//! `stagger run`: the whole scene, from the launch of its nodes to the summary.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use stagger_messages::{Checkpoint, Manifest, keys};
use stagger_recordings::{Exchange, Level, Recorder, RecorderOptions, RecordingError, RunInfo};
use stagger_solver::{
    coupling::Participant,
    coupling::{COORDINATOR, End, Ensemble as _, Precedent},
    scene::{self, Scene},
};

use crate::{
    coordinator::{Keeper, Remote, RunError},
    diagnostics,
    in_process::Threads,
    launcher::{Common, Launcher},
    link::{Arrival, Declared, Link, LinkError, Role},
    monitor::Monitor,
    pace::Pace,
    recovery::{self, Restart},
    replayed::{Replayed, ReplayedError, Replays},
    roster::{RosterError, Runs, participant, roster},
    shared_memory,
    summary::{self, FinalField, Recorded, Summary},
    view,
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
    /// Recording to write; `None` writes none.
    pub record: Option<PathBuf>,
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
    Roster(#[from] RosterError),
    /// A recorded node that cannot stand in.
    #[error(transparent)]
    Replayed(#[from] ReplayedError),
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

/// Runs a scene. `interrupted` ends it after the current step.
///
/// # Errors
/// A node, the link or the recording fails. What was recorded until then is kept.
pub fn run(scene: &Scene, options: Options, interrupted: &Arc<AtomicBool>) -> Result<Summary, Failed> {
    let mut nodes = roster(scene);
    nodes.extend(options.commands.iter().map(|(node, command)| (node.clone(), Runs::Command(command.clone()))));
    nodes.extend(options.replays.files.iter().map(|(node, file)| (node.clone(), Runs::Recorded(file.clone()))));
    let run = options.name.clone().unwrap_or_else(|| run_name(&options.scene));
    let (role, endpoint) = match &options.by_hand {
        Some(role) => (role.clone(), None),
        None => {
            let endpoint = Endpoint::new(&run, None)?;
            (Role::Hub { listen: vec![endpoint.name.clone()] }, Some(endpoint))
        }
    };
    let own_name = matches!(role, Role::Node { .. }).then_some(COORDINATOR);
    let link = Link::open_as(&role, options.config.as_deref(), own_name)?;
    if matches!(role, Role::Node { .. }) && !link.ask(&keys::manifest(&run, "coordinator"), TAKEN)?.is_empty() {
        return Err(Failed::Taken(run));
    }
    let info = run_info(&run, scene, &options);
    let mut records = Records::start(&link, &info, scene, &options)?;
    let asked = Arrival {
        key: keys::manifest(&run, "coordinator"),
        attachment: bytes::Bytes::new(),
        payload: serde_json::to_vec(&info).map_err(std::io::Error::from).map_err(io("cannot describe the run"))?.into(),
    };
    let _about = link.answer(&asked.key.clone(), move || vec![asked.clone()])?;
    let names: BTreeSet<String> = nodes.keys().cloned().collect();
    let common = Common {
        run: run.clone(),
        connect: endpoint.as_ref().map(|endpoint| endpoint.name.clone()).unwrap_or_default(),
        scene: options.scene.clone(),
        overrides: options.overrides.clone(),
        files: options.files.clone(),
        scene_hash: scene.hash,
        threads: options.threads,
    };
    let mut keeper: Box<dyn Keeper> = if options.in_process {
        let mut participants = BTreeMap::new();
        for (node, runs) in &nodes {
            match runs {
                Runs::Physics(kind) => participants.insert(node.clone(), participant(scene, node, kind)?),
                Runs::Recorded(file) => participants.insert(node.clone(), Box::new(Replayed::open(file, node)?)),
                Runs::Command(_) => return Err(RosterError::Kind(format!("{node} (a command, in one process)")).into()),
            };
        }
        Box::new(Threads::start(&link, &run, scene.hash, participants, Arc::clone(interrupted))?)
    } else if options.by_hand.is_some() {
        // Those of recordings need no process of their own.
        let mut participants: BTreeMap<String, Box<dyn Participant>> = BTreeMap::new();
        for (node, file) in &options.replays.files {
            participants.insert(node.clone(), Box::new(Replayed::open(file, node)?));
        }
        let awaited = names.iter().filter(|name| !participants.contains_key(*name)).cloned().collect();
        diagnostics::note(&format!("run {run} waits on {} for {}", role.endpoints(), join(&awaited)));
        let recorded = Threads::start(&link, &run, scene.hash, participants, Arc::clone(interrupted))?;
        Box::new(ByHand { interrupted: Arc::clone(interrupted), recorded })
    } else {
        let launcher = Launcher::start(&nodes, common, Arc::clone(interrupted));
        Box::new(launcher.map_err(io("cannot start the nodes"))?)
    };
    let by_hand = options.by_hand.is_some();
    let patience = if by_hand { PATIENCE_BY_HAND } else { Duration::from_secs_f64(scene.recovery.start_s) };
    let hang = Duration::from_secs_f64(scene.recovery.hang_s);
    let mut monitor = Monitor::new(scene.duration_s, Arc::clone(interrupted));
    monitor.rejections = scene.coupling.rejections;
    monitor.pace = records.file.as_ref().map(|(_, recorder)| Pace::of(recorder.sender()));
    let resume = options.resume.clone();
    let mut remote = Remote::new(link.clone(), &run, names, hang, resume, keeper.as_mut())?;
    let mut restarts = Vec::new();
    let precedent = options.replays.precedent.as_ref();
    let ended = conduct(scene, &mut remote, &mut records, &mut monitor, precedent, patience, &mut restarts);
    let wall_s = monitor.finish();
    if let Err(error) = &ended {
        // The nodes may be gone themselves; the error above is the one to tell.
        let _ = remote.finish(None, false, &error.to_string());
    }
    let fields = remote.final_fields();
    let (refused, missing) = (remote.refused(), remote.without_farewell());
    drop(remote);
    // All has been heard: the file is whole before anything that may take its time.
    let waited = monitor.pace.as_ref().map_or(Duration::ZERO, |pace| pace.waited);
    let recording = records.finish(waited);
    drop(keeper);
    let closed = link.close();
    let end = ended?;
    if let Err(error) = closed {
        // A reader that takes nothing, such as a stopped viewer: the run is complete without it.
        diagnostics::warn(&format!("{error}: a reader of the run does not answer; nothing of the run is missing"));
    }
    Ok(Summary {
        format: summary::FORMAT,
        run,
        title: scene.title.clone(),
        completed: end == End::Completed,
        wall_s,
        exchanges: monitor.nodes.values().map(|work| work.exchanges).sum(),
        bytes: monitor.nodes.values().map(|work| work.bytes).sum(),
        refused: refused + monitor.nodes.values().map(|work| work.refused).sum::<u64>(),
        imbalance: monitor.ledger.imbalances(),
        ledger: monitor.ledger.nodes().clone(),
        steps: monitor.steps,
        nodes: monitor.nodes,
        hash: summary::hash(&fields),
        fields: fields.iter().map(FinalField::from).collect(),
        missing,
        restarts,
        recording: recording?,
    })
}

fn conduct(
    scene: &Scene,
    remote: &mut Remote<'_>,
    records: &mut Records,
    monitor: &mut Monitor,
    precedent: Option<&Arc<Precedent>>,
    patience: Duration,
    restarts: &mut Vec<Restart>,
) -> Result<End, RunError> {
    let manifests = recovery::gather(scene, remote, patience, restarts)?;
    records.manifests(&manifests);
    recovery::conduct(scene, remote, &manifests, monitor, precedent, patience, restarts)
}

fn join(names: &BTreeSet<String>) -> String {
    names.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// Nodes started by somebody else, and those of recordings.
struct ByHand {
    interrupted: Arc<AtomicBool>,
    recorded: Threads,
}

impl Keeper for ByHand {
    fn last_words(&mut self, node: &str) -> String {
        if self.recorded.has(node) {
            return self.recorded.last_words(node);
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
    let legal: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '-' }).collect();
    let legal = if legal.is_empty() { "run" } else { &legal[..legal.len().min(32)] };
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

/// The hub's endpoint: a socket in a folder of its own, which goes with the run.
pub struct Endpoint {
    /// Its name, as Zenoh and `--connect` take it.
    pub name: String,
    folder: Option<PathBuf>,
}

/// The folder of a run on this host, where `view` finds its socket by the run's name.
#[must_use]
pub fn socket_folder(run: &str) -> PathBuf {
    std::env::temp_dir().join(format!("stagger-{run}"))
}

impl Endpoint {
    /// The endpoint given, or a socket made for this run.
    ///
    /// # Errors
    /// The socket's folder cannot be made.
    pub fn new(run: &str, listen: Option<&str>) -> Result<Self, Failed> {
        if let Some(name) = listen {
            return Ok(Self { name: name.into(), folder: None });
        }
        let folder = socket_folder(run);
        private_folder(&folder).map_err(io(format!("cannot make {}", folder.display())))?;
        Ok(Self { name: socket(&folder), folder: Some(folder) })
    }
}

/// The endpoint in a run's folder.
#[must_use]
pub fn socket(folder: &Path) -> String {
    format!("unixsock-stream/{}", folder.join("hub.sock").display())
}

fn private_folder(folder: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::DirBuilderExt as _;
    std::fs::DirBuilder::new().mode(0o700).create(folder)
}

impl Drop for Endpoint {
    fn drop(&mut self) {
        if let Some(folder) = &self.folder {
            // A folder left behind in the temporary directory does no harm.
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

/// The recording of a run, and its stream to a viewer.
struct Records {
    file: Option<(PathBuf, Recorder)>,
    viewer: Option<view::Stream>,
    subscription: Option<Declared>,
    run: String,
    /// The fields to keep, where they are named.
    fields: Vec<String>,
}

impl Records {
    fn start(link: &Link, info: &RunInfo, scene: &Scene, options: &Options) -> Result<Self, Failed> {
        let recorder_options = RecorderOptions {
            level: match scene.record.level {
                scene::Level::All => Level::All,
                scene::Level::Accepted => Level::Accepted,
            },
            every: scene.record.every,
            checkpoints: scene.recovery.checkpoint_steps > 0,
            fields: scene.record.fields.clone().map(BTreeSet::from_iter),
            frame_period_s: (scene.record.frames > 0).then(|| scene.duration_s / scene.record.frames as f64),
            queue_bytes: usize::try_from(scene.record.buffer_bytes).unwrap_or(usize::MAX),
            ..RecorderOptions::default()
        };
        let mut records = Self {
            file: None,
            viewer: None,
            subscription: None,
            run: info.run.clone(),
            fields: scene.record.fields.clone().unwrap_or_default(),
        };
        if let Some(path) = &options.record {
            let what = format!("cannot write the recording {}", path.display());
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(io(what.clone()))?;
            }
            let file = std::fs::File::create(path).map_err(io(what))?;
            // The limit holds for files, not for pipes.
            let regular = file.metadata().is_ok_and(|about| about.is_file());
            let largest_bytes = shared_memory::largest_file_bytes().filter(|_| regular);
            let recorder_options = RecorderOptions { largest_bytes, ..recorder_options };
            records.file = Some((path.clone(), Recorder::create(file, info, recorder_options)?));
        }
        if let Some(bridge) = &options.view {
            records.viewer = Some(view::Stream::start(bridge, info, &[], false)?);
        }
        let file = records.file.as_ref().map(|(_, recorder)| recorder.sender());
        let viewer = records.viewer.as_ref().map(view::Stream::sender);
        if file.is_some() || viewer.is_some() {
            let behind = AtomicBool::new(false);
            records.subscription = Some(link.subscribe_first(&keys::all(&info.run), move |arrival| {
                let topic = keys::topic(&arrival.key);
                let Some(exchange) = Exchange::from_parts(topic, arrival.attachment, arrival.payload) else { return };
                // The run waits for its recording, but leaves a viewer behind.
                if let Some(viewer) = &viewer
                    && !behind.load(Ordering::Relaxed)
                    && (!viewer.has_room(&exchange) || viewer.push(exchange.clone()).is_err())
                {
                    behind.store(true, Ordering::Relaxed);
                    diagnostics::warn("the viewer has ended or cannot keep up: the run goes on without it");
                }
                // Transport threads must not wait: `Pace` does, and tells where the recording has ended.
                if let Some(file) = &file {
                    let _ = file.hand_over(exchange);
                }
            })?);
        }
        Ok(records)
    }

    fn manifests(&mut self, manifests: &BTreeMap<String, Manifest>) {
        use prost::Message as _;
        let ports = manifests.values().filter_map(|manifest| manifest.ports.as_ref());
        let written: BTreeSet<&str> = ports.flat_map(|ports| &ports.writes).map(|port| port.field.as_str()).collect();
        for field in self.fields.iter().filter(|field| !written.contains(field.as_str())) {
            let known = written.iter().copied().collect::<Vec<_>>().join(", ");
            diagnostics::warn(&format!("record.fields: no node writes `{field}`; fields are {known}"));
        }
        for (node, manifest) in manifests {
            let key = keys::manifest(&self.run, node);
            let message = manifest.encode_to_vec().into();
            let Some(exchange) = Exchange::from_parts(keys::topic(&key), bytes::Bytes::new(), message) else {
                continue;
            };
            let file = self.file.iter().map(|(_, recorder)| recorder.sender());
            for sender in file.chain(self.viewer.iter().map(view::Stream::sender)) {
                // As above: the recorder tells its own error.
                let _ = sender.push(exchange.clone());
            }
        }
    }

    /// Waits until everything is written.
    fn finish(mut self, waited: Duration) -> Result<Option<Recorded>, RecordingError> {
        drop(self.subscription.take());
        match self.viewer.take().map(view::Stream::finish) {
            Some(Err(error)) => diagnostics::warn(&format!("the run was not shown to its end: {error}")),
            Some(Ok(status)) if !status.success() => {
                diagnostics::warn(&format!("the run was not shown to its end: stagger-view ended with {status}"));
            }
            Some(Ok(_)) | None => {}
        }
        let Some((path, recorder)) = self.file.take() else { return Ok(None) };
        let recorded = recorder.finish()?;
        Ok(Some(Recorded {
            path: path.display().to_string(),
            messages: recorded.messages,
            bytes: recorded.file_bytes,
            lost: recorded.lost,
            waited_s: waited.as_secs_f64(),
        }))
    }
}
