//! What heat the particles hold, and how they conduct it.

use stagger_coupling::SolveError;

use crate::{
    common::advice::{Facts, HeatFacts},
    thermal::settings::{Material, Settings},
};

/// The scene's own temperature with what was told of it.
pub fn all<'f>(facts: &'f Facts<'_>) -> Option<(&'f Settings, &'f HeatFacts)> {
    facts.tables.main::<Settings>().zip(facts.heat.as_ref())
}

/// Tells what heat the particles hold, and how they conduct it.
pub fn tell(facts: &mut Facts<'_>) -> Result<(), SolveError> {
    let Some(thermal) = facts.tables.main::<Settings>() else { return Ok(()) };
    let own_k = thermal.start.iter().flat_map(|start| &start.temperatures_k).copied();
    let phases = thermal.enthalpy.iter().flat_map(|enthalpy| &enthalpy.materials).map(|own| own.phases);
    let boils = phases.map(|own| own.and_then(|own| own.boiling).map_or(f64::INFINITY, |it| it.from_k + it.width_k));
    let capacity_j_kg_k = capacity_j_kg_k(thermal);
    facts.heat = Some(HeatFacts {
        start_k: thermal.temperature_k,
        warmest_k: own_k.fold(thermal.temperature_k, f64::max),
        capacity_j_kg_k,
        conductivity_w_m_k: conductivity_w_m_k(thermal),
        conductance: thermal.conductance,
        boiled_k: boils.reduce(f64::max).unwrap_or(f64::INFINITY),
        to_vapour_j_kg: to_vapour_j_kg(thermal, capacity_j_kg_k),
    });
    Ok(())
}

/// Least heat capacity C of a material where particles start, in J/(kg K).
fn capacity_j_kg_k(thermal: &Settings) -> f64 {
    match &thermal.enthalpy {
        // A table's least value bounds every rise from above.
        Some(enthalpy) => {
            let tables = enthalpy.materials.iter().flat_map(|material| &material.heat_capacity_j_kg_k.points);
            tables.map(|point| point[1]).fold(f64::INFINITY, f64::min)
        }
        None if thermal.temperature_k > 0.0 => thermal.heat_capacity_j_kg_k,
        None => f64::NAN,
    }
}

/// Least and greatest conductivity of a material, in W/(m K).
fn conductivity_w_m_k(thermal: &Settings) -> [f64; 2] {
    match &thermal.enthalpy {
        Some(enthalpy) => {
            let tables = enthalpy.materials.iter().flat_map(|material| &material.conductivity_w_m_k.points);
            tables.fold([f64::INFINITY, 0.0], |[least, most], point| [least.min(point[1]), most.max(point[1])])
        }
        None => [thermal.conductivity_w_m_k; 2],
    }
}

/// Least heat from the start to vapour of a material that boils, in J/kg.
fn to_vapour_j_kg(thermal: &Settings, capacity_j_kg_k: f64) -> Option<f64> {
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
