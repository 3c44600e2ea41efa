use std::f64::consts::PI;

use serde::Serialize;

use crate::physics::Wall;

/// Everything the particles' temperature depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Number of particles at t = 0.
    pub count: usize,
    /// Temperature of every particle at t = 0, in K.
    pub temperature_k: f64,
    /// Temperature of particles that come later, in K; `None` is that of the start.
    pub pour_temperature_k: Option<f64>,
    /// Density ρ in kg/m³.
    pub density_kg_m3: f64,
    /// Heat capacity C in J/(kg K).
    pub heat_capacity_j_kg_k: f64,
    /// Conductivity K in W/(m K).
    pub conductivity_w_m_k: f64,
    /// How a contact conducts.
    pub conductance: Conductance,
    /// Walls, in the order of the scene.
    pub walls: Vec<Wall>,
    /// Weight φ in [0, 1] of the window's end (eqs. 6.44, 10.30).
    pub phi: f64,
    /// True where an optics physics writes `absorbed_power`.
    pub reads_absorbed_power: bool,
    /// True where a current physics writes `joule_power`.
    pub reads_joule_power: bool,
    /// True where particles may come and go during the run: `ids` then says which row is whose.
    pub reads_ids: bool,
    /// Tolerance of the fixed point: largest change of a temperature over the largest temperature.
    pub tolerance: f64,
    /// Iterations after which the window is given up.
    pub iterations: u32,
}

impl Settings {
    /// Heat capacity of a particle m C with m = ρ 4/3 π R³, in J/K.
    pub(super) fn capacity_j_k(&self, radius_m: f64) -> f64 {
        self.density_kg_m3 * 4.0 / 3.0 * PI * radius_m.powi(3) * self.heat_capacity_j_kg_k
    }
}

/// Conductance of a contact, in W/K.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Conductance {
    /// K A/d, the monograph's (eq. 6.35).
    Monograph,
    /// 2 K a, the exact one of a small circular spot of radius a between half-spaces (Holm 1967), a = √(A/π).
    Constriction,
}
