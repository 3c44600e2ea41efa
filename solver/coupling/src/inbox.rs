//! The fields that one node reads, as they come in, and the versions it freezes.

use std::{collections::BTreeMap, sync::Arc};

use stagger_messages::{Envelope, Field, Fields, Iterate, Port, Source, Version, codec::Received};

use super::Frozen;
use crate::SolveError;

/// Who publishes accelerated iterates.
pub const COORDINATOR: &str = "coordinator";

/// The fields one node reads, as they come in, and the versions it freezes.
///
/// A value is known by its sender, its name and its version. At the window's start a node freezes what its sources had
/// committed when it committed itself the last time; at the window's end, what [`Source`] and [`Iterate`] say.
#[derive(Clone, Debug, Default)]
pub struct Inbox {
    sources: Vec<Source>,
    fields: BTreeMap<(String, String), BTreeMap<Version, Field>>,
    /// What each writer had committed when this node committed last.
    start: BTreeMap<String, Version>,
    /// The same for the trial solved last.
    end: BTreeMap<String, Version>,
}

impl Inbox {
    /// An empty inbox of a node that reads `sources`.
    #[must_use]
    pub fn new(sources: Vec<Source>) -> Self {
        Self { sources, ..Self::default() }
    }

    /// Where the fields come from.
    #[must_use]
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Whether the node reads this field of this sender.
    #[must_use]
    pub fn reads(&self, sender: &str, field: &str) -> bool {
        let sends = |source: &Source| source.writer == sender || (source.accelerated && sender == COORDINATOR);
        self.sources.iter().any(|source| source.field == field && sends(source))
    }

    /// Keeps a field under its version.
    pub fn insert(&mut self, sender: &str, version: Version, field: Field) {
        self.fields.entry((sender.into(), field.name().into())).or_default().insert(version, field);
    }

    /// Keeps under `version` the values of an earlier one. A reference to a version that is not here is dropped: the
    /// field is then missing, and will be asked for again.
    pub fn refer(&mut self, sender: &str, field: &str, version: Version, same_as: Version) {
        let versions = self.fields.entry((sender.into(), field.into())).or_default();
        if let Some(values) = versions.get(&same_as).cloned() {
            versions.insert(version, values);
        }
    }

    /// Takes a field as it came, whole or as a reference; false where the node does not read it of that sender.
    pub fn receive(&mut self, received: Received) -> bool {
        let Received { envelope: Envelope { sender, version, .. }, name, field, same_as, .. } = received;
        if !self.reads(&sender, &name) {
            return false;
        }
        let version = version.unwrap_or_default();
        match (field, same_as) {
            (Some(field), _) => self.insert(&sender, version, field),
            (None, Some(same_as)) => self.refer(&sender, &name, version, same_as),
            (None, None) => {}
        }
        true
    }

    /// A field of a sender at a version.
    #[must_use]
    pub fn get(&self, sender: &str, field: &str, version: Version) -> Option<&Field> {
        self.fields.get(&(sender.to_owned(), field.to_owned()))?.get(&version)
    }

    /// Begins where a run starts or goes on: each source counts as committed at the version it came with. False while
    /// one is missing.
    pub fn begin(&mut self) -> bool {
        let mut start = BTreeMap::new();
        for source in &self.sources {
            let versions = self.fields.get(&(source.writer.clone(), source.field.clone()));
            // The oldest: what a node of a slower rate holds from the start of its window comes beside the newest.
            let Some((version, _)) = versions.and_then(BTreeMap::first_key_value) else { return false };
            start.entry(source.writer.clone()).or_insert(*version);
        }
        self.start = start;
        true
    }

    /// The frozen fields of the trial `version`, or `None` until all have come.
    ///
    /// # Errors
    /// Fields that are to be added up do not stand on the same support.
    pub fn freeze(&mut self, version: Version, iterate: &Iterate) -> Result<Option<Frozen>, SolveError> {
        let mut frozen = Frozen::default();
        let mut ends = BTreeMap::new();
        for source in &self.sources {
            let (sender, at) = end(source, version, iterate);
            let Some(end) = self.get(sender, &source.field, at) else { return Ok(None) };
            let start = if source.interpolate {
                let at = self.start.get(&source.writer).copied().unwrap_or_default();
                let Some(start) = self.get(&source.writer, &source.field, at) else { return Ok(None) };
                start
            } else {
                end
            };
            add(&mut frozen.start, start)?;
            add(&mut frozen.end, end)?;
            ends.insert(source.writer.clone(), resting(&source.writer, iterate).unwrap_or(version));
        }
        self.end = ends;
        Ok(Some(frozen))
    }

    /// The node commits the trial it solved last.
    pub fn commit(&mut self) {
        self.start.clone_from(&self.end);
    }

    /// The run accepted `version`: what neither this node nor a later reference can ask for is forgotten.
    pub fn accepted(&mut self, version: Version) {
        for ((sender, _), versions) in &mut self.fields {
            let start = self.start.get(sender).copied();
            // What a late writer refers to is its newest version, which may be older than the one accepted.
            let newest = versions.range(..=version).next_back().map(|(at, _)| *at);
            versions.retain(|at, _| *at > version || Some(*at) == newest || Some(*at) == start);
        }
    }

    /// The attempt of `version` is dropped.
    pub fn rejected(&mut self, version: Version) {
        for versions in self.fields.values_mut() {
            versions.retain(|at, _| (at.step, at.attempt) != (version.step, version.attempt));
        }
    }

    /// The fields at the start of this node's window that their writers will not send again after a restart at
    /// `version`, each with its sender: those older than what the writer holds now.
    #[must_use]
    pub fn older_than(&self, version: Version) -> Vec<(String, Version, Field)> {
        let mut older = Vec::new();
        for ((sender, _), versions) in &self.fields {
            let Some(start) = self.start.get(sender) else { continue };
            let newest = versions.range(..=version).next_back().map(|(at, _)| at);
            if let (Some(field), true) = (versions.get(start), newest != Some(start)) {
                older.push((sender.clone(), *start, field.clone()));
            }
        }
        older
    }
}

/// Who publishes the end-of-window iterate of a source for the trial `version`, and under which version.
fn end<'s>(source: &'s Source, version: Version, iterate: &Iterate) -> (&'s str, Version) {
    if let Some(committed) = resting(&source.writer, iterate) {
        return (&source.writer, committed);
    }
    match (source.same_iteration, version.iteration) {
        (true, _) => (&source.writer, version),
        (false, 0 | 1) => (&source.writer, committed(&source.writer, iterate)),
        (false, iteration) => {
            let sender = if source.accelerated { COORDINATOR } else { &source.writer };
            (sender, Version { iteration: iteration - 1, ..version })
        }
    }
}

/// The version at which a node that rests in this iteration is read; `None` where it takes part.
#[must_use]
pub fn resting(node: &str, iterate: &Iterate) -> Option<Version> {
    let part = iterate.parts.iter().find(|part| part.node == node && part.rests)?;
    Some(part.committed.unwrap_or_default())
}

/// The version a node committed last.
fn committed(node: &str, iterate: &Iterate) -> Version {
    let part = iterate.parts.iter().find(|part| part.node == node);
    part.map_or(iterate.committed, |part| part.committed).unwrap_or_default()
}

/// Puts a field among others, or adds it to the one of that name that is there.
fn add(fields: &mut Fields, field: &Field) -> Result<(), SolveError> {
    let sum = match fields.get(field.name()) {
        None => field.clone(),
        Some(other) if other.support == field.support => {
            let values = other.f64()?.iter().zip(field.f64()?).map(|(a, b)| a + b);
            let port: Arc<Port> = Arc::clone(&other.port);
            Field::new(&port, other.support.revision, values.collect::<Vec<f64>>())?
        }
        Some(other) => {
            let (a, b) = (&other.support, &field.support);
            return Err(SolveError::Mismatch(format!(
                "`{}` is to be added up over its writers, but one stands on {} rows of {} (revision {}) and another on {} rows of {} (revision {})",
                field.name(),
                a.count,
                a.name,
                a.revision,
                b.count,
                b.name,
                b.revision
            )));
        }
    };
    fields.insert(field.name().into(), sum);
    Ok(())
}

#[cfg(test)]
#[path = "inbox_tests.rs"]
mod tests;
