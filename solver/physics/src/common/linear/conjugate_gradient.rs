//! The conjugate-gradient method with Jacobi's preconditioner (Hestenes & Stiefel 1952; Saad 2003, algorithm 9.1).

use rayon::prelude::*;

use super::csr::{CHUNK, Symmetric};

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outcome {
    /// Products with the matrix, less the one for the start's residual.
    pub(crate) iterations: u32,
    /// ‖b − A x‖/‖b‖, from the recursion; 0 where b is zero.
    pub(crate) residual: f64,
}

impl Outcome {
    /// Whether the tolerance was met.
    pub(crate) fn converged(&self, tolerance: f64) -> bool {
        self.residual <= tolerance
    }
}

/// Solves A x = b for a symmetric positive semidefinite A; `solution` holds the start and becomes x.
///
/// It ends where ‖b − A x‖ ≤ `tolerance` ‖b‖, after `limit` iterations, or where rounding leaves no direction in which
/// A is positive. With b = 0 the answer is x = 0. A semidefinite A needs a b in its range, which a network with given
/// sources has where each of its parts is in balance; x then keeps the start's share of the null space. The result does
/// not depend on the number of threads.
pub(crate) fn solve(
    matrix: &Symmetric,
    right_hand_side: &[f64],
    solution: &mut [f64],
    tolerance: f64,
    limit: u32,
) -> Outcome {
    let norm = dot(right_hand_side, right_hand_side).sqrt();
    if norm == 0.0 {
        solution.fill(0.0);
        return Outcome { iterations: 0, residual: 0.0 };
    }
    // A row without a diagonal is empty in a semidefinite matrix: its residual stays as it is.
    let inverse: Vec<f64> =
        matrix.diagonal.iter().map(|&diagonal| if diagonal > 0.0 { diagonal.recip() } else { 1.0 }).collect();
    let mut product = vec![0.0; matrix.rows()];
    matrix.multiply(solution, &mut product);
    let mut residual: Vec<f64> = right_hand_side.iter().zip(&product).map(|(right, product)| right - product).collect();
    let mut search: Vec<f64> = residual.iter().zip(&inverse).map(|(residual, inverse)| residual * inverse).collect();
    let mut descent = dot(&residual, &search);
    let mut relative = dot(&residual, &residual).sqrt() / norm;
    let mut iterations = 0;
    while relative > tolerance && iterations < limit {
        let curvature = matrix.multiply_dot(&search, &mut product);
        if curvature.is_nan() || curvature <= 0.0 {
            break;
        }
        iterations += 1;
        let step = descent / curvature;
        // The preconditioned residual takes the place of the product, which is used up.
        let [next, square] = advance(step, &search, &inverse, solution, &mut residual, &mut product);
        relative = square.sqrt() / norm;
        let turn = next / descent;
        descent = next;
        search.par_chunks_mut(CHUNK).zip(product.par_chunks(CHUNK)).for_each(|(search, product)| {
            search.iter_mut().zip(product).for_each(|(search, product)| *search = product + turn * *search);
        });
    }
    Outcome { iterations, residual: relative }
}

/// One pass over all vectors, as it is memory that limits them: x += `step` p, r −= `step` q, and q becomes the preconditioned
/// residual z. Returns r·z and r·r, from the sums of fixed chunks in their order.
fn advance(
    step: f64,
    search: &[f64],
    inverse: &[f64],
    solution: &mut [f64],
    residual: &mut [f64],
    product: &mut [f64],
) -> [f64; 2] {
    let vectors = (search.par_chunks(CHUNK), inverse.par_chunks(CHUNK));
    let changed = (solution.par_chunks_mut(CHUNK), residual.par_chunks_mut(CHUNK), product.par_chunks_mut(CHUNK));
    let chunks = vectors.into_par_iter().zip(changed.into_par_iter());
    let partials: Vec<[f64; 2]> = chunks
        .map(|((search, inverse), (solution, residual, product))| {
            let mut sums = [0.0; 2];
            let vectors = search.iter().zip(inverse);
            let changed = solution.iter_mut().zip(residual).zip(product);
            for ((search, inverse), ((solution, residual), product)) in vectors.zip(changed) {
                *solution += step * search;
                *residual -= step * *product;
                *product = *residual * inverse;
                sums[0] += *residual * *product;
                sums[1] += *residual * *residual;
            }
            sums
        })
        .collect();
    partials.into_iter().fold([0.0; 2], |sums, part| [sums[0] + part[0], sums[1] + part[1]])
}

/// a·b, from the sums of fixed chunks in their order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let partial = |(a, b): (&[f64], &[f64])| a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b);
    if a.len() <= CHUNK {
        return partial((a, b));
    }
    let partials: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(partial).collect();
    partials.into_iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// −x″ on a line between two zeros.
    fn line(rows: u32) -> Symmetric {
        Symmetric::new(vec![2.0; rows as usize], (1..rows).map(|row| (row - 1, row, -1.0)))
    }

    #[test]
    fn a_line_of_n_unknowns_takes_at_most_n_iterations() {
        let rows = 60;
        let exact: Vec<f64> = (0..rows).map(|row| f64::from(row % 7) - 2.5).collect();
        let mut right = vec![0.0; exact.len()];
        line(rows).multiply(&exact, &mut right);
        let mut solution = vec![0.0; exact.len()];
        let outcome = solve(&line(rows), &right, &mut solution, 1e-12, rows);
        assert!(outcome.converged(1e-12) && outcome.iterations <= rows, "{outcome:?}");
        // Condition 4 (n/π)² ≈ 1500 times the tolerance, times ‖x‖ of 16.
        let error = solution.iter().zip(&exact).fold(0.0f64, |most, (found, exact)| most.max((found - exact).abs()));
        assert!(error < 1e-7, "{error}");
        let again = solve(&line(rows), &right, &mut solution, 1e-10, rows);
        assert_eq!(again.iterations, 0, "the solution is its own start");
    }

    #[test]
    fn nothing_on_the_right_and_parts_that_float_are_solved_at_once() {
        let mut solution = vec![3.0; 4];
        assert_eq!(solve(&line(4), &[0.0; 4], &mut solution, 1e-9, 9), Outcome { iterations: 0, residual: 0.0 });
        assert_eq!(solution, [0.0; 4]);
        // Two unknowns coupled to each other only, and one to nothing: x keeps its mean, and the third its start.
        let floating = Symmetric::new(vec![1.0, 1.0, 0.0], [(0, 1, -1.0)].into_iter());
        let mut solution = vec![5.0, 5.0, 7.0];
        let outcome = solve(&floating, &[1.0, -1.0, 0.0], &mut solution, 1e-14, 9);
        assert!(outcome.converged(1e-14));
        assert_eq!(solution, [5.5, 4.5, 7.0]);
        // A right-hand side outside the range is not solved, and does not loop.
        let outcome = solve(&floating, &[1.0, 1.0, 0.0], &mut solution, 1e-9, 1000);
        assert!(!outcome.converged(1e-9) && solution.iter().all(|value| value.is_finite()), "{outcome:?}");
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let rows = 3 * CHUNK as u32 + 17;
        let right: Vec<f64> = (0..rows).map(|row| f64::from(row * 7919 % 1013) - 500.0).collect();
        let of = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut solution = vec![0.0; right.len()];
            pool.install(|| solve(&line(rows), &right, &mut solution, 1e-9, 50));
            solution
        };
        assert_eq!(of(1), of(3));
    }
}
