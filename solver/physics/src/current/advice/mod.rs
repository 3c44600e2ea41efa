//! Advice on the current, and what its heat is to others' advice.

mod charge_relaxation;
mod joule;

use std::f64::consts::PI;

use stagger_coupling::{SolveError, math};

pub use self::charge_relaxation::charge_relaxation_s;
use super::settings::{Model, Settings};
use crate::common::{
    Partner,
    advice::{Advisor, Body, Facts},
    conductance,
};

/// What the current contributes to advice.
pub static ADVISOR: Advisor = Advisor { tell, numbers: &[&joule::JOULE, &charge_relaxation::CHARGE_RELAXATION] };

/// Tells bounds of the Joule heat.
fn tell(facts: &mut Facts<'_>) -> Result<(), SolveError> {
    if let Some(current) = facts.tables.main::<Settings>() {
        let heat_j_kg = heat_j_kg(facts, current);
        facts.heating_j_kg.push(heat_j_kg);
    }
    Ok(())
}

/// Bounds of the mean Joule heat and of any particle's, in J/kg; `None` where it cannot be bounded.
///
/// A current density that is a mean of its neighbours' is nowhere larger than the largest of the walls'. Between
/// potentials no more current flows than the contacts with one electrode let through under all the tension.
fn heat_j_kg(facts: &Facts<'_>, current: &Settings) -> Option<[f64; 2]> {
    let bodies = &facts.bodies;
    let on_s = (current.ends_s.min(facts.duration_s) - current.starts_s).max(0.0);
    let electrodes = || facts.walls.iter().map(|wall| wall.electrode);
    let [least_s_m, most_s_m] = current.conductivity.range_s_m();
    match current.model {
        Model::Averaging { heat_share } => {
            let density = |body: &Body| body.mass_kg / (4.0 / 3.0 * PI * math::powi(body.radius_m, 3));
            let least_kg_m3 = bodies.each.iter().map(density).fold(f64::INFINITY, f64::min);
            let most = electrodes().filter_map(|electrode| electrode.current_density_a_m2);
            let most = most.fold(0.0f64, |most, own| most.max(own.abs()));
            // Where all particles carry it, the bound is met: the thousandth is for rounding.
            let heat_j_kg = 1.001 * heat_share * most * most * on_s / (least_s_m.max(0.0) * least_kg_m3);
            heat_j_kg.is_finite().then_some([heat_j_kg; 2])
        }
        Model::Potential { conductance: model } => {
            if electrodes().any(|electrode| electrode.current_a.is_some()) {
                return None;
            }
            let potentials = || electrodes().filter_map(|electrode| electrode.potential_v);
            let tension = potentials().fold(f64::NEG_INFINITY, f64::max) - potentials().fold(f64::INFINITY, f64::min);
            let contacts = bodies.number();
            let (overlap_m, area_m2) = (bodies.pressed)(contacts, bodies.temperature_k)?;
            let one_s = conductance(model, Partner::Wall, most_s_m, area_m2, bodies.largest_m() - overlap_m)?;
            let heat_j = contacts * one_s * math::powi(tension.max(0.0), 2) * on_s;
            Some([heat_j / bodies.mass_kg(), heat_j / bodies.lightest_kg()])
        }
    }
}
