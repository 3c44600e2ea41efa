//! Energy of each laser over the heat of the particles.

use super::{Advice, Effect, Quantity, Verdict, facts::Facts};

/// Advice on each laser: the rise that all of its light would give the mean, over the temperature at the start, with that of the
/// particle that gets most: the light that falls on its place, of which it takes its share, losing nothing.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(thermal) = facts.thermal else { return Vec::new() };
    let start_k = thermal.temperature_k;
    let capacity = facts.capacity_j_kg_k(thermal);
    let one = |laser: &super::facts::Laser<'_>| {
        let mean_k = laser.energy_j / (facts.mass_kg() * capacity);
        let [_, all_k] = facts.light_rise_k(thermal);
        let most_k = facts.hottest_k(thermal).map_or(f64::INFINITY, |hottest_k| hottest_k - start_k);
        let peak_k = all_k.min(most_k).max(mean_k);
        let small =
            mean_k <= facts.within * start_k && peak_k <= super::fourier::PEAK_OVER_MEAN * facts.within * start_k;
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
            let last = facts.lasers.len() == 1;
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
    facts.lasers.iter().map(one).collect()
}
