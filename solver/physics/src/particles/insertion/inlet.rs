//! A dispenser that pours particles during a run.

use std::collections::BTreeMap;

use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::{
    common::{Vec3, random::uniform},
    particles::settings::Pour,
};

/// Places tried for a particle before it waits for the next window: where one place in a hundred is free, seven of
/// eight particles find one.
const ATTEMPTS: u32 = 200;

/// A particle that a dispenser has put somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Poured {
    /// Centre, in m.
    pub position_m: Vec3,
    /// Velocity, in m/s.
    pub velocity_m_s: Vec3,
    /// R in m.
    pub radius_m: f64,
}

impl Pour {
    /// How many particles are to be put at the start of the window [`t_s`, `t_s + dt_s`], in s: those due until its
    /// end, less those `poured_so_far`, of which some may have waited for room.
    #[must_use]
    pub fn due(&self, t_s: f64, dt_s: f64, poured_so_far: u64) -> u64 {
        let open_s = ((t_s + dt_s).min(self.until_s) - self.from_s).max(0.0);
        // What rounding of times keeps from a whole number is forgiven; a cast of what is too large is the largest.
        let due = (self.rate_1_s * open_s * (1.0 + 1e-9) + 1e-9).floor() as u64;
        due.min(self.limit.unwrap_or(u64::MAX)).saturating_sub(poured_so_far)
    }

    /// Puts up to `due` particles, the first with the number `poured_so_far`, where they overlap neither each other nor
    /// those there are. Fewer come back where one finds no room: the caller adds their number, not `due`, to what is
    /// poured, and the others remain due.
    ///
    /// `positions_m` and `radii_m` are all particles of the run, in any order that is the same in every run. Cost: one
    /// pass over them, then for each place tried a look into 27 cells.
    #[must_use]
    pub fn place(&self, due: u64, poured_so_far: u64, positions_m: &[Vec3], radii_m: &[f64]) -> Vec<Poured> {
        if due == 0 {
            return Vec::new();
        }
        let mut near = self.near(positions_m, radii_m);
        let mut poured = Vec::new();
        for number in poured_so_far..poured_so_far.saturating_add(due) {
            let mut random = self.random(number);
            let radius_m = self.radius.draw(&mut random);
            let mut tried = (0..ATTEMPTS).map(|_| {
                let random = [uniform(&mut random), uniform(&mut random), uniform(&mut random)];
                self.region.place(radius_m, random)
            });
            let Some(position_m) = tried.find(|position_m| near.is_free(position_m, radius_m)) else { break };
            near.insert(position_m, radius_m);
            poured.push(Poured { position_m, velocity_m_s: Vec3::from(self.velocity_m_s), radius_m });
        }
        poured
    }

    /// The particles that reach into the region.
    fn near(&self, positions_m: &[Vec3], radii_m: &[f64]) -> Near {
        let [lower, upper] = self.region.bounds_m();
        let largest_m = self.radius.largest_m();
        let reaches = |position: &Vec3, radius_m: f64| {
            let reach_m = radius_m + largest_m;
            (0..3).all(|axis| position[axis] > lower[axis] - reach_m && position[axis] < upper[axis] + reach_m)
        };
        let near: Vec<(Vec3, f64)> = (positions_m.iter().zip(radii_m))
            .filter(|(position, radius_m)| reaches(position, **radius_m))
            .map(|(position, &radius_m)| (*position, radius_m))
            .collect();
        let cell_m = near.iter().fold(largest_m, |largest, (_, radius_m)| largest.max(*radius_m)) + largest_m;
        let mut cells = Near { cell_m, cells: BTreeMap::new() };
        near.into_iter().for_each(|(position, radius_m)| cells.insert(position, radius_m));
        cells
    }

    /// The random numbers of one particle: a stream of its own of a generator that is the dispenser's own.
    fn random(&self, number: u64) -> ChaCha8Rng {
        let mut seed = [0u8; 32];
        seed[..8].copy_from_slice(&self.seed.to_le_bytes());
        seed[8..16].copy_from_slice(&stagger_messages::codec::hash(self.name.as_bytes()).to_le_bytes());
        let mut random = ChaCha8Rng::from_seed(seed);
        random.set_stream(number);
        random
    }
}

/// Spheres in cells as large as the sum of the two largest radii that may meet: who meets a sphere is in its cell or
/// in one beside it.
struct Near {
    cell_m: f64,
    cells: BTreeMap<[i64; 3], Vec<(Vec3, f64)>>,
}

impl Near {
    fn cell(&self, position: &Vec3) -> [i64; 3] {
        [0, 1, 2].map(|axis| (position[axis] / self.cell_m).floor() as i64)
    }

    fn insert(&mut self, position: Vec3, radius_m: f64) {
        self.cells.entry(self.cell(&position)).or_default().push((position, radius_m));
    }

    fn is_free(&self, position: &Vec3, radius_m: f64) -> bool {
        let [x, y, z] = self.cell(position);
        let apart = |(other, other_m): &(Vec3, f64)| (position - other).norm() >= radius_m + other_m;
        (x.saturating_sub(1)..=x.saturating_add(1)).all(|x| {
            (y.saturating_sub(1)..=y.saturating_add(1)).all(|y| {
                let column = [x, y, z.saturating_sub(1)]..=[x, y, z.saturating_add(1)];
                self.cells.range(column).all(|(_, spheres)| spheres.iter().all(apart))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::settings::{PourRegion, Radius};

    fn pour() -> Pour {
        Pour {
            name: "hopper".into(),
            region: PourRegion::Box { lower_m: [0.0, 0.0, 1.0], upper_m: [1.0, 1.0, 1.5] },
            rate_1_s: 1000.0,
            from_s: 0.01,
            until_s: 0.05,
            limit: None,
            radius: Radius::Uniform { mean_m: 0.05, spread_m: 0.02 },
            material: 0,
            velocity_m_s: [0.0, 0.0, -1.0],
            seed: 7,
        }
    }

    #[test]
    fn what_is_due_adds_up_to_the_rate_whatever_the_windows() {
        for windows in [1u32, 7, 60, 999] {
            let (mut poured, dt_s) = (0, 0.06 / f64::from(windows));
            for window in 0..windows {
                poured += pour().due(f64::from(window) * dt_s, dt_s, poured);
            }
            assert_eq!(poured, 40, "{windows} windows");
        }
        assert_eq!(pour().due(0.0, 0.01, 0), 0);
        // Those that waited for room are still due, after the dispenser has closed too.
        assert_eq!(pour().due(1.0, 0.1, 33), 7);
        assert_eq!(Pour { limit: Some(15), ..pour() }.due(0.05, 0.1, 4), 11);
        assert_eq!(Pour { until_s: f64::INFINITY, ..pour() }.due(2.0, 1.0, 2980), 10);
    }

    #[test]
    fn what_is_due_at_a_time_that_a_sum_of_steps_misses_is_due_then() {
        // Ten tenths of a second, added up, are a rounding short of one.
        let pour = Pour { rate_1_s: 10.0, from_s: 0.0, until_s: f64::INFINITY, ..pour() };
        for steps in [10u32, 100_000] {
            let (dt_s, mut t_s, mut poured) = (1.0 / f64::from(steps), 0.0, 0);
            for step in 1..=steps {
                poured += pour.due(t_s, dt_s, poured);
                t_s += dt_s;
                assert_eq!(poured, u64::from(step * 10 / steps), "after {step} of {steps} steps");
            }
        }
    }

    #[test]
    fn nothing_overlaps_and_all_lie_wholly_inside() {
        let there = [Vec3::new(0.5, 0.5, 1.2), Vec3::new(0.0, 0.0, 0.9), Vec3::new(0.5, 0.5, -9.0)];
        let radii = [0.3, 0.2, 0.3];
        let poured = pour().place(60, 0, &there, &radii);
        // A fifth of the region's volume: every one finds room.
        assert_eq!(poured.len(), 60);
        let mut all: Vec<(Vec3, f64)> = there.into_iter().zip(radii).collect();
        for Poured { position_m, velocity_m_s, radius_m } in poured {
            assert!((0.03..0.07).contains(&radius_m) && velocity_m_s.z == -1.0);
            for (axis, [low, high]) in [[0.0, 1.0], [0.0, 1.0], [1.0, 1.5]].into_iter().enumerate() {
                let inside = position_m[axis] - radius_m >= low - 1e-15 && position_m[axis] + radius_m <= high + 1e-15;
                assert!(inside, "{position_m}");
            }
            for (other, other_m) in &all {
                assert!((position_m - other).norm() >= radius_m + other_m, "{position_m} and {other}");
            }
            all.push((position_m, radius_m));
        }
    }

    #[test]
    fn what_finds_no_room_waits_and_is_the_same_when_it_comes() {
        let free = pour().place(40, 0, &[], &[]);
        // One sphere fills the region.
        let (full, radius) = ([Vec3::new(0.5, 0.5, 1.25)], [2.0]);
        assert!(pour().place(40, 0, &full, &radius).is_empty());
        // In two parts, the first of which is there when the second comes.
        let first = pour().place(15, 0, &[], &[]);
        let (positions, radii): (Vec<_>, Vec<_>) = first.iter().map(|it| (it.position_m, it.radius_m)).unzip();
        let second = pour().place(25, 15, &positions, &radii);
        assert_eq!([first, second].concat(), free);
        // A region full to the brim gives fewer than due, and ends.
        let some = pour().place(100_000, 0, &[], &[]).len();
        assert!((100..1000).contains(&some), "{some}");
    }

    #[test]
    fn seed_and_name_tell_dispensers_apart() {
        let places = |pour: Pour| pour.place(5, 0, &[], &[]);
        assert_eq!(places(pour()), places(pour()));
        assert_ne!(places(pour()), places(Pour { seed: 8, ..pour() }));
        assert_ne!(places(pour()), places(Pour { name: "second".into(), ..pour() }));
    }

    #[test]
    fn a_disc_is_filled_evenly_in_its_plane() {
        let region = PourRegion::Disc { centre_m: [1.0, 2.0, 3.0], radius_m: 1.0 };
        let disc = Pour { region, radius: Radius::Uniform { mean_m: 1e-3, spread_m: 0.0 }, ..pour() };
        let poured = disc.place(2000, 0, &[], &[]);
        let distances = poured.iter().map(|it| (it.position_m - Vec3::new(1.0, 2.0, 3.0)).norm());
        let inner = distances.clone().filter(|distance| *distance < 0.5).count();
        assert!(poured.iter().all(|it| it.position_m.z == 3.0) && distances.fold(0.0, f64::max) <= 0.999);
        // A quarter of the area holds 500 ± 19 of 2000; five standard deviations.
        assert!((400..600).contains(&inner) && poured.len() == 2000, "{inner} of {}", poured.len());
    }
}
