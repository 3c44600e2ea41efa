//! Pairs within the reach of the near field, found in cells (Verlet 1967; Zohdi 2018, ch. 6.4.1).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::common::Vec3;

/// A list of more pairs than this (1 GiB) is not made: computing all pairs then costs little more than reading it.
const PAIRS_LIMIT: usize = 1 << 28;

/// Pairs of particles no farther apart than a reach when the list was built.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NearList {
    /// First entry of each row in `others`, and one past the last.
    starts: Vec<u32>,
    /// Rows j > i of the pairs of each row i, ascending.
    others: Vec<u32>,
    built_at: Vec<Vec3>,
}

impl NearList {
    /// Lists the pairs with d ≤ `reach_m`; `None` where they are too many to be listed.
    ///
    /// Only cells with particles are kept, so memory does not depend on the extent of the cloud.
    pub(super) fn build(positions: &[Vec3], reach_m: f64) -> Option<Self> {
        let inverse = 1.0 / reach_m;
        // Bounded so that a cell's neighbours have numbers too; what far-away particles then share is a cell, which
        // costs time but no pair.
        let cell = |position: &Vec3| [2, 1, 0].map(|axis| (position[axis] * inverse).floor().clamp(-1e18, 1e18) as i64);
        let mut sorted: Vec<([i64; 3], u32)> = positions.iter().map(cell).zip(0..).collect();
        sorted.sort_unstable();
        let mut cells: BTreeMap<[i64; 3], &[([i64; 3], u32)]> = BTreeMap::new();
        for members in sorted.chunk_by(|a, b| a.0 == b.0) {
            cells.insert(members[0].0, members);
        }
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        let mut starts = vec![0u32; positions.len() + 1];
        for (&[z, y, x], members) in &cells {
            // The cell itself and half of those about it; in each row along x the three neighbours follow one another.
            let mut near: Vec<&[([i64; 3], u32)]> = Vec::new();
            near.extend(cells.get(&[z, y, x + 1]));
            for [dz, dy] in [[0, 1], [1, -1], [1, 0], [1, 1]] {
                let (z, y) = (z + dz, y + dy);
                near.extend(cells.range([z, y, x - 1]..=[z, y, x + 1]).map(|cell| cell.1));
            }
            for (k, &(_, i)) in members.iter().enumerate() {
                let others = members[k + 1..].iter().chain(near.iter().copied().flatten());
                for &(_, j) in others {
                    if (positions[j as usize] - positions[i as usize]).norm_squared() <= reach_m * reach_m {
                        let pair = [i.min(j), i.max(j)];
                        starts[pair[0] as usize + 1] += 1;
                        pairs.push(pair);
                    }
                }
                if pairs.len() > PAIRS_LIMIT {
                    return None;
                }
            }
        }
        for row in 0..positions.len() {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut others = vec![0; pairs.len()];
        for [i, j] in pairs {
            let slot = &mut next[i as usize];
            others[*slot as usize] = j;
            *slot += 1;
        }
        let mut list = Self { starts, others, built_at: positions.to_vec() };
        for row in 0..positions.len() {
            let range = list.range(row);
            list.others[range].sort_unstable();
        }
        Some(list)
    }

    /// Whether the list is of these particles, none of which has moved more than half of `skin_m` since it was built.
    pub(super) fn holds(&self, positions: &[Vec3], skin_m: f64) -> bool {
        let limit = 0.25 * skin_m * skin_m;
        positions.len() == self.built_at.len()
            && positions.iter().zip(&self.built_at).all(|(now, then)| (now - then).norm_squared() <= limit)
    }

    /// Rows that row `i` is paired with, all above it, ascending.
    #[inline]
    pub(super) fn row(&self, i: usize) -> &[u32] {
        &self.others[self.range(i)]
    }

    fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// Number of listed pairs.
    #[must_use]
    pub fn pairs(&self) -> usize {
        self.others.len()
    }
}
