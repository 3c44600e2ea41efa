//! Particles cut into blocks of fixed size, each with the pairs it computes: the unit that threads share.
//!
//! A block adds up the loads on its own particles, and on those of other blocks that its pairs reach (its halo) apart. The
//! halos are added to their owners afterwards, in the order of the blocks. So every sum has one order, whatever the number
//! of threads, and no two threads write to one place.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Particles a block: small enough that its loads stay in the second-level cache and 10 000 particles keep two threads
/// evenly busy, large enough that most pairs lie inside one block.
pub const BLOCK: usize = 1024;

/// Particles above which threads share the work; below, waking them costs more than it saves.
pub const PARALLEL_PARTICLES: usize = 4096;

/// The pairs of one block's particles.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Block {
    /// First particle.
    pub first: u32,
    /// First entry of each particle's pairs, and one past the last.
    pub starts: Vec<u32>,
    /// Place in the block of each pair's owner.
    pub owners: Vec<u32>,
    /// Partner of each pair.
    pub partners: Vec<u32>,
    /// Where the load on the partner goes: its place in the block, or that in the halo after the block's own.
    pub slots: Vec<u32>,
    /// Particles of other blocks, ascending.
    pub halo: Vec<u32>,
    /// Halos of the other blocks that reach this one: the block, and its halo's entries.
    pub incoming: Vec<(u32, Range<u32>)>,
}

impl Block {
    /// The block of the particles from `first` on: `starts` and `partners` as in its fields.
    pub fn new(first: usize, starts: Vec<u32>, partners: Vec<u32>) -> Self {
        let own = first..first + starts.len().saturating_sub(1);
        let mut halo: Vec<u32> = partners.iter().filter(|j| !own.contains(&(**j as usize))).copied().collect();
        halo.sort_unstable();
        halo.dedup();
        let slot = |&partner: &u32| match halo.binary_search(&partner) {
            Ok(place) => (own.len() + place) as u32,
            Err(_) => partner - first as u32,
        };
        let slots = partners.iter().map(slot).collect();
        let rows = starts.array_windows::<2>().zip(0u32..);
        let owners = rows.flat_map(|([from, until], k)| std::iter::repeat_n(k, (until - from) as usize)).collect();
        Self { first: first as u32, starts, owners, partners, slots, halo, incoming: Vec::new() }
    }

    /// Its particles.
    pub fn range(&self) -> Range<usize> {
        self.first as usize..self.first as usize + self.len()
    }

    /// Number of its particles.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// A pair: particle and partner.
    #[inline]
    pub fn pair(&self, entry: usize) -> [u32; 2] {
        [self.first + self.owners[entry], self.partners[entry]]
    }

    /// Its pairs: particle and partner, in the order of their entries.
    pub fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.owners.iter().zip(&self.partners).map(|(owner, &partner)| [self.first + owner, partner])
    }
}

/// Tells every block which halos reach it.
pub fn connect(blocks: &mut [Block]) {
    for source in 0..blocks.len() {
        let halo = std::mem::take(&mut blocks[source].halo);
        let mut from = 0;
        while from < halo.len() {
            let target = halo[from] as usize / BLOCK;
            let until = from + halo[from..].partition_point(|&particle| particle as usize / BLOCK == target);
            blocks[target].incoming.push((source as u32, from as u32..until as u32));
            from = until;
        }
        blocks[source].halo = halo;
    }
}
