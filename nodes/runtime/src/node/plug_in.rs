//! A physics of your own as a node: implement [`Physics`], and hand it to [`main`].
//!
//! `nodes/runtime/examples/probe.rs` is a whole one; `stagger new-node NAME` writes a crate that begins as its copy.

use std::{error::Error, path::PathBuf, process::ExitCode};

use clap::Parser;
use stagger_coupling::{Local, Physics};
use stagger_messages::keys;
use stagger_scene::Scene;

use crate::{
    diagnostics,
    launch::{environment, watchdog},
    node::{self, host::Identity},
    run::scene_files::SceneFile,
};

/// Exit codes beside 0, done: 1 failed, 2 usage or bad scene.
const FAILED: u8 = 1;
const USAGE: u8 = 2;

/// What a node is told when it is started.
///
/// The launcher tells it by environment variables (docs/nodes.md), and the command's arguments are the node's own.
/// Started by hand, the node is told by flags, and its own arguments follow `--`.
#[derive(Clone, Debug, Parser)]
#[command(
    about = "A node of a stagger run. `stagger run` starts it by itself; these flags start it by hand.",
    long_about = None
)]
pub struct Setup {
    /// Name of the run, as the coordinator says
    #[arg(long)]
    pub run: String,
    /// The node's name in the run
    #[arg(long)]
    pub node: String,
    /// The coordinator's endpoint
    #[arg(long)]
    pub connect: String,
    /// The scene
    #[arg(long)]
    pub scene: PathBuf,
    /// Set a key of the scene, as the coordinator was told
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = crate::run::scene_files::key_value)]
    pub overrides: Vec<(String, String)>,
    /// Recording of the scene that holds the files it names, where they are not beside it
    #[arg(long, value_name = "RECORDING")]
    pub files: Option<PathBuf>,
    /// Zenoh configuration file
    #[arg(long)]
    pub config: Option<PathBuf>,
    /// Arguments of the node's own
    #[arg(last = true)]
    pub arguments: Vec<String>,
    /// The hash of the scene the launcher told, and with it that a launcher is the parent
    #[arg(skip)]
    parent: Option<u64>,
}

/// Why a node cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// A variable that the launcher sets is absent or not as it should be.
    #[error("the environment variable {name} {problem}: `stagger run` sets it, and flags take its place by hand")]
    Variable {
        /// The variable.
        name: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// A file that cannot be read.
    #[error("cannot read the scene {}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A scene with mistakes.
    #[error("the scene is not valid\n{0}")]
    Scene(#[from] stagger_config::Problems),
    /// A scene that was changed after the run began.
    #[error("{} is no longer the scene this run was started with: start the run again", .0.display())]
    Changed(PathBuf),
}

impl Setup {
    /// From the environment where a launcher set it, or else from the flags.
    fn read() -> Result<Self, SetupError> {
        if std::env::var_os("STAGGER_RUN").is_none() {
            return Ok(Self::parse());
        }
        let problem = |name: &'static str| move |problem: String| SetupError::Variable { name, problem };
        let variable = |name| std::env::var(name).map_err(|error| problem(name)(error.to_string()));
        let hash = variable("STAGGER_SCENE_HASH")?;
        let hash: u64 = hash.parse().map_err(|_| {
            problem("STAGGER_SCENE_HASH")(format!("is `{hash}`, where a decimal number of 64 bits is expected"))
        })?;
        // A launcher that knows of no `--set` leaves it out.
        let overrides = match std::env::var("STAGGER_OVERRIDES") {
            Ok(list) => serde_json::from_str(&list).map_err(|error| {
                problem("STAGGER_OVERRIDES")(format!("is no JSON list of pairs of key and value ({error})"))
            })?,
            Err(_) => Vec::new(),
        };
        Ok(Self {
            run: variable("STAGGER_RUN")?,
            node: variable("STAGGER_NODE")?,
            connect: variable("STAGGER_CONNECT")?,
            scene: variable("STAGGER_SCENE")?.into(),
            overrides,
            files: std::env::var_os("STAGGER_FILES").map(Into::into),
            config: None,
            arguments: std::env::args().skip(1).collect(),
            parent: Some(hash),
        })
    }

    /// The scene of the run, with its `--set` values.
    ///
    /// # Errors
    /// It cannot be read, has mistakes, or is not the one the run was started with.
    pub fn scene(&self) -> Result<Scene, SetupError> {
        let file =
            SceneFile::read(&self.scene).map_err(|source| SetupError::Read { path: self.scene.clone(), source })?;
        let scene = file.parse(&self.overrides, self.files.as_deref())?;
        match self.parent {
            Some(hash) if hash != scene.hash => Err(SetupError::Changed(self.scene.clone())),
            _ => Ok(scene),
        }
    }

    /// The hash to announce: the launcher's word where there is one, so that a node need not understand the scene.
    fn scene_hash(&self) -> Result<u64, SetupError> {
        self.parent.map_or_else(|| Ok(self.scene()?.hash), Ok)
    }
}

/// The `main` of a node: sets it up, builds its physics, takes part in the run until it ends.
///
/// Exits with 0 when the run was completed, 2 when the node cannot be set up, 1 in every other case; what went wrong is
/// on stderr.
#[must_use]
pub fn main<P: Physics + 'static>(build: impl FnOnce(&Setup) -> Result<P, Box<dyn Error>>) -> ExitCode {
    // Before anything that may take its time, and needs to be ended with the run.
    if let Err(error) = watchdog::start(std::env::var_os("STAGGER_RUN").is_some()) {
        return ended(FAILED, &format!("cannot watch for the end of the run: {error}"));
    }
    if let Err(error) = environment::check() {
        return ended(USAGE, &error);
    }
    let ready = Setup::read().and_then(|setup| Ok((setup.scene_hash()?, setup)));
    let (scene_hash, setup) = match ready {
        Ok(ready) => ready,
        Err(error) => return ended(USAGE, &error),
    };
    for name in [&setup.run, &setup.node] {
        if let Err(error) = keys::check_name(name) {
            return ended(USAGE, &error);
        }
    }
    let physics = match build(&setup) {
        Ok(physics) => physics,
        Err(error) => return ended(USAGE, error.as_ref()),
    };
    let participant = Box::new(Local::new(setup.node.clone(), physics));
    let identity = Identity { run: setup.run.clone(), node: setup.node.clone(), scene_hash };
    let child = setup.parent.is_some();
    let end = node::take_part(participant, identity, &setup.connect, setup.config.as_deref());
    match node::told(end, &setup.node, child) {
        Ok(()) => ExitCode::SUCCESS,
        Err(None) => ExitCode::from(FAILED),
        Err(Some(why)) => ended(FAILED, &why),
    }
}

fn ended(code: u8, why: &(impl std::fmt::Display + ?Sized)) -> ExitCode {
    diagnostics::error(&why.to_string());
    ExitCode::from(code)
}
