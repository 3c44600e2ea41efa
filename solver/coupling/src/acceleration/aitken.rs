//! Relaxation with Aitken's dynamic factor (Küttler & Wall 2008, eq. 44).

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::{Iterates, Pair, relax, weights};

/// Relaxation with Aitken's dynamic factor (Küttler & Wall 2008, eq. 44):
///
/// ω_{k+1} = −ω_k r_kᵀ (r_{k+1} − r_k) / ‖r_{k+1} − r_k‖²
///
/// As they advise, the first factor of a step is the last one of the step before, in size at most the run's first one: a
/// factor from residuals near convergence may be far off.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Aitken {
    /// ω of the run's first iteration.
    initial: f64,
    /// ω of the step's first iteration.
    first: f64,
    /// ω of the newest iteration.
    newest: f64,
    /// Residual of the newest iteration of this attempt.
    residual: Option<DVector<f64>>,
}

impl Aitken {
    pub fn new(relaxation: f64) -> Self {
        Self { initial: relaxation, first: relaxation, newest: relaxation, residual: None }
    }

    pub fn next(&mut self, fields: &[Iterates<'_>]) -> Vec<Vec<f64>> {
        let residual = Pair::new(fields).residual;
        if let Some(last) = &self.residual {
            let weights = weights(fields, &[last, &residual]);
            let before = weighted(fields, &weights, last);
            let difference = weighted(fields, &weights, &(&residual - last));
            let square = difference.norm_squared();
            // Equal residuals give no factor.
            let newest = if square > 0.0 { -self.newest * before.dot(&difference) / square } else { self.newest };
            // One of zero would never be left again.
            if newest.is_normal() {
                self.newest = newest;
            }
        }
        self.residual = Some(residual);
        relax(fields, self.newest)
    }

    pub fn accepted(&mut self) {
        self.first = self.newest.abs().min(self.initial.abs()).copysign(self.newest);
        self.rejected();
    }

    pub fn rejected(&mut self) {
        self.newest = self.first;
        self.residual = None;
    }
}

/// A vector over all fields, each with its weight.
fn weighted(fields: &[Iterates<'_>], weights: &[f64], vector: &DVector<f64>) -> DVector<f64> {
    let mut vector = vector.clone();
    let mut start = 0;
    for (field, weight) in fields.iter().zip(weights) {
        vector.rows_mut(start, field.answered.len()).scale_mut(*weight);
        start += field.answered.len();
    }
    vector
}
