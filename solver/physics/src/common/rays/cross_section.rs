//! Where the rays of a beam pass its cross-section: points a golden angle apart (Vogel 1979) or drawn at random.

use std::f64::consts::PI;

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use stagger_coupling::math;

use super::{Grid, Pattern, Ray, Sampling, Vec3};
use crate::common::beam::{Frame, Profile};

/// The golden angle π (3 − √5): successive multiples of it leave no direction out (Vogel 1979).
const GOLDEN_ANGLE: f64 = PI * 0.763_932_022_500_210_3;

/// Where the rays pass the beam's cross-section, in m from its axis. Each stands for the same share of the power.
pub fn points_m(profile: &Profile, sampling: &Sampling) -> Vec<[f64; 2]> {
    let point = |q: f64, angle: f64| {
        let (sine, cosine) = math::sin_cos(angle);
        let radius_m = profile.quantile_m(q);
        [radius_m * cosine, radius_m * sine]
    };
    let count = sampling.count;
    match sampling.pattern {
        Pattern::Stratified => {
            (0..count).map(|k| point((k as f64 + 0.5) / count as f64, GOLDEN_ANGLE * k as f64)).collect()
        }
        Pattern::Random { seed } => {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            // 53 bits: in [0, 1).
            let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            (0..count).map(|_| point(uniform(), 2.0 * PI * uniform())).collect()
        }
    }
}

/// Rays of a parallel beam through these points of its cross-section, from before the first sphere: outside all of them.
pub(crate) fn starts(frame: &Frame, spot_m: Vec3, points_m: &[[f64; 2]], grid: &Grid) -> Vec<Ray> {
    let direction = frame.along();
    let depths = grid.spheres().iter().map(|sphere| direction.dot(&(sphere.centre - spot_m)) - 2.0 * sphere.radius);
    let first = depths.fold(0.0, f64::min);
    points_m.iter().map(|&[u, v]| Ray { origin: frame.point_m([u, v, first], spot_m), direction }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::rays::Limits;

    #[test]
    fn the_points_have_the_profiles_second_moment() {
        let limits = Limits { threshold: 0.0, reflections: 1 };
        for (profile, moment) in [
            // ∫ r² dP: R²/2; w²/2; 6/b².
            (Profile::TopHat { radius_m: 2.0 }, 2.0),
            (Profile::Gaussian { radius_m: 2.0 }, 2.0),
            (Profile::Exponential { decay_1_m: 2.0 }, 1.5),
        ] {
            for (pattern, tolerance) in [
                // The cut tail of half a ray holds ln N/N of the moment, some 1e-4 for N = 10⁵ and up to ten times for the
                // exponential's ln² N; the spread of r² is up to three times its mean: 3/√N = 1e-2, and three of those.
                (Pattern::Stratified, 2e-3),
                (Pattern::Random { seed: 3 }, 3e-2),
            ] {
                let points = points_m(&profile, &Sampling { count: 100_000, pattern, limits });
                let sum: f64 = points.iter().map(|[u, v]| u * u + v * v).sum();
                assert!((sum / 1e5 / moment - 1.0).abs() < tolerance, "{profile:?}, {pattern:?}: {}", sum / 1e5);
                // No direction is preferred: the mean is √(moment/N) off at random.
                let [u, v] = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / 1e5);
                assert!(u.hypot(v) < 4.0 * (moment / 1e5).sqrt(), "{profile:?}, {pattern:?}: {u}, {v}");
            }
        }
    }
}
