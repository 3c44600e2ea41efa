//! Random sequential addition of spheres (Widom 1966).

use std::f64::consts::PI;

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};

use super::Vec3;
use crate::SolveError;

/// Packing fraction at which random sequential addition of equal spheres jams (Zhang & Torquato 2013: 0.3841).
const JAMMING_FRACTION: f64 = 0.38;

/// Attempts a particle that make a start up to about nine tenths of jamming, and the least in all.
const ATTEMPTS_PER_PARTICLE: u64 = 5_000;
const ATTEMPTS_AT_LEAST: u64 = 1_000_000;

/// What is to be placed, in m.
pub(super) struct SequentialAddition {
    pub count: usize,
    pub radius_m: f64,
    pub radius_spread_m: f64,
    pub lower_m: [f64; 3],
    pub upper_m: [f64; 3],
    pub seed: u64,
}

impl SequentialAddition {
    /// Positions and radii: radii uniform in mean ± spread, placed largest first, wholly inside the box, without
    /// overlap. The same seed gives the same numbers on every machine.
    ///
    /// # Errors
    /// [`SolveError::Start`] where the particles do not fit into the box within the bounded number of attempts.
    pub fn place(&self) -> Result<(Vec<Vec3>, Vec<f64>), SolveError> {
        let mut seed = [0u8; 32];
        seed[..8].copy_from_slice(&self.seed.to_le_bytes());
        let mut random = ChaCha8Rng::from_seed(seed);
        let mut radii: Vec<f64> = (0..self.count)
            .map(|_| self.radius_m + self.radius_spread_m * (2.0 * uniform(&mut random) - 1.0))
            .collect();
        radii.sort_unstable_by(|a, b| b.total_cmp(a));
        let Some(&largest) = radii.first() else { return Ok((Vec::new(), radii)) };

        let lower = Vec3::from(self.lower_m);
        let extent = Vec3::from(self.upper_m) - lower;
        if !extent.iter().all(|&side| side >= 2.0 * largest) {
            return Err(SolveError::Start(format!(
                "particles: a sphere of radius {largest:e} m does not fit into the start box of {:e} x {:e} x {:e} m; \
                 use a larger box or smaller particles",
                extent.x, extent.y, extent.z
            )));
        }
        let mut cells = Cells::new(lower, extent, 2.0 * largest, self.count);
        let mut positions: Vec<Vec3> = Vec::with_capacity(self.count);
        let mut attempts = ATTEMPTS_AT_LEAST + ATTEMPTS_PER_PARTICLE * self.count as u64;
        for i in 0..self.count {
            let radius = radii[i];
            let position = loop {
                if attempts == 0 {
                    return Err(self.jammed(i, &radii, &extent));
                }
                attempts -= 1;
                let room = extent.map(|side| side - 2.0 * radius);
                let shift = Vec3::from_fn(|axis, _| radius + room[axis] * uniform(&mut random));
                let candidate = lower + shift;
                if cells.free(&candidate, radius, &positions, &radii) {
                    break candidate;
                }
            };
            cells.insert(&position, i);
            positions.push(position);
        }
        Ok((positions, radii))
    }

    fn jammed(&self, placed: usize, radii: &[f64], extent: &Vec3) -> SolveError {
        let volume: f64 = radii.iter().map(|radius| 4.0 / 3.0 * PI * radius.powi(3)).sum();
        SolveError::Start(format!(
            "particles: random sequential addition placed {placed} of {} particles and found no room for more: the \
             packing fraction asked for is {:.3}, and random sequential addition jams near {JAMMING_FRACTION}; use a \
             larger box, fewer particles, or given positions",
            self.count,
            volume / extent.product()
        ))
    }
}

/// Uniform in [0, 1): the upper 53 bits of the next number.
pub(super) fn uniform(random: &mut impl RngCore) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Cells at least as large as the largest diameter; a particle is chained in the cell of its centre.
struct Cells {
    lower: Vec3,
    inverse_cell: Vec3,
    sides: [usize; 3],
    /// Last particle inserted into each cell.
    heads: Vec<Option<u32>>,
    /// The particle inserted before, by particle.
    previous: Vec<Option<u32>>,
}

impl Cells {
    fn new(lower: Vec3, extent: Vec3, diameter: f64, count: usize) -> Self {
        // Not more cells than particles, however large the box.
        let per_side = (count as f64).cbrt().ceil().max(1.0);
        let volume_side = extent.map(|side| (side / diameter).floor());
        let wanted = volume_side.product();
        let share = if wanted > per_side.powi(3) { (per_side.powi(3) / wanted).cbrt() } else { 1.0 };
        let sides = [0, 1, 2].map(|axis| ((volume_side[axis] * share) as usize).clamp(1, count.max(1)));
        let inverse_cell = Vec3::from_fn(|axis, _| sides[axis] as f64 / extent[axis]);
        Self { lower, inverse_cell, sides, heads: vec![None; sides.iter().product()], previous: Vec::new() }
    }

    fn cell(&self, position: &Vec3) -> [usize; 3] {
        [0, 1, 2].map(|axis| {
            let cell = (position[axis] - self.lower[axis]) * self.inverse_cell[axis];
            (cell as usize).min(self.sides[axis] - 1)
        })
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.sides[1] + y) * self.sides[2] + z
    }

    fn insert(&mut self, position: &Vec3, particle: usize) {
        let index = self.index(self.cell(position));
        self.previous.push(self.heads[index].replace(particle as u32));
    }

    fn free(&self, candidate: &Vec3, radius: f64, positions: &[Vec3], radii: &[f64]) -> bool {
        let cell = self.cell(candidate);
        let range = |axis: usize| cell[axis].saturating_sub(1)..=(cell[axis] + 1).min(self.sides[axis] - 1);
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    let mut next = self.heads[self.index([x, y, z])];
                    while let Some(other) = next {
                        let other = other as usize;
                        let reach = radius + radii[other];
                        if (positions[other] - candidate).norm_squared() < reach * reach {
                            return false;
                        }
                        next = self.previous[other];
                    }
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn addition(count: usize, side: f64) -> SequentialAddition {
        SequentialAddition {
            count,
            radius_m: 1.0,
            radius_spread_m: 0.3,
            lower_m: [-1.0, 2.0, 0.0],
            upper_m: [side - 1.0, side + 2.0, side],
            seed: 7,
        }
    }

    #[test]
    fn no_overlap_and_wholly_inside() {
        let (positions, radii) = addition(400, 19.0).place().unwrap();
        for i in 0..positions.len() {
            assert!((0.7..=1.3).contains(&radii[i]));
            // The box is met to rounding of coordinates of order ten.
            assert!((0..3).all(|axis| {
                let lower = [-1.0, 2.0, 0.0][axis];
                positions[i][axis] - radii[i] >= lower - 1e-14 && positions[i][axis] + radii[i] <= lower + 19.0 + 1e-14
            }));
            for j in 0..i {
                assert!((positions[i] - positions[j]).norm() >= (radii[i] + radii[j]) * (1.0 - 1e-15));
            }
        }
    }

    #[test]
    fn the_stream_is_portable() {
        // ChaCha8 with a zero key and stream, first word of the keystream: 3e 00 ef 2f 89 5f 40 d6 (Strombergson,
        // Test Vectors for the Stream Cipher ChaCha, TC1).
        let mut random = ChaCha8Rng::from_seed([0; 32]);
        let expected = (0xd640_5f89_2fef_003e_u64 >> 11) as f64 / (1u64 << 53) as f64;
        assert!((uniform(&mut random) - expected).abs() < f64::EPSILON);
    }

    #[test]
    fn too_dense_says_so_and_ends() {
        let message = addition(60, 7.0).place().unwrap_err().to_string();
        assert!(message.contains("packing fraction asked for is 0.69") && message.contains("0.38"), "{message}");
        assert!(addition(1, 1.0).place().unwrap_err().to_string().contains("does not fit"));
        assert!(addition(0, 1.0).place().unwrap().0.is_empty());
    }
}
