//! `stagger check --json`: a scene's values in SI units, for nodes that are not written in Rust and for scripts.

use std::collections::BTreeMap;

use serde::Serialize;
use stagger_config::Value;
use stagger_messages::{Supports, Told};
use stagger_scene::{
    Scene,
    advice::{self, Advice},
};

use stagger_coupling::out_of_reach;

use crate::check::{check, ports};

/// Name of the format; keys are added within one version, never renamed or removed.
pub const FORMAT: &str = "stagger-check/3";

/// A scene as a program reads it. An infinite number is `null` in JSON.
#[derive(Serialize)]
pub struct Report<'a> {
    /// [`FORMAT`].
    pub format: &'static str,
    /// Title of the scene.
    pub title: &'a str,
    /// Simulated time, in s.
    pub duration_s: f64,
    /// Hash of the scene and its `--set` values, as a node's manifest carries it, in 16 hexadecimal digits.
    pub hash: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Every value in effect, given or default.
    pub settings: &'a [Value],
    /// What each physics is set up with, by its table or by the node that has settings of its own: material constants and
    /// defaults resolved.
    pub physics: BTreeMap<&'a str, serde_json::Value>,
    /// The supports that the fields stand on, with what their rows are in space; those of a command are known only when it
    /// runs.
    pub supports: BTreeMap<String, Told>,
    /// Advice on it, where it is asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<Vec<Advice>>,
    /// What is likely to go wrong in a run; empty where nothing is, and where a command's ports are known only when it runs.
    pub warnings: Vec<String>,
    /// Why the scene cannot run; `None` where it can.
    pub problem: Option<String>,
}

/// Looks at a scene; `within` asks for advice with that relative change counting as none. One that cannot run has its values all the same: a node that replaces another may be what it needs.
#[must_use]
pub fn report(scene: &Scene, within: Option<f64>) -> Report<'_> {
    let (problem, warnings) = match check(scene) {
        Ok(plan) => (None, plan.map(|plan| out_of_reach(&plan, &scene.coupling)).unwrap_or_default()),
        Err(error) => (Some(format!("the scene cannot run: {error}")), Vec::new()),
    };
    let tables = scene.physics.iter().map(|(name, settings)| (*name, settings));
    let own = scene.nodes.iter().filter_map(|(name, node)| Some((name.as_str(), node.own.as_ref()?)));
    let physics = tables.chain(own).map(|(name, settings)| (name, settings.to_json())).collect();
    Report {
        format: FORMAT,
        title: &scene.title,
        duration_s: scene.duration_s,
        hash: format!("{:016x}", scene.hash),
        seed: scene.seed,
        settings: &scene.effective,
        physics,
        // Where a node cannot be built, that is the problem already.
        supports: ports(scene).map(|(ports, _)| Supports::told(ports.values())).unwrap_or_default(),
        // Particles that cannot be placed are the problem already.
        advice: within.and_then(|within| advice::advise(scene, within).ok()),
        warnings,
        problem,
    }
}
