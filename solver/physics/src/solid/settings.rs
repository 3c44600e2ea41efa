//! Settings of the temperature of a solid.

use serde::Serialize;
use stagger_coupling::SolveError;
use stagger_messages::{Geometry, Measure, Port, Ports};

use super::{NODE, Solid};
use crate::common::{
    HeatMaterial, SURFACE, SolidSurface,
    checks::{positive, setting},
    grid::{CellGrid, FaceMean},
};

/// Support of the fields on the cells, and of numbers for the whole.
pub(super) const CELLS: &str = "solid";
const WHOLE: &str = "solid-whole";

/// Everything the temperature of a solid depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Its cells.
    pub grid: CellGrid,
    /// The materials.
    pub materials: Vec<HeatMaterial>,
    /// The material of each cell, as a place in that list, x running fastest; empty where all are of the first.
    pub kinds: Vec<u16>,
    /// Temperature at t = 0, in K.
    pub temperature_k: f64,
    /// How a window is taken.
    pub level: Level,
    /// Conductivity of a face between two cells.
    pub face_mean: FaceMean,
    /// What holds at the faces: lower and upper x, lower and upper y, lower and upper z.
    pub faces: [Face; 6],
    /// Evaporation at the upper face across z; `None` is none.
    pub evaporation: Option<Evaporation>,
    /// How light that arrives at the upper face across z is absorbed.
    pub light: Light,
    /// Relaxation time τ of the heat flux in s (Zohdi 2018, eqs. 5.98–5.111); 0 is Fourier's law.
    pub relaxation_s: f64,
    /// Tolerance of the implicit equations: largest change of a temperature over the largest temperature.
    pub tolerance: f64,
    /// Iterations of Newton's method after which the window is given up.
    pub iterations: u32,
    /// What is told of the track that melts, where a material melts.
    pub track: Track,
    /// Index in the scene of the wall whose contacts rest on the upper face; `None` is none.
    pub wall: Option<u32>,
}

/// How a window is taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// In one step, however long it is (eqs. 5.34–5.37).
    Implicit {
        /// Weight φ of the window's end, from 0 to 1; with 1 nothing leaves the range of what surrounds it.
        phi: f64,
    },
    /// In forward Euler substeps below the explicit limit.
    Explicit {
        /// Substep over the explicit limit, above 0 and at most 1.
        share: f64,
    },
}

/// What holds at a face.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Face {
    /// No heat passes.
    Insulated,
    /// It has a temperature.
    Held {
        /// In K.
        temperature_k: f64,
    },
    /// A flux enters.
    Flux {
        /// Into the solid, in W/m².
        flux_w_m2: f64,
    },
    /// It loses h (θ − θ_∞) + ε σ_SB (θ⁴ − θ_∞⁴).
    Ambient {
        /// θ_∞, in K.
        temperature_k: f64,
        /// Coefficient h of convection, in W/(m² K).
        convection_w_m2_k: f64,
        /// Emissivity ε, from 0 to 1.
        emissivity: f64,
    },
}

/// Evaporation from a lit surface (Anisimov 1968).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Evaporation {
    /// Boiling point θ_v at 101 325 Pa, in K.
    pub boiling_k: f64,
    /// Latent heat L_v, in J/kg.
    pub latent_j_kg: f64,
    /// Mass of a mole M, in kg/mol.
    pub molar_mass_kg_mol: f64,
}

/// Light at the upper face across z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Light {
    /// Share of what arrives that enters, from 0 to 1; the rest is reflected.
    pub absorptivity: f64,
    /// Absorption coefficient a inside, in 1/m (eqs. 5.90–5.92); `None` absorbs all that enters in the uppermost cell.
    pub absorption_1_m: Option<f64>,
}

/// What is told of a track.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Track {
    /// Axis along which it runs, 0 or 1.
    pub along: usize,
    /// Temperature at its border, in K: where it was as hot, it counts as molten.
    pub border_k: f64,
    /// Part of that axis over which width and depth are averaged, in m.
    pub part_m: [f64; 2],
    /// The cooling rate is that between these two temperatures, the higher one first, in K; `None` tells none.
    pub cooling_k: Option<[f64; 2]>,
}

impl Settings {
    /// Whether a material melts.
    #[must_use]
    pub fn melts(&self) -> bool {
        self.materials.iter().any(|material| material.phases.is_some_and(|phases| phases.melting.is_some()))
    }

    /// Refuses what is outside its range.
    pub(super) fn check_all(&self) -> Result<(), SolveError> {
        self.grid.check(NODE)?;
        if self.materials.is_empty() {
            return Err(SolveError::Start(format!("{NODE}: a solid is made of a material, but none is given")));
        }
        let cells = self.grid.len();
        if !self.kinds.is_empty() && self.kinds.len() != cells {
            let found = self.kinds.len();
            return Err(SolveError::Start(format!("{NODE}: {found} materials are given for {cells} cells")));
        }
        if let Some(row) = self.kinds.iter().position(|kind| usize::from(*kind) >= self.materials.len()) {
            let (kind, there) = (self.kinds[row], self.materials.len());
            return Err(SolveError::Start(format!(
                "{NODE}: cell {row} is of material {kind}, but there are {there}, counted from 0"
            )));
        }
        for material in &self.materials {
            positive(NODE, "density", material.density_kg_m3)?;
            let conducts = |value: f64| value >= 0.0;
            material.conductivity_w_m_k.check(NODE, "conductivity", conducts, "at least 0 and finite")?;
        }
        let not_negative = |what: &str, value: f64, unit: &str| {
            setting(NODE, what, value, value.is_finite() && value >= 0.0, &format!("at least 0 {unit}"))
        };
        let share = |what: &str, value: f64| setting(NODE, what, value, (0.0..=1.0).contains(&value), "from 0 to 1");
        not_negative("temperature at the start", self.temperature_k, "K")?;
        not_negative("relaxation time", self.relaxation_s, "s")?;
        positive(NODE, "tolerance", self.tolerance)?;
        positive(NODE, "limit of iterations", self.iterations.into())?;
        match self.level {
            Level::Implicit { phi } => share("phi", phi)?,
            Level::Explicit { share } => {
                setting(NODE, "share of the explicit limit", share, share > 0.0 && share <= 1.0, "above 0, at most 1")?;
                let is_fourier = self.relaxation_s == 0.0;
                setting(NODE, "relaxation time of an explicit solid", self.relaxation_s, is_fourier, "0 s")?;
            }
        }
        for face in &self.faces {
            match *face {
                Face::Insulated => {}
                Face::Held { temperature_k } => not_negative("temperature of a face", temperature_k, "K")?,
                Face::Flux { flux_w_m2 } => {
                    setting(NODE, "flux at a face", flux_w_m2, flux_w_m2.is_finite(), "finite")?;
                }
                Face::Ambient { temperature_k, convection_w_m2_k, emissivity } => {
                    not_negative("temperature beside a face", temperature_k, "K")?;
                    not_negative("convection at a face", convection_w_m2_k, "W/(m² K)")?;
                    share("emissivity of a face", emissivity)?;
                }
            }
        }
        share("absorptivity", self.light.absorptivity)?;
        if let Some(absorption_1_m) = self.light.absorption_1_m {
            not_negative("absorption of light", absorption_1_m, "1/m")?;
        }
        if let Some(Evaporation { boiling_k, latent_j_kg, molar_mass_kg_mol }) = self.evaporation {
            positive(NODE, "boiling point", boiling_k)?;
            positive(NODE, "latent heat of boiling", latent_j_kg)?;
            positive(NODE, "molar mass", molar_mass_kg_mol)?;
        }
        let along = self.track.along;
        setting(NODE, "axis of the track", along as f64, along < 2, "0 or 1")
    }
}

impl crate::Settings for Settings {
    type Physics = Solid;

    fn ports(&self) -> Ports {
        let sum = |name, support| Port::f64(name, "W", support, 1, Measure::None).as_sum().as_optional();
        let reads = vec![sum("surface_light", SURFACE), sum("surface_heat", SURFACE), sum("solid_heat_source", CELLS)];
        let scalar = |name, unit, support, measure| Port::f64(name, unit, support, 1, measure);
        let mut writes = vec![
            scalar("solid_temperature", "K", CELLS, Measure::Magnitude),
            scalar("surface_temperature", "K", SURFACE, Measure::Magnitude),
            scalar("solid_peak", "K", WHOLE, Measure::None),
        ];
        if self.melts() {
            writes.push(scalar("solid_melted", "1", CELLS, Measure::None));
            writes.push(scalar("solid_peak_temperature", "K", CELLS, Measure::None));
            for name in ["pool_length", "pool_width", "pool_depth", "track_width", "track_depth"] {
                writes.push(scalar(name, "m", WHOLE, Measure::None));
            }
            if self.track.cooling_k.is_some() {
                writes.push(scalar("surface_cooling_rate", "K/s", SURFACE, Measure::None));
            }
        }
        Ports::new(reads, writes)
            .with(Geometry::grid(CELLS, self.grid.as_support()))
            .with(Geometry::grid(SURFACE, self.grid.layer(2, true).as_support()))
            .with(Geometry::global(WHOLE))
    }

    fn build(self) -> Result<Solid, SolveError> {
        Solid::new(self)
    }

    fn check(&self) -> Result<(), SolveError> {
        self.check_all()
    }

    fn solid_surface(&self) -> Option<SolidSurface> {
        Some(SolidSurface { cells: self.grid.layer(2, true), wall: self.wall })
    }
}
