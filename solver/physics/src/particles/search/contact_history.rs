//! The tangential springs of the contacts: what a contact remembers from step to step.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{blocks::Block, wall_list::WallList};
use crate::common::{Vec3, walls::Touch};

/// Springs of one block, entry by entry of its lists.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactHistory {
    pairs: Vec<Vec3>,
    /// Entries of the pairs that touched at the last evaluation, ascending.
    touching: Vec<u32>,
    walls: Vec<Vec3>,
    touching_walls: Vec<bool>,
}

impl ContactHistory {
    /// No contact yet among so many pairs and walls.
    pub fn none(pairs: usize, walls: usize) -> Self {
        Self {
            pairs: vec![Vec3::zeros(); pairs],
            touching: Vec::new(),
            walls: vec![Vec3::zeros(); walls],
            touching_walls: vec![false; walls],
        }
    }

    /// Takes note which pairs touch, by their entries in ascending order; one that no longer does forgets.
    pub fn keep(&mut self, now: &[u32]) {
        if self.touching == now {
            return;
        }
        let mut rest = now.iter().copied().peekable();
        for &before in &self.touching {
            while rest.next_if(|&entry| entry < before).is_some() {}
            if rest.peek() != Some(&before) {
                self.pairs[before as usize] = Vec3::zeros();
            }
        }
        self.touching.clear();
        self.touching.extend_from_slice(now);
    }

    /// Takes note which features of a wall a particle touches, among those near it. A contact that passes from one
    /// feature to another, as over the edge of two triangles, takes its spring along; one that ends forgets. One that begins
    /// within the patch of another, which it will share, begins with that one's spring.
    pub fn note_walls(&mut self, near: Range<usize>, touches: &[Touch]) {
        let first = near.start;
        let touched = touches.iter().map(|touch| touch.entry as usize);
        for touch in touches {
            let entry = first + touch.entry as usize;
            if self.touching_walls[entry] {
                continue;
            }
            let left =
                |before: &usize| self.touching_walls[*before] && touched.clone().all(|now| first + now != *before);
            if let Some(before) = near.clone().find(left) {
                self.walls[entry] = std::mem::take(&mut self.walls[before]);
                self.touching_walls[before] = false;
            } else if touch.share < 0.5 {
                let held = touches.iter().filter(|other| self.touching_walls[first + other.entry as usize]);
                let beside = |other: &&Touch| other.normal.dot(&touch.normal);
                if let Some(other) = held.max_by(|a, b| beside(a).total_cmp(&beside(b))) {
                    self.walls[entry] = self.walls[first + other.entry as usize];
                }
            }
            self.touching_walls[entry] = true;
        }
        for entry in near {
            if self.touching_walls[entry] && touched.clone().all(|now| first + now != entry) {
                self.touching_walls[entry] = false;
                self.walls[entry] = Vec3::zeros();
            }
        }
    }

    /// Adds to the spring of every pair that touched at the last evaluation what is given for its entry, in m.
    pub fn stretch_pairs(&mut self, by: impl Fn(usize) -> Vec3) {
        for &entry in &self.touching {
            self.pairs[entry as usize] += by(entry as usize);
        }
    }

    /// Adds to the spring of a wall contact, where it touched at the last evaluation, in m.
    pub fn stretch_wall(&mut self, entry: usize, by: Vec3) {
        if self.touching_walls[entry] {
            self.walls[entry] += by;
        }
    }

    /// Displacement of the spring of a pair, in m.
    #[inline(always)]
    pub fn pair(&self, entry: usize) -> &Vec3 {
        &self.pairs[entry]
    }

    /// The same, to be changed.
    #[inline(always)]
    pub fn pair_mut(&mut self, entry: usize) -> &mut Vec3 {
        &mut self.pairs[entry]
    }

    /// Displacement of the spring of a wall contact, in m.
    pub fn wall(&self, entry: usize) -> &Vec3 {
        &self.walls[entry]
    }

    /// The same, to be changed.
    pub fn wall_mut(&mut self, entry: usize) -> &mut Vec3 {
        &mut self.walls[entry]
    }
}

/// Springs by particle, whatever lists they came from.
pub struct Remembered {
    /// First spring of each particle with a partner of a higher number, and one past the last.
    starts: Vec<u32>,
    pairs: Vec<(u32, Vec3)>,
    wall_starts: Vec<u32>,
    walls: Vec<([u32; 2], Vec3)>,
}

/// Entries by their particle (a counting sort), in the order they come.
fn by_particle<T: Copy>(count: usize, entries: &[(u32, T)], fill: T) -> (Vec<u32>, Vec<T>) {
    let mut starts = vec![0u32; count + 1];
    for (particle, _) in entries {
        starts[*particle as usize + 1] += 1;
    }
    for particle in 0..count {
        starts[particle + 1] += starts[particle];
    }
    let mut next = starts.clone();
    let mut sorted = vec![fill; entries.len()];
    for &(particle, value) in entries {
        let place = &mut next[particle as usize];
        sorted[*place as usize] = value;
        *place += 1;
    }
    (starts, sorted)
}

impl Remembered {
    /// Collects the springs of all contacts; `place` says where a particle of the old numbers is now, `None` that it is gone.
    pub fn collect<'a>(
        count: usize,
        blocks: impl Iterator<Item = (&'a Block, &'a WallList, &'a ContactHistory)>,
        place: impl Fn(u32) -> Option<u32>,
    ) -> Self {
        let (mut pairs, mut walls) = (Vec::new(), Vec::new());
        for (block, wall_list, contact_history) in blocks {
            for &entry in &contact_history.touching {
                let [i, j] = block.pair(entry as usize);
                if let (Some(i), Some(j)) = (place(i), place(j)) {
                    let spring = contact_history.pairs[entry as usize];
                    // Seen from the partner, the same spring points the other way.
                    pairs.push(if i < j { (i, (j, spring)) } else { (j, (i, -spring)) });
                }
            }
            for (entry, (particle, key)) in wall_list.entries().enumerate() {
                let touching = contact_history.touching_walls[entry];
                if let Some(i) = place(block.first + particle).filter(|_| touching) {
                    walls.push((i, (key, contact_history.walls[entry])));
                }
            }
        }
        let (starts, pairs) = by_particle(count, &pairs, (0, Vec3::zeros()));
        let (wall_starts, walls) = by_particle(count, &walls, ([0; 2], Vec3::zeros()));
        Self { starts, pairs, wall_starts, walls }
    }

    /// The springs of a block of new lists.
    pub fn recall(&self, block: &Block, walls: &WallList) -> ContactHistory {
        let mut contact_history = ContactHistory::none(block.partners.len(), walls.features.len());
        for (entry, [i, j]) in block.pairs().enumerate() {
            let (low, high) = (i.min(j), i.max(j));
            let known = &self.pairs[self.starts[low as usize] as usize..self.starts[low as usize + 1] as usize];
            if let Some((_, spring)) = known.iter().find(|(partner, _)| *partner == high) {
                contact_history.touching.push(entry as u32);
                contact_history.pairs[entry] = if i < j { *spring } else { -spring };
            }
        }
        for (entry, (particle, key)) in walls.entries().enumerate() {
            let i = (block.first + particle) as usize;
            let known = &self.walls[self.wall_starts[i] as usize..self.wall_starts[i + 1] as usize];
            if let Some((_, spring)) = known.iter().find(|(known, _)| *known == key) {
                contact_history.touching_walls[entry] = true;
                contact_history.walls[entry] = *spring;
            }
        }
        contact_history
    }
}
