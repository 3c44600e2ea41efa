//! Iterations that acceleration saves, counted on maps of known spectrum.
//!
//! The figures to reach are preCICE's for a linear map x̃ = A x + b of spectral radius 0.9 with N = 1000 values and a
//! tolerance of 1e-8 for ‖r‖/‖x̃‖, over four windows of which each starts at the last one's solution: plain
//! 156/132/109/132, Aitken 20/17/15/17, IQN-ILS 18/2/2/2. Its A and b are not known. Ours: A is symmetric with the
//! eigenvalues given and cosines as eigenvectors, b is random and changes from window to window by the factors of
//! [`LOADS`], for which the plain iteration takes as many iterations as preCICE's to within two.

use stagger_coupling::{Acceleration, Accelerator, Iterates};

const N: usize = 1000;
const TOLERANCE: f64 = 1e-8;
/// Size of b in the four windows.
const LOADS: [f64; 4] = [1.0, 1.1, 1.11, 1.01];
const AITKEN: Acceleration = Acceleration::Aitken { relaxation: 0.5 };

/// IQN-ILS with a scene's default settings but for the filter.
const fn iqn_ils(filter: f64) -> Acceleration {
    Acceleration::IqnIls { relaxation: 0.5, reused_steps: 8, columns: 20, filter }
}

/// The iterations of one window, the last of which finds convergence; `None` where `limit` were not enough.
fn window(
    accelerator: &mut Accelerator,
    x: &mut Vec<f64>,
    limit: usize,
    map: impl Fn(&[f64]) -> Vec<f64>,
) -> Option<usize> {
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    for iteration in 1..=limit {
        let answered = map(x);
        let residual = norm(&mut answered.iter().zip(x.iter()).map(|(answer, x)| answer - x));
        let fields = [Iterates { frozen: x, answered: &answered }];
        if residual <= TOLERANCE * norm(&mut answered.iter().copied()) {
            accelerator.accepted(&fields);
            *x = answered;
            return Some(iteration);
        }
        *x = accelerator.next(&fields).remove(0);
    }
    None
}

/// Values in [0, 1) that look random and are the same everywhere (SplitMix64; Steele, Lea & Flood 2014).
fn load(seed: u64) -> Vec<f64> {
    let mix = |i: u64| {
        let z = (seed << 32 | i).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..N as u64).map(mix).collect()
}

/// Iterations of the four windows for the map with these eigenvalues.
fn windows(method: Acceleration, eigenvalues: &[f64], seed: u64) -> Vec<usize> {
    let mode = |mode: usize| -> Vec<f64> {
        let scale = if mode == 0 { 1.0 } else { 2f64.sqrt() } / (N as f64).sqrt();
        let angle = std::f64::consts::PI * mode as f64 / N as f64;
        (0..N).map(|i| scale * (angle * (i as f64 + 0.5)).cos()).collect()
    };
    let modes: Vec<Vec<f64>> = (0..eigenvalues.len()).map(mode).collect();
    let load = load(seed);
    let mut accelerator = Accelerator::new(method);
    let mut x = vec![0.0; N];
    let solve = |size: f64| {
        let map = |x: &[f64]| {
            let mut answered: Vec<f64> = load.iter().map(|value| size * value).collect();
            for (mode, eigenvalue) in modes.iter().zip(eigenvalues) {
                let share = eigenvalue * mode.iter().zip(x).map(|(mode, x)| mode * x).sum::<f64>();
                answered.iter_mut().zip(mode).for_each(|(answer, mode)| *answer += share * mode);
            }
            answered
        };
        window(&mut accelerator, &mut x, 400, map).unwrap()
    };
    LOADS.into_iter().map(solve).collect()
}

/// The most iterations of each window over twelve random loads.
fn most(method: Acceleration, eigenvalues: &[f64]) -> Vec<usize> {
    let larger = |most: Vec<usize>, counts: Vec<usize>| most.into_iter().zip(counts).map(|(a, b)| a.max(b)).collect();
    (0..12).map(|seed| windows(method, eigenvalues, seed)).fold(vec![0; LOADS.len()], larger)
}

/// A few modes dominate, 0.9 (1 − i/6)³: a map on which Aitken's method takes as many iterations as on preCICE's, too.
#[test]
fn acceleration_takes_as_few_iterations_as_the_best_known() {
    let eigenvalues: Vec<f64> = (0..6).map(|i| 0.9 * (1.0 - f64::from(i) / 6.0).powi(3)).collect();
    let methods = [Acceleration::None, AITKEN, iqn_ils(1e-2), iqn_ils(1e-6)];
    let [plain, aitken, default, fine] = methods.map(|method| most(method, &eigenvalues));
    println!("6 modes: plain {plain:?}, Aitken {aitken:?}, IQN-ILS {default:?}, with a filter of 1e-6 {fine:?}");
    assert!(plain.iter().zip([156usize, 132, 109, 132]).all(|(ours, theirs)| ours.abs_diff(theirs) <= 2), "{plain:?}");
    assert!(aitken.iter().all(|count| *count <= 20), "{aitken:?}");
    // The default filter, made for nonlinear physics, leaves out what is 99 % known; some loads need it in window 2.
    assert!(default[0] <= 18 && default[1] <= 4 && default[2..] == [2, 2], "{default:?}");
    assert!(fine[0] <= 18 && fine[1..] == [2, 2, 2], "{fine:?}");
}

/// Sixteen modes from 0.9 down in equal steps: a Krylov method needs about 17 iterations, Aitken's single factor takes
/// some more than 20.
#[test]
fn quasi_newton_learns_many_modes_in_the_first_window() {
    let eigenvalues: Vec<f64> = (0..16).map(|i| 0.9 * (1.0 - f64::from(i) / 16.0)).collect();
    let methods = [AITKEN, iqn_ils(1e-2), iqn_ils(1e-6)];
    let [aitken, default, fine] = methods.map(|method| most(method, &eigenvalues));
    println!("16 modes: Aitken {aitken:?}, IQN-ILS {default:?}, with a filter of 1e-6 {fine:?}");
    assert!(aitken.iter().all(|count| *count <= 28), "{aitken:?}");
    assert!(default[0] <= 18 && default[1] <= 8 && default[2..] == [2, 2], "{default:?}");
    assert!(fine[0] <= 18 && fine[1..] == [2, 2, 2], "{fine:?}");
}

/// Two nodes one after the other, w = 1 + g v and v = 1 + h w in ten components, so that the field fed back is multiplied
/// by g h in each iteration: from −3 to −2.1, or from 1.5 to 1.05 for a pair that drives itself.
#[test]
fn a_pair_whose_plain_iteration_diverges_converges_when_accelerated() {
    for radius in [-3.0, 1.5] {
        let gain = |i: usize| radius * (1.0 - 0.03333 * i as f64);
        let map = |v: &[f64]| -> Vec<f64> {
            let w = v.iter().map(|v| 1.0 + 2.0 * v);
            w.enumerate().map(|(i, w)| 1.0 + 0.5 * gain(i) * w).collect()
        };
        let solve = |method, limit| {
            let mut v = vec![0.0; 10];
            let count = window(&mut Accelerator::new(method), &mut v, limit, map);
            let exact = |i: usize| (1.0 + 0.5 * gain(i)) / (1.0 - gain(i));
            let error = (0..10).map(|i| (v[i] / exact(i) - 1.0).abs()).fold(0.0, f64::max);
            (count, error)
        };
        let (plain, far) = solve(Acceleration::None, 100);
        assert!(plain.is_none() && far > 1.0, "plain iteration: {plain:?}, error {far:e}");
        let accelerated = [AITKEN, iqn_ils(1e-2)].map(|method| solve(method, 100));
        println!("spectral radius {radius}: Aitken {:?}, IQN-ILS {:?}", accelerated[0], accelerated[1]);
        for (count, error) in accelerated {
            // A residual of 1e-8 is an error of up to 1e-8/|1 − g h|, with |1 − g h| down to 0.05, and ten components
            // of sizes that differ by as much.
            assert!(error < 1e-5, "spectral radius {radius}: {count:?} iterations, error {error:e}");
        }
        let (Some(aitken), Some(iqn_ils)) = (accelerated[0].0, accelerated[1].0) else {
            panic!("no convergence in 100 iterations: {accelerated:?}");
        };
        assert!(iqn_ils <= 15 && aitken <= 40, "spectral radius {radius}: Aitken {aitken}, IQN-ILS {iqn_ils}");
    }
}
