//! The nodes of a scene, and the participant behind each.

use std::{collections::BTreeMap, path::PathBuf};

use stagger_coupling::{Local, Participant, SolveError};
use stagger_physics::{
    acoustics::Acoustics, current::Current, optics::Optics, particles::Particles, substrate::Substrate,
    thermal::Thermal,
};
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

/// Why a node cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum RosterError {
    /// A kind of physics that is not built in.
    #[error("there is no physics `{0}`: expected particles, thermal, optics, current, substrate or acoustics")]
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
    let named = [
        ("particles", scene.particles.is_some()),
        ("thermal", scene.thermal.is_some()),
        ("optics", scene.optics.is_some()),
        ("current", scene.current.is_some()),
        ("substrate", scene.substrate.is_some()),
        ("acoustics", scene.acoustics.is_some()),
    ];
    // One with settings of its own runs beside its namesake, not instead of it.
    let renamed = |kind: &str| {
        let mut others = scene.nodes.values();
        others.any(|settings| settings.physics.as_deref() == Some(kind) && settings.optics.is_none())
    };
    let mut nodes: BTreeMap<String, Runs> = named
        .into_iter()
        .filter(|(kind, present)| *present && !renamed(kind))
        .map(|(kind, _)| (kind.to_owned(), Runs::Physics(kind.into())))
        .collect();
    for (name, settings) in &scene.nodes {
        let runs = match (&settings.command, &settings.physics) {
            (Some(command), _) => Runs::Command(command.clone()),
            (None, Some(kind)) => Runs::Physics(kind.clone()),
            (None, None) => continue,
        };
        nodes.insert(name.clone(), runs);
    }
    nodes
}

/// Builds the participant of a node from the scene.
///
/// # Errors
/// The kind is unknown, its table absent, or its settings not accepted.
pub fn participant(scene: &Scene, node: &str, kind: &str) -> Result<Box<dyn Participant>, RosterError> {
    let no_table = || RosterError::NoTable { node: node.into(), kind: kind.into() };
    let settings = |source| RosterError::Settings { node: node.into(), source };
    Ok(match kind {
        "particles" => {
            let physics = Particles::new(scene.particles.clone().ok_or_else(no_table)?).map_err(settings)?;
            Box::new(Local::new(node, physics))
        }
        "thermal" => {
            let physics = Thermal::new(scene.thermal.clone().ok_or_else(no_table)?).map_err(settings)?;
            Box::new(Local::new(node, physics))
        }
        "optics" => {
            let own = scene.nodes.get(node).and_then(|settings| settings.optics.clone());
            let physics = Optics::new(own.or_else(|| scene.optics.clone()).ok_or_else(no_table)?).map_err(settings)?;
            Box::new(Local::new(node, physics))
        }
        "current" => {
            let physics = Current::new(scene.current.clone().ok_or_else(no_table)?).map_err(settings)?;
            Box::new(Local::new(node, physics))
        }
        "substrate" => {
            let physics = Substrate::new(scene.substrate.clone().ok_or_else(no_table)?).map_err(settings)?;
            Box::new(Local::new(node, physics))
        }
        "acoustics" => {
            let physics = Acoustics::new(scene.acoustics.clone().ok_or_else(no_table)?).map_err(settings)?;
            Box::new(Local::new(node, physics))
        }
        other => return Err(RosterError::Kind(other.into())),
    })
}
