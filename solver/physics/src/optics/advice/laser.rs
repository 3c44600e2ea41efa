//! Energy of each laser over the heat of the particles.

use crate::common::advice::{Advice, Effect, Facts, LightFacts, Number, Quantity, Verdict};

/// Each light: the rise that all of its light would give the mean, over the temperature at the start, with that of the
/// particle that gets most: the light that falls on its place, of which it takes its share, losing nothing.
pub static LASER: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(heat) = &facts.heat else { return Vec::new() };
    let (start_k, capacity) = (heat.start_k, heat.capacity_j_kg_k);
    let one = |laser: &LightFacts| {
        let mean_k = laser.energy_j / (facts.bodies.mass_kg() * capacity);
        let [_, all_k] = facts.light_rise_k(heat);
        let most_k = facts.hottest_k(heat).map_or(f64::INFINITY, |hottest_k| hottest_k - start_k);
        let peak_k = all_k.min(most_k).max(mean_k);
        let small = facts.is_small(heat, [mean_k, peak_k]);
        let verdict = if small { Verdict::Drop } else { Verdict::Keep };
        let says = if laser.energy_j <= 0.0 {
            "the laser is never on"
        } else if small {
            "its light warms nothing noticeably"
        } else {
            "its light warms the particles"
        };
        let meaning = "rise of the mean temperature if all the light is absorbed, over the temperature at the start";
        let mut advice =
            Advice::new(&laser.table, "energy of the light", mean_k / start_k, meaning, verdict, says.into());
        advice.effects = facts.temperatures(mean_k, peak_k);
        if small {
            let last = facts.lights.len() == 1;
            let fields: &[&str] = if last { &["absorbed_power"] } else { &[] };
            advice.edits = facts.without(&[laser.table.as_str()], fields);
            advice.effects.push(Effect {
                quantity: Quantity::AbsorbedEnergy,
                at_most: laser.energy_j,
                share: if laser.energy_j > 0.0 { 1.0 } else { 0.0 },
            });
        }
        advice
    };
    facts.lights.iter().map(one).collect()
}
