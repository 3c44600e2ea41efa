//! Fourier number over the run: whether anything's temperature changes at all.

use super::{heat::all, radiation::exchange_k};
use crate::{
    common::{
        Shape,
        advice::{Advice, Facts, HeatFacts, Number, Verdict},
    },
    thermal::NODE,
};

/// The temperature: Fo = G t/(m C) of a particle on a warm wall, with the conductance G of its contact, and the rise
/// of the mean and of the peak that all sources can give together.
///
/// Walls: a wall at θ_w gives at most N_w G (θ_w − θ_0) t to the N_w particles that fit onto it, and nothing warms beyond
/// θ_w. G is bounded by the mean force on the floor. Light: all of it. What else heats: all of it. The ambient: see `radiation`.
pub static FOURIER: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some((thermal, heat)) = all(facts) else { return Vec::new() };
    let [light_mean_k, light_peak_k] = facts.light_rise_k(heat);
    let (fourier, [wall_mean_k, wall_peak_k]) = walls(facts, heat);
    let heating = facts.heating_rise_k(heat);
    let ambient_k = exchange_k(facts, thermal, heat, thermal.temperature_k);
    let poured_k = thermal.pour_temperature_k.map_or(0.0, |poured_k| (poured_k - thermal.temperature_k).abs());
    // What comes with particles, of a dispenser or of a file, may go over to others.
    let of_file = thermal.start.iter().flat_map(|start| &start.temperatures_k);
    let poured_k = of_file.fold(poured_k, |most, own_k| most.max((own_k - thermal.temperature_k).abs()));
    let mean_k = heating.map(|[heating_k, _]| light_mean_k + wall_mean_k + heating_k + ambient_k + poured_k);
    let mean_k = mean_k.filter(|k| k.is_finite());
    let most_k = facts.hottest_k(heat).map_or(f64::INFINITY, |hottest_k| hottest_k - thermal.temperature_k);
    let light_peak_k = light_peak_k.min(most_k).max(light_mean_k);
    let peak_k = heating.map(|[_, heating_k]| light_peak_k + wall_peak_k + heating_k + ambient_k + poured_k);
    let start_k = thermal.temperature_k;
    let small = mean_k.zip(peak_k).is_some_and(|(mean_k, peak_k)| facts.is_small(heat, [mean_k, peak_k]));
    let verdict = if small { Verdict::Drop } else { Verdict::Keep };
    let says = if small {
        format!("no source there is warms the particles noticeably: they stay at {start_k} K within what is said below")
    } else if fourier.is_finite() {
        "temperatures change".to_owned()
    } else {
        "temperatures change; how hard particles are pressed onto the walls is not known before the run".to_owned()
    };
    let meaning = "heat that a particle on the warmest wall takes up in the run, over what it can hold (a bound)";
    let mut advice = Advice::new(NODE, "Fourier number over the run", fourier, meaning, verdict, says);
    if let (Some(mean_k), Some(peak_k)) = (mean_k, peak_k) {
        advice.effects = facts.temperatures(mean_k, peak_k);
    }
    if small {
        let tables: Vec<&str> =
            std::iter::once(NODE).chain(facts.lights.iter().map(|light| light.table.as_str())).collect();
        advice.edits = facts.without(&tables, &["temperature", "absorbed_power"]);
    }
    vec![advice]
}

/// Fourier number of a particle on a wall that differs from it, and bounds of the change of the mean and of the peak by all
/// walls, in K.
fn walls(facts: &Facts<'_>, heat: &HeatFacts) -> (f64, [f64; 2]) {
    let start_k = heat.start_k;
    let (lightest_kg, capacity) = (facts.bodies.lightest_kg(), heat.capacity_j_kg_k);
    let (mut fourier, mut mean_k, mut peak_k) = (0.0f64, 0.0, 0.0f64);
    for wall in facts.walls {
        let Some(difference_k) = wall.temperature_k.map(|wall_k| (wall_k - start_k).abs()).filter(|k| *k > 0.0) else {
            continue;
        };
        let contacts = match &wall.shape {
            Shape::Plane(plane) => facts.bodies.on_plane(plane.normal),
            _ => facts.bodies.number(),
        };
        let hottest_k = facts.hottest_k(heat).unwrap_or(f64::INFINITY);
        let one_w_k = facts.contact_conductance_w_k(heat, contacts, hottest_k).unwrap_or(f64::INFINITY);
        let taken = one_w_k * facts.duration_s / capacity;
        fourier = fourier.max(taken / lightest_kg);
        mean_k += difference_k * (contacts * taken / facts.bodies.mass_kg()).min(1.0);
        peak_k = peak_k.max(difference_k);
    }
    (fourier, [mean_k.min(peak_k), peak_k])
}
