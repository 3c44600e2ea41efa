//! Nodes that die: who starts them again, how often a scene allows it, and what is told of it.

use std::time::{Duration, Instant};

use serde::Serialize;
use stagger_scene::Scene;

use crate::diagnostics;

/// What the coordinator needs from who started the nodes.
pub trait Supervisor {
    /// How a node ended and what it said last, for the message about its end.
    fn why_it_ended(&mut self, node: &str) -> String;
    /// Whether the user wants the run to end.
    fn interrupted(&self) -> bool;
    /// A node whose process has ended before it announced itself.
    fn ended_early(&mut self) -> Option<String>;
    /// Whether a node that has ended, in its start or later, would only end the same way again, as far as its end tells.
    fn is_hopeless(&mut self, _node: &str, _at_start: bool) -> bool {
        false
    }
    /// Ends what is left of a node and starts it again.
    ///
    /// # Errors
    /// It cannot be started again, in words.
    fn restart(&mut self, node: &str) -> Result<(), String>;
}

/// A node that died and was started again.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Restart {
    /// The node.
    pub node: String,
    /// What it was asked for when it died.
    pub at: String,
    /// Accepted step from which the run went on.
    pub from_step: u64,
    /// Accepted steps that were solved once more.
    pub steps_repeated: u64,
    /// Wall time until all nodes were ready again, in s; what is repeated after that comes on top.
    pub outage_s: f64,
}

/// The restarts of a run.
pub struct Restarts {
    list: Vec<Restart>,
    most: usize,
    /// When the node died that was started again last, until all nodes are ready again.
    since: Option<Instant>,
}

impl Restarts {
    /// None yet, of those that a scene allows: without checkpoints none at all.
    #[must_use]
    pub fn allowed_by(scene: &Scene) -> Self {
        let most = if scene.recovery.checkpoint_steps > 0 { scene.recovery.restarts as usize } else { 0 };
        Self { list: Vec::new(), most, since: None }
    }

    /// Whether one more is allowed.
    #[must_use]
    pub fn are_left(&self) -> bool {
        self.list.len() < self.most
    }

    /// A node ended before the run began, and was there again after `outage`.
    pub fn in_start(&mut self, node: String, at: String, outage: Duration) {
        let outage_s = outage.as_secs_f64();
        self.list.push(Restart { node, at, from_step: 0, steps_repeated: 0, outage_s });
    }

    /// A node has died during the run, which goes on from the accepted step `from_step`.
    pub fn in_run(&mut self, node: String, at: String, from_step: u64, steps_repeated: u64) {
        self.since = Some(Instant::now());
        self.list.push(Restart { node, at, from_step, steps_repeated, outage_s: 0.0 });
    }

    /// All nodes were ready again at that time, where they were.
    pub fn over(&mut self, ready_at: Option<Instant>) {
        if let (Some(since), Some(ready_at), Some(restart)) = (self.since.take(), ready_at, self.list.last_mut()) {
            restart.outage_s = ready_at.saturating_duration_since(since).as_secs_f64();
        }
    }

    /// All of them, in their order.
    #[must_use]
    pub fn into_list(self) -> Vec<Restart> {
        self.list
    }
}

/// Tells that a node is gone, and what follows.
pub fn tell(node: &str, at: &str, why: &str, what: &str) {
    diagnostics::warn(&format!("node `{node}` is gone, in {at}: {why}; {what}"));
}
