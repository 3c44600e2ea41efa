//! What the cells hold: masses, and enthalpy as a function of temperature.

use rayon::prelude::*;
use stagger_coupling::SolveError;

use super::{NODE, settings::Settings};
use crate::common::{
    Table,
    enthalpy_curve::{Curve, Place},
    grid::conduction::Conductivities,
};

/// Cells that one task works on.
pub(super) const CHUNK: usize = 4096;

/// The materials, prepared.
pub(super) struct Matter {
    materials: Vec<Prepared>,
    kinds: Vec<u16>,
    pub(super) masses_kg: Vec<f64>,
    pub(super) start_k: f64,
    /// K where it is one number for all cells at all temperatures, in W/(m K).
    constant_w_m_k: Option<f64>,
}

struct Prepared {
    curve: Curve,
    /// C where it is a number and nothing changes its phase, in J/(kg K).
    constant_j_kg_k: Option<f64>,
    conductivity: Table,
}

impl Prepared {
    fn place(&self, enthalpy_j_kg: f64, start_k: f64) -> Place {
        match self.constant_j_kg_k {
            Some(capacity) => Place { temperature_k: start_k + enthalpy_j_kg / capacity, slope: capacity.recip() },
            None => self.curve.place(enthalpy_j_kg),
        }
    }
}

impl Matter {
    pub(super) fn new(settings: &Settings) -> Result<Self, SolveError> {
        let start_k = settings.temperature_k;
        let prepare = |material: &crate::common::HeatMaterial| {
            let capacity = &material.heat_capacity_j_kg_k;
            let curve = Curve::new(NODE, capacity, material.phases.as_ref(), start_k)?;
            let constant_j_kg_k = (material.phases.is_none() && capacity.is_constant()).then(|| capacity.at(start_k));
            Ok(Prepared { curve, constant_j_kg_k, conductivity: material.conductivity_w_m_k.clone() })
        };
        let materials: Vec<Prepared> = settings.materials.iter().map(prepare).collect::<Result<_, SolveError>>()?;
        let mut masses_kg = settings.grid.volumes_m3();
        let density = |row: usize| {
            let kind = settings.kinds.get(row).map_or(0, |kind| usize::from(*kind));
            settings.materials[kind].density_kg_m3
        };
        masses_kg.iter_mut().enumerate().for_each(|(row, mass)| *mass *= density(row));
        let constant_w_m_k = match &materials[..] {
            [only] if only.conductivity.is_constant() => Some(only.conductivity.at(start_k)),
            _ => None,
        };
        Ok(Self { materials, kinds: settings.kinds.clone(), masses_kg, start_k, constant_w_m_k })
    }

    fn of(&self, row: usize) -> &Prepared {
        &self.materials[self.kinds.get(row).map_or(0, |kind| usize::from(*kind))]
    }

    /// Where a cell is that holds an enthalpy above the start, in J/kg.
    pub(super) fn place(&self, row: usize, enthalpy_j_kg: f64) -> Place {
        self.of(row).place(enthalpy_j_kg, self.start_k)
    }

    /// Enthalpy of a cell at a temperature in K, above the start, in J/kg.
    pub(super) fn enthalpy(&self, row: usize, temperature_k: f64) -> f64 {
        let material = self.of(row);
        match material.constant_j_kg_k {
            Some(capacity) => capacity * (temperature_k - self.start_k),
            None => material.curve.enthalpy(temperature_k),
        }
    }

    /// Shares of a cell that are molten and vapour.
    pub(super) fn molten_and_vapour(&self, row: usize, enthalpy_j_kg: f64) -> [f64; 2] {
        self.of(row).curve.molten_and_vapour(enthalpy_j_kg)
    }

    /// The part of the heat in a cell that is latent, in J.
    pub(super) fn latent_j(&self, row: usize, shares: [f64; 2]) -> f64 {
        self.masses_kg[row] * self.of(row).curve.latent(shares)
    }

    /// Least heat capacity of a cell at any temperature, in J/K.
    pub(super) fn least_j_k(&self, row: usize) -> f64 {
        self.masses_kg[row] * self.of(row).curve.least_j_kg_k()
    }

    /// Whether conductivities change with temperature.
    pub(super) fn conductivity_depends_on_temperature(&self) -> bool {
        self.materials.iter().any(|material| !material.conductivity.is_constant())
    }

    /// Conductivities at given temperatures; `each` takes them where they differ.
    pub(super) fn conductivities<'k>(&self, temperatures_k: &[f64], each: &'k mut Vec<f64>) -> Conductivities<'k> {
        if let Some(constant) = self.constant_w_m_k {
            return Conductivities::All(constant);
        }
        each.resize(temperatures_k.len(), 0.0);
        each.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, each)| {
            for (row, conductivity) in (chunk * CHUNK..).zip(each) {
                *conductivity = self.of(row).conductivity.at(temperatures_k[row]);
            }
        });
        Conductivities::Each(each)
    }
}
