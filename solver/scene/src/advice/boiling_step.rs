//! Heat of the longest step over what boils a particle away.

use stagger_coupling::Window;
use stagger_physics::{
    optics::Model,
    thermal::{Material, Settings},
};
use std::f64::consts::PI;

use super::{
    Advice, Verdict,
    facts::{Body, Facts, Laser},
    moving_spot::steps,
};

/// Share of what boils a particle that it may get in a step: of the light for it, half of this is meant for it when it has
/// boiled, in the mean.
const MOST: f64 = 0.1;

/// Advice on the steps of each laser that can boil something: what the particle in the middle of the beam gets in the longest
/// step, over what takes it from the start to vapour (a bound).
///
/// Light that is computed for several steps at once counts with all of them.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(to_vapour_j_kg) = facts.thermal.and_then(|thermal| to_vapour_j_kg(thermal, facts)) else {
        return Vec::new();
    };
    let local = |laser: &&Laser<'_>| laser.energy_j > 0.0 && laser.settings.model != Model::EnergyBalance;
    let one = |laser: &Laser<'_>| {
        let (coupling, beam) = (&facts.scene.coupling, &laser.settings.beam);
        let node = laser.table.strip_prefix("nodes.").unwrap_or(&laser.table);
        let every = coupling.every.get(node).copied().unwrap_or(1);
        let step_s = coupling.dt.limit_s.min(facts.duration_s()) * every as f64;
        let lit = Window { t_s: beam.starts_s.max(0.0), dt_s: step_s };
        let fluence_j_m2 = beam.mean_power_w(lit) * step_s * beam.profile.irradiance_1_m2(0.0);
        let heat = |body: &Body| {
            fluence_j_m2 * laser.share_of(body).min(1.0) * PI * body.radius_m * body.radius_m / body.mass_kg
        };
        let value = facts.bodies.iter().map(heat).fold(0.0, f64::max) / to_vapour_j_kg;
        let fits = value <= MOST || !value.is_finite();
        let verdict = if fits { Verdict::Suffices } else { Verdict::Refine };
        let mut says = if fits {
            "what boils takes nearly all of its light".to_owned()
        } else {
            "a particle can boil away early in a step: the light that is meant for it until the step's end is booked as `missed` \
             and does not reach what lies behind"
                .to_owned()
        };
        if every > 1 {
            says += &format!(
                "; coupling.every.{node} makes it {every} steps, and light for what has left since is missed too"
            );
        }
        let meaning =
            "heat of a particle in the middle of the beam in the longest step over what boils it away (a bound)";
        let number = "heat of a step over heat to boil";
        let mut advice = Advice::new(&laser.table, number, value, meaning, verdict, says);
        if !fits {
            advice.edits = steps(facts, coupling.dt.limit_s.min(facts.duration_s()) * MOST / value);
        }
        advice
    };
    facts.lasers.iter().filter(local).map(one).collect()
}

/// Least heat from the start to vapour of a material that boils, in J/kg.
fn to_vapour_j_kg(thermal: &Settings, facts: &Facts<'_>) -> Option<f64> {
    let capacity_j_kg_k = facts.capacity_j_kg_k(thermal);
    let of = |material: &Material| {
        let phases = material.phases?;
        let boiling = phases.boiling?;
        let melting_j_kg = phases.melting.map_or(0.0, |melting| melting.latent_j_kg);
        let rise_k = boiling.from_k + boiling.width_k - thermal.temperature_k;
        Some(capacity_j_kg_k * rise_k + melting_j_kg + boiling.latent_j_kg)
    };
    let least = thermal.enthalpy.iter().flat_map(|enthalpy| &enthalpy.materials).filter_map(of).reduce(f64::min)?;
    (least > 0.0).then_some(least)
}
