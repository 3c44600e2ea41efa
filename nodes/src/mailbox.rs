//! The fields a node has received, by name and version.

use std::collections::BTreeMap;

use stagger_messages::{Field, Source, Version, codec::Received};

/// Received fields from the committed version on.
#[derive(Default)]
pub struct Mailbox {
    fields: BTreeMap<String, BTreeMap<Version, Field>>,
}

impl Mailbox {
    /// Keeps a field under its version. A reference to a version that is not here is dropped: the field is then
    /// missing, and will be asked for again.
    pub fn store(&mut self, received: Received) {
        let version = received.envelope.version.unwrap_or_default();
        let versions = self.fields.entry(received.name).or_default();
        let field = match received.same_as {
            Some(earlier) => versions.get(&earlier).cloned(),
            None => received.field,
        };
        if let Some(field) = field {
            versions.insert(version, field);
        }
    }

    /// A field at a version.
    #[must_use]
    pub fn get(&self, field: &str, version: Version) -> Option<&Field> {
        self.fields.get(field)?.get(&version)
    }

    /// Whether every source is here at a version.
    #[must_use]
    pub fn has_all(&self, sources: &[Source], version: Version) -> bool {
        sources.iter().all(|source| self.get(&source.field, version).is_some())
    }

    /// Forgets what is older than a committed version.
    pub fn forget_before(&mut self, version: Version) {
        for versions in self.fields.values_mut() {
            // What a late writer refers to is its newest version, which may be older than the one committed.
            let newest_before = versions.range(..version).next_back().map(|(at, _)| *at);
            versions.retain(|at, _| *at >= version || Some(*at) == newest_before);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use stagger_messages::{Envelope, Measure, Port};

    fn received(step: u64, values: Option<f64>, same_as: Option<u64>) -> Received {
        let port = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude));
        Received {
            envelope: Envelope { version: Some(Version::first(step)), ..Envelope::default() },
            field: values.map(|value| Field::new(&port, 0, vec![value]).unwrap()),
            name: "temperature".into(),
            support: stagger_messages::Support::default(),
            port,
            same_as: same_as.map(Version::first),
        }
    }

    #[test]
    fn a_reference_finds_its_values_and_a_broken_one_stays_missing() {
        let mut mailbox = Mailbox::default();
        mailbox.store(received(1, Some(300.0), None));
        mailbox.store(received(2, None, Some(1)));
        mailbox.forget_before(Version::first(2));
        mailbox.store(received(3, None, Some(2)));
        mailbox.store(received(5, None, Some(4)));
        assert_eq!(mailbox.get("temperature", Version::first(3)).unwrap().f64().unwrap(), [300.0]);
        assert!(mailbox.get("temperature", Version::first(5)).is_none());
    }
}
