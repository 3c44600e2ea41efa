//! The upper face of a solid on a grid, where light and heat arrive on it.

use serde::Serialize;
use stagger_messages::{Measure, Port};

use super::{Vec3, grid::CellGrid};

/// Support of the fields on the cells at the upper face.
pub const SURFACE: &str = "solid-surface";

/// The upper face across z of a solid on a grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SolidSurface {
    /// The cells at it, one layer.
    pub cells: CellGrid,
    /// Index in the scene of the wall that is this face; `None` is none.
    pub wall: Option<u32>,
}

/// A power in W on each cell of a surface, a mean over the window.
pub(crate) fn power_port(name: &str) -> Port {
    Port::f64(name, "W", SURFACE, 1, Measure::Magnitude)
}

impl SolidSurface {
    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is no cell.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Its height, in m.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.cells.edges_m[2].last().copied().unwrap_or(f64::NAN)
    }

    /// A length along any beam that puts a point of it above the face, in m.
    #[must_use]
    pub fn beyond_m(&self, point: Vec3) -> f64 {
        let widths_m =
            self.cells.edges_m.iter().map(|edges| edges.iter().fold(0.0f64, |most, edge| most.max(edge.abs())));
        2.0 * (point.norm() + widths_m.sum::<f64>())
    }

    /// Where a straight line from a point above meets it, in m; `None` where it does not.
    #[must_use]
    pub fn met(&self, from: Vec3, direction: Vec3) -> Option<Vec3> {
        let way_m = (self.height_m() - from.z) / direction.z;
        let point = from + direction * way_m;
        let is_met = direction.z < 0.0
            && way_m.is_finite()
            && [0, 1].iter().all(|&axis| {
                let edges_m = &self.cells.edges_m[axis];
                edges_m.first().is_some_and(|first| point[axis] >= *first)
                    && edges_m.last().is_some_and(|last| point[axis] <= *last)
            });
        is_met.then_some(point)
    }

    /// The cell under a place; beyond the edge the nearest one.
    #[must_use]
    pub fn cell_at(&self, x_m: f64, y_m: f64) -> usize {
        let [i, j] = [(0, x_m), (1, y_m)].map(|(axis, at_m)| self.nearest(axis, at_m));
        i + j * self.cells.counts()[0]
    }

    fn nearest(&self, axis: usize, at_m: f64) -> usize {
        let edges_m = &self.cells.edges_m[axis];
        edges_m.partition_point(|edge| *edge <= at_m).saturating_sub(1).min(edges_m.len().saturating_sub(2))
    }

    /// Spreads an amount evenly over a square around a point, `half_m` to each side, and adds to each cell what of the square
    /// lies on it. What lies beyond the face goes to the cells at its edge, so that the whole amount arrives.
    pub fn spread(&self, point: Vec3, half_m: f64, amount: f64, onto: &mut [f64]) {
        let [nx, _, _] = self.cells.counts();
        let [along_x, along_y] = [0, 1].map(|axis| self.overlaps(axis, point[axis], half_m));
        for &(j, share_y) in &along_y {
            for &(i, share_x) in &along_x {
                onto[j * nx + i] += amount * (share_x * share_y);
            }
        }
    }

    /// Cells along an axis with their shares of the interval from `at_m − half_m` to `at_m + half_m`; they add up to 1.
    fn overlaps(&self, axis: usize, at_m: f64, half_m: f64) -> Vec<(usize, f64)> {
        let edges_m = &self.cells.edges_m[axis];
        let [from, to] = [at_m - half_m, at_m + half_m].map(|at_m| self.nearest(axis, at_m));
        if from == to {
            return vec![(from, 1.0)];
        }
        let mut left = 1.0;
        let mut shares = Vec::with_capacity(to - from + 1);
        for place in from..to {
            let covered_m = edges_m[place + 1].min(at_m + half_m) - edges_m[place].max(at_m - half_m);
            // Below the first edge, too, all goes to the first cell.
            let below_m = if place == 0 { (edges_m[0] - (at_m - half_m)).max(0.0) } else { 0.0 };
            let share = (covered_m + below_m) / (2.0 * half_m);
            shares.push((place, share));
            left -= share;
        }
        shares.push((to, left));
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface() -> SolidSurface {
        let edges_m = [vec![0.0, 1.0, 3.0, 4.0], vec![0.0, 1.0, 2.0], vec![-1.0, 0.0]];
        SolidSurface { cells: CellGrid { name: "plate".into(), edges_m }, wall: None }
    }

    #[test]
    fn a_square_is_shared_by_the_cells_it_lies_on() {
        let mut onto = vec![0.0; 6];
        surface().spread(Vec3::new(1.0, 1.0, 0.0), 0.5, 8.0, &mut onto);
        assert_eq!(onto, [2.0, 2.0, 0.0, 2.0, 2.0, 0.0]);
        let mut onto = vec![0.0; 6];
        surface().spread(Vec3::new(2.0, 0.25, 0.0), 0.5, 8.0, &mut onto);
        assert_eq!(onto, [0.0, 8.0, 0.0, 0.0, 0.0, 0.0]);
        // Over a corner, and wider than the face: all of it arrives.
        for (point, half_m) in [(Vec3::new(0.1, 1.9, 0.0), 0.5), (Vec3::new(2.0, 1.0, 0.0), 10.0)] {
            let mut onto = vec![0.0; 6];
            surface().spread(point, half_m, 8.0, &mut onto);
            assert!((onto.iter().sum::<f64>() - 8.0).abs() < 1e-14, "{onto:?}");
            assert!(onto.iter().all(|part| *part >= 0.0), "{onto:?}");
        }
    }

    #[test]
    fn a_line_meets_the_face_from_above_only() {
        let met = |from: [f64; 3], direction: [f64; 3]| surface().met(from.into(), direction.into());
        assert_eq!(met([0.5, 0.5, 2.0], [0.6, 0.0, -0.8]), Some(Vec3::new(2.0, 0.5, 0.0)));
        assert_eq!(met([0.5, 0.5, 2.0], [0.0, 0.0, 1.0]), None);
        assert_eq!(met([5.0, 0.5, 2.0], [0.0, 0.0, -1.0]), None);
        assert_eq!(met([0.5, 0.5, 2.0], [1.0, 0.0, 0.0]), None);
    }
}
