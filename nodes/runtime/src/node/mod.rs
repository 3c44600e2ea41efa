//! `stagger node`: one physics of a scene as a process of its own.

pub mod host;
pub mod plug_in;
pub mod recorded;

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use stagger_coupling::Participant;
use stagger_messages::keys;
use stagger_scene::{ParticipantError, Scene};

use crate::{
    launch::watchdog,
    link::{Link, LinkError, Role},
    node::{
        host::{Event, Host, HostError, Identity, NodeEnd},
        recorded::{Replayed, ReplayedError},
    },
};

/// How long a node whose run has ended stays for the coordinator to have heard it.
const LINGER: Duration = Duration::from_secs(2);

/// What a node is started with.
#[derive(Clone, Debug)]
pub struct Options {
    /// The physics.
    pub kind: String,
    /// Its name in the run.
    pub name: String,
    /// Name of the run.
    pub run: String,
    /// The hub's endpoint.
    pub connect: String,
    /// Whether a parent holds the other end of the standard input, and its end is ours.
    pub child: bool,
    /// Zenoh configuration file.
    pub config: Option<PathBuf>,
    /// Recording whose node of this name answers instead of the physics.
    pub replayed: Option<PathBuf>,
}

/// Why a node ended in failure.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// It cannot be built.
    #[error(transparent)]
    Participant(#[from] ParticipantError),
    /// Its recording cannot be replayed.
    #[error(transparent)]
    Replayed(#[from] ReplayedError),
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It could not go on.
    #[error(transparent)]
    Host(#[from] HostError),
}

/// What a node's process says of how it ended: nothing of a run that was completed; else why, unless its parent, which
/// knows, tells it.
///
/// # Errors
/// The run was not completed, or the node failed.
pub fn told(end: Result<NodeEnd, NodeError>, node: &str, child: bool) -> Result<(), Option<String>> {
    match end {
        Ok(NodeEnd::Stopped { completed: true, .. }) => Ok(()),
        Ok(NodeEnd::Stopped { .. }) if child => Err(None),
        Ok(NodeEnd::Stopped { reason, .. }) => Err(Some(format!("the run ended early: {reason}"))),
        Ok(NodeEnd::Abandoned) => Err(Some(format!("`{node}`: the coordinator is gone"))),
        Err(error) => Err(Some(error.to_string())),
    }
}

/// Runs a node until its run ends.
///
/// # Errors
/// It cannot be built or connected, or it fails.
pub fn run(scene: &Scene, options: &Options) -> Result<NodeEnd, NodeError> {
    let participant = match &options.replayed {
        Some(file) => Box::new(Replayed::open(file, &options.name)?),
        None => scene.participant(&options.name, &options.kind)?,
    };
    let identity = Identity { run: options.run.clone(), node: options.name.clone(), scene_hash: scene.hash };
    take_part(participant, identity, &options.connect, options.config.as_deref())
}

/// Connects `participant` to the hub and hosts it until its run ends, or until the parent that [`watchdog::start`] was
/// told of is gone.
///
/// # Errors
/// It cannot be connected, or it fails.
pub fn take_part(
    participant: Box<dyn Participant>,
    identity: Identity,
    connect: &str,
    config: Option<&Path>,
) -> Result<NodeEnd, NodeError> {
    let link = Link::open_as(&Role::Node { connect: connect.into() }, config, Some(&identity.node))?;
    let run = identity.run.clone();
    let host = Host::new(&link, identity, participant)?;
    let to_host = host.sender();
    watchdog::on_parent_gone(move || {
        // A host that has ended needs no more events.
        let _ = to_host.send(Event::Abandoned);
    });
    // A QUIC link that closes drops what has not arrived yet: the coordinator, once it has heard all, leaves first.
    let (leaves, left) = std::sync::mpsc::channel();
    let _coordinator = link.watch(&keys::live(&run, "coordinator", "*"), move |_, alive| {
        if !alive {
            watchdog::coordinator_gone();
            // A node that no longer waits has left itself.
            let _ = leaves.send(());
        }
    })?;
    let end = host.run();
    if matches!(end, Ok(NodeEnd::Stopped { .. })) {
        // Whether it left in time or not, there is nothing more to say.
        let _ = left.recv_timeout(LINGER);
    }
    // Whatever happened, what was said last must leave; how the node ended is the more important news.
    let closed = link.close();
    let end = end?;
    // A link to nobody does not close in time.
    if end != NodeEnd::Abandoned {
        closed?;
    }
    Ok(end)
}
