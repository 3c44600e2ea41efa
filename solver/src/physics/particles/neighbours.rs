//! Verlet list built from cell bins (Verlet 1967; Zohdi 2018, ch. 6.4.1).

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{PARALLEL_ITEMS, Vec3};

/// Particles are binned with others up to half their size; below 2^-15 of the largest they share the last level.
const LEVELS: usize = 16;

/// Pairs close enough to touch before either particle has moved half its skin.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct NeighbourList {
    /// Pairs i < j in ascending order.
    pub pairs: Vec<[u32; 2]>,
    /// Positions the list was built at.
    built_at: Vec<Vec3>,
}

impl NeighbourList {
    /// Lists the pairs with d < (R_i + R_j)(1 + skin/2).
    ///
    /// The skin is a share of each particle's own radius, so that a few large particles do not make neighbours of all
    /// small ones. Particles are binned by size, each level in cells as large as its reach; a particle looks into its
    /// own level and the coarser ones. Cells are hashed into as many buckets as there are particles, so memory does not
    /// depend on the extent of the cloud.
    pub fn build(positions: &[Vec3], radii: &[f64], skin: f64) -> Self {
        let largest = radii.iter().fold(0.0f64, |largest, &radius| largest.max(radius));
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); LEVELS];
        let level_of = |radius: f64| ((largest / radius).log2().max(0.0) as usize).min(LEVELS - 1);
        for (i, &radius) in (0u32..).zip(radii) {
            members[level_of(radius)].push(i);
        }
        let levels: Vec<Option<Bins>> =
            members.iter().map(|members| Bins::build(members, positions, radii, skin)).collect();
        let reach = 1.0 + 0.5 * skin;
        let near = |i: usize| {
            let own = level_of(radii[i]);
            let mut found = Vec::new();
            for (level, bins) in levels.iter().enumerate().take(own + 1) {
                let Some(bins) = bins else { continue };
                bins.visit(&positions[i], |j| {
                    let other = j as usize;
                    let limit = (radii[i] + radii[other]) * reach;
                    if (level < own || other > i) && (positions[other] - positions[i]).norm_squared() < limit * limit {
                        found.push([(i as u32).min(j), (i as u32).max(j)]);
                    }
                });
            }
            found
        };
        let mut pairs: Vec<[u32; 2]> = if positions.len() > PARALLEL_ITEMS {
            (0..positions.len()).into_par_iter().flat_map_iter(near).collect()
        } else {
            (0..positions.len()).flat_map(near).collect()
        };
        pairs.sort_unstable();
        Self { pairs, built_at: positions.to_vec() }
    }

    /// Whether no particle has moved more than half its skin since the list was built.
    pub fn holds(&self, positions: &[Vec3], radii: &[f64], skin: f64) -> bool {
        positions.iter().zip(&self.built_at).zip(radii).all(|((now, then), &radius)| {
            let limit = 0.5 * skin * radius;
            (now - then).norm_squared() <= limit * limit
        })
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

    /// Calls `visit` once with each particle in the 27 cells about `position`.
    fn visit(&self, position: &Vec3, mut visit: impl FnMut(u32)) {
        let [x, y, z] = self.cell(position);
        for dx in -1..=1 {
            for dy in -1..=1 {
                for dz in -1..=1 {
                    let key = key([x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)]);
                    let bucket = self.bucket(key);
                    let range = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
                    for &(_, particle) in self.entries[range].iter().filter(|entry| entry.0 == key) {
                        visit(particle);
                    }
                }
            }
        }
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
    use crate::physics::particles::sequential_addition::uniform;

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

    #[test]
    fn lists_exactly_the_pairs_in_reach() {
        for smallest in [0.9, 0.1, 0.001, 1e-6] {
            let (positions, radii) = cloud(600, smallest);
            for skin in [0.0, 0.2] {
                let list = NeighbourList::build(&positions, &radii, skin);
                assert_eq!(list.pairs, all_pairs(&positions, &radii, skin), "{smallest} {skin}");
            }
        }
    }

    #[test]
    fn far_away_and_coincident_particles_are_no_trouble() {
        let mut positions = vec![Vec3::zeros(); 3];
        positions.push(Vec3::new(1e30, -1e12, 0.0));
        let list = NeighbourList::build(&positions, &[1.0, 1e-3, 1e-3, 1.0], 0.3);
        assert_eq!(list.pairs, [[0, 1], [0, 2], [1, 2]]);
        assert!(NeighbourList::build(&[], &[], 0.3).pairs.is_empty());
        assert!(NeighbourList::build(&positions[..1], &[1.0], 0.3).pairs.is_empty());
    }

    #[test]
    fn a_list_holds_until_half_the_skin() {
        let radii = [1.0, 0.1];
        let built = [Vec3::zeros(), Vec3::x()];
        let list = NeighbourList::build(&built, &radii, 0.2);
        assert!(list.holds(&[Vec3::x() * 0.099, Vec3::x()], &radii, 0.2));
        assert!(!list.holds(&[Vec3::x() * 0.101, Vec3::x()], &radii, 0.2));
        assert!(!list.holds(&[Vec3::zeros(), Vec3::x() * 1.011], &radii, 0.2), "a small particle has a small skin");
    }
}
