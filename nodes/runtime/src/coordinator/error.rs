//! Why a run ends before its end.

use std::time::Duration;

use stagger_coupling::{ControlError, PlanError, SolveError};
use stagger_messages::MessageError;

use crate::{link::LinkError, run::outputs::OutputError};

/// Why a run ended before its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The step control gave up, or a node cannot go on.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The nodes do not fit together.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A message that should have been one of ours.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// A state that cannot be encoded or restored.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A node that cannot be started again.
    #[error("node `{node}` cannot be started again: {message}")]
    Restart {
        /// The node.
        node: String,
        /// Why.
        message: String,
    },
    /// The recording cannot have its name.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Nodes that never announced themselves.
    #[error("{} did not announce themselves within {} s: look at their messages above", .nodes.join(", "), .patience.as_secs())]
    Absent {
        /// The nodes.
        nodes: Vec<String>,
        /// How long they had.
        patience: Duration,
    },
    /// A node of another scene or another version.
    #[error("node `{node}` does not belong to this run: {difference}")]
    Foreign {
        /// The node.
        node: String,
        /// What differs.
        difference: String,
    },
    /// A node that ended.
    #[error("node `{node}` is gone, in {at}: {why}")]
    Lost {
        /// The node.
        node: String,
        /// What it was asked for.
        at: String,
        /// How it ended, and what it said last.
        why: String,
    },
    /// A node failed before its start.
    #[error("node `{node}` cannot start: {message}")]
    Start {
        /// The node.
        node: String,
        /// What it said.
        message: String,
    },
    /// A node that is there but gives no answer.
    #[error("node `{node}` has not answered for {} s, in {at}", .patience.as_secs())]
    Silent {
        /// The node.
        node: String,
        /// What it was asked for.
        at: String,
        /// How long it had.
        patience: Duration,
    },
    /// The user asked to stop before the first step, or the step under way does not end.
    #[error("interrupted")]
    Interrupted,
}
