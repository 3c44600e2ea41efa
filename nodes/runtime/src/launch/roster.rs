//! The nodes of a scene, and the participant behind each.

use std::{collections::BTreeMap, path::PathBuf};

use stagger_coupling::{Participant, SolveError};
use stagger_scene::{Scene, built_in};

/// What runs as a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Runs {
    /// A physics of stagger, by its kind.
    Physics(String),
    /// A command that speaks the protocol.
    Command(Vec<String>),
    /// A node of that name in a recording, which answers as it did.
    Recorded(PathBuf),
}

/// Why a node cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum RosterError {
    /// A kind of physics that is not built in.
    #[error("there is no physics `{0}`: expected {expected}", expected = built_in::names())]
    Kind(String),
    /// A physics whose table is not in the scene.
    #[error("node `{node}` runs the physics `{kind}`, but the scene has no [{kind}] table to set it up")]
    NoTable {
        /// The node.
        node: String,
        /// The kind.
        kind: String,
    },
    /// Settings the physics does not accept.
    #[error("node `{node}`: {source}")]
    Settings {
        /// The node.
        node: String,
        /// What is wrong.
        source: SolveError,
    },
}

/// The nodes of a scene by name: one for each physics it names, unless a `[nodes]` table runs it under another name, and
/// those of its `[nodes]` tables.
#[must_use]
pub fn roster(scene: &Scene) -> BTreeMap<String, Runs> {
    let built_in = scene.built_in_nodes().into_iter().map(|(name, kind)| (name, Runs::Physics(kind.name.into())));
    let commands =
        scene.nodes.iter().filter_map(|(name, node)| Some((name.clone(), Runs::Command(node.command.clone()?))));
    built_in.chain(commands).collect()
}

/// Builds the participant of a node from the scene.
///
/// # Errors
/// The kind is unknown, its table absent, or its settings not accepted.
pub fn participant(scene: &Scene, node: &str, kind: &str) -> Result<Box<dyn Participant>, RosterError> {
    if built_in::kind(kind).is_none() {
        return Err(RosterError::Kind(kind.into()));
    }
    let no_table = || RosterError::NoTable { node: node.into(), kind: kind.into() };
    let settings = scene.settings_of(node, kind).ok_or_else(no_table)?;
    settings.participant(node).map_err(|source| RosterError::Settings { node: node.into(), source })
}
