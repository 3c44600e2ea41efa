//! Starts a process per node and leaves none behind.
//!
//! A node ends when it is told to, when the coordinator's token is gone, or when the pipe on its standard input
//! closes: the kernel closes it however this process ends.

use std::{
    collections::BTreeMap,
    os::unix::process::CommandExt as _,
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use crate::{coordinator::Keeper, last_words::LastWords, roster::Runs};

/// Lines of a node's diagnostics that are kept to explain its end.
const LAST_LINES: usize = 20;
/// How long a node that was told to end may take.
const LEAVE: Duration = Duration::from_secs(5);
/// One thread for everything Zenoh does in a node: fastest at these rates, and its callbacks only enqueue.
const ONE_THREAD: &str =
    "(app: (worker_threads: 1), rx: (handover: app), tx: (handover: app), acc: (handover: app), net: (handover: app))";

/// What every node of a run is told.
#[derive(Clone, Debug)]
pub struct Common {
    /// Name of the run.
    pub run: String,
    /// The hub's endpoint.
    pub connect: String,
    /// File of the scene.
    pub scene: PathBuf,
    /// `--set` values.
    pub overrides: Vec<(String, String)>,
    /// Recording that holds the scene's files where they are not beside it.
    pub files: Option<PathBuf>,
    /// Hash of the scene.
    pub scene_hash: u64,
    /// Threads of each node; `None` is one per core.
    pub threads: Option<usize>,
}

/// The processes of a run's nodes.
pub struct Launcher {
    workers: BTreeMap<String, Worker>,
    common: Common,
    interrupted: Arc<AtomicBool>,
}

struct Worker {
    runs: Runs,
    child: Child,
    words: LastWords,
}

impl Launcher {
    /// Starts a process for each node. Those already started end when this fails.
    ///
    /// # Errors
    /// A process cannot be started.
    pub fn start(
        nodes: &BTreeMap<String, Runs>,
        common: Common,
        interrupted: Arc<AtomicBool>,
    ) -> std::io::Result<Self> {
        let mut launcher = Self { workers: BTreeMap::new(), common, interrupted };
        for (name, runs) in nodes {
            let worker = Worker::start(name, runs, &launcher.common)?;
            launcher.workers.insert(name.clone(), worker);
        }
        Ok(launcher)
    }
}

impl Drop for Launcher {
    fn drop(&mut self) {
        for worker in self.workers.values_mut() {
            // A node that has not been told to end notices this.
            drop(worker.child.stdin.take());
        }
        let deadline = Instant::now() + LEAVE;
        for (name, worker) in &mut self.workers {
            while Instant::now() < deadline && !worker.ended() {
                std::thread::sleep(Duration::from_millis(2));
            }
            if !worker.ended() {
                crate::diagnostics::warn(&format!("node `{name}` did not leave by itself and is ended"));
                // One that has just ended by itself cannot be killed, which is as good.
                let _ = worker.child.kill();
                let _ = worker.child.wait();
                // A process it started may still hold its diagnostics open: they are not waited for.
                continue;
            }
            worker.words.wait();
        }
    }
}

impl Worker {
    fn start(name: &str, runs: &Runs, common: &Common) -> std::io::Result<Self> {
        let mut command = command(name, runs, common)?;
        let mut child = command.spawn().map_err(|error| {
            std::io::Error::new(error.kind(), format!("node `{name}`: cannot start {command:?}: {error}"))
        })?;
        let name = name.to_owned();
        let hear = move |line: &str| crate::diagnostics::note(&format!("[{name}] {line}"));
        let words = LastWords::follow(&mut child, LAST_LINES, hear);
        Ok(Self { runs: runs.clone(), child, words })
    }

    fn ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }
}

/// The command that runs a node, with all it is told.
pub(crate) fn command(name: &str, runs: &Runs, common: &Common) -> std::io::Result<Command> {
    let mut command = match runs {
        Runs::Physics(kind) => built_in(name, kind, common)?,
        Runs::Recorded(file) => {
            let mut command = built_in(name, name, common)?;
            command.arg("--replayed").arg(file);
            command
        }
        Runs::Command(words) => plug_in(words),
    };
    command
        .env("ZENOH_RUNTIME", ONE_THREAD)
        .env("STAGGER_RUN", &common.run)
        .env("STAGGER_NODE", name)
        .env("STAGGER_CONNECT", &common.connect)
        .env("STAGGER_SCENE", &common.scene)
        .env("STAGGER_OVERRIDES", serde_json::json!(common.overrides).to_string())
        .env("STAGGER_PROGRAM", std::env::current_exe()?)
        .env("STAGGER_SCENE_HASH", common.scene_hash.to_string())
        .envs(common.files.as_ref().map(|files| ("STAGGER_FILES", files)))
        // Ctrl-C is for the coordinator, which lets the nodes finish their step.
        .process_group(0)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    Ok(command)
}

fn built_in(name: &str, kind: &str, common: &Common) -> std::io::Result<Command> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["node", kind, "--name", name, "--run", &common.run, "--connect", &common.connect, "--child"]);
    command.arg("--scene").arg(&common.scene);
    for (key, value) in &common.overrides {
        command.arg("--set").arg(format!("{key}={value}"));
    }
    if let Some(files) = &common.files {
        command.arg("--files").arg(files);
    }
    if let Some(threads) = common.threads {
        command.args(["--threads", &threads.to_string()]);
    }
    Ok(command)
}

fn plug_in(words: &[String]) -> Command {
    let mut command = Command::new(words.first().map_or("", String::as_str));
    command.args(words.iter().skip(1));
    command
}

impl Keeper for Launcher {
    fn last_words(&mut self, node: &str) -> String {
        let Some(worker) = self.workers.get_mut(node) else { return "it was not started here".into() };
        // The process and its pipe end a moment after its token.
        let deadline = Instant::now() + Duration::from_millis(500);
        while !worker.ended() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        let status = match worker.child.try_wait() {
            Ok(Some(status)) => status.to_string(),
            _ => "its process does not answer".into(),
        };
        format!("{status}{}", worker.words.told())
    }

    fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn ended_early(&mut self) -> Option<String> {
        self.workers.iter_mut().find_map(|(name, worker)| worker.ended().then(|| name.clone()))
    }
    fn restart(&mut self, node: &str) -> Result<(), String> {
        let worker = self.workers.get_mut(node).ok_or("it was not started here")?;
        // One that is stopped, or hangs, does not end by itself; one that has ended cannot be killed, which is as good.
        let _ = worker.child.kill();
        let _ = worker.child.wait();
        *worker = Worker::start(node, &worker.runs.clone(), &self.common).map_err(|error| error.to_string())?;
        Ok(())
    }
}
