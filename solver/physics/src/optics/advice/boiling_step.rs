//! Heat of the longest step over what boils a particle away.

use std::f64::consts::PI;

use stagger_coupling::Window;

use super::light::{Laser, lasers};
use crate::{
    common::advice::{Advice, Body, Facts, Number, Verdict},
    optics::settings::Model,
};

/// Share of what boils a particle that it may get in a step: of the light for it, half of this is meant for it when it has
/// boiled, in the mean.
const MOST: f64 = 0.1;

/// The steps of each laser that can boil something: what the particle in the middle of the beam gets in the longest
/// step, over what takes it from the start to vapour (a bound).
///
/// Light that is computed for several steps at once counts with all of them.
pub static BOILING_STEP: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(to_vapour_j_kg) = facts.heat.as_ref().and_then(|heat| heat.to_vapour_j_kg) else { return Vec::new() };
    let local = |laser: &Laser<'_>| laser.light.energy_j > 0.0 && laser.settings.model != Model::EnergyBalance;
    let one = |laser: Laser<'_>| {
        let (coupling, beam, table) = (facts.coupling, &laser.settings.beam, &laser.light.table);
        let node = table.strip_prefix("nodes.").unwrap_or(table);
        let every = coupling.every.get(node).copied().unwrap_or(1);
        let step_s = coupling.dt.limit_s.min(facts.duration_s) * every as f64;
        let lit = Window { t_s: beam.starts_s.max(0.0), dt_s: step_s };
        let fluence_j_m2 = beam.mean_power_w(lit) * step_s * beam.profile.irradiance_1_m2(0.0);
        let heat = |(body, share): (&Body, &f64)| {
            fluence_j_m2 * share.min(1.0) * PI * body.radius_m * body.radius_m / body.mass_kg
        };
        let value = facts.bodies.each.iter().zip(&laser.light.shares).map(heat).fold(0.0, f64::max) / to_vapour_j_kg;
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
        let mut advice = Advice::new(table, number, value, meaning, verdict, says);
        if !fits {
            advice.edits = facts.steps(coupling.dt.limit_s.min(facts.duration_s) * MOST / value);
        }
        advice
    };
    lasers(facts).filter(local).map(one).collect()
}
