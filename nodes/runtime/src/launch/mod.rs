//! Starts a process per node and leaves none behind.
//!
//! A node ends when it is told to, when the coordinator's token is gone, or when the pipe on its standard input
//! closes: the kernel closes it however this process ends.

pub mod environment;
pub mod roster;
pub mod stderr_tail;
pub mod watchdog;
pub mod words;

use std::{
    collections::BTreeMap,
    ffi::{OsStr, OsString},
    os::unix::process::{CommandExt as _, ExitStatusExt as _},
    path::PathBuf,
    process::{Child, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use crate::{
    coordinator::Supervisor,
    diagnostics,
    launch::{roster::Runs, stderr_tail::StderrTail},
    link::{endpoint::Endpoint, shared_memory},
};

/// Lines of a node's diagnostics that are kept to explain its end.
const LAST_LINES: usize = 20;
/// How long a node that was told to end may take.
const LEAVE: Duration = Duration::from_secs(5);
/// How long the diagnostics of a node that has ended are waited for: a process it started may hold them open for ever.
const STDERR_CLOSES: Duration = Duration::from_millis(500);
/// The signal for a file that grows beyond its limit.
const FILE_TOO_LARGE: i32 = nix::sys::signal::SIGXFSZ as i32;
/// Exit codes of a start that fails the same way each time: the usage or the scene is wrong (ours, and an interpreter's for a
/// script it cannot open), a shell's command cannot be run, or is not found.
const HOPELESS: [i32; 3] = [2, 126, 127];
/// One thread for everything Zenoh does in a node: fastest at these rates, and its callbacks only enqueue.
pub(crate) const ONE_THREAD: &str =
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
    endpoint: Arc<Mutex<Endpoint>>,
    interrupted: Arc<AtomicBool>,
}

struct Worker {
    runs: Runs,
    child: Child,
    stderr: StderrTail,
}

impl Launcher {
    /// Starts a process for each node, which meets the others at `endpoint`. Those already started end when this fails.
    ///
    /// # Errors
    /// A process cannot be started.
    pub fn start(
        nodes: &BTreeMap<String, Runs>,
        common: Common,
        endpoint: Arc<Mutex<Endpoint>>,
        interrupted: Arc<AtomicBool>,
    ) -> std::io::Result<Self> {
        if let Some(why) = shared_memory::why_unusable() {
            diagnostics::warn(&format!("there is no shared memory ({why}): fields go through the socket, slower"));
        }
        let mut launcher = Self { workers: BTreeMap::new(), common, endpoint, interrupted };
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
                diagnostics::warn(&format!("node `{name}` did not leave by itself and is ended"));
                worker.kill();
            }
        }
        let deadline = Instant::now() + STDERR_CLOSES;
        for (name, worker) in &mut self.workers {
            if !worker.stderr.wait(deadline.saturating_duration_since(Instant::now())) {
                diagnostics::note(&format!(
                    "a process that node `{name}` started lives on and holds its standard error; it is not waited for"
                ));
            }
        }
    }
}

impl Worker {
    fn start(name: &str, runs: &Runs, common: &Common) -> std::io::Result<Self> {
        let mut command = command(name, runs, common)?;
        let mut child = command.spawn().map_err(|error| {
            std::io::Error::new(error.kind(), format!("node `{name}`: cannot start {}: {error}", shown(&command)))
        })?;
        let name = name.to_owned();
        let hear = move |line: &str| diagnostics::note(&format!("[{name}] {line}"));
        let stderr = StderrTail::follow(&mut child, LAST_LINES, hear);
        Ok(Self { runs: runs.clone(), child, stderr })
    }

    fn ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }

    /// How it ended, where it has.
    fn status(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().ok().flatten()
    }

    /// Ends it whatever it does, and with it what stands between it and this process, such as the shell of a command.
    fn kill(&mut self) {
        // It leads a group of its own as long as it is there. One that has just ended cannot be killed, which is as good.
        if !self.ended()
            && let Ok(group) = i32::try_from(self.child.id())
        {
            let _ = nix::sys::signal::killpg(nix::unistd::Pid::from_raw(group), nix::sys::signal::SIGKILL);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// How a process ended, in words.
fn in_words(status: ExitStatus) -> String {
    if status.signal() == Some(FILE_TOO_LARGE) {
        return format!("{status}: a file, or shared memory, would have grown beyond the limit that `ulimit -f` shows");
    }
    status.to_string()
}

/// The command that runs a node, with all it is told.
pub fn command(name: &str, runs: &Runs, common: &Common) -> std::io::Result<Command> {
    let mut command = match runs {
        Runs::Physics(kind) => built_in(name, kind, common)?,
        Runs::Recorded(file) => {
            let mut command = built_in(name, name, common)?;
            command.arg(option("replayed", file));
            command
        }
        Runs::Command(words) => plug_in(words),
    };
    command
        .env(environment::ZENOH_RUNTIME, ONE_THREAD)
        .envs(common.threads.map(|threads| (environment::THREADS, threads.to_string())))
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
    command.args(["node", kind, "--child"]);
    command.arg(option("name", name)).arg(option("run", &common.run)).arg(option("connect", &common.connect));
    command.arg(option("scene", &common.scene));
    command.args(common.overrides.iter().map(|(key, value)| option("set", format!("{key}={value}"))));
    command.args(common.files.iter().map(|files| option("files", files)));
    command.args(common.threads.map(|threads| option("threads", threads.to_string())));
    Ok(command)
}

/// An option and its value in one word: a value that begins with `-` would be taken for an option of its own.
fn option(name: &str, value: impl AsRef<OsStr>) -> OsString {
    let mut word = OsString::from(format!("--{name}="));
    word.push(value);
    word
}

/// A command as it is typed, without what it is told in its environment.
pub fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| words::quote(&word.to_string_lossy())).collect::<Vec<_>>().join(" ")
}

fn plug_in(words: &[String]) -> Command {
    let mut command = Command::new(words.first().map_or("", String::as_str));
    command.args(words.iter().skip(1));
    command
}

impl Supervisor for Launcher {
    fn why_it_ended(&mut self, node: &str) -> String {
        let Some(worker) = self.workers.get_mut(node) else { return "it was not started here".into() };
        // The process and its pipe end a moment after its token.
        let deadline = Instant::now() + Duration::from_millis(500);
        while !worker.ended() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        let status = worker.status().map_or_else(|| "its process does not answer".into(), in_words);
        worker.stderr.wait(deadline.saturating_duration_since(Instant::now()));
        format!("{status}{}", worker.stderr.told())
    }

    fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn ended_early(&mut self) -> Option<String> {
        self.workers.iter_mut().find_map(|(name, worker)| worker.ended().then(|| name.clone()))
    }

    fn is_hopeless(&mut self, node: &str, at_start: bool) -> bool {
        let status = self.workers.get_mut(node).and_then(Worker::status);
        status.is_some_and(|status| {
            let usage = status.code().is_some_and(|code| HOPELESS.contains(&code));
            status.signal() == Some(FILE_TOO_LARGE) || at_start && usage
        })
    }

    fn restart(&mut self, node: &str) -> Result<(), String> {
        let worker = self.workers.get_mut(node).ok_or("it was not started here")?;
        // Poisoned means a panic elsewhere; what is there is looked at again.
        let mended = self.endpoint.lock().unwrap_or_else(PoisonError::into_inner).mend();
        mended.map_err(|error| error.to_string())?;
        // One that is stopped, or hangs, does not end by itself.
        worker.kill();
        *worker = Worker::start(node, &worker.runs.clone(), &self.common).map_err(|error| error.to_string())?;
        Ok(())
    }
}
