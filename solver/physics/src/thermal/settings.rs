//! Settings of the particles' temperature.

use std::f64::consts::PI;

use serde::Serialize;

use stagger_messages::{Measure, Port, Ports};

use super::{NODE, Thermal};
pub use crate::common::{Conductance, HeatMaterial as Material, PhaseChange, Phases};
use stagger_coupling::{SolveError, math};

use crate::common::{
    PARTICLES, SURFACE, SolidSurface, Wall,
    checks::{positive, setting},
    contacts, power_port,
};

/// Everything the particles' temperature depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Number of particles at t = 0.
    pub count: usize,
    /// Temperature of every particle at t = 0, in K.
    pub temperature_k: f64,
    /// What each particle has at t = 0 instead, in the order of the rows; `None` where they start alike.
    pub start: Option<Start>,
    /// Temperature of particles that come later, in K; `None` is that of the start.
    pub pour_temperature_k: Option<f64>,
    /// Density ρ in kg/m³; this and the next two are of the first material at the start, and hold for all particles at all
    /// temperatures where [`Self::enthalpy`] is `None`.
    pub density_kg_m3: f64,
    /// Heat capacity C in J/(kg K).
    pub heat_capacity_j_kg_k: f64,
    /// Conductivity K in W/(m K).
    pub conductivity_w_m_k: f64,
    /// How a contact conducts.
    pub conductance: Conductance,
    /// Walls, in the order of the scene.
    pub walls: Vec<Wall>,
    /// The solid on a grid whose upper face one of the walls is; `None` is none.
    pub solid: Option<SolidSurface>,
    /// Weight φ in [0, 1] of the window's end (eqs. 6.44, 10.30).
    pub phi: f64,
    /// What is done where a window with this φ would carry a particle beyond all that surrounds it.
    pub overshoot: Overshoot,
    /// Tolerance of the fixed point: largest change of a temperature over the largest temperature.
    pub tolerance: f64,
    /// Iterations after which the window is given up.
    pub iterations: u32,
    /// What takes enthalpy instead of temperature as the state: several materials, properties that depend on temperature,
    /// phases, an ambient, or conjugate gradients. `None` has none of them, and costs nothing.
    pub enthalpy: Option<Enthalpy>,
}

/// Particles that do not start alike; all lists are of one length.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Start {
    /// Temperatures in K.
    pub temperatures_k: Vec<f64>,
    /// Liquid shares, from 0 to 1: they tell how far a particle is that melts at one temperature. Empty where nothing is known.
    pub melted: Vec<f64>,
    /// Radii in m, by which the heat at t = 0 is known.
    pub radii_m: Vec<f64>,
    /// Places in the list of materials.
    pub materials: Vec<u16>,
}

/// What goes beyond one material of constant properties whose heat flows through contacts only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Enthalpy {
    /// The materials; a particle names its own by its place in this list.
    pub materials: Vec<Material>,
    /// How the implicit equations are solved.
    pub solver: Solver,
    /// Heat exchanged with what surrounds the particles; `None` is none.
    pub ambient: Option<Ambient>,
}

/// What is done where a window would carry a particle beyond all that surrounds it: the part 1 − φ of the flow at the window's
/// start does so in steps longer than m C/(G (1 − φ)), with the sum G of the particle's conductances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Overshoot {
    /// The window's end gets more weight than φ, as much as it takes.
    Implicit,
    /// A smaller step is asked for.
    SmallerStep,
    /// The run ends with an error.
    Refuse,
}

impl Enthalpy {
    /// Whether a material changes its phase.
    #[must_use]
    pub fn changes_phase(&self) -> bool {
        self.materials.iter().any(|material| material.phases.is_some())
    }
}

/// How the implicit equations of a window are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// Sweeps in which every particle takes the temperature that balances its own heat.
    FixedPoint,
    /// Newton's method with preconditioned conjugate gradients: for steps far above the explicit limit.
    ConjugateGradient,
}

/// What surrounds the particles: h A_s (θ_∞ − θ) + ε_r σ_SB A_s (θ_∞⁴ − θ⁴) into each, with A_s a share of its surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ambient {
    /// Its temperature θ_∞ in K.
    pub temperature_k: f64,
    /// Coefficient h of convection in W/(m² K).
    pub convection_w_m2_k: f64,
    /// Emissivity ε_r from 0 to 1.
    pub emissivity: f64,
    /// Share of each particle's surface 4π R² that sees it, from 0 to 1.
    pub exposed: f64,
}

impl Start {
    /// Refuses lists of other lengths and values outside their range.
    pub(super) fn check(&self, count: usize) -> Result<(), SolveError> {
        let Self { temperatures_k, melted, radii_m, materials } = self;
        let optional = |length: usize| length == 0 || length == count;
        let fits = temperatures_k.len() == count && radii_m.len() == count;
        if !(fits && optional(melted.len()) && optional(materials.len())) {
            return Err(SolveError::Start(format!(
                "{NODE}: {count} particles start, but with {} temperatures, {} liquid shares, {} radii and {} materials",
                temperatures_k.len(),
                melted.len(),
                radii_m.len(),
                materials.len()
            )));
        }
        for &temperature_k in temperatures_k {
            let is_one = temperature_k.is_finite() && temperature_k >= 0.0;
            setting(NODE, "initial temperature of a particle", temperature_k, is_one, "at least 0 K")?;
        }
        for &share in melted {
            setting(NODE, "liquid share of a particle", share, (0.0..=1.0).contains(&share), "from 0 to 1")?;
        }
        radii_m.iter().try_for_each(|&radius_m| positive(NODE, "radius of a particle", radius_m))
    }
}

impl crate::Settings for Settings {
    type Physics = Thermal;

    fn ports(&self) -> Ports {
        let particles = |name, unit| Port::f64(name, unit, PARTICLES, 1, Measure::None);
        let mut reads = vec![particles("radii", "m")];
        reads.extend(contacts::ports());
        // Several lasers may light the particles.
        let power = |name| particles(name, "W").as_sum().as_optional();
        reads.extend([power("absorbed_power"), power("joule_power"), Port::u32("ids", PARTICLES, 1).as_optional()]);
        reads.extend(self.reads_material().then(|| Port::u32("material", PARTICLES, 1)));
        if self.on_solid().is_some() {
            reads.push(Port::f64("surface_temperature", "K", SURFACE, 1, Measure::None));
            reads.push(Port::f64("positions", "m", PARTICLES, 3, Measure::None));
        }
        let mut writes = vec![Port::f64("temperature", "K", PARTICLES, 1, Measure::Magnitude)];
        if self.enthalpy.as_ref().is_some_and(Enthalpy::changes_phase) {
            writes.extend([particles("melted", "1"), Port::u8("vapourised", PARTICLES, 1)]);
        }
        writes.extend(self.on_solid().map(|_| power_port("surface_heat")));
        Ports::new(reads, writes)
    }

    fn build(self) -> Result<Thermal, SolveError> {
        Thermal::new(self)
    }
}

impl Settings {
    /// The solid that contacts with a wall rest on.
    pub(super) fn on_solid(&self) -> Option<&SolidSurface> {
        self.solid.as_ref().filter(|solid| solid.wall.is_some())
    }

    /// Whether a field says what each particle is made of.
    pub(super) fn reads_material(&self) -> bool {
        self.enthalpy.as_ref().is_some_and(|enthalpy| enthalpy.materials.len() > 1)
    }

    /// Heat capacity of a particle m C, in J/K.
    pub(super) fn capacity_j_k(&self, radius_m: f64) -> f64 {
        mass_kg(self.density_kg_m3, radius_m) * self.heat_capacity_j_kg_k
    }
}

/// Mass of a sphere m = ρ 4/3 π R³, in kg.
pub(super) fn mass_kg(density_kg_m3: f64, radius_m: f64) -> f64 {
    density_kg_m3 * 4.0 / 3.0 * PI * math::powi(radius_m, 3)
}
