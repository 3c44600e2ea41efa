//! Conduction between neighbouring cells of a grid, in flux form: what one cell gains its neighbour loses, to the last bit.

use rayon::prelude::*;
use serde::Serialize;

use super::CellGrid;

/// Rows below which one thread does it all: handing out work costs more.
const ALONE: usize = 8192;

/// How the conductivity of a face follows from those of its two cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaceMean {
    /// Their resistances in series: exact where the materials' border is the face, and an insulator blocks.
    Harmonic,
    /// The mean of the two (Zohdi 2018, eqs. 5.19–5.28): the flux through an interface has an error of first order in the
    /// width of the cells.
    Arithmetic,
}

/// Conductivities of the cells, in W/(m K).
#[derive(Clone, Copy, Debug)]
pub(crate) enum Conductivities<'k> {
    /// One for all.
    All(f64),
    /// One for each.
    Each(&'k [f64]),
}

impl Conductivities<'_> {
    pub(crate) fn at(self, row: usize) -> f64 {
        match self {
            Self::All(conductivity) => conductivity,
            Self::Each(each) => each[row],
        }
    }
}

/// Conductances between the cells of a grid and their next neighbours upwards along each axis, in W/K; 0 at the last cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Conduction {
    counts: [usize; 3],
    upwards_w_k: [Vec<f64>; 3],
}

/// One row of cells along x in vectors over the whole grid.
#[derive(Clone, Copy)]
struct Row {
    j: usize,
    k: usize,
    from: usize,
}

impl Conduction {
    pub(crate) fn new(grid: &CellGrid, conductivities: Conductivities<'_>, mean: FaceMean) -> Self {
        let counts = grid.counts();
        let widths_m = [0, 1, 2].map(|axis| grid.widths_m(axis));
        let strides = strides(counts);
        let rows = grid.len();
        let axis = |axis: usize| {
            let (stride, along) = (strides[axis], &widths_m[axis]);
            let [one, other] = [(axis + 1) % 3, (axis + 2) % 3];
            let mut upwards_w_k = vec![0.0; rows];
            for_planes(&mut upwards_w_k, counts, |k, plane| {
                for (place, conductance_w_k) in plane.iter_mut().enumerate() {
                    let cell = [place % counts[0], place / counts[0], k];
                    if cell[axis] + 1 == counts[axis] {
                        continue;
                    }
                    let row = k * counts[0] * counts[1] + place;
                    let halves_m = [0.5 * along[cell[axis]], 0.5 * along[cell[axis] + 1]];
                    let area_m2 = widths_m[one][cell[one]] * widths_m[other][cell[other]];
                    let own = [conductivities.at(row), conductivities.at(row + stride)];
                    *conductance_w_k = area_m2 * per_area(own, halves_m, mean);
                }
            });
            upwards_w_k
        };
        Self { counts, upwards_w_k: [0, 1, 2].map(axis) }
    }

    /// From conductances that are known.
    pub(super) fn of(counts: [usize; 3], upwards_w_k: [Vec<f64>; 3]) -> Self {
        Self { counts, upwards_w_k }
    }

    pub(crate) fn counts(&self) -> [usize; 3] {
        self.counts
    }

    /// Distances in memory from a cell to the next along each axis.
    pub(crate) fn strides(&self) -> [usize; 3] {
        strides(self.counts)
    }

    pub(crate) fn rows(&self) -> usize {
        self.counts.iter().product()
    }

    pub(crate) fn upwards_w_k(&self, axis: usize) -> &[f64] {
        &self.upwards_w_k[axis]
    }

    /// Conductances weakened by a factor.
    pub(crate) fn scaled(mut self, factor: f64) -> Self {
        self.upwards_w_k.iter_mut().flatten().for_each(|conductance_w_k| *conductance_w_k *= factor);
        self
    }

    /// Heat that flows into each cell from its neighbours, in W, where their temperatures are `values`.
    pub(crate) fn flow_into(&self, values: &[f64], into: &mut [f64]) {
        self.sweep(into, |row, into| {
            into.fill(0.0);
            self.add_differences(row, values, -1.0, into);
        });
    }

    /// `product` = own · `values` + Σ G (value − neighbour's): what leaves each cell.
    pub(crate) fn multiply(&self, own: &[f64], values: &[f64], product: &mut [f64]) {
        self.sweep(product, |row, product| {
            let end = row.from + product.len();
            let both = own[row.from..end].iter().zip(&values[row.from..end]);
            product.iter_mut().zip(both).for_each(|(product, (own, value))| *product = own * value);
            self.add_differences(row, values, 1.0, product);
        });
    }

    /// Sum of the conductances at each cell, in W/K.
    pub(crate) fn at_cells(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.rows()];
        let strides = strides(self.counts);
        self.sweep(&mut sums, |row, sums| {
            for axis in 0..3 {
                let upwards = &self.upwards_w_k[axis];
                for (place, sum) in (row.from..).zip(sums.iter_mut()) {
                    *sum += upwards[place];
                    if place >= strides[axis] {
                        *sum += upwards[place - strides[axis]];
                    }
                }
            }
        });
        sums
    }

    fn sweep(&self, out: &mut [f64], of_row: impl Fn(Row, &mut [f64]) + Sync) {
        let [nx, ny, _] = self.counts;
        for_planes(out, self.counts, |k, plane| {
            for (j, out) in plane.chunks_mut(nx.max(1)).enumerate() {
                of_row(Row { j, k, from: (k * ny + j) * nx }, out);
            }
        });
    }

    /// Adds sign · Σ G (value − neighbour's) to a row.
    fn add_differences(&self, Row { j, k, from }: Row, values: &[f64], sign: f64, out: &mut [f64]) {
        let [nx, ny, nz] = self.counts;
        let own = &values[from..from + nx];
        let along = &self.upwards_w_k[0][from..from + nx];
        for ((out, own), conductance) in out[1..].iter_mut().zip(own.array_windows::<2>()).zip(along) {
            *out += sign * conductance * (own[1] - own[0]);
        }
        for ((out, own), conductance) in out.iter_mut().zip(own.array_windows::<2>()).zip(along) {
            *out += sign * conductance * (own[0] - own[1]);
        }
        let [_, y, z] = &self.upwards_w_k;
        let plane = nx * ny;
        let mut beside = |conductances: &[f64], at_face: usize, neighbour: usize| {
            let both = own.iter().zip(&conductances[at_face..]).zip(&values[neighbour..]);
            for (out, ((own, conductance), other)) in out.iter_mut().zip(both) {
                *out += sign * conductance * (own - other);
            }
        };
        if j > 0 {
            beside(y, from - nx, from - nx);
        }
        if j + 1 < ny {
            beside(y, from, from + nx);
        }
        if k > 0 {
            beside(z, from - plane, from - plane);
        }
        if k + 1 < nz {
            beside(z, from, from + plane);
        }
    }
}

/// Conductance of a face per area, in W/(m² K), between two half cells.
fn per_area(conductivities: [f64; 2], halves_m: [f64; 2], mean: FaceMean) -> f64 {
    let [one, other] = conductivities;
    let length_m = halves_m[0] + halves_m[1];
    match mean {
        FaceMean::Arithmetic => 0.5 * (one + other) / length_m,
        FaceMean::Harmonic if one > 0.0 && other > 0.0 => 1.0 / (halves_m[0] / one + halves_m[1] / other),
        FaceMean::Harmonic => 0.0,
    }
}

/// Distances in memory from a cell to the next along each axis.
pub(super) fn strides([nx, ny, _]: [usize; 3]) -> [usize; 3] {
    [1, nx, nx * ny]
}

/// Calls `of_plane` with each plane of cells across z, on several threads where that pays.
pub(super) fn for_planes(values: &mut [f64], [nx, ny, _]: [usize; 3], of_plane: impl Fn(usize, &mut [f64]) + Sync) {
    let plane = (nx * ny).max(1);
    if values.len() <= ALONE {
        values.chunks_mut(plane).enumerate().for_each(|(k, plane)| of_plane(k, plane));
    } else {
        values.par_chunks_mut(plane).enumerate().for_each(|(k, plane)| of_plane(k, plane));
    }
}
