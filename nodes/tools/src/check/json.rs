//! `stagger check --json`: a scene's values in SI units, for nodes that are not written in Rust and for scripts.

use std::collections::BTreeMap;

use serde::Serialize;
use stagger_config::Value;
use stagger_messages::{Supports, Told};
use stagger_physics::{acoustics, current, optics, particles, substrate, thermal};
use stagger_scene::{
    Scene,
    advice::{self, Advice},
};

use stagger_coupling::out_of_reach;

use crate::check::{check, ports};

/// Name of the format; keys are added within one version, never renamed or removed.
pub const FORMAT: &str = "stagger-check/2";

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
    /// What each physics the scene names is set up with: material constants and defaults resolved.
    pub physics: Physics<'a>,
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

/// Resolved settings by physics; those the scene does not name are left out.
#[derive(Serialize)]
pub struct Physics<'a> {
    /// The motion of the particles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub particles: Option<&'a particles::Settings>,
    /// Their temperature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal: Option<&'a thermal::Settings>,
    /// The laser.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optics: Option<&'a optics::Settings>,
    /// The electrical current.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub current: Option<&'a current::Settings>,
    /// Stress in the solid under a wall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub substrate: Option<&'a substrate::Settings>,
    /// The sound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acoustics: Option<&'a acoustics::Settings>,
}

/// Looks at a scene; `within` asks for advice with that relative change counting as none. One that cannot run has its values all the same: a node that replaces another may be what it needs.
#[must_use]
pub fn report(scene: &Scene, within: Option<f64>) -> Report<'_> {
    let (problem, warnings) = match check(scene) {
        Ok(plan) => (None, plan.map(|plan| out_of_reach(&plan, &scene.coupling)).unwrap_or_default()),
        Err(error) => (Some(format!("the scene cannot run: {error}")), Vec::new()),
    };
    Report {
        format: FORMAT,
        title: &scene.title,
        duration_s: scene.duration_s,
        hash: format!("{:016x}", scene.hash),
        seed: scene.seed,
        settings: &scene.effective,
        physics: Physics {
            particles: scene.particles.as_ref(),
            thermal: scene.thermal.as_ref(),
            optics: scene.optics.as_ref(),
            current: scene.current.as_ref(),
            substrate: scene.substrate.as_ref(),
            acoustics: scene.acoustics.as_ref(),
        },
        // Where a node cannot be built, that is the problem already.
        supports: ports(scene).map(|(ports, _)| Supports::told(ports.values())).unwrap_or_default(),
        // Particles that cannot be placed are the problem already.
        advice: within.and_then(|within| advice::advise(scene, within).ok()),
        warnings,
        problem,
    }
}
