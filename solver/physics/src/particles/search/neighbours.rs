//! Verlet list built from cell bins (Verlet 1967; Zohdi 2018, ch. 6.4.1).

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use stagger_coupling::{SolveError, math};

use super::blocks::{BLOCK, Block, PARALLEL_PARTICLES, connect};
use crate::common::Vec3;

/// Particles are binned with others up to half their size; below 2^-15 of the largest they share the last level.
const LEVELS: usize = 16;

/// Pairs a particle, on average over a block, above which a list is refused: sound packings have less than ten.
const PAIRS_LIMIT: usize = 1000;

/// Pairs close enough to touch before either particle has moved half its skin.
#[derive(Debug, Serialize, Deserialize)]
pub struct NeighbourList {
    /// The pairs, each in the block of the particle that owns it: the finer one, among equals the one in the earlier cell.
    pub blocks: Vec<Block>,
    /// Positions the list was built at.
    built_at: Vec<Vec3>,
}

impl NeighbourList {
    /// Lists the pairs with d < (R_i + R_j)(1 + skin/2).
    ///
    /// The skin is a share of each particle's own radius, so that a few large particles do not make neighbours of all
    /// small ones. Particles are binned by size, each level in cells as large as its reach; a particle looks into half of
    /// its own level's cells around it and all around it in the coarser ones. Cells are hashed into as many buckets as
    /// there are particles, so memory does not depend on the extent of the cloud. A particle's touching pairs come first,
    /// which keeps the contact loop's branch predictable.
    ///
    /// # Errors
    /// So many particles lie in one another that the pairs would not fit into memory.
    pub fn build(positions: &[Vec3], radii: &[f64], skin: f64) -> Result<Self, SolveError> {
        let largest = radii.iter().fold(0.0f64, |largest, &radius| largest.max(radius));
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); LEVELS];
        let level_of = |radius: f64| (math::log2(largest / radius).max(0.0) as usize).min(LEVELS - 1);
        for (i, &radius) in (0u32..).zip(radii) {
            members[level_of(radius)].push(i);
        }
        let levels: Vec<Option<Bins>> =
            members.iter().map(|members| Bins::build(members, positions, radii, skin)).collect();
        let reach = 1.0 + 0.5 * skin;
        let crowded = AtomicBool::new(false);
        let block = |first: usize| {
            let range = first..(first + BLOCK).min(positions.len());
            let (mut starts, mut partners, mut apart) = (vec![0], Vec::new(), Vec::new());
            for i in range {
                if crowded.load(Ordering::Relaxed) {
                    break;
                }
                let (position, radius) = (&positions[i], radii[i]);
                let mut see = |j: u32| {
                    let sum = radius + radii[j as usize];
                    let distance_squared = (positions[j as usize] - position).norm_squared();
                    if distance_squared < sum * sum {
                        partners.push(j);
                    } else if distance_squared < (sum * reach) * (sum * reach) {
                        apart.push(j);
                    }
                };
                let own = level_of(radius);
                for (level, bins) in levels.iter().enumerate().take(own + 1) {
                    match bins {
                        Some(bins) if level == own => bins.visit_half(position, i as u32, &mut see),
                        Some(bins) => bins.visit_all(position, &mut see),
                        None => {}
                    }
                }
                partners.append(&mut apart);
                starts.push(partners.len() as u32);
                if partners.len() > PAIRS_LIMIT * BLOCK {
                    // Only ever set on the way to an error.
                    crowded.store(true, Ordering::Relaxed);
                }
            }
            Block::new(first, starts, partners)
        };
        let firsts: Vec<usize> = (0..positions.len()).step_by(BLOCK).collect();
        let mut blocks: Vec<Block> = if positions.len() > PARALLEL_PARTICLES {
            firsts.into_par_iter().map(block).collect()
        } else {
            firsts.into_iter().map(block).collect()
        };
        if crowded.into_inner() {
            return Err(SolveError::Mismatch(format!(
                "particles: more than {PAIRS_LIMIT} neighbours a particle: they lie in one another; start them apart, or use a \
                 smaller step or stiffer contacts"
            )));
        }
        connect(&mut blocks);
        Ok(Self { blocks, built_at: positions.to_vec() })
    }

    /// Whether no particle has moved more than half its skin since the list was built.
    pub fn holds(&self, positions: &[Vec3], radii: &[f64], skin: f64) -> bool {
        let still = |(now, (then, radius)): (&Vec3, (&Vec3, &f64))| {
            let limit = 0.5 * skin * radius;
            (now - then).norm_squared() <= limit * limit
        };
        positions.iter().zip(self.built_at.iter().zip(radii)).all(still)
    }

    /// All pairs, block by block.
    pub fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.blocks.iter().flat_map(Block::pairs)
    }
}

/// Particles of one level of size, binned by cell.
struct Bins {
    inverse_cell: f64,
    /// Right shift that takes a mixed key to its bucket.
    shift: u32,
    /// First entry of each bucket, and one past the last.
    starts: Vec<u32>,
    /// Key of the cell and particle, bucket by bucket.
    entries: Vec<(u64, u32)>,
}

impl Bins {
    /// `None` where the level is empty.
    fn build(members: &[u32], positions: &[Vec3], radii: &[f64], skin: f64) -> Option<Self> {
        let largest = members.iter().map(|&i| radii[i as usize]).reduce(f64::max)?;
        let inverse_cell = 1.0 / (2.0 * largest * (1.0 + 0.5 * skin));
        let buckets = (2 * members.len()).next_power_of_two();
        let mut bins = Self {
            inverse_cell,
            shift: u64::BITS - buckets.trailing_zeros(),
            starts: vec![0; buckets + 1],
            entries: vec![(0, 0); members.len()],
        };
        let keys: Vec<u64> = members.iter().map(|&i| key(bins.cell(&positions[i as usize]))).collect();
        for &key in &keys {
            let bucket = bins.bucket(key);
            bins.starts[bucket + 1] += 1;
        }
        for bucket in 0..buckets {
            bins.starts[bucket + 1] += bins.starts[bucket];
        }
        let mut next = bins.starts.clone();
        for (&key, &i) in keys.iter().zip(members) {
            let slot = &mut next[bins.bucket(key)];
            bins.entries[*slot as usize] = (key, i);
            *slot += 1;
        }
        Some(bins)
    }

    fn cell(&self, position: &Vec3) -> [i64; 3] {
        // A cast saturates; what far-away particles then share is a cell, which costs time but no pair.
        [position.x, position.y, position.z].map(|x| (x * self.inverse_cell).floor() as i64)
    }

    fn bucket(&self, key: u64) -> usize {
        // Fibonacci hashing (Knuth, The Art of Computer Programming, vol. 3, sec. 6.4).
        (key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> self.shift) as usize
    }

    /// Calls `visit` with each particle in the 27 cells about `position`.
    fn visit_all(&self, position: &Vec3, mut visit: impl FnMut(u32)) {
        for offset in -13..=13 {
            self.cell_at(self.cell(position), offset).for_each(&mut visit);
        }
    }

    /// Calls `visit` with each particle in the 13 cells after that of particle `i`, and with the later ones in its own:
    /// so that every pair is seen by one of the two.
    fn visit_half(&self, position: &Vec3, i: u32, mut visit: impl FnMut(u32)) {
        let cell = self.cell(position);
        self.cell_at(cell, 0).filter(|&j| j > i).for_each(&mut visit);
        for offset in 1..=13 {
            self.cell_at(cell, offset).for_each(&mut visit);
        }
    }

    /// Particles in one of the 27 cells about a cell: `offset` counts them from −13 to 13, 0 is the cell itself.
    fn cell_at(&self, [x, y, z]: [i64; 3], offset: i64) -> impl Iterator<Item = u32> + '_ {
        let [dx, dy, dz] = [(offset + 13) % 3 - 1, (offset + 13) / 3 % 3 - 1, (offset + 13) / 9 - 1];
        let key = key([x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)]);
        let bucket = self.bucket(key);
        let range = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
        self.entries[range].iter().filter(move |entry| entry.0 == key).map(|entry| entry.1)
    }
}

/// One number for a cell: 21 bits an axis. Cells 2^21 apart share one, which the distance test sorts out.
fn key(cell: [i64; 3]) -> u64 {
    let [x, y, z] = cell.map(|c| c as u64 & 0x1F_FFFF);
    x | y << 21 | z << 42
}

#[cfg(test)]
mod tests {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::common::random::uniform;

    fn cloud(count: usize, smallest: f64) -> (Vec<Vec3>, Vec<f64>) {
        let mut random = ChaCha8Rng::from_seed([3; 32]);
        let positions = (0..count).map(|_| Vec3::from_fn(|_, _| 4.0 * uniform(&mut random) - 2.0)).collect();
        let radii = (0..count).map(|_| smallest.powf(uniform(&mut random)) * 0.5).collect();
        (positions, radii)
    }

    fn all_pairs(positions: &[Vec3], radii: &[f64], skin: f64) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        for i in 0..positions.len() {
            for j in i + 1..positions.len() {
                let limit = (radii[i] + radii[j]) * (1.0 + 0.5 * skin);
                if (positions[j] - positions[i]).norm_squared() < limit * limit {
                    pairs.push([i as u32, j as u32]);
                }
            }
        }
        pairs
    }

    fn listed(positions: &[Vec3], radii: &[f64], skin: f64) -> Vec<[u32; 2]> {
        let list = NeighbourList::build(positions, radii, skin).unwrap();
        let mut pairs: Vec<[u32; 2]> = list.pairs().map(|[i, j]| [i.min(j), i.max(j)]).collect();
        pairs.sort_unstable();
        pairs
    }

    #[test]
    fn lists_exactly_the_pairs_in_reach() {
        for smallest in [0.9, 0.1, 0.001, 1e-6] {
            let (positions, radii) = cloud(1600, smallest);
            for skin in [0.0, 0.2] {
                assert_eq!(listed(&positions, &radii, skin), all_pairs(&positions, &radii, skin), "{smallest} {skin}");
            }
        }
    }

    #[test]
    fn every_pair_has_a_place_in_its_block_or_its_halo() {
        let (positions, radii) = cloud(2500, 0.3);
        let list = NeighbourList::build(&positions, &radii, 0.2).unwrap();
        assert_eq!(list.blocks.len(), 3);
        let mut reached = 0;
        for block in &list.blocks {
            for (&partner, &slot) in block.partners.iter().zip(&block.slots) {
                let slot = slot as usize;
                let target =
                    if slot < block.len() { block.first + slot as u32 } else { block.halo[slot - block.len()] };
                assert_eq!(target, partner);
            }
            for (source, range) in &block.incoming {
                reached += range.len();
                let halo = &list.blocks[*source as usize].halo[range.start as usize..range.end as usize];
                assert!(halo.iter().all(|&particle| block.range().contains(&(particle as usize))));
            }
        }
        assert_eq!(reached, list.blocks.iter().map(|block| block.halo.len()).sum::<usize>());
    }

    #[test]
    fn a_crowd_is_refused() {
        let message =
            NeighbourList::build(&vec![Vec3::zeros(); 100_000], &[1.0; 100_000], 0.3).unwrap_err().to_string();
        assert!(message.contains("more than 1000 neighbours"), "{message}");
    }

    #[test]
    fn far_away_and_coincident_particles_are_no_trouble() {
        let mut positions = vec![Vec3::zeros(); 3];
        positions.push(Vec3::new(1e30, -1e12, 0.0));
        assert_eq!(listed(&positions, &[1.0, 1e-3, 1e-3, 1.0], 0.3), [[0, 1], [0, 2], [1, 2]]);
        assert!(listed(&[], &[], 0.3).is_empty());
        assert!(listed(&positions[..1], &[1.0], 0.3).is_empty());
    }

    #[test]
    fn a_list_holds_until_half_the_skin() {
        let radii = [1.0, 0.1];
        let built = [Vec3::zeros(), Vec3::x()];
        let list = NeighbourList::build(&built, &radii, 0.2).unwrap();
        assert!(list.holds(&[Vec3::x() * 0.099, Vec3::x()], &radii, 0.2));
        assert!(!list.holds(&[Vec3::x() * 0.101, Vec3::x()], &radii, 0.2));
        assert!(!list.holds(&[Vec3::zeros(), Vec3::x() * 1.011], &radii, 0.2), "a small particle has a small skin");
    }
}
