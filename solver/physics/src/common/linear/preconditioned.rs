//! The conjugate-gradient method with a preconditioner of the caller's (Saad 2003, algorithm 9.1), for operators that are not
//! stored as matrices.

use rayon::prelude::*;

use super::{
    conjugate_gradient::{Outcome, dot},
    csr::CHUNK,
};

/// A symmetric positive definite operator A with an approximate inverse that is symmetric and positive definite, too.
pub(crate) trait Preconditioned {
    /// `product` = A `vector`.
    fn multiply(&self, vector: &[f64], product: &mut [f64]);

    /// `correction` ≈ A⁻¹ `residual`.
    fn precondition(&mut self, residual: &[f64], correction: &mut [f64]);
}

/// Solves A x = b from the `solution` that is there, until ‖b − A x‖ ≤ `tolerance` ‖b‖ or for `limit` iterations; with b = 0
/// the answer is x = 0. The residual returned is that of the recursion. The result does not depend on the number of threads.
pub(crate) fn solve(
    system: &mut impl Preconditioned,
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
    let rows = right_hand_side.len();
    let (mut residual, mut product) = (vec![0.0; rows], vec![0.0; rows]);
    system.multiply(solution, &mut product);
    update(&mut residual, |row, _| right_hand_side[row] - product[row]);
    let mut relative = dot(&residual, &residual).sqrt() / norm;
    let mut iterations = 0;
    let mut preconditioned = vec![0.0; rows];
    let mut search = Vec::new();
    let mut descent = 0.0;
    while relative > tolerance && iterations < limit {
        system.precondition(&residual, &mut preconditioned);
        let next = dot(&residual, &preconditioned);
        if search.is_empty() {
            search.clone_from(&preconditioned);
        } else {
            let turn = next / descent;
            update(&mut search, |row, search| preconditioned[row] + turn * search);
        }
        descent = next;
        system.multiply(&search, &mut product);
        let curvature = dot(&search, &product);
        // Where rounding leaves no direction in which A is positive, what is there is the best.
        if !(curvature > 0.0 && descent > 0.0) {
            break;
        }
        iterations += 1;
        let step = descent / curvature;
        update(solution, |row, solution| solution + step * search[row]);
        update(&mut residual, |row, residual| residual - step * product[row]);
        relative = dot(&residual, &residual).sqrt() / norm;
    }
    Outcome { iterations, residual: relative }
}

/// Sets each value to what `of` makes of its row and of itself.
pub(crate) fn update(values: &mut [f64], of: impl Fn(usize, f64) -> f64 + Sync) {
    values.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, values)| {
        let from = chunk * CHUNK;
        values.iter_mut().enumerate().for_each(|(place, value)| *value = of(from + place, *value));
    });
}
