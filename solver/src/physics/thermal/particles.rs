//! Whose temperatures they are: particles that come and go, followed by their ids.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use stagger_messages::{Field, Fields};

use super::{NODE, Settings};
use crate::{
    SolveError,
    physics::{
        checks::{field, radii, values},
        rows::{by_ids, rows_then},
    },
};

/// The particles of one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Particles {
    /// Their radii, in m; the support tells one set of rows from another.
    pub(super) radii: Field,
    /// Who they are; `None` where nobody says it, and particles neither come nor go.
    ids: Option<Field>,
    /// Who those were that the powers read last belong to, one list for each: they may be older than the rest.
    heated: Vec<Field>,
}

/// Temperatures at a window's start on the rows of its end, and the heat above the initial temperature that moved with
/// particles that came or went, in J.
pub(super) struct Carried {
    pub(super) temperatures_k: Vec<f64>,
    pub(super) poured_j: f64,
    pub(super) removed_j: f64,
}

impl Particles {
    /// Reads who and how large the particles are.
    pub(super) fn read(settings: &Settings, fields: &Fields) -> Result<Self, SolveError> {
        radii(NODE, fields)?;
        let radii = field(fields, "radii")?.clone();
        let ids = settings.reads_ids.then(|| field(fields, "ids")).transpose()?.cloned();
        match ids.as_ref().filter(|ids| ids.support != radii.support) {
            None => Ok(Self { radii, ids, heated: Vec::new() }),
            Some(ids) => Err(SolveError::Mismatch(format!(
                "{NODE}: field `ids` is of {} particles at revision {}, but `radii` of {} at revision {}",
                ids.support.count, ids.support.revision, radii.support.count, radii.support.revision
            ))),
        }
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

    /// What `temperatures_k` of these are on the rows of `now`: new particles have the temperature of what is poured.
    pub(super) fn carry(&self, settings: &Settings, temperatures_k: &[f64], now: &Self) -> Result<Carried, SolveError> {
        let Some(rows) = now.rows(self)? else {
            return Ok(Carried { temperatures_k: temperatures_k.to_vec(), poured_j: 0.0, removed_j: 0.0 });
        };
        let poured_k = settings.pour_temperature_k.unwrap_or(settings.temperature_k);
        let temperature_k = |row: &Option<u32>| row.map_or(poured_k, |row| temperatures_k[row as usize]);
        let carried_k = rows.iter().map(temperature_k).collect();

        let above_k = |temperature_k: f64| temperature_k - settings.temperature_k;
        let came = rows.iter().zip(now.radii.f64()?).filter(|(row, _)| row.is_none());
        let poured_j = came.fold(0.0, |sum, (_, &radius_m)| sum + settings.capacity_j_k(radius_m) * above_k(poured_k));
        let rows_now = rows_then(now.ids(self)?, self.ids(now)?)?;
        let went = rows_now.iter().zip(self.radii.f64()?.iter().zip(temperatures_k)).filter(|(row, _)| row.is_none());
        let removed_j = went.fold(0.0, |sum, (_, (&radius_m, &temperature_k))| {
            sum + settings.capacity_j_k(radius_m) * above_k(temperature_k)
        });
        Ok(Carried { temperatures_k: carried_k, poured_j, removed_j })
    }

    /// The power `name` on these rows, in W. Where its writer has not seen yet who came or went, particles take what it
    /// gave them then, and new ones nothing; `known` are the particles of earlier instants it may belong to.
    pub(super) fn power<'f>(
        &mut self,
        name: &str,
        fields: &'f Fields,
        known: [&Self; 2],
    ) -> Result<Cow<'f, [f64]>, SolveError> {
        let power = field(fields, name)?;
        let Some(ids) = &self.ids else {
            return values(NODE, fields, name, self.radii.rows(), "`radii`").map(Cow::Borrowed);
        };
        let power_w = values(NODE, fields, name, power.rows(), "it")?;
        let mut sets = [ids].into_iter().chain(known.into_iter().flat_map(|of| of.ids.iter().chain(&of.heated)));
        let Some(heated) = sets.find(|set| set.support == power.support) else {
            return Err(SolveError::Mismatch(format!(
                "{NODE}: field `{name}` is of {} particles at revision {}, but there are {} at revision {}: \
                 who writes it must solve whenever particles come or go, and write it on the rows that it read",
                power.support.count, power.support.revision, ids.support.count, ids.support.revision
            )));
        };
        let on_rows = if heated.support == ids.support {
            Cow::Borrowed(power_w)
        } else {
            Cow::Owned(by_ids(power_w, heated.u32()?, ids.u32()?, 0.0)?)
        };
        self.heated.push(heated.clone());
        Ok(on_rows)
    }
}
