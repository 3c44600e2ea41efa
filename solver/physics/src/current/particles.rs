//! Which particles there are, and what is known of them from instants at which there were others.

use std::borrow::Cow;

use stagger_coupling::SolveError;
use stagger_messages::{Field, Fields};

use super::{NODE, Settings};
use crate::common::{
    checks::{field, radii, values},
    rows::by_ids,
};

/// The particles of one instant.
pub(super) struct Particles<'f> {
    pub(super) radii_m: &'f [f64],
    /// Their ids, where particles come and go; else their radii. The support tells one set of rows from another.
    pub(super) rows: &'f Field,
    has_ids: bool,
}

impl<'f> Particles<'f> {
    pub(super) fn read(fields: &'f Fields) -> Result<Self, SolveError> {
        let radii_m = radii(NODE, fields)?;
        let has_ids = fields.contains_key("ids");
        let rows = field(fields, if has_ids { "ids" } else { "radii" })?;
        let support = &field(fields, "radii")?.support;
        if rows.support == *support {
            return Ok(Self { radii_m, rows, has_ids });
        }
        Err(SolveError::Mismatch(format!(
            "{NODE}: field `ids` is of {} particles at revision {}, but `radii` of {} at revision {}",
            rows.support.count, rows.support.revision, support.count, support.revision
        )))
    }

    /// Values that the particles of `then` had, one each, on these rows; `None` where it is not known which is which.
    pub(super) fn carry(&self, then: &Field, values: &[f64], default: f64) -> Result<Option<Vec<f64>>, SolveError> {
        if then.support == self.rows.support {
            return Ok(Some(values.to_vec()));
        }
        self.has_ids.then(|| by_ids(values, then.u32()?, self.rows.u32()?, default)).transpose()
    }

    /// The temperatures on these rows, in K. Where their writer has not seen yet who came or went, particles have those it
    /// gave them then; `known` are the rows of earlier instants they may stand on.
    pub(super) fn temperatures_k(
        &self,
        settings: &Settings,
        fields: &'f Fields,
        known: [Option<&Field>; 2],
    ) -> Result<Cow<'f, [f64]>, SolveError> {
        if settings.conductivity.by_temperature.is_none() || !fields.contains_key("temperature") {
            return Ok(vec![settings.temperature_k; self.radii_m.len()].into());
        }
        let temperature = field(fields, "temperature")?;
        let values_k = values(NODE, fields, "temperature", temperature.rows(), "it")?;
        if temperature.support == self.rows.support {
            return Ok(values_k.into());
        }
        let then = known.into_iter().flatten().find(|rows| rows.support == temperature.support);
        let carried = then.map(|then| self.carry(then, values_k, settings.temperature_k)).transpose()?.flatten();
        carried.map(Cow::Owned).ok_or_else(|| {
            SolveError::Mismatch(format!(
                "{NODE}: field `temperature` is of {} particles at revision {}, but there are {} at revision {}",
                temperature.support.count,
                temperature.support.revision,
                self.rows.support.count,
                self.rows.support.revision
            ))
        })
    }
}
