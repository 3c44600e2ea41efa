//! Settings of the push of a sound beam.

use super::Acoustics;
use serde::Serialize;
use stagger_coupling::SolveError;
use stagger_messages::{Geometry, Measure, Port, Ports};

use super::Interface;
use crate::common::{
    PARTICLES,
    beam::{Path, Pulses},
    rays::{POINTS, Sampling},
};

/// Everything the push of a sound beam depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Number of particles at t = 0.
    pub count: usize,
    /// The beam of sound.
    pub beam: SoundBeam,
    /// The surface of the particles in the fluid.
    pub interface: Interface,
    /// The rays.
    pub sampling: Sampling,
    /// Unit normals of the planes among the walls, at rest: a ray that leaves the particles against one that faces the beam
    /// has met that wall.
    pub walls: Vec<[f64; 3]>,
}

/// A beam of sound of the same intensity over its cross-section, along `direction`, on from `starts_s` to `ends_s`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SoundBeam {
    /// Intensity while on, in W/m².
    pub intensity_w_m2: f64,
    /// Radius of the cross-section, in m.
    pub radius_m: f64,
    /// Unit vector it travels along.
    pub direction: [f64; 3],
    /// Where the beam's axis passes.
    pub path: Path,
    /// When it is switched on, in s.
    pub starts_s: f64,
    /// When it is switched off, in s; infinity is never.
    pub ends_s: f64,
    /// Pulses; `None` is continuous.
    pub pulses: Option<Pulses>,
}

impl crate::Settings for Settings {
    type Physics = Acoustics;

    fn ports(&self) -> Ports {
        let reads = vec![
            Port::f64("positions", "m", PARTICLES, 3, Measure::None),
            Port::f64("radii", "m", PARTICLES, 1, Measure::None),
        ];
        let writes = vec![
            Port::f64("acoustic_force", "N", PARTICLES, 3, Measure::Magnitude),
            Port::f64("acoustic_paths", "m", "acoustic-rays", 3 * POINTS as u32, Measure::None),
        ];
        Ports::new(reads, writes).with(Geometry::points("acoustic-rays", "acoustic_paths"))
    }

    fn build(self) -> Result<Acoustics, SolveError> {
        Acoustics::new(self)
    }
}
