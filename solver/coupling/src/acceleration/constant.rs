//! Relaxation with a constant factor.

use super::Iterates;

/// x + ω (x̃ − x) for every field; where that is too large for binary64, x̃ itself.
pub(super) fn relax(fields: &[Iterates<'_>], relaxation: f64) -> Vec<Vec<f64>> {
    let next = |(frozen, answered): (&f64, &f64)| {
        let relaxed = frozen + relaxation * (answered - frozen);
        if relaxed.is_finite() { relaxed } else { *answered }
    };
    fields.iter().map(|field| field.frozen.iter().zip(field.answered).map(next).collect()).collect()
}
