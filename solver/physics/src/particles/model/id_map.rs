//! Who has come and gone.

use serde::{Deserialize, Serialize};

/// Counts and numbers of the particles, and what the last changes of their rows did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IdMap {
    /// Counts how often rows came or went: the revision of the particles' support.
    pub revision: u64,
    /// Number that the next particle gets.
    pub next_id: u32,
    /// Particles poured so far, by dispenser.
    pub poured: Vec<u64>,
    /// The last changes, up to this revision: fields of slower physics are older than they.
    changes: Vec<Change>,
}

/// What one change of the rows did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Change {
    /// [`IdMap::next_id`] before it.
    next_id: u32,
    /// Numbers of those that left.
    gone: Vec<u32>,
}

impl IdMap {
    /// Of `count` particles that are there from the start, and dispensers that have poured nothing.
    pub fn new(count: u32, dispensers: usize) -> Self {
        Self { next_id: count, poured: vec![0; dispensers], ..Self::default() }
    }

    /// Notes a change that began at `next_id`, and forgets those which every field as new as `oldest` has behind it.
    pub fn change(&mut self, next_id: u32, gone: Vec<u32>, oldest: u64) {
        let kept = usize::try_from(self.revision.saturating_sub(oldest)).unwrap_or(usize::MAX);
        self.changes.drain(..self.changes.len().saturating_sub(kept));
        self.changes.push(Change { next_id, gone });
        self.revision += 1;
    }

    /// Numbers of the particles at an earlier revision, in the order of their rows, which is theirs; `now` are those of
    /// today. `None` where nothing is known of it.
    pub fn ids_at(&self, revision: u64, now: &[u32]) -> Option<Vec<u32>> {
        let back = usize::try_from(self.revision.checked_sub(revision)?).ok()?;
        let since = &self.changes[self.changes.len().checked_sub(back)?..];
        let next_id = since.first().map_or(self.next_id, |change| change.next_id);
        let all = now.iter().chain(since.iter().flat_map(|change| &change.gone));
        let mut ids: Vec<u32> = all.copied().filter(|&id| id < next_id).collect();
        ids.sort_unstable();
        Some(ids)
    }
}

#[cfg(test)]
mod tests {
    use super::IdMap;

    #[test]
    fn earlier_rows_are_known_as_far_back_as_asked_for() {
        let mut id_map = IdMap::new(4, 0);
        let mut then = vec![vec![0, 1, 2, 3]];
        // Two come; one of them and an old one leave as another comes; all but one leave.
        for (now, gone) in
            [(vec![0, 1, 2, 3, 4, 5], vec![]), (vec![0, 2, 3, 5, 6], vec![1, 4]), (vec![6], vec![0, 2, 3, 5])]
        {
            let next_id = id_map.next_id;
            id_map.next_id = now.last().unwrap() + 1;
            id_map.change(next_id, gone, 0);
            then.push(now);
        }
        for (revision, ids) in then.iter().enumerate() {
            assert_eq!(id_map.ids_at(revision as u64, &[6]).as_ref(), Some(ids), "{revision}");
        }
        assert_eq!(id_map.ids_at(4, &[6]), None);
        // Nobody reads what is older than revision 2 any more.
        id_map.change(7, vec![6], 2);
        assert_eq!((id_map.ids_at(1, &[]), id_map.ids_at(2, &[])), (None, Some(then[2].clone())));
    }
}
