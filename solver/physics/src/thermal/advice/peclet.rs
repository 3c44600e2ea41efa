//! Péclet number of the beam: whether heat spreads between particles while they are lit.

use crate::common::advice::{Advice, Edit, Facts, Number, Verdict};

/// Most contacts of a sphere with equals.
const KISSING: f64 = 12.0;

/// Conduction between particles: Pe = (m C/ΣG)/t_dwell, the time in which a particle's contacts carry its heat away
/// over that for which the beam lights it.
///
/// From when the light comes on, for t, a particle gives away at most the share ΣG t/(m C) of its rise: that is what leaving
/// conduction out changes peaks by at most. The mean changes by what walls can give (see `fourier`) and by what they can
/// take of the rise.
pub static PECLET: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(heat) = facts.heat.as_ref().filter(|_| !facts.lights.is_empty()) else { return Vec::new() };
    let [_, most] = heat.conductivity_w_m_k;
    if most <= 0.0 {
        return Vec::new();
    }
    let Some(hottest_k) = facts.hottest_k(heat) else { return Vec::new() };
    let floor = facts.bodies.on_floor();
    let Some(one_w_k) = facts.contact_conductance_w_k(heat, floor, hottest_k) else { return Vec::new() };
    let rate_1_s = KISSING * one_w_k / (facts.bodies.lightest_kg() * heat.capacity_j_kg_k);
    let dwell_s = facts.lights.iter().map(|light| light.dwell_s).fold(0.0, f64::max);
    if rate_1_s * dwell_s <= 0.0 {
        return Vec::new();
    }
    let from_s = facts.lights.iter().map(|light| light.starts_s).fold(f64::INFINITY, f64::min);
    let lost = (rate_1_s * (facts.duration_s - from_s).max(0.0)).min(1.0);
    let warm = facts.walls.iter().filter_map(|wall| wall.temperature_k);
    let walls_k = warm.map(|wall_k| (wall_k - heat.start_k).abs()).fold(0.0, f64::max);
    let run = (rate_1_s * facts.duration_s).min(1.0);
    let [mean_k, peak_k] = facts.light_rise_k(heat);
    let has_sink = facts.walls.iter().any(|wall| wall.temperature_k.is_some());
    let mean_change_k = run * walls_k + if has_sink { lost * mean_k } else { 0.0 };
    let peak_change_k = lost * peak_k + run * walls_k;
    let small = mean_change_k <= facts.within * mean_k && peak_change_k <= facts.within * peak_k;
    let verdict = if small { Verdict::Drop } else { Verdict::Keep };
    let says = if small {
        "heat stays where it is absorbed for all the run: conduction can be left out"
    } else if rate_1_s * dwell_s > 1.0 {
        "heat spreads while the beam is there"
    } else {
        "heat spreads after the beam has passed"
    };
    let meaning =
        "time in which contacts carry a particle's heat away over that for which the beam lights it (a bound)";
    let value = 1.0 / (rate_1_s * dwell_s);
    let mut advice = Advice::new("thermal.conductance", "Péclet number", value, meaning, verdict, says.into());
    if small {
        advice.effects = facts.temperatures(mean_change_k, peak_change_k);
        let names = facts.bodies.materials.iter();
        advice.edits = names.map(|name| Edit::set(format!("materials.{name}.conductivity"), "0")).collect();
    }
    vec![advice]
}
