//! `stagger view`: hands a recording or a live run to the Rerun bridge, which is a program of its own.

use std::{
    ffi::OsString,
    io::{self, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

use stagger_messages::keys;
use stagger_recordings::{Exchange, Recorder, RecorderOptions, RecorderSender, RecordingError, RunInfo};

use crate::{
    coordinator::sinks::Sink,
    link::{
        Declaration, Link, LinkError, Role, Sample,
        endpoint::{socket, socket_folder},
    },
};

/// How to get the bridge, in one line.
pub const HOW_TO_GET: &str = "the viewer bridge `stagger-view` is not built yet (it takes some minutes, once): \
     cargo build --release --manifest-path recordings/view/Cargo.toml";

/// The bridge's option to serve a viewer in a browser, which it does until it is ended.
pub const WEB: &str = "--web";

/// How long a run may take to describe itself.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long a bridge may take nothing before it is ended: longer than a viewer takes to start, shorter than a link
/// waits for a reader before it is closed.
const STALLED: Duration = Duration::from_secs(30);
/// How often the bridge is looked at.
const LOOK: Duration = Duration::from_millis(100);

/// Why a run cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// Neither a file nor a run.
    #[error("there is no file and no run of that name on this host")]
    Nothing,
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The stream to the bridge ended.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The bridge cannot be started.
    #[error("cannot start stagger-view: {0}")]
    Io(#[from] io::Error),
    /// The run's description is not one.
    #[error("the run does not describe itself as expected: {0}")]
    Info(#[from] serde_json::Error),
}

/// The bridge: beside this program, in the workspace it was built in, or on the PATH.
#[must_use]
pub fn bridge() -> Option<PathBuf> {
    let own = std::env::current_exe().ok();
    let folder = own.as_deref().and_then(Path::parent);
    let beside = folder.map(|folder| folder.join("stagger-view"));
    let workspace = folder
        .and_then(|folder| folder.ancestors().find(|at| at.join("recordings/view/Cargo.toml").is_file()))
        .map(|root| root.join("recordings/view/target/release/stagger-view"));
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let on_path = std::env::split_paths(&paths).map(|folder| folder.join("stagger-view"));
    beside.into_iter().chain(workspace).chain(on_path).find(|path| path.is_file())
}

/// Shows a recording; returns when the bridge has ended.
///
/// # Errors
/// The bridge cannot be started.
pub fn file(bridge: &Path, recording: &str, arguments: &[OsString]) -> io::Result<ExitStatus> {
    Command::new(bridge).arg(recording).args(arguments).stdin(Stdio::null()).status()
}

/// A bridge, and the stream of a run to it.
///
/// A run may wait for it as it does for a disk, but not for ever: a bridge that takes nothing for half a minute is ended.
pub struct Stream {
    recorder: Recorder,
    child: Arc<Mutex<Child>>,
    over: Arc<AtomicBool>,
    watch: JoinHandle<()>,
    /// Whether the bridge stays when it has shown everything.
    stays: bool,
}

impl Stream {
    /// Starts the bridge and describes the run to it, which may be `joined` on its way.
    ///
    /// # Errors
    /// The bridge cannot be started, or takes nothing.
    pub fn start(bridge: &Path, info: &RunInfo, arguments: &[OsString], joined: bool) -> Result<Self, ViewError> {
        let mut child = Command::new(bridge).arg("-").args(arguments).stdin(Stdio::piped()).spawn()?;
        let output = child.stdin.take().ok_or(io::ErrorKind::BrokenPipe).map_err(io::Error::from)?;
        let (child, writing) = (Arc::new(Mutex::new(child)), Arc::new(Mutex::new(None)));
        let pipe = Pipe { output, writing: Arc::clone(&writing) };
        let recorder = Recorder::create(pipe, info, RecorderOptions { joined, ..RecorderOptions::default() })?;
        let over = Arc::new(AtomicBool::new(false));
        let watched = (Arc::clone(&child), Arc::clone(&over));
        let watch = std::thread::Builder::new().name("viewer".into()).spawn(move || {
            let (child, over) = watched;
            while !over.load(Ordering::Relaxed) {
                std::thread::sleep(LOOK);
                if lock(&writing).is_some_and(|since: Instant| since.elapsed() > STALLED) {
                    crate::diagnostics::warn("the viewer takes nothing any more and is given up");
                    // One that has just ended by itself is given up as well.
                    let _ = lock(&child).kill();
                    return;
                }
            }
        })?;
        Ok(Self { recorder, child, over, watch, stays: arguments.iter().any(|argument| argument == WEB) })
    }

    /// Whether the bridge has ended.
    ///
    /// # Errors
    /// The system does not say.
    pub fn ended(&self) -> io::Result<bool> {
        Ok(lock(&self.child).try_wait()?.is_some())
    }

    /// Hands over what waits, and waits until the bridge has shown it and ends, or is ended where it serves browsers.
    ///
    /// # Errors
    /// The system does not say how it ended.
    pub fn finish(self) -> Result<ExitStatus, ViewError> {
        let handed_over = self.recorder.finish();
        self.over.store(true, Ordering::Relaxed);
        // It only sleeps and looks.
        let _ = self.watch.join();
        let until = Instant::now() + STALLED;
        while (self.stays || Instant::now() < until) && lock(&self.child).try_wait()?.is_none() {
            std::thread::sleep(LOOK);
        }
        let mut child = lock(&self.child);
        if child.try_wait()?.is_none() {
            crate::diagnostics::warn("the viewer does not come to an end and is given up");
            child.kill()?;
        }
        let status = child.wait()?;
        // A bridge that failed has said why; one that did not has read everything.
        if status.success() {
            handed_over?;
        }
        Ok(status)
    }

    /// As [`Stream::finish`], for a run that is complete whatever becomes of the viewer: a failure is told.
    pub fn finish_or_warn(self) {
        match self.finish() {
            Err(error) => crate::diagnostics::warn(&format!("the run was not shown to its end: {error}")),
            Ok(status) if !status.success() => {
                crate::diagnostics::warn(&format!(
                    "the run was not shown to its end: stagger-view ended with {status}"
                ));
            }
            Ok(_) => {}
        }
    }
}

impl Sink for Stream {
    fn sender(&self) -> RecorderSender {
        self.recorder.sender()
    }

    fn is_waited_for(&self) -> bool {
        false
    }
}

/// The pipe to a bridge, and since when the bridge is waited for.
struct Pipe {
    output: ChildStdin,
    writing: Arc<Mutex<Option<Instant>>>,
}

impl Write for Pipe {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        *lock(&self.writing) = Some(Instant::now());
        let written = self.output.write(buffer);
        *lock(&self.writing) = None;
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing panics while it holds one of these.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is heard of a run while its past is asked for, and after that the way on to the bridge.
enum Heard {
    Early(Vec<Sample>),
    On,
}

/// Feeds `sender` with a run from now on, after the newest value of every field: a field that does not change is not
/// sent again, and one under way refers to what was sent before. `closed` is called when nobody takes it any more.
///
/// # Errors
/// The link fails.
pub fn follow(
    link: &Link,
    run: &str,
    sender: RecorderSender,
    closed: impl Fn() + Send + Sync + 'static,
) -> Result<Declaration, LinkError> {
    let push = move |sample: Sample| {
        let exchange = Exchange::from_parts(keys::topic(&sample.key), sample.attachment, sample.payload);
        if exchange.is_some_and(|exchange| sender.push(exchange).is_err()) {
            closed();
        }
    };
    let push = Arc::new(push);
    // Heard before asked: nothing falls in between.
    let heard = Arc::new(Mutex::new(Heard::Early(Vec::new())));
    let (pass, gate) = (Arc::clone(&push), Arc::clone(&heard));
    let everything = link.subscribe(&keys::all(run), move |sample| match &mut *lock(&gate) {
        Heard::Early(early) => early.push(sample),
        Heard::On => pass(sample),
    })?;
    for sample in link.query(&keys::field(run, "*", "*"), PATIENCE)? {
        push(sample);
    }
    let mut gate = lock(&heard);
    if let Heard::Early(early) = std::mem::replace(&mut *gate, Heard::On) {
        early.into_iter().for_each(|sample| push(sample));
    }
    drop(gate);
    Ok(everything)
}

/// Shows a run that is going on, until it ends or the bridge does.
///
/// # Errors
/// There is no such run, or the link or the bridge fails.
pub fn live(bridge: &Path, run: &str, arguments: &[OsString]) -> Result<ExitStatus, ViewError> {
    let folder = socket_folder(run);
    if keys::check_name(run).is_err() || !folder.is_dir() {
        return Err(ViewError::Nothing);
    }
    let link = Link::open(&Role::Node { connect: socket(&folder) }, None)?;
    let about = link.query(&keys::manifest(run, "coordinator"), PATIENCE)?;
    let info: RunInfo = serde_json::from_slice(&about.first().ok_or(ViewError::Nothing)?.payload)?;
    let stream = Stream::start(bridge, &info, arguments, true)?;
    let (tell, ended) = channel();
    let closed = tell.clone();
    let everything = follow(&link, run, stream.sender(), move || {
        // Nobody listens any more when this has been heard.
        let _ = closed.send(());
    })?;
    let coordinator = link.watch(&keys::live(run, "coordinator", "*"), move |_, alive| {
        if !alive {
            let _ = tell.send(());
        }
    })?;
    while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(LOOK) {
        if stream.ended()? {
            break;
        }
    }
    drop((everything, coordinator));
    stream.finish()
}
