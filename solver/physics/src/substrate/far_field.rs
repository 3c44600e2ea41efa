//! Loads far from where their stress is asked for, taken together: Chebyshev interpolation over their places.
//!
//! Cells of a quadtree over the surface carry p × p point loads at the Chebyshev nodes of the cell, which give the same
//! stress as the cell's own loads wherever the stress is a polynomial of degree p − 1 in the loads' places (the
//! black-box method of Fong & Darve 2009). Seen from at least [`SEPARATION`] half sides away it nearly is one, and the
//! nodes' loads are summed by the same kernel as any other.

use stagger_coupling::{SolveError, math};
use std::ops::Range;

use super::{Load, NODE, point_load::Source, samples::Bounds};
use crate::common::checks::setting;

/// Least distance from a cell's centre to a point that sees its loads together, in half sides of the cell.
const SEPARATION: f64 = 3.0;

/// Nodes p along a cell's side, and the largest error they make, over the largest stress scale ‖F‖/(2πγ²) of the load.
///
/// Found by searching loads in a cell, points at the least distance in all directions and the Poisson ratios 0 and ½, and
/// rounded up by a fifth at least; farther away the error is smaller. `tests/validation` holds sums against it.
const ERRORS: [(usize, f64); 9] =
    [(2, 1.3), (3, 0.36), (4, 0.12), (5, 3.5e-2), (6, 9.8e-3), (7, 2.7e-3), (8, 7.6e-4), (9, 2.1e-4), (10, 5.7e-5)];

/// Cells are not divided further than this often: loads may coincide.
const DEPTH: u32 = 24;

/// Groups loads far away; its error at a point is at most its tolerance times Σ ‖F‖/(2πγ²), over all loads at their
/// distances γ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarField {
    /// Nodes along a cell's side.
    nodes: usize,
}

impl FarField {
    /// The cheapest grouping within a tolerance.
    ///
    /// # Errors
    /// No number of nodes reaches it.
    pub fn new(tolerance: f64) -> Result<Self, SolveError> {
        let fits = |&&(_, error): &&(usize, f64)| error <= tolerance;
        let &(nodes, smallest) = ERRORS.iter().find(fits).unwrap_or(&ERRORS[ERRORS.len() - 1]);
        let expected = format!("at least {smallest:e}");
        setting(NODE, "tolerance of the far field", tolerance, tolerance >= smallest, &expected)?;
        Ok(Self { nodes })
    }

    /// The Chebyshev nodes in [−1, 1].
    fn places(self) -> Vec<f64> {
        let p = self.nodes as f64;
        (0..self.nodes).map(|node| math::cos(std::f64::consts::PI * (node as f64 + 0.5) / p)).collect()
    }
}

/// Lagrange polynomial of each of `places` at `t`.
fn weights(places: &[f64], t: f64) -> Vec<f64> {
    let weight = |m: usize| {
        let others = places.iter().enumerate().filter(|(k, _)| *k != m);
        others.map(|(_, &other)| (t - other) / (places[m] - other)).product()
    };
    (0..places.len()).map(weight).collect()
}

/// Indices of loads that are near points of a chunk.
pub(super) type Near = Vec<u32>;

/// Loads by the cells of a quadtree.
pub(super) struct Groups {
    cells: Vec<Cell>,
    /// The loads in the order of the cells, and their indices.
    sources: Vec<Source>,
    indices: Vec<u32>,
    /// Loads at the nodes of the cells.
    nodes: Vec<Source>,
}

struct Cell {
    centre_m: [f64; 2],
    half_m: f64,
    loads: Range<usize>,
    /// Empty in a cell that is not divided.
    children: Range<usize>,
    /// Empty where summing its loads is cheaper.
    nodes: Range<usize>,
    /// Distance within which a load of the cell is spread over its disc, at most, in m.
    reach_m: f64,
}

impl Groups {
    pub fn new(loads: &[Load], far_field: FarField) -> Self {
        let sources: Vec<Source> = loads.iter().map(Source::of).collect();
        let span = |of: fn(&Source) -> f64| {
            let bounds = (f64::INFINITY, f64::NEG_INFINITY);
            sources.iter().map(of).fold(bounds, |(lower, upper), at| (at.min(lower), at.max(upper)))
        };
        let (x, y) = (span(|source| source.x_m), span(|source| source.y_m));
        let mut groups =
            Self { cells: Vec::new(), indices: (0..).take(loads.len()).collect(), sources, nodes: Vec::new() };
        if loads.is_empty() {
            return groups;
        }
        let half_m = 0.5 * (x.1 - x.0).max(y.1 - y.0);
        groups.cells.push(groups.cell([0.5 * (x.0 + x.1), 0.5 * (y.0 + y.1)], half_m, 0..loads.len()));
        let (mut next, mut level) = (0, groups.cells.len());
        for _ in 0..DEPTH {
            while next < level {
                groups.divide(next, far_field.nodes * far_field.nodes);
                next += 1;
            }
            level = groups.cells.len();
        }
        let sorted = groups.indices.iter().map(|&index| groups.sources[index as usize]).collect();
        groups.sources = sorted;
        let places = far_field.places();
        for cell in 0..groups.cells.len() {
            groups.gather(cell, &places);
        }
        groups
    }

    fn cell(&self, centre_m: [f64; 2], half_m: f64, loads: Range<usize>) -> Cell {
        let near_m2 = |&index: &u32| self.sources[index as usize].near_m2;
        let reach_m = self.indices[loads.clone()].iter().map(near_m2).fold(0.0, f64::max).sqrt();
        Cell { centre_m, half_m, loads, children: 0..0, nodes: 0..0, reach_m }
    }

    /// Divides a cell of more than `few` loads into four; without those that are empty.
    fn divide(&mut self, cell: usize, few: usize) {
        let Cell { centre_m, half_m, ref loads, .. } = self.cells[cell];
        let loads = loads.clone();
        if loads.len() <= few || half_m <= 0.0 {
            return;
        }
        let quadrant =
            |source: &Source| usize::from(source.x_m >= centre_m[0]) + 2 * usize::from(source.y_m >= centre_m[1]);
        let sources = &self.sources;
        // Stable: the order of the sums is that of the loads.
        self.indices[loads.clone()].sort_by_key(|&index| quadrant(&sources[index as usize]));
        let first = self.cells.len();
        let mut from = loads.start;
        for corner in 0..4 {
            let here = &self.indices[from..loads.end];
            let count = here.iter().take_while(|&&index| quadrant(&self.sources[index as usize]) == corner).count();
            if count > 0 {
                let quarter = 0.5 * half_m;
                let side = |upper: bool| if upper { quarter } else { -quarter };
                let centre_m = [centre_m[0] + side(corner & 1 == 1), centre_m[1] + side(corner & 2 == 2)];
                self.cells.push(self.cell(centre_m, quarter, from..from + count));
            }
            from += count;
        }
        self.cells[cell].children = first..self.cells.len();
    }

    /// Moves the loads of a cell to its nodes, where that makes them fewer.
    fn gather(&mut self, cell: usize, places: &[f64]) {
        let p = places.len();
        let Cell { centre_m: [x_m, y_m], half_m, ref loads, .. } = self.cells[cell];
        if loads.len() <= p * p || half_m <= 0.0 {
            return;
        }
        let first = self.nodes.len();
        for node in 0..p * p {
            let (x_m, y_m) = (x_m + places[node % p] * half_m, y_m + places[node / p] * half_m);
            self.nodes.push(Source { x_m, y_m, normal: 0.0, along_x: 0.0, along_y: 0.0, near_m2: 0.0 });
        }
        for source in &self.sources[loads.clone()] {
            let along_x = weights(places, (source.x_m - x_m) / half_m);
            let along_y = weights(places, (source.y_m - y_m) / half_m);
            for (node, to) in self.nodes[first..].iter_mut().enumerate() {
                let weight = along_x[node % p] * along_y[node / p];
                to.normal += weight * source.normal;
                to.along_x += weight * source.along_x;
                to.along_y += weight * source.along_y;
            }
        }
        self.cells[cell].nodes = first..self.nodes.len();
    }

    /// Appends what the points within `bounds` have to sum, and the loads that may be near them.
    pub fn collect(&self, bounds: &Bounds, sum: &mut Vec<Source>, near: &mut Near) {
        let mut open: Vec<usize> = if self.cells.is_empty() { Vec::new() } else { vec![0] };
        while let Some(index) = open.pop() {
            let cell = &self.cells[index];
            let distance_m = bounds.distance_squared(cell.centre_m[0], cell.centre_m[1]).sqrt();
            let clear_m = (SEPARATION * cell.half_m).max(std::f64::consts::SQRT_2 * cell.half_m + cell.reach_m);
            if !cell.nodes.is_empty() && distance_m >= clear_m {
                sum.extend_from_slice(&self.nodes[cell.nodes.clone()]);
            } else if cell.children.is_empty() {
                for (source, &index) in self.sources[cell.loads.clone()].iter().zip(&self.indices[cell.loads.clone()]) {
                    sum.push(*source);
                    if bounds.distance_squared(source.x_m, source.y_m) < source.near_m2 {
                        near.push(index);
                    }
                }
            } else {
                open.extend(cell.children.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        common::simd::Triple,
        substrate::point_load::{COMPONENTS, add},
    };

    /// Largest error of one load taken to the nodes of its cell, over its stress scale, seen from `distance` half sides.
    fn largest_error(nodes: usize, distance: f64) -> f64 {
        let places = FarField { nodes }.places();
        let mut largest: f64 = 0.0;
        let steps = 12;
        let share = |k: usize| k as f64 / steps as f64;
        for (i, j) in (0..=steps).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let place = [2.0 * share(i) - 1.0, 2.0 * share(j) - 1.0];
            let weights = place.map(|t| weights(&places, t));
            for (turn, rise) in (0..32).flat_map(|turn| (0..=8).map(move |rise| (turn, rise))) {
                let (turn, rise) =
                    (std::f64::consts::TAU * turn as f64 / 32.0, std::f64::consts::PI * rise as f64 / 16.0);
                let at = [turn.cos() * rise.cos(), turn.sin() * rise.cos(), rise.sin()].map(|x| distance * x);
                let at = Triple { x: at[0], y: at[1], z: at[2] };
                for (component, compressible) in (0..3).flat_map(|k| [(k, 0.0), (k, 1.0)]) {
                    let load = |x_m: f64, y_m: f64, weight: f64| {
                        let force = |k: usize| if k == component { weight } else { 0.0 };
                        let (along_x, along_y, normal) = (force(0), force(1), force(2));
                        Source { x_m, y_m, normal, along_x, along_y, near_m2: 0.0 }
                    };
                    let mut difference = [0.0; COMPONENTS];
                    for (m, n) in (0..nodes).flat_map(|m| (0..nodes).map(move |n| (m, n))) {
                        let weight = weights[0][m] * weights[1][n];
                        add(compressible, &load(places[m], places[n], weight), at, &mut difference);
                    }
                    add(compressible, &load(place[0], place[1], -1.0), at, &mut difference);
                    let [xx, yy, zz, xy, yz, zx] = difference;
                    let norm = (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)).sqrt();
                    let gamma2 = (at.x - place[0]).powi(2) + (at.y - place[1]).powi(2) + at.z.powi(2);
                    largest = largest.max(norm * gamma2);
                }
            }
        }
        largest
    }

    #[test]
    fn nodes_err_less_than_stated_and_less_still_from_farther_away() {
        let found = ERRORS.map(|(nodes, stated)| {
            (nodes, stated, largest_error(nodes, SEPARATION), largest_error(nodes, 1.5 * SEPARATION))
        });
        for (nodes, stated, found, farther) in found {
            assert!(1.2 * found <= stated, "{nodes} nodes err by {found:e}");
            assert!(found > 0.3 * stated, "{nodes} nodes err by {found:e} only: the statement is idle");
            assert!(farther < found, "{nodes} nodes err by {farther:e} from farther away");
        }
    }
}
