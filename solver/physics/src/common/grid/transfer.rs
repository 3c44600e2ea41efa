//! Between a grid and the next coarser one of a multigrid method: which axes are coarsened, interpolation and its transpose.

use super::conduction::{Conduction, for_planes, strides};

/// Share of the largest mean conductance along an axis from which on that axis is coarsened, too.
const STRONG: f64 = 0.25;

/// From cells to the cells of a coarser grid, each of which is one cell or two along each axis.
#[derive(Clone, Debug)]
pub(super) struct Transfer {
    fine: [usize; 3],
    pub(super) coarse: [usize; 3],
    pub(super) axes: [Axis; 3],
}

/// The two grids along one axis.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// Edges of the coarse cells, as places among those of the fine ones.
    starts: Vec<usize>,
    /// Of each fine cell: two coarse ones and their weights, which are linear in the distance of the middles.
    interpolated: Vec<[(usize, f64); 2]>,
    /// Of each coarse cell: fine ones and their weights, the transpose.
    gathered: Vec<Vec<(usize, f64)>>,
}

impl Axis {
    /// `middles_m` of the fine cells; two of them make a coarse one where the axis is coarsened.
    fn new(middles_m: &[f64], is_coarsened: bool) -> Self {
        let count = middles_m.len();
        let step = if is_coarsened { 2 } else { 1 };
        let starts: Vec<usize> = (0..count).step_by(step).chain([count]).collect();
        let coarse: Vec<f64> = coarse_middles(middles_m, &starts);
        let weights = |fine: usize| {
            let parent = (fine / step).min(coarse.len() - 1);
            let at_m = middles_m[fine];
            let other = if at_m < coarse[parent] { parent.checked_sub(1) } else { Some(parent + 1) };
            match other.filter(|other| *other < coarse.len() && is_coarsened) {
                Some(other) => {
                    let weight = (at_m - coarse[parent]) / (coarse[other] - coarse[parent]);
                    [(parent, 1.0 - weight), (other, weight)]
                }
                None => [(parent, 1.0), (parent, 0.0)],
            }
        };
        let interpolated: Vec<_> = (0..count).map(weights).collect();
        let mut gathered = vec![Vec::new(); coarse.len()];
        for (fine, pair) in interpolated.iter().enumerate() {
            for &(coarse, weight) in pair.iter().filter(|(_, weight)| *weight != 0.0) {
                gathered[coarse].push((fine, weight));
            }
        }
        Self { starts, interpolated, gathered }
    }
}

fn coarse_middles(middles_m: &[f64], starts: &[usize]) -> Vec<f64> {
    starts.array_windows().map(|[from, to]| middles_m[*from..*to].iter().sum::<f64>() / (to - from) as f64).collect()
}

impl Transfer {
    /// To the next coarser grid: axes along which conduction is weak stay, so that what is left on the coarse grid is alike in
    /// all directions. `None` where there is one cell only.
    pub(super) fn new(conduction: &Conduction, middles_m: &[Vec<f64>; 3]) -> Option<Self> {
        let fine = conduction.counts();
        let mean = |axis: usize| {
            let faces = (fine[axis] - 1) * fine[(axis + 1) % 3] * fine[(axis + 2) % 3];
            if faces == 0 { 0.0 } else { conduction.upwards_w_k(axis).iter().sum::<f64>() / faces as f64 }
        };
        let means = [mean(0), mean(1), mean(2)];
        let most = means.into_iter().fold(0.0, f64::max);
        let mut is_coarsened = [0, 1, 2].map(|axis| fine[axis] > 1 && means[axis] >= STRONG * most);
        if is_coarsened == [false; 3] {
            is_coarsened = fine.map(|count| count > 1);
        }
        if is_coarsened == [false; 3] {
            return None;
        }
        let axes = [0, 1, 2].map(|axis| Axis::new(&middles_m[axis], is_coarsened[axis]));
        let coarse = [0, 1, 2].map(|axis| axes[axis].gathered.len());
        Some(Self { fine, coarse, axes })
    }

    /// Middles of the coarse cells along each axis, in m.
    pub(super) fn middles_m(&self, fine_m: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
        [0, 1, 2].map(|axis| coarse_middles(&fine_m[axis], &self.axes[axis].starts))
    }

    /// Sums over the fine cells of each coarse one.
    pub(super) fn sums(&self, fine: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.coarse.iter().product()];
        let [_, stride_y, stride_z] = strides(self.fine);
        let [x, y, z] = &self.axes;
        let nx = self.coarse[0];
        for_planes(&mut sums, self.coarse, |k, plane| {
            for (j, sums) in plane.chunks_mut(nx).enumerate() {
                for fine_k in z.starts[k]..z.starts[k + 1] {
                    for fine_j in y.starts[j]..y.starts[j + 1] {
                        let row = &fine[fine_k * stride_z + fine_j * stride_y..];
                        for (i, sum) in sums.iter_mut().enumerate() {
                            *sum += row[x.starts[i]..x.starts[i + 1]].iter().sum::<f64>();
                        }
                    }
                }
            }
        });
        sums
    }

    /// Conductances between the coarse cells: those of the faces between them side by side, in series with half of what conducts
    /// within each of the two. For equal cells of one material that is the conductance of the coarse grid's own faces.
    pub(super) fn coarse(&self, fine: &Conduction) -> Conduction {
        let coarse_strides = strides(self.coarse);
        let upwards = |axis: usize| {
            let starts = &self.axes[axis].starts;
            let [between, within] = [0, 1].map(|inside| self.faces(fine, axis, inside == 1));
            let half = |row: usize, place: usize| match starts[place + 1] - starts[place] {
                1 => 0.0,
                _ => 0.5 / within[row],
            };
            let mut conductances_w_k = vec![0.0; between.len()];
            let (stride, count) = (coarse_strides[axis], self.coarse[axis]);
            for (row, conductance_w_k) in conductances_w_k.iter_mut().enumerate() {
                let place = row / stride % count;
                if place + 1 < count && between[row] > 0.0 {
                    let resistance = 1.0 / between[row] + half(row, place) + half(row + stride, place + 1);
                    *conductance_w_k = 1.0 / resistance;
                }
            }
            conductances_w_k
        };
        Conduction::of(self.coarse, [0, 1, 2].map(upwards))
    }

    /// Sums, over each coarse cell, of the conductances along an axis at its upper face, or within it between its two cells.
    fn faces(&self, fine: &Conduction, axis: usize, inside: bool) -> Vec<f64> {
        let upwards = fine.upwards_w_k(axis);
        let fine_strides = strides(self.fine);
        let mut sums = vec![0.0; self.coarse.iter().product()];
        for_planes(&mut sums, self.coarse, |k, plane| {
            for (place, sum) in plane.iter_mut().enumerate() {
                let cell = [place % self.coarse[0], place / self.coarse[0], k];
                let ranges = [0, 1, 2].map(|other| {
                    let starts = &self.axes[other].starts;
                    let (from, to) = (starts[cell[other]], starts[cell[other] + 1]);
                    match other == axis {
                        true if inside => from..to - 1,
                        true => to - 1..to,
                        false => from..to,
                    }
                });
                let [x, y, z] = ranges;
                for k in z {
                    for j in y.clone() {
                        for i in x.clone() {
                            *sum += upwards[i + j * fine_strides[1] + k * fine_strides[2]];
                        }
                    }
                }
            }
        });
        sums
    }

    /// Adds to the fine values what the coarse ones are between the middles of their cells.
    pub(super) fn interpolate(&self, coarse: &[f64], fine: &mut [f64]) {
        let [nx, ny, _] = self.fine;
        let coarse_nx = self.coarse[0];
        let [_, stride_y, stride_z] = strides(self.coarse);
        let [x, y, z] = &self.axes;
        for_planes(fine, self.fine, |k, plane| {
            let mut line = vec![0.0; coarse_nx];
            for (j, fine) in plane.chunks_mut(nx).enumerate().take(ny) {
                line.fill(0.0);
                for (of_k, weight_k) in z.interpolated[k] {
                    for (of_j, weight_j) in y.interpolated[j] {
                        let weight = weight_k * weight_j;
                        if weight != 0.0 {
                            let from = of_k * stride_z + of_j * stride_y;
                            let row = &coarse[from..from + coarse_nx];
                            line.iter_mut().zip(row).for_each(|(line, value)| *line += weight * value);
                        }
                    }
                }
                for (fine, [(one, of_one), (other, of_other)]) in fine.iter_mut().zip(&x.interpolated) {
                    *fine += of_one * line[*one] + of_other * line[*other];
                }
            }
        });
    }

    /// The transpose: what the coarse cells get of fine values.
    pub(super) fn gather(&self, fine: &[f64], coarse: &mut [f64]) {
        let nx = self.fine[0];
        let [_, stride_y, stride_z] = strides(self.fine);
        let [x, y, z] = &self.axes;
        for_planes(coarse, self.coarse, |k, plane| {
            let mut line = vec![0.0; nx];
            for (j, coarse) in plane.chunks_mut(self.coarse[0]).enumerate() {
                line.fill(0.0);
                for &(of_k, weight_k) in &z.gathered[k] {
                    for &(of_j, weight_j) in &y.gathered[j] {
                        let weight = weight_k * weight_j;
                        let from = of_k * stride_z + of_j * stride_y;
                        let row = &fine[from..from + nx];
                        line.iter_mut().zip(row).for_each(|(line, value)| *line += weight * value);
                    }
                }
                for (coarse, gathered) in coarse.iter_mut().zip(&x.gathered) {
                    *coarse = gathered.iter().fold(0.0, |sum, &(of, weight)| sum + weight * line[of]);
                }
            }
        });
    }
}
