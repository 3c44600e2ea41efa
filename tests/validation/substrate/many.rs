//! Sums over many loads: lanes, threads, groups.

use std::f64::consts::TAU;

use proptest::prelude::*;
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use stagger_physics::substrate::{FarField, Load, Samples, stress_at};

use super::{Tensor, difference};

fn random(seed: u8) -> impl FnMut() -> f64 {
    let mut random = ChaCha8Rng::from_seed([seed; 32]);
    move || random.next_u64() as f64 / u64::MAX as f64
}

/// Loads over a square of side 1, pressing and sliding every way, a few of them pulling.
fn loads(count: usize, seed: u8) -> Vec<Load> {
    let mut uniform = random(seed);
    let each = |_| Load {
        x_m: uniform(),
        y_m: uniform(),
        normal_n: 1.1 * uniform() - 0.1,
        tangential_n: [uniform() - 0.5, uniform() - 0.5],
        radius_m: 1e-4 + 1e-3 * uniform(),
    };
    (0..count).map(each).collect()
}

fn points(count: usize, seed: u8) -> Vec<[f64; 3]> {
    let mut uniform = random(seed);
    // Every third on the surface, the others down to a depth of 1.
    (0..count).map(|k| [uniform(), uniform(), if k % 3 == 0 { 0.0 } else { uniform() }]).collect()
}

/// ‖F‖/(2πγ²) summed over the loads: what the tolerance is relative to.
fn scale(loads: &[Load], [x, y, z]: [f64; 3]) -> f64 {
    let each = |load: &Load| {
        let [fx, fy] = load.tangential_n;
        let force = (fx * fx + fy * fy + load.normal_n * load.normal_n).sqrt();
        force / (TAU * ((x - load.x_m).powi(2) + (y - load.y_m).powi(2) + z * z))
    };
    loads.iter().map(each).sum()
}

#[test]
fn lanes_and_threads_give_the_bits_of_the_plain_sum() {
    let (loads, points) = (loads(300, 1), points(1000, 2));
    let samples = Samples::new(&points);
    let plain: Vec<Tensor> = points.iter().map(|&point| stress_at(0.3, &loads, point)).collect();
    let grouped = samples.stress(0.3, &loads, Some(FarField::new(0.01).unwrap()));
    for threads in [1, 2, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let direct = pool.install(|| samples.stress(0.3, &loads, None));
        assert!(direct == plain, "{threads} threads");
        let again = pool.install(|| samples.stress(0.3, &loads, Some(FarField::new(0.01).unwrap())));
        assert!(again == grouped, "{threads} threads, grouped");
    }
    assert!(grouped != plain, "groups are in use");
}

#[test]
fn no_loads_no_points_and_loads_in_one_place_are_fine() {
    let grouped = Some(FarField::new(0.1).unwrap());
    let samples = Samples::new(&points(100, 3));
    assert!(samples.stress(0.3, &[], grouped).iter().all(|stress| *stress == [0.0; 6]));
    assert!(Samples::new(&[]).stress(0.3, &loads(5, 1), grouped).is_empty());
    let alike = vec![loads(1, 4)[0]; 500];
    let (one, all) = (samples.stress(0.3, &alike[..1], None), samples.stress(0.3, &alike, grouped));
    for (one, all) in one.iter().zip(&all) {
        // Five hundred additions.
        assert!(difference(one.map(|value| 500.0 * value), *all) < 1e-12 * difference(*all, [0.0; 6]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn grouping_errs_less_than_its_tolerance(
        seed in 0u8..255, nu in 0.0..0.5f64, tolerance in prop::sample::select(vec![0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4]),
        clustered in any::<bool>(),
    ) {
        let mut loads = loads(1500, seed);
        if clustered {
            // Two heaps far apart, one of them pulling, so that nothing averages out.
            for (k, load) in loads.iter_mut().enumerate() {
                load.x_m = 0.05 * load.x_m + if k % 2 == 0 { 0.9 } else { 0.0 };
                load.normal_n = if k % 2 == 0 { 1.0 } else { -1.0 };
            }
        }
        let points = points(300, seed.wrapping_add(1));
        let samples = Samples::new(&points);
        let direct = samples.stress(nu, &loads, None);
        let grouped = samples.stress(nu, &loads, Some(FarField::new(tolerance).unwrap()));
        for ((direct, grouped), point) in direct.iter().zip(&grouped).zip(&points) {
            let error = difference(*direct, *grouped) / scale(&loads, *point);
            prop_assert!(error <= tolerance, "{point:?}: {error:e} with {tolerance:e}");
        }
    }
}
