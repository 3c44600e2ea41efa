//! The participant behind each node that runs a built-in physics.

use std::collections::BTreeMap;

use stagger_coupling::{Participant, SolveError};

use crate::{Scene, built_in};

/// Why a node has no participant.
#[derive(Debug, thiserror::Error)]
pub enum ParticipantError {
    /// A kind of physics that is not built in.
    #[error("there is no physics `{0}`: expected {expected}", expected = built_in::names())]
    Kind(String),
    /// A node that is a program of its own, which only `stagger run` starts, as a process of its own.
    #[error("node `{0}` is a command: `stagger run` starts it as a process of its own")]
    Command(String),
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

impl Scene {
    /// The participant of a node that runs a kind of physics.
    ///
    /// # Errors
    /// The kind is unknown, its table absent, or its settings not accepted.
    pub fn participant(&self, node: &str, kind: &str) -> Result<Box<dyn Participant>, ParticipantError> {
        if built_in::kind(kind).is_none() {
            return Err(ParticipantError::Kind(kind.into()));
        }
        let no_table = || ParticipantError::NoTable { node: node.into(), kind: kind.into() };
        let settings = self.settings_of(node, kind).ok_or_else(no_table)?;
        settings.participant(node).map_err(|source| ParticipantError::Settings { node: node.into(), source })
    }

    /// The participants of all nodes, by the node's name.
    ///
    /// # Errors
    /// A node is a command, or its settings are not accepted.
    pub fn participants(&self) -> Result<BTreeMap<String, Box<dyn Participant>>, ParticipantError> {
        if let Some((name, _)) = self.nodes.iter().find(|(_, node)| node.command.is_some()) {
            return Err(ParticipantError::Command(name.clone()));
        }
        let nodes = self.built_in_nodes().into_iter();
        nodes.map(|(node, kind)| self.participant(&node, kind.name).map(|made| (node, made))).collect()
    }
}
