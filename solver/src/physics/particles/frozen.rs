//! What other physics have computed for the particles.

use stagger_messages::Field;

use super::{Particles, State};
use crate::{SolveError, physics::rows::by_ids};

impl Particles {
    /// The values of a frozen field of the particles, in memory order; those that were written before particles came or
    /// went follow them by their numbers, and new particles get `other`.
    pub(super) fn frozen_values(
        &self,
        field: &Field,
        before: &State,
        now: &State,
        other: f64,
    ) -> Result<Vec<f64>, SolveError> {
        let values = field.f64()?;
        if let Some(row) = field.first_not_finite() {
            let (node, field) = ("particles".into(), field.name().into());
            return Err(SolveError::NotFinite { node, field, row, value: values[row] });
        }
        let is_of = |state: &State| {
            let support = &field.support;
            (support.revision, support.count) == (state.register.revision, state.bodies.len() as u64)
        };
        if is_of(now) {
            return Ok(now.bodies.in_memory(values));
        }
        if is_of(before) {
            let ids = |state: &State| state.bodies.in_rows(&state.bodies.ids);
            return Ok(now.bodies.in_memory(&by_ids(values, &ids(before), &ids(now), other)?));
        }
        Err(SolveError::Mismatch(format!(
            "particles: field `{}` has {} values at revision {}, but there are {} particles at revision {}",
            field.name(),
            values.len(),
            field.support.revision,
            now.bodies.len(),
            now.register.revision
        )))
    }
}
