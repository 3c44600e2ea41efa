//! Geometric multigrid for conduction on a grid, as a preconditioner (Trottenberg, Oosterlee & Schüller 2001).

use std::borrow::Cow;

use super::{CellGrid, conduction::Conduction, transfer::Transfer};
use crate::common::linear::preconditioned::{Preconditioned, update};

/// Steps of the smoother before and after the correction by the coarser grid.
const SMOOTHING: usize = 2;
/// The eigenvalues of D⁻¹ A, with D the diagonal, are in (0, 2], as the rows of A are weakly dominant; those of what the coarser
/// grid cannot represent are above a third in three dimensions.
const EIGENVALUES: [f64; 2] = [1.0 / 3.0, 2.0];

/// A x = own · x + Σ G (x − neighbour's) on a grid, for own ≥ 0 that is positive somewhere in each connected part, with one
/// V-cycle as an approximate inverse.
///
/// Each coarser grid joins pairs of cells along the axes in which conduction is strong; corrections are interpolated linearly,
/// and residuals are gathered by the transpose. The smoother is a Chebyshev polynomial in D⁻¹ A, which is symmetric and, unlike
/// sweeps through the cells, has no order in which threads could differ.
pub(crate) struct Multigrid<'c> {
    levels: Vec<Level<'c>>,
    /// 0 in cells where x is 0, else 1, on the finest grid; `None` where there is none.
    free: Option<Vec<f64>>,
}

struct Level<'c> {
    conduction: Cow<'c, Conduction>,
    own_w_k: Vec<f64>,
    /// 1/D.
    inverse: Vec<f64>,
    /// To the next level; `None` on the last one.
    transfer: Option<Transfer>,
    work: Work,
}

#[derive(Default)]
struct Work {
    residual: Vec<f64>,
    solution: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
}

impl<'c> Multigrid<'c> {
    /// For `own_w_k` in each cell; a cell with an infinite one has x = 0.
    pub(crate) fn new(grid: &CellGrid, conduction: &'c Conduction, mut own_w_k: Vec<f64>) -> Self {
        let free = own_w_k.iter().any(|own| own.is_infinite()).then(|| {
            let at_cells = conduction.at_cells();
            let mut free = vec![1.0; own_w_k.len()];
            for (row, own) in own_w_k.iter_mut().enumerate().filter(|(_, own)| own.is_infinite()) {
                // On coarser grids such a cell draws its neighbours to 0 as strongly as it conducts. With nothing to conduct
                // to, any number will do.
                *own = if at_cells[row] > 0.0 { at_cells[row] } else { 1.0 };
                free[row] = 0.0;
            }
            free
        });
        let mut middles_m = [0, 1, 2].map(|axis| grid.middles_m(axis));
        let mut levels: Vec<Level<'c>> = Vec::new();
        let mut conduction = Cow::Borrowed(conduction);
        loop {
            let mut inverse = conduction.at_cells();
            update(&mut inverse, |row, at_cell| {
                let diagonal = at_cell + own_w_k[row];
                if diagonal > 0.0 { diagonal.recip() } else { 0.0 }
            });
            let transfer = Transfer::new(&conduction, &middles_m);
            let next = transfer.as_ref().map(|transfer| {
                middles_m = transfer.middles_m(&middles_m);
                (transfer.coarse(&conduction), transfer.sums(&own_w_k))
            });
            let work = Work {
                residual: vec![0.0; own_w_k.len()],
                solution: vec![0.0; own_w_k.len()],
                direction: vec![0.0; own_w_k.len()],
                product: vec![0.0; own_w_k.len()],
            };
            levels.push(Level { conduction, own_w_k, inverse, transfer, work });
            let Some((coarse, sums)) = next else { break };
            (conduction, own_w_k) = (Cow::Owned(coarse), sums);
        }
        Self { levels, free }
    }
}

impl Preconditioned for Multigrid<'_> {
    fn multiply(&self, vector: &[f64], product: &mut [f64]) {
        let Some(finest) = self.levels.first() else { return };
        finest.conduction.multiply(&finest.own_w_k, vector, product);
        if let Some(free) = &self.free {
            update(product, |row, product| product * free[row]);
        }
    }

    fn precondition(&mut self, residual: &[f64], correction: &mut [f64]) {
        if let Some(finest) = self.levels.first_mut() {
            finest.work.residual.copy_from_slice(residual);
            cycle(&mut self.levels, self.free.as_deref());
            correction.copy_from_slice(&self.levels[0].work.solution);
        }
    }
}

/// One V-cycle for the residual of the first level, from 0; its solution is the correction.
fn cycle(levels: &mut [Level<'_>], free: Option<&[f64]>) {
    let Some((level, coarser)) = levels.split_first_mut() else { return };
    let Some(transfer) = &level.transfer else {
        // One cell.
        let Work { residual, solution, .. } = &mut level.work;
        solution.iter_mut().zip(residual).zip(&level.inverse).for_each(|((solution, r), inverse)| {
            *solution = *r * inverse;
        });
        return;
    };
    level.work.solution.fill(0.0);
    smooth(&level.conduction, &level.own_w_k, &level.inverse, &mut level.work, free);
    if let Some(next) = coarser.first_mut() {
        transfer.gather(&level.work.residual, &mut next.work.residual);
        cycle(coarser, None);
        let Work { residual, solution, direction, product } = &mut level.work;
        direction.fill(0.0);
        transfer.interpolate(&coarser[0].work.solution, direction);
        if let Some(free) = free {
            update(direction, |row, direction| direction * free[row]);
        }
        level.conduction.multiply(&level.own_w_k, direction, product);
        advance(solution, residual, direction, product, free);
    }
    smooth(&level.conduction, &level.own_w_k, &level.inverse, &mut level.work, free);
}

/// Chebyshev's iteration on D⁻¹ A (Saad 2003, algorithm 12.1): improves the solution and keeps its residual.
fn smooth(conduction: &Conduction, own_w_k: &[f64], inverse: &[f64], work: &mut Work, free: Option<&[f64]>) {
    let Work { residual, solution, direction, product } = work;
    let [low, high] = EIGENVALUES;
    let (centre, half) = (0.5 * (high + low), 0.5 * (high - low));
    let mut ratio = half / centre;
    update(direction, |row, _| residual[row] * inverse[row] / centre);
    for step in 0..SMOOTHING {
        if step > 0 {
            let next = 1.0 / (2.0 * centre / half - ratio);
            let (keep, take) = (next * ratio, 2.0 * next / half);
            update(direction, |row, direction| keep * direction + take * residual[row] * inverse[row]);
            ratio = next;
        }
        conduction.multiply(own_w_k, direction, product);
        advance(solution, residual, direction, product, free);
    }
}

/// Adds a direction to the solution and takes its product from the residual.
fn advance(solution: &mut [f64], residual: &mut [f64], direction: &[f64], product: &[f64], free: Option<&[f64]>) {
    update(solution, |row, solution| solution + direction[row]);
    match free {
        Some(free) => update(residual, |row, residual| (residual - product[row]) * free[row]),
        None => update(residual, |row, residual| residual - product[row]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{
        grid::{
            Fine,
            conduction::{Conductivities, FaceMean},
            graded_edges,
        },
        linear::{
            conjugate_gradient::{Outcome, dot},
            preconditioned,
        },
    };

    fn cube(cells: usize) -> CellGrid {
        CellGrid::regular("cube", [0.0; 3], [1.0; 3], [cells; 3])
    }

    /// Numbers without a pattern.
    fn scattered(rows: usize) -> Vec<f64> {
        (0..rows as u64).map(|row| (row * 7919 % 10_007) as f64 / 5003.5 - 1.0).collect()
    }

    fn solved(grid: &CellGrid, conduction: &Conduction, own_w_k: Vec<f64>) -> (Outcome, f64) {
        let exact = scattered(grid.len());
        let free: Vec<f64> = own_w_k.iter().map(|own| if own.is_infinite() { 0.0 } else { 1.0 }).collect();
        let exact: Vec<f64> = exact.iter().zip(&free).map(|(exact, free)| exact * free).collect();
        let mut system = Multigrid::new(grid, conduction, own_w_k);
        let mut right = vec![0.0; grid.len()];
        system.multiply(&exact, &mut right);
        let mut found = vec![0.0; grid.len()];
        let outcome = preconditioned::solve(&mut system, &right, &mut found, 1e-10, 200);
        let error = found.iter().zip(&exact).fold(0.0f64, |most, (found, exact)| most.max((found - exact).abs()));
        (outcome, error)
    }

    #[test]
    fn iterations_do_not_grow_with_the_number_of_cells() {
        let mut counts = Vec::new();
        for cells in [10, 21, 40] {
            let grid = cube(cells);
            let conduction = Conduction::new(&grid, Conductivities::All(1.0), FaceMean::Harmonic);
            // A slab with a given temperature at one face, and nothing else that holds it.
            let mut own = vec![0.0; grid.len()];
            own[..cells * cells].fill(2.0 / cells as f64);
            let (outcome, error) = solved(&grid, &conduction, own);
            assert!(outcome.converged(1e-10), "{cells}: {outcome:?}");
            // The condition is about (2 n/π)² ≈ 650.
            assert!(error < 1e-6, "{cells}: {error}");
            counts.push(outcome.iterations);
        }
        assert!(counts.iter().all(|count| *count <= 14), "{counts:?}");
    }

    #[test]
    fn flat_cells_grading_and_contrast_are_solved_too() {
        let flat = CellGrid::regular("flat", [0.0; 3], [1.0, 1.0, 1e-3], [24, 24, 24]);
        // A plate with fine cells around its middle, 100 explicit limits of them.
        let fine = |from_m, to_m| Some(Fine { from_m, to_m, growth: 1.25 });
        let across = graded_edges(-1.0, 1.0, 0.02, fine(-0.1, 0.1));
        let plate = CellGrid {
            name: "plate".into(),
            edges_m: [across.clone(), across, graded_edges(-1.0, 0.0, 0.02, fine(-0.1, 0.0))],
        };
        let own_of = |grid: &CellGrid, per_volume: f64| -> Vec<f64> {
            grid.volumes_m3().into_iter().map(|volume| per_volume * volume).collect()
        };
        for (grid, own, most) in [
            (&flat, own_of(&flat, 1e-3), 16),
            (&plate, own_of(&plate, 1.0 / (600.0 * 0.02 * 0.02)), 35),
            (&plate, own_of(&plate, 1e-3), 60),
        ] {
            let conduction = Conduction::new(grid, Conductivities::All(1.0), FaceMean::Harmonic);
            let (outcome, _) = solved(grid, &conduction, own);
            assert!(outcome.converged(1e-10) && outcome.iterations <= most, "{}: {outcome:?}", grid.name);
        }
        let grid = cube(20);
        let contrast: Vec<f64> =
            scattered(grid.len()).iter().map(|value| if *value > 0.4 { 1e3 } else { 1.0 }).collect();
        let conduction = Conduction::new(&grid, Conductivities::Each(&contrast), FaceMean::Harmonic);
        let (outcome, _) = solved(&grid, &conduction, vec![1e-3; grid.len()]);
        assert!(outcome.converged(1e-10) && outcome.iterations <= 120, "{outcome:?}");
        // Cells that are held: every seventh, as where a melting front passes.
        let conduction = Conduction::new(&grid, Conductivities::All(1.0), FaceMean::Harmonic);
        let own = (0..grid.len()).map(|row| if row % 7 == 0 { f64::INFINITY } else { 1e-3 }).collect();
        let (outcome, error) = solved(&grid, &conduction, own);
        assert!(outcome.converged(1e-10) && outcome.iterations <= 25 && error < 1e-8, "{outcome:?}, {error}");
    }

    #[test]
    fn one_cycle_is_symmetric_and_positive() {
        let grid = CellGrid::regular("box", [0.0; 3], [1.0, 2.0, 0.5], [9, 6, 11]);
        let conduction = Conduction::new(&grid, Conductivities::All(1.0), FaceMean::Harmonic);
        let mut system = Multigrid::new(&grid, &conduction, vec![0.01; grid.len()]);
        let (a, b) = (scattered(grid.len()), scattered(grid.len() + 31)[31..].to_vec());
        let (mut of_a, mut of_b) = (vec![0.0; a.len()], vec![0.0; a.len()]);
        system.precondition(&a, &mut of_a);
        system.precondition(&b, &mut of_b);
        let [ab, ba] = [dot(&a, &of_b), dot(&b, &of_a)];
        assert!((ab - ba).abs() < 1e-12 * dot(&a, &of_a), "{ab} and {ba}");
        assert!(dot(&a, &of_a) > 0.0 && dot(&b, &of_b) > 0.0);
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let grid = cube(24);
        let of = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let conduction = Conduction::new(&grid, Conductivities::All(1.0), FaceMean::Harmonic);
                let mut system = Multigrid::new(&grid, &conduction, vec![0.01; grid.len()]);
                let mut found = vec![0.0; grid.len()];
                preconditioned::solve(&mut system, &scattered(grid.len()), &mut found, 1e-9, 50);
                found
            })
        };
        assert_eq!(of(1), of(3));
    }
}
