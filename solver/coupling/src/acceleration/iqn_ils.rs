//! Interface quasi-Newton with a least-squares model (Degroote, Bathe & Vierendeels 2009).

use std::collections::VecDeque;

use nalgebra::{DMatrix, DMatrixView, DVector};
use serde::{Deserialize, Serialize};

use super::{Iterates, Pair, relax, weights};

/// Rows of the least-squares problem that are factorised at a time: with some tens of columns they stay in the cache.
const ROWS: usize = 256;

/// Interface quasi-Newton with the inverse Jacobian from a least-squares model (Degroote, Bathe & Vierendeels 2009):
///
/// x_next = x̃ + W c with c = argmin ‖V c + r‖,
///
/// where the columns of V are differences of residuals and those of W the differences of x̃ that belong to them. Both are
/// taken between iterations of one attempt, as each window is a problem of its own; columns of accepted steps are used
/// again. The newest come first, and the QR factorisation drops a column that says little beyond those before it
/// (Haelterman, Bogaers, Scheufele, Uekermann & Mehl 2016, filter QR2). Cost N k² for k columns of N values.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct IqnIls {
    relaxation: f64,
    reused_steps: usize,
    columns: usize,
    filter: f64,
    /// The newest pair of this attempt.
    pair: Option<Pair>,
    /// Differences of this attempt, newest first.
    attempt: VecDeque<Column>,
    /// Differences of accepted steps, newest first; a step that taught nothing has no entry.
    steps: VecDeque<VecDeque<Column>>,
}

/// What one iteration taught.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Column {
    /// The differences of residual (a column of V) and of x̃ (of W).
    difference: Pair,
    /// The newest model did without it.
    dropped: bool,
}

impl IqnIls {
    pub fn new(relaxation: f64, reused_steps: u32, columns: u32, filter: f64) -> Self {
        // A count too large for the machine is as good as no bound.
        let count = |count| usize::try_from(count).unwrap_or(usize::MAX);
        let (reused_steps, columns) = (count(reused_steps), count(columns));
        let (attempt, steps) = (VecDeque::new(), VecDeque::new());
        Self { relaxation, reused_steps, columns, filter, pair: None, attempt, steps }
    }

    pub fn next(&mut self, fields: &[Iterates<'_>]) -> Vec<Vec<f64>> {
        let pair = Pair::new(fields);
        self.learn(&pair);
        let next = self.model(fields, &pair).filter(|next| next.iter().all(|value| value.is_finite()));
        self.pair = Some(pair);
        let Some(next) = next else { return relax(fields, self.relaxation) };
        let mut rest = next.as_slice();
        let split = |field: &Iterates<'_>| {
            let (values, behind) = rest.split_at(field.answered.len());
            rest = behind;
            values.to_vec()
        };
        fields.iter().map(split).collect()
    }

    pub fn accepted(&mut self, fields: &[Iterates<'_>]) {
        self.learn(&Pair::new(fields));
        self.pair = None;
        let step = std::mem::take(&mut self.attempt);
        if !step.is_empty() {
            self.steps.push_front(step);
        }
        self.steps.truncate(self.reused_steps);
        let mut left = self.columns;
        for step in &mut self.steps {
            step.retain(|column| !column.dropped);
            step.truncate(left);
            left -= step.len();
        }
        self.steps.retain(|step| !step.is_empty());
    }

    pub fn rejected(&mut self) {
        self.pair = None;
        self.attempt.clear();
        for column in self.steps.iter_mut().flatten() {
            column.dropped = false;
        }
    }

    /// Columns kept of each accepted step, newest first.
    #[cfg(test)]
    pub fn columns_of_steps(&self) -> Vec<usize> {
        self.steps.iter().map(VecDeque::len).collect()
    }

    fn learn(&mut self, pair: &Pair) {
        if let Some(last) = &self.pair {
            let residual = &pair.residual - &last.residual;
            let difference = Pair { residual, answered: &pair.answered - &last.answered };
            // Nothing follows from equal residuals, nor from values beyond binary64.
            let finite = difference.answered.iter().all(|value| value.is_finite());
            if finite && difference.residual.norm_squared().is_normal() {
                self.attempt.push_front(Column { difference, dropped: false });
                if self.reused_steps == 0 {
                    // Nobody will use the older ones again.
                    self.attempt.truncate(self.columns);
                }
            }
        }
    }

    /// x̃ + W c; `None` where no column is worth keeping.
    fn model(&mut self, fields: &[Iterates<'_>], pair: &Pair) -> Option<DVector<f64>> {
        let mut columns: Vec<&mut Column> =
            self.attempt.iter_mut().chain(self.steps.iter_mut().flatten()).take(self.columns).collect();
        if columns.is_empty() {
            return None;
        }
        let vectors: Vec<_> =
            columns.iter().map(|column| &column.difference.residual).chain([&pair.residual]).collect();
        let weights = weights(fields, &vectors);

        // [V r] = Q T: lengths and angles of V's columns, and of r, are those of T's.
        let whole = triangular_factor(fields, &weights, &vectors);
        let mut basis = DMatrix::zeros(whole.nrows(), columns.len());
        let mut triangle = DMatrix::zeros(columns.len(), columns.len());
        let mut kept = 0;
        for (column, vector) in columns.iter_mut().zip(whole.column_iter()) {
            let length = vector.norm();
            let (vector, shares) = orthogonal(vector.into_owned(), &basis.columns(0, kept));
            let left = vector.norm();
            column.dropped = !(left.is_normal() && left > self.filter * length);
            if !column.dropped {
                basis.set_column(kept, &(vector / left));
                triangle.view_mut((0, kept), (kept, 1)).copy_from(&shares);
                triangle[(kept, kept)] = left;
                kept += 1;
            }
        }
        if kept == 0 {
            return None;
        }
        let share = -basis.columns(0, kept).tr_mul(&whole.column(whole.ncols() - 1));
        let factors = triangle.view((0, 0), (kept, kept)).solve_upper_triangular(&share)?;
        let mut next = pair.answered.clone();
        let kept = columns.iter().filter(|column| !column.dropped);
        for (column, factor) in kept.zip(factors.iter()) {
            next.axpy(*factor, &column.difference.answered, 1.0);
        }
        Some(next)
    }
}

/// The triangular factor of the weighted vectors' QR factorisation, each block of rows factorised together with the
/// triangle of those before it (Demmel, Grigori, Hoemmen & Langou 2012): no factor Q of the problem's size is stored.
fn triangular_factor(fields: &[Iterates<'_>], weights: &[f64], vectors: &[&DVector<f64>]) -> DMatrix<f64> {
    let width = vectors.len();
    let mut triangle = DMatrix::zeros(width, width);
    let mut start = 0;
    for (field, weight) in fields.iter().zip(weights) {
        let end = start + field.answered.len();
        while start < end {
            let rows = ROWS.min(end - start);
            let mut block = DMatrix::zeros(width + rows, width);
            block.rows_mut(0, width).copy_from(&triangle);
            for (mut column, vector) in block.rows_mut(width, rows).column_iter_mut().zip(vectors) {
                column.axpy(*weight, &vector.rows(start, rows), 0.0);
            }
            triangle = block.qr().r();
            start += rows;
        }
    }
    triangle
}

/// What is left of a vector orthogonal to the columns of a basis, and its shares in them: Gram and Schmidt's method done
/// twice, which leaves it orthogonal to rounding (Giraud, Langou, Rozložník & van den Eshof 2005).
fn orthogonal(mut vector: DVector<f64>, basis: &DMatrixView<'_, f64>) -> (DVector<f64>, DVector<f64>) {
    let mut shares = DVector::zeros(basis.ncols());
    for _ in 0..2 {
        let share = basis.tr_mul(&vector);
        vector.gemv(-1.0, basis, &share, 1.0);
        shares += share;
    }
    (vector, shares)
}
