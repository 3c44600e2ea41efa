//! Acceleration of the staggered iteration x̃ = H(x): the next frozen iterate from those before it.
//!
//! A system is one or more fields accelerated together. Each method is a file; all of them see a pair of iterates (x, x̃)
//! and its residual r = x̃ − x, and keep what accepted steps taught until rows of a field of the system come or go.

mod aitken;
mod constant;
mod iqn_ils;

use aitken::Aitken;
use constant::relax;
use iqn_ils::IqnIls;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::Acceleration;

/// One system of fields accelerated together; its state is plain data, the same bits after being stored and read back.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Accelerator {
    method: Acceleration,
    /// Values of each field; empty before the first pair.
    lengths: Vec<usize>,
    rule: Rule,
}

/// The iterates of one field of the system, of equal length unless particles came or went.
#[derive(Clone, Copy, Debug)]
pub struct Iterates<'a> {
    /// The iterate x that the nodes read.
    pub frozen: &'a [f64],
    /// The iterate x̃ = H(x) they answered with; finite.
    pub answered: &'a [f64],
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum Rule {
    None,
    Constant(f64),
    Aitken(Aitken),
    IqnIls(IqnIls),
}

impl Rule {
    fn new(method: Acceleration) -> Self {
        match method {
            Acceleration::None => Self::None,
            Acceleration::Constant { relaxation } => Self::Constant(relaxation),
            Acceleration::Aitken { relaxation } => Self::Aitken(Aitken::new(relaxation)),
            Acceleration::IqnIls { relaxation, reused_steps, columns, filter } => {
                Self::IqnIls(IqnIls::new(relaxation, reused_steps, columns, filter))
            }
        }
    }
}

impl Accelerator {
    /// A system that has learnt nothing yet.
    #[must_use]
    pub fn new(method: Acceleration) -> Self {
        Self { method, lengths: Vec::new(), rule: Rule::new(method) }
    }

    /// The next iterate of each field; finite where the iterates are.
    ///
    /// The fields are the same in every call, in the same order. Where one changed its length, nothing learnt before
    /// applies; where its two iterates differ in length, the next iterate is the one answered.
    pub fn next(&mut self, fields: &[Iterates<'_>]) -> Vec<Vec<f64>> {
        if !self.compare(fields) {
            return fields.iter().map(|field| field.answered.to_vec()).collect();
        }
        match &mut self.rule {
            Rule::None => fields.iter().map(|field| field.answered.to_vec()).collect(),
            Rule::Constant(relaxation) => relax(fields, *relaxation),
            Rule::Aitken(rule) => rule.next(fields),
            Rule::IqnIls(rule) => rule.next(fields),
        }
    }

    /// The step was accepted with this last pair: what it taught is kept for the next steps.
    pub fn accepted(&mut self, fields: &[Iterates<'_>]) {
        if !self.compare(fields) {
            return;
        }
        match &mut self.rule {
            Rule::None | Rule::Constant(_) => {}
            Rule::Aitken(rule) => rule.accepted(),
            Rule::IqnIls(rule) => rule.accepted(fields),
        }
    }

    /// The attempt was rejected: what it taught belongs to another window and is dropped; what older steps taught stays.
    pub fn rejected(&mut self) {
        match &mut self.rule {
            Rule::None | Rule::Constant(_) => {}
            Rule::Aitken(rule) => rule.rejected(),
            Rule::IqnIls(rule) => rule.rejected(),
        }
    }

    /// Rows came or went: what was learnt so far speaks of others, even where there are as many as before.
    pub fn forget(&mut self) {
        *self = Self::new(self.method);
    }

    /// Whether the iterates of each field can be subtracted; forgets everything where lengths changed.
    fn compare(&mut self, fields: &[Iterates<'_>]) -> bool {
        let lengths = || fields.iter().map(|field| field.answered.len());
        if !lengths().eq(self.lengths.iter().copied()) {
            *self = Self { lengths: lengths().collect(), ..Self::new(self.method) };
        }
        fields.iter().all(|field| field.frozen.len() == field.answered.len())
    }
}

/// A pair of iterates of all fields of the system, one behind the other.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Pair {
    residual: DVector<f64>,
    answered: DVector<f64>,
}

impl Pair {
    fn new(fields: &[Iterates<'_>]) -> Self {
        let join = |values: fn(&Iterates<'_>) -> Vec<f64>| DVector::from_vec(fields.iter().flat_map(values).collect());
        Self {
            residual: join(|field| field.answered.iter().zip(field.frozen).map(|(answer, x)| answer - x).collect()),
            answered: join(|field| field.answered.to_vec()),
        }
    }
}

/// Weights of the fields in a least-squares problem over all of them: the reciprocal of the largest norm the field has in
/// one of the problem's vectors, so that no unit outweighs another; a single field has none to be weighed against.
///
/// A norm within rounding of the field's own size says nothing, and is not made to count like one that does.
fn weights(fields: &[Iterates<'_>], vectors: &[&DVector<f64>]) -> Vec<f64> {
    if fields.len() == 1 {
        return vec![1.0];
    }
    let mut start = 0;
    let weight = |field: &Iterates<'_>| {
        let (from, length) = (start, field.answered.len());
        start += length;
        let rounding = 4.0 * f64::EPSILON * DVector::from_column_slice(field.answered).norm();
        let norms = vectors.iter().map(|vector| vector.rows(from, length).norm());
        let scale = norms.fold(rounding, f64::max);
        // A field of zeros weighs the same with any weight.
        if scale.is_normal() { 1.0 / scale } else { 1.0 }
    };
    fields.iter().map(weight).collect()
}

#[cfg(test)]
mod tests;
