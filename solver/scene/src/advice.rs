//! Advice on a scene before it runs: the dimensionless numbers that decide which physics matter and which fidelity
//! suffices, each with what follows from it and a bound of what following it changes.
//!
//! Nothing is run: numbers come from the scene and its start configuration. What cannot be known before the run is replaced by a
//! stated bound. Each physics has its numbers in its own folder; here they are put together.

use stagger_coupling::SolveError;
pub use stagger_physics::common::advice::{Advice, Edit, Effect, Quantity, Verdict};
use stagger_physics::{
    PhysicsKind,
    common::advice::{Advisor, BodyFacts, Facts, Number},
};

use crate::{Scene, built_in::BUILT_IN};

/// Advice on a scene, in the order of its physics; `within` is the relative change that counts as none, 0.01 for a percent.
/// There is none on a scene without bodies.
///
/// # Errors
/// The bodies of the scene cannot be placed.
pub fn advise(scene: &Scene, within: f64) -> Result<Vec<Advice>, SolveError> {
    let mut facts = facts(scene, within);
    let advisors = |kinds: Vec<&PhysicsKind>| -> Vec<&'static Advisor> {
        kinds.into_iter().filter_map(|kind| kind.advice).collect()
    };
    let (of_bodies, others): (Vec<_>, Vec<_>) = BUILT_IN.iter().copied().partition(|kind| kind.bodies.is_some());
    let (of_bodies, others) = (advisors(of_bodies), advisors(others));
    of_bodies.iter().try_for_each(|advisor| (advisor.tell)(&mut facts))?;
    if facts.bodies.each.is_empty() {
        return Ok(Vec::new());
    }
    others.iter().try_for_each(|advisor| (advisor.tell)(&mut facts))?;
    let mut numbers: Vec<&Number> = Vec::new();
    for number in of_bodies.iter().chain(&others).flat_map(|advisor| advisor.numbers.iter().copied()) {
        // One that several physics share.
        if !numbers.iter().any(|known| std::ptr::eq(*known, number)) {
            numbers.push(number);
        }
    }
    numbers.sort_by_key(|number| !number.asks_for_more);
    Ok(numbers.iter().flat_map(|number| (number.advise)(&facts)).collect())
}

/// What a scene says of itself.
fn facts(scene: &Scene, within: f64) -> Facts<'_> {
    Facts {
        within,
        duration_s: scene.duration_s,
        walls: &scene.walls,
        coupling: &scene.coupling,
        solidus_k: &scene.solidus_k,
        values: &scene.effective,
        written: scene.written(),
        has_programs: scene.nodes.values().any(|node| node.command.is_some()),
        tables: scene.tables(),
        bodies: BodyFacts::none(),
        heat: None,
        lights: Vec::new(),
        heating_j_kg: Vec::new(),
        beams: Vec::new(),
    }
}
