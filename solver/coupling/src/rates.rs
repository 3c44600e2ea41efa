//! Which nodes take part in which step.

use std::collections::{BTreeMap, BTreeSet};

use stagger_messages::{Part, Plan, Version};

use super::{Settings, Window};

/// Who solves when: nodes that take part in every n-th step only, and nodes that only read, which solve once when the
/// others have converged.
#[derive(Clone, Debug)]
pub struct Rates {
    every: BTreeMap<String, u64>,
    readers: BTreeSet<String>,
    nodes: Vec<String>,
    clocks: Clocks,
}

/// Last commit of each node that solves at a rate of its own: version and time reached, in s.
pub type Clocks = BTreeMap<String, (Version, f64)>;

/// Which nodes solve in an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Those that are iterated.
    Iterating,
    /// Those that only read, after the others have converged.
    Reading,
}

impl Rates {
    /// The rates of a plan's nodes.
    #[must_use]
    pub fn new(plan: &Plan, settings: &Settings) -> Self {
        let every: BTreeMap<String, u64> = settings
            .every
            .iter()
            .filter(|(_, every)| **every > 1)
            .map(|(node, every)| (node.clone(), *every))
            .collect();
        let readers = readers(plan);
        let clocks = every.keys().map(|node| (node.clone(), (Version::INITIAL, 0.0))).collect();
        Self { every, readers, nodes: plan.order.clone(), clocks }
    }

    /// Last commits, for a checkpoint.
    #[must_use]
    pub fn clocks(&self) -> &Clocks {
        &self.clocks
    }

    /// Goes on from a checkpoint.
    pub fn restore(&mut self, clocks: Clocks) {
        self.clocks = clocks;
    }

    /// Whether nodes that only read solve at the end of this step.
    #[must_use]
    pub fn has_reading(&self, step: u64, last: bool) -> bool {
        self.readers.iter().any(|node| self.due(node, step, last))
    }

    /// Whether a node takes part in iterations of this step.
    #[must_use]
    pub fn iterates(&self, node: &str, step: u64, last: bool) -> bool {
        !self.readers.contains(node) && self.due(node, step, last)
    }

    /// What differs from one clock for all, in the exchange `turn` of `version`; `last`: the window ends the run.
    #[must_use]
    pub fn parts(&self, version: Version, committed: Version, window: Window, last: bool, turn: Turn) -> Vec<Part> {
        let mut parts = Vec::new();
        for node in &self.nodes {
            let due = self.due(node, version.step, last);
            let reads = self.readers.contains(node);
            let solves = due && reads == (turn == Turn::Reading);
            let clock = self.clocks.get(node);
            if solves && clock.is_none() {
                continue;
            }
            let (held, since_s) = clock.copied().unwrap_or((committed, window.t_s));
            // To those that read, the others stand where they have just converged.
            let stands = if turn == Turn::Reading && due && !reads { version } else { held };
            parts.push(Part {
                node: node.clone(),
                rests: !solves,
                committed: Some(stands),
                t_s: since_s,
                dt_s: window.t_s + window.dt_s - since_s,
            });
        }
        parts
    }

    /// The step was accepted at `version`, at time `t_s`.
    pub fn accepted(&mut self, version: Version, t_s: f64, last: bool) {
        for (node, every) in &self.every {
            if last || version.step.is_multiple_of(*every) {
                self.clocks.insert(node.clone(), (version, t_s));
            }
        }
    }

    fn due(&self, node: &str, step: u64, last: bool) -> bool {
        last || self.every.get(node).is_none_or(|every| step.is_multiple_of(*every))
    }
}

/// Nodes that read others and that nobody reads: they cannot change what the others do.
#[must_use]
pub fn readers(plan: &Plan) -> BTreeSet<String> {
    let read: BTreeSet<&str> =
        plan.nodes.iter().flat_map(|node| &node.sources).map(|source| source.writer.as_str()).collect();
    let only_reads = plan.nodes.iter().filter(|node| !node.sources.is_empty() && !read.contains(node.node.as_str()));
    only_reads.map(|node| node.node.clone()).collect()
}
