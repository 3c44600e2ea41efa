//! What is computed that nothing reads, and what is set that nothing computes.

use super::{Advice, Verdict, facts::Facts};

/// Advice where light or current heats nothing because no temperature is computed, and where walls are warm for nothing.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let mut advice = Vec::new();
    let replaced = facts.scene.nodes.values().any(|node| node.command.is_some());
    if facts.thermal.is_some() || replaced {
        return advice;
    }
    let number = "readers of the heat";
    let meaning = "physics of the scene that take the heat up";
    if !facts.lasers.is_empty() {
        let says = "absorbed light heats nothing: without [thermal] nobody reads `absorbed_power`".into();
        let mut own = Advice::new("thermal", number, 0.0, meaning, Verdict::Add, says);
        own.edits = vec![super::Edit::set("thermal", "{}")];
        advice.push(own);
    }
    let warm = facts.scene.walls.iter().find(|wall| wall.temperature_k.is_some());
    if let Some(wall) = warm {
        let says = format!("wall `{}` has a temperature, which changes nothing without [thermal]", wall.name);
        let mut own = Advice::new("thermal", number, 0.0, meaning, Verdict::Add, says);
        own.edits = vec![super::Edit::set("thermal", "{}")];
        advice.push(own);
    }
    advice.truncate(1);
    advice
}
