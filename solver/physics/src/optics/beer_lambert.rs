//! The laser along parallel lines, absorbed by Beer and Lambert's law in the particles that a line crosses.

use nalgebra::Vector3;
use rayon::prelude::*;
use stagger_coupling::{SolveError, math};

use super::{NODE, Profile};
use crate::common::{SolidSurface, beam::Frame, checks::setting};

/// Sampling points on one side of the square grid: 4 million lines are 32 MB.
const LARGEST_SIDE: f64 = 2001.0;

/// Lines handed to a thread at a time; results do not depend on it.
const LINES_PER_TASK: usize = 64;

/// Cosine and sine of the angle by which the grid of lines is turned: its tangent is the golden ratio less 1, the number that
/// fractions approximate worst.
const TURN: [f64; 2] = [0.850_650_808_352_039_9, 0.525_731_112_119_133_6];

/// Parallel lines on a square grid about the beam's axis, each carrying a share of the power.
///
/// One line is the axis. A line carries the irradiance at its point; the shares are scaled to add up to 1. Grid error:
/// of order 1.5 in the spacing for particles inside the beam, as the chord's slope is infinite at a sphere's edge. The grid
/// is turned against the beam's own directions: edges along these, as of particles in rows or of a sphere larger
/// than the beam, would otherwise fall between two columns of lines all along, an error of order 1.
pub struct Lines {
    spacing_m: f64,
    /// Lines on either side of the axis.
    half: i64,
    /// Share of each line, row by row; 0 outside the beam.
    shares: Vec<f64>,
    /// Number of lines that carry power.
    pub(super) count: usize,
}

/// Where a line meets a particle.
#[derive(Clone, Copy)]
struct Hit {
    line: u32,
    particle: u32,
    /// Depth at which the line enters the particle, in m.
    entry_m: f64,
    /// Length of the line within the particle, in m.
    chord_m: f64,
    /// What the particle takes from this line, as a share of the beam's power.
    absorbed: f64,
}

impl Lines {
    /// The smallest distance between lines that is not refused for a beam of this `profile`, in m.
    pub fn finest_m(profile: &Profile) -> f64 {
        2.0 * profile.cut_m() / (LARGEST_SIDE - 1.0)
    }

    /// Lines `spacing_m` apart over the cross-section of a beam of this `profile`.
    pub(super) fn new(profile: &Profile, spacing_m: f64) -> Result<Self, SolveError> {
        let half = (profile.cut_m() / spacing_m).floor();
        let side = 2.0 * half + 1.0;
        let expected = format!("at most {LARGEST_SIDE}: raise the spacing");
        setting(NODE, "number of lines across the beam", side, side <= LARGEST_SIDE, &expected)?;
        let half = half as i64;
        let mut shares = Vec::with_capacity((side * side) as usize);
        for row in -half..=half {
            for column in -half..=half {
                let d_m = spacing_m * math::hypot(row as f64, column as f64);
                shares.push(if d_m <= profile.cut_m() { profile.irradiance_1_m2(d_m) } else { 0.0 });
            }
        }
        let total: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= total);
        let count = shares.iter().filter(|&&share| share > 0.0).count();
        Ok(Self { spacing_m, half, shares, count })
    }

    /// Share of the beam's power that each particle takes by the law of Beer and Lambert with shadowing: on each line,
    /// in the order in which it enters them (Zohdi 2018, eqs. 6.38, 6.42), a particle takes 1 − e^{−a·chord} of what
    /// the ones before it left. Where two overlap, both chords count in full. The shares add up to 1 at most.
    ///
    /// `centres_m` are in the beam's frame; `absorption_1_m` is a. The second list is the share that each line has left.
    pub(super) fn absorbed(
        &self,
        absorption_1_m: f64,
        centres_m: &[[f64; 3]],
        radii_m: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let [cos, sin] = TURN;
        let turned = |&[u, v, depth]: &[f64; 3]| [cos * u + sin * v, cos * v - sin * u, depth];
        let centres_m: Vec<_> = centres_m.iter().map(turned).collect();
        let mut hits = by_line(&self.hits(&centres_m, radii_m), self.shares.len());
        let mut lines: Vec<&mut [Hit]> = hits.chunk_by_mut(|a, b| a.line == b.line).collect();
        lines.par_iter_mut().with_min_len(LINES_PER_TASK).for_each(|line| {
            line.sort_unstable_by(|a, b| a.entry_m.total_cmp(&b.entry_m).then(a.particle.cmp(&b.particle)));
            let mut left = self.shares[line[0].line as usize];
            for hit in line.iter_mut() {
                hit.absorbed = left * -math::exp_m1(-absorption_1_m * hit.chord_m);
                left -= hit.absorbed;
            }
        });
        // One thread, line by line: the order of the sums does not depend on the number of threads.
        let (mut absorbed, mut left) = (vec![0.0; radii_m.len()], self.shares.clone());
        for hit in &hits {
            absorbed[hit.particle as usize] += hit.absorbed;
            left[hit.line as usize] -= hit.absorbed;
        }
        (absorbed, left)
    }

    /// What of the beam's power arrives on each cell of a solid's upper face, where the lines have these shares `left`. A line
    /// stands for a square as wide as lines are apart.
    pub(super) fn arrived(&self, left: &[f64], frame: &Frame, spot_m: Vector3<f64>, solid: &SolidSurface) -> Vec<f64> {
        let mut arrived = vec![0.0; solid.len()];
        let side = 2 * self.half + 1;
        for (line, &share) in (0i64..).zip(left).filter(|(_, share)| **share > 0.0) {
            let place = |index: i64| (index - self.half) as f64 * self.spacing_m;
            let (row, column) = (place(line / side), place(line % side));
            let [cos, sin] = TURN;
            let point = frame.point_m([cos * column - sin * row, sin * column + cos * row, 0.0], spot_m);
            // The spot may lie at any depth along the beam.
            if let Some(point) = solid.met(point - frame.along() * solid.beyond_m(point), frame.along()) {
                solid.spread(point, 0.5 * self.spacing_m, share, &mut arrived);
            }
        }
        arrived
    }

    /// Every meeting of a line that carries power with a particle. The grid itself is the search structure: a
    /// particle's disc covers a range of rows, and a range of columns in each.
    fn hits(&self, centres_m: &[[f64; 3]], radii_m: &[f64]) -> Vec<Hit> {
        let mut hits = Vec::new();
        for (particle, (&[u, v, depth], &radius)) in centres_m.iter().zip(radii_m).enumerate() {
            for row in self.range(v, radius) {
                let across = row as f64 * self.spacing_m - v;
                let half_width_squared = radius * radius - across * across;
                for column in self.range(u, half_width_squared.max(0.0).sqrt()) {
                    let line = ((row + self.half) * (2 * self.half + 1) + column + self.half) as usize;
                    let offset = column as f64 * self.spacing_m - u;
                    let half_chord_squared = half_width_squared - offset * offset;
                    if half_chord_squared > 0.0 && self.shares[line] > 0.0 {
                        let half_chord = half_chord_squared.sqrt();
                        hits.push(Hit {
                            line: line as u32,
                            particle: particle as u32,
                            entry_m: depth - half_chord,
                            chord_m: 2.0 * half_chord,
                            absorbed: 0.0,
                        });
                    }
                }
            }
        }
        hits
    }

    /// Rows or columns within `reach` of `at`, in the grid. Casts saturate, so any finite place is safe.
    fn range(&self, at: f64, reach: f64) -> std::ops::RangeInclusive<i64> {
        let first = ((at - reach) / self.spacing_m).ceil() as i64;
        let last = ((at + reach) / self.spacing_m).floor() as i64;
        first.max(-self.half)..=last.min(self.half)
    }
}

/// The hits line by line, in a line as they came: a counting sort.
fn by_line(hits: &[Hit], lines: usize) -> Vec<Hit> {
    let mut next = vec![0; lines + 1];
    for hit in hits {
        next[hit.line as usize + 1] += 1;
    }
    for line in 0..lines {
        next[line + 1] += next[line];
    }
    let mut sorted = hits.to_vec();
    for hit in hits {
        let at = &mut next[hit.line as usize];
        sorted[*at] = *hit;
        *at += 1;
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_the_power_and_a_narrow_beam_still_has_its_axis() {
        for profile in [
            Profile::TopHat { radius_m: 3e-5 },
            Profile::Gaussian { radius_m: 3e-5 },
            Profile::Exponential { decay_1_m: 1e5 },
        ] {
            let lines = Lines::new(&profile, 1e-6).unwrap();
            // Rounding of a sum of some 10⁵ shares.
            assert!((lines.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        let narrow = Lines::new(&Profile::TopHat { radius_m: 1e-6 }, 1e-3).unwrap();
        assert_eq!(narrow.shares, [1.0]);
    }

    #[test]
    fn the_spacing_of_a_narrow_beam_finds_what_falls_on_one_side_of_an_edge() {
        for (profile, most) in [
            (Profile::TopHat { radius_m: 1e-5 }, 0.008),
            (Profile::Gaussian { radius_m: 1e-5 }, 0.005),
            (Profile::Exponential { decay_1_m: 1e5 }, 0.006),
        ] {
            let lines = Lines::new(&profile, profile.sampling_m()).unwrap();
            // A black disc much larger than the beam, and in 20 directions and at 9 distances from the axis.
            let (disc_m, half_m) = (1e-4, profile.quantile_m(0.5));
            for away in -4..=4 {
                let away_m = disc_m + f64::from(away) * 0.3 * half_m;
                let n = 4000;
                let width_m = profile.cut_m() / f64::from(n);
                let ring = |k| {
                    let d_m = (f64::from(k) + 0.5) * width_m;
                    let cosine = (d_m * d_m + away_m * away_m - disc_m * disc_m) / (2.0 * d_m * away_m);
                    profile.irradiance_1_m2(d_m) * 2.0 * d_m * cosine.clamp(-1.0, 1.0).acos() * width_m
                };
                let expected: f64 = (0..n).map(ring).sum();
                for direction in 0..20 {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(direction) / 20.0).sin_cos();
                    let found = lines.absorbed(1e12, &[[away_m * cos, away_m * sin, 0.0]], &[disc_m]).0[0];
                    let error = (found - expected).abs();
                    assert!(error < most, "{profile:?}, {away} at {direction}: {found}, expected {expected}");
                }
            }
        }
    }

    #[test]
    fn too_many_lines_are_refused_before_memory_is_taken() {
        let error = Lines::new(&Profile::TopHat { radius_m: 1.0 }, 1e-9).err().unwrap();
        assert!(error.to_string().contains("raise the spacing"), "{error}");
    }

    #[test]
    fn a_line_goes_through_particles_by_depth_whatever_their_index() {
        let lines = Lines::new(&Profile::TopHat { radius_m: 1e-6 }, 1e-3).unwrap();
        // Unit spheres on the axis, the last index on top: each takes 1 − e^{−2a} of what is left.
        let centres = [[0.0, 0.0, 7.0], [0.0, 0.0, 4.0], [0.0, 0.0, 1.0], [5.0, 0.0, -3.0]];
        let (absorbed, left) = lines.absorbed(0.5, &centres, &[1.0; 4]);
        assert!((left[0] + absorbed.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let taken = 1.0 - (-1.0_f64).exp();
        for (share, above) in absorbed.iter().zip([2, 1, 0]) {
            assert!((share - taken * (1.0 - taken).powi(above)).abs() < 1e-15);
        }
        assert!(absorbed[3].abs() < f64::MIN_POSITIVE, "no line meets the last one");
    }
}
