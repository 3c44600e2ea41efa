//! Exchange with the surroundings over the run.

use stagger_coupling::math;

use super::heat::all;
use crate::{
    common::{
        advice::{Advice, Body, Edit, Facts, HeatFacts, Number, Verdict},
        radiation::STEFAN_BOLTZMANN_W_M2_K4,
    },
    thermal::settings::{Ambient, Settings},
};

/// A black body's surroundings at the particles' first temperature, for scenes that name none.
fn unnamed(start_k: f64) -> Ambient {
    Ambient { temperature_k: start_k, convection_w_m2_k: 0.0, emissivity: 1.0, exposed: 1.0 }
}

/// Change of the smallest particle's temperature in K by surroundings in some time, if it stays at `hot_k`:
/// (h |θ − θ_∞| + ε σ_SB |θ⁴ − θ_∞⁴|) t A/(m C), A/m = 3/(ρ R) of a sphere.
fn free_k(facts: &Facts<'_>, heat: &HeatFacts, ambient: &Ambient, hot_k: f64, time_s: f64) -> f64 {
    let area = |body: &Body| 4.0 * std::f64::consts::PI * math::powi(body.radius_m, 2) / body.mass_kg;
    let area_m2_kg = facts.bodies.each.iter().map(area).fold(0.0, f64::max);
    let there_k = ambient.temperature_k;
    let flux = ambient.convection_w_m2_k * (hot_k - there_k).abs()
        + ambient.emissivity * STEFAN_BOLTZMANN_W_M2_K4 * (math::powi(hot_k, 4) - math::powi(there_k, 4)).abs();
    ambient.exposed * area_m2_kg * flux * time_s / heat.capacity_j_kg_k
}

/// The same of one that follows: nothing cools, or warms, beyond its surroundings.
fn change_k(facts: &Facts<'_>, heat: &HeatFacts, ambient: &Ambient, hot_k: f64, time_s: f64) -> f64 {
    free_k(facts, heat, ambient, hot_k, time_s).min((hot_k - ambient.temperature_k).abs())
}

/// Bound of the change that the scene's own surroundings give particles at `hot_k`, in K; zero where it names none.
pub(super) fn exchange_k(facts: &Facts<'_>, thermal: &Settings, heat: &HeatFacts, hot_k: f64) -> f64 {
    let ambient = thermal.enthalpy.as_ref().and_then(|enthalpy| enthalpy.ambient);
    ambient.map_or(0.0, |ambient| change_k(facts, heat, &ambient, hot_k, facts.duration_s))
}

/// The surroundings: the share of its temperature that the hottest particle exchanges with them in the run.
///
/// The bound for a particle takes the highest temperature there can be over all the run. What is lost is a convex function of
/// the temperature, so that the mean loses at most the share of that which its own rise is of the highest (the chord of
/// the function), for the time it has risen. Where the scene has no surroundings, adding them is advised when already
/// particles of the mean temperature lose more than counts, as black bodies: nothing is said of their surface.
pub static RADIATION: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some((thermal, heat)) = all(facts) else { return Vec::new() };
    let (Some(hottest_k), Some([heating_k, _])) = (facts.hottest_k(heat), facts.heating_rise_k(heat)) else {
        return Vec::new();
    };
    let (start_k, whole_s) = (thermal.temperature_k, facts.duration_s);
    let own = thermal.enthalpy.as_ref().and_then(|enthalpy| enthalpy.ambient);
    let ambient = own.unwrap_or_else(|| unnamed(start_k));
    let highest_k = hottest_k.max(ambient.temperature_k);
    let lost_k = change_k(facts, heat, &ambient, highest_k, whole_s);
    // Where particles begin, surroundings may be the other side.
    let begun_k = exchange_k(facts, thermal, heat, start_k);
    let [light_k, _] = facts.light_rise_k(heat);
    let light_k = light_k.min(highest_k - start_k);
    let walls_k = facts.walls.iter().filter_map(|wall| wall.temperature_k).fold(start_k, f64::max) - start_k;
    let most_k = lost_k + begun_k;
    let mean_k = if highest_k > start_k {
        let above = Ambient { temperature_k: start_k, ..ambient };
        let per_k_s = free_k(facts, heat, &above, highest_k, 1.0) / (highest_k - start_k);
        let risen_k_s = light_k * facts.warm_s() + (walls_k + heating_k) * whole_s;
        (per_k_s * risen_k_s + begun_k).min(most_k)
    } else {
        most_k
    };
    let likely_k = change_k(facts, heat, &ambient, start_k + light_k + heating_k, facts.warm_s().max(0.5 * whole_s));
    let small = facts.is_small(heat, [mean_k, most_k]);
    let verdict = match own {
        Some(_) if small => Verdict::Drop,
        Some(_) => Verdict::Keep,
        None if likely_k > facts.within * start_k => Verdict::Add,
        None => Verdict::Suffices,
    };
    let says = match (own, verdict) {
        (_, Verdict::Drop) => "what the surroundings take or give is next to nothing in this time".to_owned(),
        (Some(_), _) => "the surroundings take or give heat".to_owned(),
        (_, Verdict::Add) => format!("black particles of the mean temperature would radiate {likely_k:.1} K of it"),
        _ if small => "without surroundings: they would take next to nothing in this time".to_owned(),
        _ => format!("left out as it is: black particles of the mean temperature would radiate {likely_k:.2} K of it"),
    };
    let meaning =
        format!("change of temperature by the surroundings at {highest_k:.0} K over the temperature at the start");
    let value = most_k / start_k;
    let mut advice = Advice::new("thermal.ambient", "radiated share", value, &meaning, verdict, says);
    advice.effects = facts.temperatures(mean_k, most_k);
    match verdict {
        Verdict::Drop => advice.edits = facts.without(&["thermal.ambient"], &[]),
        Verdict::Add => advice.edits = vec![Edit::set("thermal.ambient", "{ emissivity = 0.3 }")],
        _ => {}
    }
    vec![advice]
}
