//! A window in forward Euler substeps below the explicit limit.

use rayon::prelude::*;

use super::{
    faces::{Faces, Lost},
    matter::{CHUNK, Matter},
};
use crate::common::grid::{CellGrid, FaceMean, conduction::Conduction};

/// Substeps of one window above which a smaller window is asked for.
const MOST_SUBSTEPS: f64 = 2e4;

/// How a window ended.
pub(super) struct Stepped {
    /// E in J.
    pub(super) energies_j: Vec<f64>,
    pub(super) temperatures_k: Vec<f64>,
    /// What left through the faces, in J.
    pub(super) lost_j: Lost,
    pub(super) substeps: u64,
}

/// What a window starts from.
pub(super) struct Explicit<'a> {
    pub(super) grid: &'a CellGrid,
    pub(super) matter: &'a Matter,
    pub(super) faces: &'a Faces,
    pub(super) face_mean: FaceMean,
    /// Substep over the explicit limit.
    pub(super) share: f64,
    /// Heat that enters each cell from outside, in W.
    pub(super) power_w: Option<&'a [f64]>,
}

impl Explicit<'_> {
    /// The explicit limit: the least C/ΣG of all cells, with the conductances and the faces at `temperatures_k`, in s.
    fn limit_s(&self, conduction: &Conduction, temperatures_k: &[f64], each: &mut Vec<f64>) -> f64 {
        let mut outflow_w_k = conduction.at_cells();
        let conductivities = self.matter.conductivities(temperatures_k, each);
        self.faces.add_slopes(conductivities, temperatures_k, &mut outflow_w_k);
        let of = |(row, outflow): (usize, &f64)| {
            if *outflow > 0.0 { self.matter.least_j_k(row) / outflow } else { f64::INFINITY }
        };
        outflow_w_k.par_iter().enumerate().map(of).reduce(|| f64::INFINITY, f64::min)
    }

    /// Advances energies in J and temperatures in K by `dt_s`; `None` where that takes more than 20 000 substeps.
    pub(super) fn advance(&self, energies_j: Vec<f64>, temperatures_k: Vec<f64>, dt_s: f64) -> Option<Stepped> {
        let mut stepped = Stepped { energies_j, temperatures_k, lost_j: Lost::default(), substeps: 0 };
        let (mut each, mut limit_each) = (Vec::new(), Vec::new());
        let mut conduction: Option<Conduction> = None;
        let mut flow_w = vec![0.0; stepped.energies_j.len()];
        let mut left_s = dt_s;
        while left_s > 0.0 {
            let conductivities = self.matter.conductivities(&stepped.temperatures_k, &mut each);
            let varies = self.matter.conductivity_depends_on_temperature();
            let conduction = match &mut conduction {
                Some(known) if !varies => known,
                other => other.insert(Conduction::new(self.grid, conductivities, self.face_mean)),
            };
            // The limit moves with conductivities and with radiation only.
            let limit_s = self.share * self.limit_s(conduction, &stepped.temperatures_k, &mut limit_each);
            let needed = (left_s / limit_s).ceil().max(1.0);
            let total = needed + stepped.substeps as f64;
            if total.is_nan() || total > MOST_SUBSTEPS {
                return None;
            }
            let substep_s = if needed <= 1.0 { left_s } else { left_s / needed };
            conduction.flow_into(&stepped.temperatures_k, &mut flow_w);
            let lost_w = self.faces.add_flow(conductivities, &stepped.temperatures_k, &mut flow_w);
            stepped.lost_j = stepped.lost_j.mean(1.0, lost_w, substep_s);
            let Stepped { energies_j, temperatures_k, .. } = &mut stepped;
            let chunks = energies_j.par_chunks_mut(CHUNK).zip(temperatures_k.par_chunks_mut(CHUNK)).enumerate();
            chunks.for_each(|(chunk, (energies_j, temperatures_k))| {
                for (row, (energy_j, temperature_k)) in (chunk * CHUNK..).zip(energies_j.iter_mut().zip(temperatures_k))
                {
                    let power_w = self.power_w.map_or(0.0, |power_w| power_w[row]);
                    *energy_j += substep_s * (flow_w[row] + power_w);
                    *temperature_k = self.matter.place(row, *energy_j / self.matter.masses_kg[row]).temperature_k;
                }
            });
            stepped.substeps += 1;
            left_s = if needed <= 1.0 { 0.0 } else { left_s - substep_s };
        }
        Some(stepped)
    }
}
