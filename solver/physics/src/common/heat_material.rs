//! What heat needs to know of a material.

use serde::Serialize;

use super::{PhaseChange, Phases, Table, keys::materials::Material};

/// Properties of a material that decide its temperature. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeatMaterial {
    /// Its name in the scene.
    pub name: String,
    /// Density ρ in kg/m³; it holds for every temperature and phase, as bodies keep mass and size.
    pub density_kg_m3: f64,
    /// Heat capacity C in J/(kg K), without latent heat.
    pub heat_capacity_j_kg_k: Table,
    /// Conductivity K in W/(m K).
    pub conductivity_w_m_k: Table,
    /// Where it melts and boils; `None` is never.
    pub phases: Option<Phases>,
}

/// Bandwidths of the changes of phase, as a scene asks for them.
#[derive(Clone, Copy, Debug)]
pub struct PhaseBands {
    /// Of melting, in K; `None` is from the solidus to the liquidus.
    pub melting_k: Option<f64>,
    /// Of boiling, in K; `None` is a material that does not boil.
    pub boiling_k: Option<f64>,
}

impl HeatMaterial {
    /// The properties that a scene gives for a material; `bands` where it changes its phase. `number` and `table` report, by
    /// its name, a property that is missing, and return what stands in for it.
    pub(crate) fn of(
        (name, known): &(String, Material),
        bands: Option<&PhaseBands>,
        number: impl Fn(&str, Option<f64>) -> f64,
        table: impl Fn(&str, &Option<Table>) -> Table,
    ) -> Self {
        let density_kg_m3 = number("density", known.density_kg_m3);
        let heat_capacity_j_kg_k = table("heat-capacity", &known.heat_capacity_j_kg_k);
        let conductivity_w_m_k = table("conductivity", &known.conductivity_w_m_k);
        let phases = bands.map(|bands| {
            let solidus_k = number("solidus", known.solidus_k);
            let melting = PhaseChange {
                from_k: solidus_k,
                width_k: bands.melting_k.unwrap_or_else(|| number("liquidus", known.liquidus_k) - solidus_k),
                latent_j_kg: number("melting-heat", known.melting_heat_j_kg),
            };
            let boiling = bands.boiling_k.map(|width_k| PhaseChange {
                from_k: number("boiling", known.boiling_k),
                width_k,
                latent_j_kg: number("boiling-heat", known.boiling_heat_j_kg),
            });
            Phases { melting: Some(melting), boiling }
        });
        Self { name: name.clone(), density_kg_m3, heat_capacity_j_kg_k, conductivity_w_m_k, phases }
    }
}
