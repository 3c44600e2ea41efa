//! Jacobi's iteration for a symmetric system (Zohdi 2018, section 8.4).

use crate::common::linear::{
    Symmetric,
    conjugate_gradient::{Outcome, dot},
};

/// Solves A x = b by sweeps x_i ← (b_i − Σ_{j≠i} a_ij x_j)/a_ii, all from the last sweep's values; `solution` holds the start
/// and becomes x.
///
/// On a graph this is the monograph's way: every node takes the weighted mean of its neighbours, again and again (Zohdi
/// 2018, section 8.4). It ends where ‖b − A x‖ ≤ `tolerance` ‖b‖ or after `limit` sweeps. Diagonals are positive. On a
/// bed of n layers it takes O(n²) sweeps where conjugate gradients take O(n).
pub(super) fn jacobi(
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
    let mut residual = vec![0.0; solution.len()];
    let mut iterations = 0;
    loop {
        matrix.multiply(solution, &mut residual);
        residual.iter_mut().zip(right_hand_side).for_each(|(residual, right)| *residual = right - *residual);
        let relative = dot(&residual, &residual).sqrt() / norm;
        if relative <= tolerance || relative.is_nan() || iterations >= limit {
            return Outcome { iterations, residual: relative };
        }
        iterations += 1;
        let sweep = solution.iter_mut().zip(residual.iter().zip(&matrix.diagonal));
        sweep.for_each(|(value, (residual, diagonal))| *value += residual / diagonal);
    }
}
