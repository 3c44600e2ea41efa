//! Grids of cells in a box: regular, or graded along each axis.

pub(crate) mod conduction;
mod graded;
pub(crate) mod multigrid;
mod transfer;

use serde::Serialize;
use stagger_coupling::SolveError;
use stagger_messages::Grid as Described;

pub use conduction::FaceMean;
pub use graded::{Fine, graded_edges};

use super::checks::setting;

/// Most cells of a grid: rows of a field are counted in 32 bits where they are indices.
const MOST_CELLS: f64 = u32::MAX as f64;

/// Cells in a box whose sides are along x, y and z, between planes across each axis. x runs fastest, then y, then z.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellGrid {
    /// Name in the scene.
    pub name: String,
    /// Planes between the cells across each axis, with those at both ends, in m; rising.
    pub edges_m: [Vec<f64>; 3],
}

impl CellGrid {
    /// Equal cells: `counts` of them in the box between two corners, in m.
    #[must_use]
    pub fn regular(name: &str, lower_m: [f64; 3], upper_m: [f64; 3], counts: [usize; 3]) -> Self {
        let edges = |axis: usize| {
            let (lower, upper, count) = (lower_m[axis], upper_m[axis], counts[axis]);
            // The last one is the corner itself, not what rounding makes of it.
            let edge = |place: usize| match place == count {
                true => upper,
                false => lower + (upper - lower) * (place as f64 / count as f64),
            };
            (0..=count).map(edge).collect()
        };
        Self { name: name.into(), edges_m: [0, 1, 2].map(edges) }
    }

    /// Refuses, on behalf of `node`, edges that are not finite and rising, and more cells than rows can be counted.
    ///
    /// # Errors
    /// As said.
    pub fn check(&self, node: &str) -> Result<(), SolveError> {
        for (axis, edges) in ["x", "y", "z"].into_iter().zip(&self.edges_m) {
            let rises = edges.len() >= 2 && edges.array_windows().all(|[a, b]| a < b);
            if !rises || edges.iter().any(|edge| !edge.is_finite()) {
                return Err(SolveError::Start(format!(
                    "{node}: grid `{}` needs at least two rising, finite edges along {axis}",
                    self.name
                )));
            }
        }
        let cells: f64 = self.counts().iter().map(|&count| count as f64).product();
        setting(node, &format!("number of cells of grid `{}`", self.name), cells, cells <= MOST_CELLS, "below 2^32")
    }

    /// Cells along each axis.
    #[must_use]
    pub fn counts(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.edges_m[axis].len().saturating_sub(1))
    }

    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.counts().iter().product()
    }

    /// Whether there is no cell.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Widths of the cells along an axis, in m.
    #[must_use]
    pub fn widths_m(&self, axis: usize) -> Vec<f64> {
        self.edges_m[axis].array_windows().map(|[a, b]| b - a).collect()
    }

    /// Middles of the cells along an axis, in m.
    #[must_use]
    pub fn middles_m(&self, axis: usize) -> Vec<f64> {
        self.edges_m[axis].array_windows().map(|[a, b]| 0.5 * (a + b)).collect()
    }

    /// Volumes of the cells, in m³.
    #[must_use]
    pub fn volumes_m3(&self) -> Vec<f64> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.widths_m(axis));
        let mut volumes = Vec::with_capacity(self.len());
        for z in &z {
            for y in &y {
                volumes.extend(x.iter().map(|x| x * y * z));
            }
        }
        volumes
    }

    /// The row of the cell `[i, j, k]`.
    #[must_use]
    pub fn row(&self, [i, j, k]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.counts();
        i + nx * (j + ny * k)
    }

    /// The cell along an axis whose edges a coordinate lies between, in m; `None` outside the box. An edge belongs to the
    /// cell above it, and the last one to the last cell.
    #[must_use]
    pub fn along(&self, axis: usize, at_m: f64) -> Option<usize> {
        let edges = &self.edges_m[axis];
        let (first, last) = (*edges.first()?, *edges.last()?);
        let inside = at_m >= first && at_m <= last;
        inside.then(|| (edges.partition_point(|edge| *edge <= at_m) - 1).min(edges.len() - 2))
    }

    /// The grid as a support.
    #[must_use]
    pub fn as_support(&self) -> Described {
        match self.spacing_m() {
            Some(spacing_m) => {
                let dims = self.counts().map(|count| u32::try_from(count).unwrap_or(0));
                Described::of_cells([0, 1, 2].map(|axis| self.edges_m[axis][0]), spacing_m, dims)
            }
            None => Described::between([0, 1, 2].map(|axis| self.edges_m[axis].as_slice())),
        }
    }

    /// The cells at one end of an axis as a grid of their own, one cell thick: what lies at that face.
    #[must_use]
    pub fn layer(&self, axis: usize, at_upper_end: bool) -> Self {
        let mut edges_m = self.edges_m.clone();
        let edges = &self.edges_m[axis];
        let from = if at_upper_end { edges.len().saturating_sub(2) } else { 0 };
        edges_m[axis] = edges[from..].iter().take(2).copied().collect();
        Self { name: self.name.clone(), edges_m }
    }

    /// The widths, where all cells are alike within rounding, in m.
    #[must_use]
    pub fn spacing_m(&self) -> Option<[f64; 3]> {
        let mean = |axis: usize| {
            let edges = &self.edges_m[axis];
            let mean_m = (edges.last()? - edges.first()?) / (edges.len() - 1) as f64;
            let scale_m = edges.iter().fold(mean_m, |most, edge| most.max(edge.abs()));
            let alike = |width: &f64| (width - mean_m).abs() <= 1e-9 * mean_m + 4.0 * f64::EPSILON * scale_m;
            self.widths_m(axis).iter().all(alike).then_some(mean_m)
        };
        Some([mean(0)?, mean(1)?, mean(2)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_lie_between_their_edges() {
        let grid = CellGrid::regular("plate", [0.0, 1.0, -2.0], [4.0, 2.0, 0.0], [4, 1, 2]);
        assert_eq!((grid.counts(), grid.len(), grid.row([3, 0, 1])), ([4, 1, 2], 8, 7));
        assert_eq!(grid.middles_m(0), [0.5, 1.5, 2.5, 3.5]);
        assert_eq!(grid.spacing_m(), Some([1.0, 1.0, 1.0]));
        let along: Vec<_> = [-0.1, 0.0, 0.9, 1.0, 4.0, 4.1].map(|at_m| grid.along(0, at_m)).into();
        assert_eq!(along, [None, Some(0), Some(0), Some(1), Some(3), None]);
        let top = grid.layer(2, true);
        assert_eq!((top.counts(), top.edges_m[2].clone()), ([4, 1, 1], vec![-1.0, 0.0]));
        assert_eq!(grid.layer(2, false).edges_m[2], [-2.0, -1.0]);
    }

    #[test]
    fn a_support_says_whether_the_grid_is_graded() {
        let regular = CellGrid::regular("plate", [0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [3, 7, 9]);
        assert!(!regular.as_support().is_graded());
        let graded = CellGrid { edges_m: [vec![0.0, 1.0, 3.0], vec![0.0, 1.0], vec![0.0, 1.0]], ..regular };
        let support = graded.as_support();
        assert!(support.is_graded());
        assert_eq!(support.point_m([1, 0, 0]), Some([2.0, 0.5, 0.5]));
    }

    #[test]
    fn edges_that_do_not_rise_are_refused() {
        let sound = CellGrid::regular("plate", [0.0; 3], [1.0; 3], [2, 2, 2]);
        assert!(sound.check("solid").is_ok());
        for wrong in [vec![0.0], vec![0.0, 0.0], vec![1.0, 0.0], vec![0.0, f64::NAN], vec![0.0, f64::INFINITY]] {
            let grid = CellGrid { edges_m: [vec![0.0, 1.0], wrong, vec![0.0, 1.0]], name: "plate".into() };
            let error = grid.check("solid").unwrap_err().to_string();
            assert!(error.contains("grid `plate`") && error.contains("along y"), "{error}");
        }
    }
}
