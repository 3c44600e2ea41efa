//! Settings of the electric current through the particles.

use super::Current;
use serde::Serialize;
use stagger_coupling::SolveError;
use stagger_messages::{Geometry, Measure, Port, Ports};

pub use super::conductivity::{Conductivity, Transition};
use crate::common::{Conductance, PARTICLES, Wall, contacts};

/// Everything the current through the particles depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Number of particles at t = 0.
    pub count: usize,
    /// How the current is computed.
    pub model: Model,
    /// Electrical conductivity of the particles.
    pub conductivity: Conductivity,
    /// Temperature of every particle where none is read, and of new ones, in K.
    pub temperature_k: f64,
    /// Walls, in the order of the scene.
    pub walls: Vec<Wall>,
    /// When the walls are electrified, in s.
    pub starts_s: f64,
    /// When they no longer are, in s; infinity is never.
    pub ends_s: f64,
    /// How the linear equations are solved.
    pub solver: Solver,
}

/// How the current is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// The monograph's: a particle's current density is the mean of its neighbours', weighted by contact area (Zohdi 2018,
    /// eqs. 8.13–8.14). Walls are given current densities.
    Averaging {
        /// Share a of the Joule power that becomes heat, in [0, 1] (eq. 8.6).
        heat_share: f64,
    },
    /// Kirchhoff's laws on the network of contacts: charge and energy are conserved. Walls are given potentials or currents.
    Potential {
        /// How a contact conducts.
        conductance: Conductance,
    },
}

/// How the linear equations are solved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Solver {
    /// The method.
    pub method: Method,
    /// Residual over right-hand side, in the 2-norm, at which it ends.
    pub tolerance: f64,
    /// Iterations after which it gives up.
    pub iterations: u32,
}

/// A method for linear equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Conjugate gradients with Jacobi's preconditioner.
    ConjugateGradient,
    /// Jacobi's sweeps, the monograph's: for comparison.
    Jacobi,
}

impl crate::Settings for Settings {
    type Physics = Current;

    fn ports(&self) -> Ports {
        let of = |name, unit, support, measure| Port::f64(name, unit, support, 1, measure);
        let mut reads = vec![of("radii", "m", PARTICLES, Measure::None)];
        reads.extend(contacts::ports());
        if self.conductivity.by_temperature.is_some() {
            reads.push(of("temperature", "K", PARTICLES, Measure::None).as_optional());
        }
        reads.push(Port::u32("ids", PARTICLES, 1).as_optional());
        let mut writes = vec![
            of("joule_power", "W", PARTICLES, Measure::Magnitude),
            of("current_density", "A/m^2", PARTICLES, Measure::None),
            of("wall_current", "A", "electrodes", Measure::None),
            of("wall_current_density", "A/m^2", "electrodes", Measure::None),
        ];
        if matches!(self.model, Model::Potential { .. }) {
            writes.push(of("potential", "V", PARTICLES, Measure::None));
        }
        Ports::new(reads, writes).with(Geometry::global("electrodes"))
    }

    fn build(self) -> Result<Current, SolveError> {
        Current::new(self)
    }
}
