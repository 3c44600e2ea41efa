//! `stagger view`: hands a recording or a live run to the Rerun bridge, which is a program of its own.

use std::{
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::mpsc::{RecvTimeoutError, channel},
    time::Duration,
};

use stagger_messages::keys;
use stagger_recordings::{Exchange, Recorder, RecorderOptions, RecordingError, RunInfo};

use crate::{
    link::{Arrival, Link, LinkError, Role},
    run::{socket, socket_folder},
};

/// How to get the bridge, in one line.
pub const HOW_TO_GET: &str = "the viewer bridge `stagger-view` is not built yet (it takes some minutes, once): \
     cargo build --release --manifest-path recordings/view/Cargo.toml";

/// How long a run may take to describe itself.
const PATIENCE: Duration = Duration::from_secs(5);

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
    Io(#[from] std::io::Error),
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

/// Starts the bridge on a file, or on `-`, a stream.
///
/// # Errors
/// It cannot be started.
pub fn start(bridge: &Path, input: &str, arguments: &[String]) -> std::io::Result<Child> {
    let stdin = if input == "-" { Stdio::piped() } else { Stdio::null() };
    Command::new(bridge).arg(input).args(arguments).stdin(stdin).spawn()
}

/// Shows a run that is going on, until it ends or the bridge does. It is asked for the fields it sent before.
///
/// # Errors
/// There is no such run, or the link or the bridge fails.
pub fn live(bridge: &Path, run: &str, arguments: &[String]) -> Result<ExitStatus, ViewError> {
    let folder = socket_folder(run);
    if keys::check_name(run).is_err() || !folder.is_dir() {
        return Err(ViewError::Nothing);
    }
    let link = Link::open(&Role::Node { connect: socket(&folder) }, None)?;
    let about = link.ask(&keys::manifest(run, "coordinator"), PATIENCE)?;
    let info: RunInfo = serde_json::from_slice(&about.first().ok_or(ViewError::Nothing)?.payload)?;
    let mut child = start(bridge, "-", arguments)?;
    let Some(pipe) = child.stdin.take() else { return Ok(child.wait()?) };
    let recorder = Recorder::create(pipe, &info, RecorderOptions::default())?;
    let sender = recorder.sender();
    let push = move |arrival: Arrival| {
        let exchange = Exchange::from_parts(keys::topic(&arrival.key), arrival.attachment, arrival.payload);
        // A bridge that was closed ends this program below.
        exchange.is_none_or(|exchange| sender.push(exchange).is_ok())
    };
    let (tell, ended) = channel();
    let closed = tell.clone();
    let push = std::sync::Arc::new(push);
    let push_asked = std::sync::Arc::clone(&push);
    let everything = link.subscribe(&keys::all(run), move |arrival| {
        if !push(arrival) {
            // Nobody listens any more when this has been heard.
            let _ = closed.send(());
        }
    })?;
    // Asked after subscribing, so that no version falls between the two.
    for arrival in link.ask(&keys::field(run, "*", "*"), PATIENCE)? {
        push_asked(arrival);
    }
    let coordinator = link.watch(&keys::live(run, "coordinator", "*"), move |_, alive| {
        if !alive {
            let _ = tell.send(());
        }
    })?;
    while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(Duration::from_millis(200)) {
        if child.try_wait()?.is_some() {
            break;
        }
    }
    drop((everything, coordinator));
    recorder.finish()?;
    Ok(child.wait()?)
}
