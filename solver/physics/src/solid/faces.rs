//! Heat through the faces of the box.

use std::f64::consts::PI;

use stagger_coupling::math;

use super::settings::{Evaporation, Face, Settings};
use crate::common::{
    grid::{CellGrid, conduction::Conductivities},
    radiation::{STEFAN_BOLTZMANN_W_M2_K4, fourth_power},
};

/// Gas constant R_g in J/(mol K) (CODATA 2018, exact).
const GAS_CONSTANT_J_MOL_K: f64 = 8.314_462_618_153_24;
/// Pressure at which a boiling point holds, in Pa.
const BOILING_PRESSURE_PA: f64 = 101_325.0;
/// Share of the vapour's enthalpy flux that does not come back (Anisimov 1968).
const ANISIMOV: f64 = 0.82;

/// Heat that left through the faces, in W or J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lost {
    /// To faces of given temperature.
    pub(super) conducted: f64,
    /// By convection.
    pub(super) convected: f64,
    /// By radiation.
    pub(super) radiated: f64,
    /// With vapour.
    pub(super) evaporated: f64,
    /// Entered as a given flux.
    pub(super) entered: f64,
}

impl Lost {
    /// The sums of both, each times a factor.
    pub(super) fn mean(self, of_self: f64, other: Self, of_other: f64) -> Self {
        let mean = |one: f64, other: f64| of_self * one + of_other * other;
        Self {
            conducted: mean(self.conducted, other.conducted),
            convected: mean(self.convected, other.convected),
            radiated: mean(self.radiated, other.radiated),
            evaporated: mean(self.evaporated, other.evaporated),
            entered: mean(self.entered, other.entered),
        }
    }
}

/// The cells at the faces through which heat passes.
pub(super) struct Faces {
    sides: Vec<Side>,
}

/// One face of the box.
struct Side {
    face: Face,
    evaporation: Option<Evaporation>,
    /// Row, area in m², and half the width in m of each cell at it.
    cells: Vec<(usize, f64, f64)>,
}

impl Faces {
    pub(super) fn new(settings: &Settings) -> Self {
        let side = |place: usize| {
            let (axis, is_upper) = (place / 2, place % 2 == 1);
            let evaporation = settings.evaporation.filter(|_| axis == 2 && is_upper);
            let face = settings.faces[place];
            (face != Face::Insulated || evaporation.is_some()).then(|| Side {
                face,
                evaporation,
                cells: cells_at(&settings.grid, axis, is_upper),
            })
        };
        Self { sides: (0..6).filter_map(side).collect() }
    }

    /// Adds what flows into each cell, in W; returns what all lose.
    pub(super) fn add_flow(&self, conductivities: Conductivities<'_>, values_k: &[f64], into_w: &mut [f64]) -> Lost {
        let mut lost = Lost::default();
        for side in &self.sides {
            for &(row, area_m2, half_m) in &side.cells {
                let at_k = values_k[row];
                let inside_w_k = area_m2 * conductivities.at(row) / half_m;
                match side.face {
                    Face::Insulated => {}
                    Face::Held { temperature_k } => {
                        let flow_w = inside_w_k * (at_k - temperature_k);
                        into_w[row] -= flow_w;
                        lost.conducted += flow_w;
                    }
                    Face::Flux { flux_w_m2 } => {
                        into_w[row] += flux_w_m2 * area_m2;
                        lost.entered += flux_w_m2 * area_m2;
                    }
                    Face::Ambient { temperature_k, convection_w_m2_k, emissivity } => {
                        let convected_w = in_series(inside_w_k, convection_w_m2_k * area_m2) * (at_k - temperature_k);
                        let radiated_w = emissivity
                            * STEFAN_BOLTZMANN_W_M2_K4
                            * area_m2
                            * (fourth_power(at_k) - fourth_power(temperature_k));
                        into_w[row] -= convected_w + radiated_w;
                        lost.convected += convected_w;
                        lost.radiated += radiated_w;
                    }
                }
                if let Some(evaporation) = side.evaporation {
                    let flow_w = evaporation.flux_w_m2(at_k) * area_m2;
                    into_w[row] -= flow_w;
                    lost.evaporated += flow_w;
                }
            }
        }
        lost
    }

    /// Adds what each cell loses more for each kelvin that it is hotter, in W/K.
    pub(super) fn add_slopes(&self, conductivities: Conductivities<'_>, values_k: &[f64], slopes_w_k: &mut [f64]) {
        for side in &self.sides {
            for &(row, area_m2, half_m) in &side.cells {
                let at_k = values_k[row];
                let inside_w_k = area_m2 * conductivities.at(row) / half_m;
                slopes_w_k[row] += match side.face {
                    Face::Insulated | Face::Flux { .. } => 0.0,
                    Face::Held { .. } => inside_w_k,
                    Face::Ambient { convection_w_m2_k, emissivity, .. } => {
                        let radiated = 4.0 * emissivity * STEFAN_BOLTZMANN_W_M2_K4 * math::powi(at_k.abs(), 3);
                        in_series(inside_w_k, convection_w_m2_k * area_m2) + radiated * area_m2
                    }
                };
                if let Some(evaporation) = side.evaporation {
                    slopes_w_k[row] += evaporation.slope_w_m2_k(at_k) * area_m2;
                }
            }
        }
    }
}

impl Evaporation {
    /// Heat flux 0.82 L_v p_s(θ) √(M/(2π R_g θ)) in W/m², p_s = p_0 e^{(L_v M/R_g)(1/θ_v − 1/θ)}.
    pub(super) fn flux_w_m2(&self, temperature_k: f64) -> f64 {
        if temperature_k <= 0.0 {
            return 0.0;
        }
        let per_kelvin = self.molar_mass_kg_mol / GAS_CONSTANT_J_MOL_K;
        let exponent = self.latent_j_kg * per_kelvin * (1.0 / self.boiling_k - 1.0 / temperature_k);
        let pressure_pa = BOILING_PRESSURE_PA * math::exp(exponent);
        ANISIMOV * self.latent_j_kg * pressure_pa * (per_kelvin / (2.0 * PI * temperature_k)).sqrt()
    }

    fn slope_w_m2_k(&self, temperature_k: f64) -> f64 {
        if temperature_k <= 0.0 {
            return 0.0;
        }
        let latent_k = self.latent_j_kg * self.molar_mass_kg_mol / GAS_CONSTANT_J_MOL_K;
        let relative = latent_k / (temperature_k * temperature_k) - 0.5 / temperature_k;
        // Far above any boiling point the flux falls; taken as constant there, so that equations stay positive definite.
        self.flux_w_m2(temperature_k) * relative.max(0.0)
    }
}

fn in_series(one_w_k: f64, other_w_k: f64) -> f64 {
    if one_w_k > 0.0 && other_w_k > 0.0 { 1.0 / (1.0 / one_w_k + 1.0 / other_w_k) } else { 0.0 }
}

fn cells_at(grid: &CellGrid, axis: usize, is_upper: bool) -> Vec<(usize, f64, f64)> {
    let counts = grid.counts();
    let widths_m = [0, 1, 2].map(|axis| grid.widths_m(axis));
    let [one, other] = [(axis + 1) % 3, (axis + 2) % 3];
    let layer = if is_upper { counts[axis] - 1 } else { 0 };
    let mut cells = Vec::with_capacity(counts[one] * counts[other]);
    for at_other in 0..counts[other] {
        for at_one in 0..counts[one] {
            let mut cell = [layer; 3];
            (cell[one], cell[other]) = (at_one, at_other);
            let area_m2 = widths_m[one][at_one] * widths_m[other][at_other];
            cells.push((grid.row(cell), area_m2, 0.5 * widths_m[axis][layer]));
        }
    }
    cells
}
