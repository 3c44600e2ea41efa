//! Settings of the absorption of a laser.

use super::Optics;
use serde::Serialize;
use stagger_coupling::SolveError;
use stagger_messages::{Geometry, Measure, Port, Ports};

pub use crate::common::beam::{Beam, Path, Profile, Pulses};
use crate::common::{
    PARTICLES, SolidSurface, power_port,
    rays::{POINTS, RefractiveIndex, Sampling},
};

/// Everything the absorption of the laser depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Number of particles at t = 0.
    pub count: usize,
    /// How absorption is computed.
    pub model: Model,
    /// The laser beam.
    pub beam: Beam,
    /// Unit normals of the planes among the walls, at rest: a ray that leaves the particles against one that faces the beam
    /// has met that wall.
    pub walls: Vec<[f64; 3]>,
    /// Heat capacity ρ C of each material at the start, in J/(m³ K), in the order in which particles name them: by these
    /// [`Model::EnergyBalance`] spreads the power. Empty with other models and where there is one material.
    pub capacities_j_m3_k: Vec<f64>,
    /// The solid on whose upper face the light arrives that the particles let pass; `None` is none. Particles may then be
    /// absent.
    pub solid: Option<SolidSurface>,
}

/// How absorption is computed, cheapest first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// All power spread over the particles by their heat capacity m C, which is by mass where they are of one material
    /// (Zohdi 2018, eq. 6.39).
    EnergyBalance,
    /// Beer–Lambert with shadowing, energy-conserving: parallel lines sample the beam's cross-section, and each
    /// particle on a line takes 1 − e^{−a·chord} of what the ones above it left (eq. 6.42).
    BeerLambert {
        /// Absorption coefficient a, in 1/m.
        absorption_1_m: f64,
        /// Distance between sampling lines, in m.
        spacing_m: f64,
    },
    /// The monograph's form H = a I V with the irradiance at the particle's centre (eqs. 6.38, 6.42).
    BeerLambertMonograph {
        /// Absorption coefficient a, in 1/m.
        absorption_1_m: f64,
    },
    /// Rays that the particles reflect and absorb (ch. 10).
    Rays {
        /// The rays.
        sampling: Sampling,
        /// What a particle reflects.
        surface: Surface,
    },
}

impl Settings {
    /// Whether a field says what each particle is made of.
    #[must_use]
    pub fn reads_material(&self) -> bool {
        self.capacities_j_m3_k.len() > 1
    }
}

/// What particles reflect of the light that meets them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Surface {
    /// Refractive index of solid particles over that of the gas.
    pub solid: RefractiveIndex,
    /// That of molten ones; the particles' `melted` is then read. `None` is as solid.
    pub molten: Option<RefractiveIndex>,
    /// Magnetic permeability μ̂ over that of the gas; positive.
    pub permeability: f64,
}

impl crate::Settings for Settings {
    type Physics = Optics;

    fn ports(&self) -> Ports {
        let of = |name, unit, support, components, measure| Port::f64(name, unit, support, components, measure);
        let mut reads =
            vec![of("positions", "m", PARTICLES, 3, Measure::None), of("radii", "m", PARTICLES, 1, Measure::None)];
        if self.solid.is_some() {
            reads = reads.iter().map(Port::as_optional).collect();
        }
        let traced = matches!(self.model, Model::Rays { .. });
        if matches!(&self.model, Model::Rays { surface, .. } if surface.molten.is_some()) {
            reads.push(of("melted", "1", PARTICLES, 1, Measure::None));
            reads.push(Port::u32("ids", PARTICLES, 1).as_optional());
        }
        reads.extend(self.reads_material().then(|| Port::u32("material", PARTICLES, 1)));
        let mut writes = vec![
            of("absorbed_power", "W", PARTICLES, 1, Measure::Magnitude),
            of("beam_spot", "m", "beam", 3, Measure::None),
            of("beam_radius", "m", "beam", 1, Measure::None),
            of("beam_power", "W", "beam", 1, Measure::None),
        ];
        writes.extend(self.solid.is_some().then(|| power_port("surface_light")));
        writes.extend(traced.then(|| of("ray_paths", "m", "rays", 3 * POINTS as u32, Measure::None)));
        let ports = Ports::new(reads, writes).with(Geometry::global("beam"));
        if traced { ports.with(Geometry::points("rays", "ray_paths")) } else { ports }
    }

    fn build(self) -> Result<Optics, SolveError> {
        Optics::new(self)
    }
}
