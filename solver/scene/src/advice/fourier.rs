//! Fourier number over the run: whether anything's temperature changes at all.

use super::{Advice, Verdict, facts::Facts};
use stagger_physics::{common::walls::Shape, thermal::Settings};

/// A peak may change by so many times what the mean may, for the temperature to count as unchanged.
pub(super) const PEAK_OVER_MEAN: f64 = 10.0;

/// Advice on the temperature: Fo = G t/(m C) of a particle on a warm wall, with the conductance G of its contact, and the rise
/// of the mean and of the peak that all sources can give together.
///
/// Walls: a wall at θ_w gives at most N_w G (θ_w − θ_0) t to the N_w particles that fit onto it, and nothing warms beyond
/// θ_w. G is bounded by the mean force on the floor. Light: all of it. Current: see `joule`. The ambient: see `radiation`.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(thermal) = facts.thermal else { return Vec::new() };
    let [light_mean_k, light_peak_k] = facts.light_rise_k(thermal);
    let (fourier, [wall_mean_k, wall_peak_k]) = walls(facts, thermal);
    let joule = facts.joule_rise_k(thermal);
    let ambient_k = super::radiation::exchange_k(facts, thermal, thermal.temperature_k);
    let poured_k = thermal.pour_temperature_k.map_or(0.0, |poured_k| (poured_k - thermal.temperature_k).abs());
    // What comes with particles, of a dispenser or of a file, may go over to others.
    let of_file = thermal.start.iter().flat_map(|start| &start.temperatures_k);
    let poured_k = of_file.fold(poured_k, |most, own_k| most.max((own_k - thermal.temperature_k).abs()));
    let mean_k = joule.map(|[joule_k, _]| light_mean_k + wall_mean_k + joule_k + ambient_k + poured_k);
    let mean_k = mean_k.filter(|k| k.is_finite());
    let most_k = facts.hottest_k(thermal).map_or(f64::INFINITY, |hottest_k| hottest_k - thermal.temperature_k);
    let light_peak_k = light_peak_k.min(most_k).max(light_mean_k);
    let peak_k = joule.map(|[_, joule_k]| light_peak_k + wall_peak_k + joule_k + ambient_k + poured_k);
    let start_k = thermal.temperature_k;
    let small = mean_k.is_some_and(|mean_k| mean_k <= facts.within * start_k)
        && peak_k.is_some_and(|peak_k| peak_k <= PEAK_OVER_MEAN * facts.within * start_k);
    let verdict = if small { Verdict::Drop } else { Verdict::Keep };
    let says = if small {
        format!("no source there is warms the particles noticeably: they stay at {start_k} K within what is said below")
    } else if fourier.is_finite() {
        "temperatures change".to_owned()
    } else {
        "temperatures change; how hard particles are pressed onto the walls is not known before the run".to_owned()
    };
    let meaning = "heat that a particle on the warmest wall takes up in the run, over what it can hold (a bound)";
    let mut advice = Advice::new("thermal", "Fourier number over the run", fourier, meaning, verdict, says);
    if let (Some(mean_k), Some(peak_k)) = (mean_k, peak_k) {
        advice.effects = facts.temperatures(mean_k, peak_k);
    }
    if small {
        let tables: Vec<&str> =
            std::iter::once("thermal").chain(facts.lasers.iter().map(|laser| laser.table.as_str())).collect();
        advice.edits = facts.without(&tables, &["temperature", "absorbed_power"]);
    }
    vec![advice]
}

/// Fourier number of a particle on a wall that differs from it, and bounds of the change of the mean and of the peak by all
/// walls, in K.
fn walls(facts: &Facts<'_>, thermal: &Settings) -> (f64, [f64; 2]) {
    let start_k = thermal.temperature_k;
    let lightest_kg = facts.bodies.iter().map(|body| body.mass_kg).fold(f64::INFINITY, f64::min);
    let capacity = facts.capacity_j_kg_k(thermal);
    let (mut fourier, mut mean_k, mut peak_k) = (0.0f64, 0.0, 0.0f64);
    for wall in &facts.scene.walls {
        let Some(difference_k) = wall.temperature_k.map(|wall_k| (wall_k - start_k).abs()).filter(|k| *k > 0.0) else {
            continue;
        };
        let contacts = match &wall.shape {
            Shape::Plane(plane) => facts.on_plane(plane.normal),
            _ => facts.number(),
        };
        let hottest_k = facts.hottest_k(thermal).unwrap_or(f64::INFINITY);
        let one_w_k = facts.contact_conductance_w_k(thermal, contacts, hottest_k).unwrap_or(f64::INFINITY);
        let taken = one_w_k * facts.duration_s() / capacity;
        fourier = fourier.max(taken / lightest_kg);
        mean_k += difference_k * (contacts * taken / facts.mass_kg()).min(1.0);
        peak_k = peak_k.max(difference_k);
    }
    (fourier, [mean_k.min(peak_k), peak_k])
}
