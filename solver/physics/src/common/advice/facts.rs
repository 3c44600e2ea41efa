//! What advice rests on: a scene, and what its physics tell of it.

use std::collections::{BTreeMap, BTreeSet};

use stagger_config::Value;
use stagger_coupling::Settings as CouplingSettings;

use super::{
    Edit, Effect, Quantity,
    told::{BeamFacts, BodyFacts, HeatFacts, LightFacts},
};
use crate::common::{Partner, Tables, Wall, conductance};

/// A peak may change by so many times what the mean may, for the temperature to count as unchanged.
const PEAK_OVER_MEAN: f64 = 10.0;

/// What advice rests on.
pub struct Facts<'s> {
    /// Relative change that counts as none: 0.01 is a percent.
    pub within: f64,
    /// Simulated time, in s.
    pub duration_s: f64,
    /// Walls, in the order of the scene.
    pub walls: &'s [Wall],
    /// How the physics are coupled.
    pub coupling: &'s CouplingSettings,
    /// Where the materials begin to melt, in K, by name, where it is known.
    pub solidus_k: &'s BTreeMap<String, f64>,
    /// Every value in effect.
    pub values: &'s [Value],
    /// Fields that physics of the scene write.
    pub written: BTreeSet<String>,
    /// Whether programs of the user's take part, of which nothing is known.
    pub has_programs: bool,
    /// Settings of each physics.
    pub tables: Tables<'s>,
    /// What the bodies are.
    pub bodies: BodyFacts,
    /// What holds their heat.
    pub heat: Option<HeatFacts>,
    /// The light on them.
    pub lights: Vec<LightFacts>,
    /// Bounds of the heat of the mean and of any body by each source beside light, in J/kg; `None` of one that cannot be bounded.
    pub heating_j_kg: Vec<Option<[f64; 2]>>,
    /// Beams of light and of sound.
    pub beams: Vec<BeamFacts<'s>>,
}

impl Facts<'_> {
    /// Bound of the conductance in W/K of one contact, of those among which the press is shared by `contacts`; `None` where
    /// the press is not known.
    ///
    /// A contact's area grows less than in proportion to its force for every law, so that the mean over time and contacts
    /// of the conductance is at most that at the mean force (Jensen's inequality). A contact with a wall conducts at least as
    /// well as one between particles.
    #[must_use]
    pub fn contact_conductance_w_k(&self, heat: &HeatFacts, contacts: f64, hottest_k: f64) -> Option<f64> {
        let (overlap_m, area_m2) = (self.bodies.pressed)(contacts, hottest_k)?;
        let [_, most] = heat.conductivity_w_m_k;
        conductance(heat.conductance, Partner::Wall, most, area_m2, self.bodies.largest_m() - overlap_m)
    }

    /// Bound of the mean rise of temperature if all light is absorbed, and of the rise of the particle that gets most, in K.
    #[must_use]
    pub fn light_rise_k(&self, heat: &HeatFacts) -> [f64; 2] {
        let light_j: f64 = self.lights.iter().map(|light| light.energy_j).sum();
        let mean_k = light_j / (self.bodies.mass_kg() * heat.capacity_j_kg_k);
        let peaks_j_kg: f64 = self.lights.iter().map(|light| light.peak_j_kg).sum();
        // In a cloud that holds all the light no particle takes more than all of it.
        [mean_k, (peaks_j_kg / heat.capacity_j_kg_k).max(mean_k)]
    }

    /// Bounds of the mean rise by what heats beside light, and of any particle's, in K; `None` where it cannot be bounded.
    #[must_use]
    pub fn heating_rise_k(&self, heat: &HeatFacts) -> Option<[f64; 2]> {
        let mut sum_k = [0.0; 2];
        for source in &self.heating_j_kg {
            let own_k = (*source)?.map(|j_kg| j_kg / heat.capacity_j_kg_k);
            sum_k = [sum_k[0] + own_k[0], sum_k[1] + own_k[1]];
        }
        Some(sum_k)
    }

    /// Bound of the temperature that anything would have that loses no heat and changes no phase, in K; `None` where the heat
    /// is not bounded.
    #[must_use]
    pub fn hottest_without_phases_k(&self, heat: &HeatFacts) -> Option<f64> {
        let walls = self.walls.iter().filter_map(|wall| wall.temperature_k).fold(heat.warmest_k, f64::max);
        let [_, light_k] = self.light_rise_k(heat);
        let [_, heating_k] = self.heating_rise_k(heat)?;
        Some(walls + light_k + heating_k)
    }

    /// The same with phases: what has boiled leaves.
    #[must_use]
    pub fn hottest_k(&self, heat: &HeatFacts) -> Option<f64> {
        self.hottest_without_phases_k(heat).map(|hottest_k| hottest_k.min(heat.boiled_k))
    }

    /// Whether changes of the mean temperature and of the highest, in K, count as none.
    #[must_use]
    pub fn is_small(&self, heat: &HeatFacts, [mean_k, peak_k]: [f64; 2]) -> bool {
        let limit_k = self.within * heat.start_k;
        mean_k <= limit_k && peak_k <= PEAK_OVER_MEAN * limit_k
    }

    /// How long the light warms particles, in s: half of the time it is on, as the mean rises evenly, and all that follows.
    #[must_use]
    pub fn warm_s(&self) -> f64 {
        let warm = |light: &LightFacts| {
            let ends_s = light.ends_s.min(self.duration_s);
            self.duration_s - 0.5 * (light.starts_s.min(ends_s) + ends_s)
        };
        self.lights.iter().map(warm).fold(0.0, f64::max)
    }

    /// A bound of a mean and of a peak temperature as effects.
    #[must_use]
    pub fn temperatures(&self, mean_k: f64, peak_k: f64) -> Vec<Effect> {
        let start_k = self.bodies.temperature_k;
        [(Quantity::MeanTemperature, mean_k), (Quantity::PeakTemperature, peak_k)]
            .map(|(quantity, at_most)| Effect { quantity, at_most, share: at_most / start_k })
            .into()
    }

    /// Edits that take tables out, and with them what the coupling says of their nodes and fields.
    #[must_use]
    pub fn without(&self, tables: &[&str], fields: &[&str]) -> Vec<Edit> {
        let tables = tables.iter().map(|table| (*table).to_owned());
        let of_nodes = tables.clone().map(|table| format!("coupling.every.{table}"));
        let of_fields =
            fields.iter().flat_map(|field| [format!("coupling.tolerance.{field}"), format!("coupling.fields.{field}")]);
        let given = |key: &String| {
            let below = format!("{key}.");
            self.values.iter().any(|value| value.path == *key || value.path.starts_with(&below))
        };
        let coupling: Vec<String> = of_nodes.chain(of_fields).filter(given).collect();
        tables.chain(coupling).map(|key| Edit::Delete { key }).collect()
    }

    /// Edits that give a longest step, in s; the first one is at most that.
    #[must_use]
    pub fn steps(&self, step_s: f64) -> Vec<Edit> {
        let (dt, value) = (&self.coupling.dt, format!("{step_s:.3e}"));
        // A step that does not grow is a single time in most scenes.
        if dt.start_s >= dt.limit_s {
            return vec![Edit::set("coupling.dt", value)];
        }
        let begins = dt.start_s > step_s;
        let keys = ["coupling.dt.start", "coupling.dt.limit"].into_iter().skip(usize::from(!begins));
        keys.map(|key| Edit::set(key, value.clone())).collect()
    }
}
