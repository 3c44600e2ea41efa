//! Heat that nobody takes up, and walls that are warm for nothing, where no temperature is computed.

use crate::{
    common::advice::{Advice, Edit, Facts, Number, Verdict},
    thermal::NODE,
};

/// Readers of the heat: none without a temperature.
pub static UNREAD: Number = Number { asks_for_more: true, advise };

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    if facts.heat.is_some() || facts.has_programs {
        return Vec::new();
    }
    let says = if !facts.lights.is_empty() {
        "absorbed light heats nothing: without [thermal] nobody reads `absorbed_power`".to_owned()
    } else if let Some(wall) = facts.walls.iter().find(|wall| wall.temperature_k.is_some()) {
        format!("wall `{}` has a temperature, which changes nothing without [thermal]", wall.name)
    } else {
        return Vec::new();
    };
    let meaning = "physics of the scene that take the heat up";
    let mut advice = Advice::new(NODE, "readers of the heat", 0.0, meaning, Verdict::Add, says);
    advice.edits = vec![Edit::set(NODE, "{}")];
    vec![advice]
}
