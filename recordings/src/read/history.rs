//! Values of a field that later messages refer to.

use stagger_messages::Version;

/// Values of one field that a later message may refer to by `same_as`: the committed ones, and those of the attempt
/// under way.
///
/// A value is known by its own version and by its *origin*, the version under which it was first sent in full.
#[derive(Clone, Debug)]
pub struct History<T> {
    entries: Vec<Entry<T>>,
}

#[derive(Clone, Debug)]
struct Entry<T> {
    version: Version,
    origin: Version,
    value: T,
}

impl<T> Default for History<T> {
    fn default() -> Self {
        Self { entries: Vec::new() }
    }
}

impl<T: Clone> History<T> {
    /// Takes a value sent in full; it is its own origin.
    pub fn insert(&mut self, version: Version, value: T) {
        self.entries.push(Entry { version, origin: version, value });
    }

    /// Takes a message that says its values are those of `same_as`; returns their origin and the values, or `None`
    /// where that version is not known here.
    pub fn refer(&mut self, version: Version, same_as: Version) -> Option<(Version, T)> {
        let names = |entry: &&Entry<T>| entry.version == same_as || entry.origin == same_as;
        let found = self.entries.iter().rev().find(names)?.clone();
        let answer = (found.origin, found.value.clone());
        self.entries.push(Entry { version, ..found });
        Some(answer)
    }

    /// The values at `version`.
    #[must_use]
    pub fn get(&self, version: Version) -> Option<&T> {
        self.entries.iter().rev().find(|entry| entry.version == version).map(|entry| &entry.value)
    }

    /// The values taken last.
    #[must_use]
    pub fn newest(&self) -> Option<&T> {
        self.entries.last().map(|entry| &entry.value)
    }

    /// `version` is committed: the other iterations of its step are forgotten. Where the field has no message at that
    /// version, the values committed before stay.
    pub fn accept(&mut self, version: Version) {
        let changed = self.entries.iter().any(|entry| entry.version == version);
        self.entries.retain(|entry| if changed { entry.version == version } else { entry.version.step < version.step });
    }

    /// The attempt of `version` is given up: its iterations are forgotten.
    pub fn reject(&mut self, version: Version) {
        self.entries.retain(|entry| (entry.version.step, entry.version.attempt) != (version.step, version.attempt));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn version(step: u64, attempt: u32, iteration: u32) -> Version {
        Version { step, attempt, iteration }
    }

    #[test]
    fn after_a_rejection_a_reference_finds_the_committed_values_and_not_the_rejected_ones() {
        let mut history = History::default();
        history.insert(version(1, 1, 1), 'a');
        history.accept(version(1, 1, 1));
        history.insert(version(2, 1, 1), 'b');
        history.reject(version(2, 1, 1));
        assert_eq!(history.refer(version(2, 2, 1), version(2, 1, 1)), None);
        assert_eq!(history.refer(version(2, 2, 1), version(1, 1, 1)), Some((version(1, 1, 1), 'a')));
    }

    #[test]
    fn a_chain_of_references_keeps_its_origin_over_many_steps() {
        let mut history = History::default();
        history.insert(Version::INITIAL, 'a');
        for step in 1..50 {
            // Some writers name the origin, some the version before: both are found.
            let same_as = if step % 2 == 0 { Version::INITIAL } else { Version { step: step - 1, ..version(0, 1, 1) } };
            let same_as = if step == 1 { Version::INITIAL } else { same_as };
            assert_eq!(history.refer(version(step, 1, 1), same_as), Some((Version::INITIAL, 'a')));
            history.accept(version(step, 1, 1));
            assert_eq!(history.entries.len(), 1);
        }
    }

    #[test]
    fn a_field_silent_in_a_step_keeps_its_committed_values() {
        let mut history = History::default();
        history.insert(version(1, 1, 2), 'a');
        history.accept(version(1, 1, 2));
        history.accept(version(2, 1, 3));
        assert_eq!(history.newest(), Some(&'a'));
    }
}
