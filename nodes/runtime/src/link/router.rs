//! `stagger router`: passes messages on between a coordinator and nodes that all connect to it.

use std::{
    io::Read as _,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use crate::{
    diagnostics,
    link::{Link, LinkError, Role},
};

/// How often it looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// What a router is started with.
#[derive(Clone, Debug)]
pub struct Options {
    /// Endpoints to listen on.
    pub listen: Vec<String>,
    /// Zenoh configuration file.
    pub config: Option<PathBuf>,
    /// Whether a parent holds the other end of the standard input, and its end is ours.
    pub child: bool,
}

/// Routes until `interrupted`.
///
/// # Errors
/// An endpoint cannot be listened on, or the links do not close.
pub fn run(options: Options, interrupted: &Arc<AtomicBool>) -> Result<(), LinkError> {
    let Options { listen, config, child } = options;
    let endpoints = listen.join(", ");
    let link = Link::open(&Role::Router { listen }, config.as_deref())?;
    diagnostics::note(&format!("routing on {endpoints}"));
    if child {
        let ended = Arc::clone(interrupted);
        std::thread::spawn(move || {
            // Nothing is ever written to this pipe: its end, or an error on it, is the parent's end.
            let _ = std::io::stdin().read(&mut [0]);
            ended.store(true, Ordering::Relaxed);
        });
    }
    while !interrupted.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
    }
    link.close()
}
