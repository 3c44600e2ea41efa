//! The nodes of a scene, and what runs as each.

use std::{collections::BTreeMap, path::PathBuf};

use stagger_scene::Scene;

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

/// The nodes of a scene by name: one for each physics it names, unless a `[nodes]` table runs it under another name, and
/// those of its `[nodes]` tables.
#[must_use]
pub fn roster(scene: &Scene) -> BTreeMap<String, Runs> {
    let built_in = scene.built_in_nodes().into_iter().map(|(name, kind)| (name, Runs::Physics(kind.name.into())));
    let commands =
        scene.nodes.iter().filter_map(|(name, node)| Some((name.clone(), Runs::Command(node.command.clone()?))));
    built_in.chain(commands).collect()
}
