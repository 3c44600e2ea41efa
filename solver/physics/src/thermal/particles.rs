//! Whose temperatures they are: particles that come and go, followed by their ids.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use stagger_coupling::SolveError;
use stagger_messages::{Field, Fields};

use super::{NODE, Settings};
use crate::common::{
    checks::{field, radii, values},
    rows::rows_then,
};

/// The particles of one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Particles {
    /// Their radii, in m; the support tells one set of rows from another.
    pub(super) radii: Field,
    /// Who they are; `None` where nobody says it, and particles neither come nor go.
    ids: Option<Field>,
    /// What they are made of, as places in the list of materials; `None` where there is one.
    kinds: Option<Field>,
    /// Who those were that the powers read last belong to, one list for each: they may be older than the rest.
    heated: Vec<Field>,
}

/// What one value of each particle becomes on the rows of a later instant.
pub(super) struct Carried {
    pub(super) values: Vec<f64>,
    /// Rows of the later instant that were not there before.
    pub(super) came: Vec<usize>,
    /// Rows of the earlier instant that are there no more.
    pub(super) went: Vec<usize>,
}

/// A power that a field gives the particles, in W.
pub(super) struct Power<'f> {
    /// As its writer gave it.
    pub(super) given_w: &'f [f64],
    /// On the rows there are now.
    pub(super) on_rows_w: Cow<'f, [f64]>,
    /// Given to particles that are there no more.
    pub(super) missed_w: f64,
}

impl Particles {
    /// Reads who and how large the particles are.
    pub(super) fn read(settings: &Settings, fields: &Fields) -> Result<Self, SolveError> {
        radii(NODE, fields)?;
        let radii = field(fields, "radii")?.clone();
        let of_these = |reads: bool, name: &str| {
            let read = reads.then(|| field(fields, name)).transpose()?.cloned();
            match read.as_ref().filter(|read| read.support != radii.support) {
                None => Ok(read),
                Some(read) => Err(SolveError::Mismatch(format!(
                    "{NODE}: field `{name}` is of {} particles at revision {}, but `radii` of {} at revision {}",
                    read.support.count, read.support.revision, radii.support.count, radii.support.revision
                ))),
            }
        };
        let ids = of_these(fields.contains_key("ids"), "ids")?;
        let kinds = of_these(settings.reads_material(), "material")?;
        Ok(Self { radii, ids, kinds, heated: Vec::new() })
    }

    /// Who they are, where they are to be told from `others`.
    fn ids(&self, others: &Self) -> Result<&[u32], SolveError> {
        let Some(ids) = &self.ids else {
            let (here, there) = (&self.radii.support, &others.radii.support);
            return Err(SolveError::Mismatch(format!(
                "{NODE}: field `radii` has {} rows at revision {}, but had {} at revision {}: particles came or went, \
                 and no field `ids` is read that says which; [particles.pour.NAME] or [particles.domain] in the scene \
                 has it read",
                here.count, here.revision, there.count, there.revision
            )));
        };
        Ok(ids.u32()?)
    }

    /// For each row of these its row `now`, `None` where that particle is gone; `None` at all where no row changed.
    pub(super) fn rows(&self, now: &Self) -> Result<Option<Vec<Option<u32>>>, SolveError> {
        if self.radii.support == now.radii.support {
            return Ok(None);
        }
        rows_then(now.ids(self)?, self.ids(now)?).map(Some)
    }

    /// What `values` of these, one each, are on the rows of `now`; a new particle's is that of its row.
    pub(super) fn carry(
        &self,
        values: &[f64],
        now: &Self,
        of_new: impl Fn(usize) -> f64,
    ) -> Result<Carried, SolveError> {
        let Some(rows) = now.rows(self)? else {
            return Ok(Carried { values: values.to_vec(), came: Vec::new(), went: Vec::new() });
        };
        let gone = |rows: &[Option<u32>]| -> Vec<usize> {
            (0..).zip(rows).filter(|(_, row)| row.is_none()).map(|(row, _)| row).collect()
        };
        let value = |(now, row): (usize, &Option<u32>)| row.map_or_else(|| of_new(now), |row| values[row as usize]);
        let went = gone(&rows_then(now.ids(self)?, self.ids(now)?)?);
        Ok(Carried { values: (0..).zip(&rows).map(value).collect(), came: gone(&rows), went })
    }

    /// Number of particles.
    pub(super) fn len(&self) -> usize {
        self.radii.rows()
    }

    /// Place of each one's material in the list of `materials`; 0 for all where no field says it.
    pub(super) fn kinds(&self, materials: usize) -> Result<Vec<u32>, SolveError> {
        let Some(kinds) = &self.kinds else { return Ok(vec![0; self.len()]) };
        let kinds = kinds.u32()?;
        match kinds.iter().position(|&kind| kind as usize >= materials) {
            None => Ok(kinds.to_vec()),
            Some(row) => Err(SolveError::Mismatch(format!(
                "{NODE}: field `material` names material {} in row {row}, but there are {materials}, counted from 0",
                kinds[row]
            ))),
        }
    }

    /// The power `name`, in W. Where its writer has not seen yet who came or went, particles take what it gave them then, and
    /// new ones nothing; `known` are the particles of earlier instants it may belong to.
    pub(super) fn power<'f>(
        &mut self,
        name: &str,
        fields: &'f Fields,
        known: [&Self; 2],
    ) -> Result<Power<'f>, SolveError> {
        let power = field(fields, name)?;
        let Some(ids) = &self.ids else {
            let given_w = values(NODE, fields, name, self.radii.rows(), "`radii`")?;
            return Ok(Power { given_w, on_rows_w: Cow::Borrowed(given_w), missed_w: 0.0 });
        };
        let given_w = values(NODE, fields, name, power.rows(), "it")?;
        let mut sets = [ids].into_iter().chain(known.into_iter().flat_map(|of| of.ids.iter().chain(&of.heated)));
        let Some(heated) = sets.find(|set| set.support == power.support) else {
            return Err(SolveError::Mismatch(format!(
                "{NODE}: field `{name}` is of {} particles at revision {}, but there are {} at revision {}: \
                 who writes it must solve whenever particles come or go, and write it on the rows that it read",
                power.support.count, power.support.revision, ids.support.count, ids.support.revision
            )));
        };
        let mut missed_w = 0.0;
        let on_rows_w = if heated.support == ids.support {
            Cow::Borrowed(given_w)
        } else {
            let mut on_rows_w = vec![0.0; ids.rows()];
            for (row, &power_w) in rows_then(ids.u32()?, heated.u32()?)?.into_iter().zip(given_w) {
                match row {
                    Some(row) => on_rows_w[row as usize] = power_w,
                    None => missed_w += power_w,
                }
            }
            Cow::Owned(on_rows_w)
        };
        self.heated.push(heated.clone());
        Ok(Power { given_w, on_rows_w, missed_w })
    }
}
