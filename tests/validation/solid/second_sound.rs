//! Second sound on a grid: a front of finite speed, and Fourier's law where the relaxation is fast.

use stagger_physics::{
    common::grid::CellGrid,
    solid::{Level, Settings, Solid},
};

use super::*;

const CELLS: usize = 400;
const LENGTH_M: f64 = 1e-3;
const RELAXATION_S: f64 = 1e-3;

/// Temperatures after `time_s` of a rod of which the first quarter is 100 K hotter at the start.
fn rod(relaxation_s: f64, time_s: f64, steps: u32) -> Vec<f64> {
    let grid = CellGrid::regular("rod", [0.0; 3], [LENGTH_M, 1e-5, 1e-5], [CELLS, 1, 1]);
    let solid = Solid::new(Settings { relaxation_s, level: Level::Implicit { phi: 0.5 }, ..settings(grid) }).unwrap();
    let start = (0..CELLS).map(|cell| if cell < CELLS / 4 { START_K + 100.0 } else { START_K }).collect();
    let (_, reply) = run(&solid, solid.state(start).unwrap(), steps, time_s / f64::from(steps));
    temperatures_k(&reply).to_vec()
}

#[test]
fn before_the_front_nothing_has_moved() {
    let speed_m_s = (DIFFUSIVITY_M2_S / RELAXATION_S).sqrt();
    let time_s = 0.25 * LENGTH_M / speed_m_s;
    let found = rod(RELAXATION_S, time_s, 400);
    let fourier = rod(0.0, time_s, 400);
    let front = CELLS / 2;
    // The scheme smears the jump over some cells, as many as steps to the power of a third; its foot is below 1e-4 of the
    // jump 30 cells ahead, where Fourier's law has spread a tenth of it.
    let ahead = front + 30;
    assert!((found[ahead] - START_K).abs() < 1e-2, "{}", found[ahead] - START_K);
    assert!(fourier[ahead] - START_K > 1.0, "{}", fourier[ahead] - START_K);
    // The jump decays as e^{−t/(2τ)} while it travels, half of it each way.
    let expected_k = 50.0 * (-time_s / (2.0 * RELAXATION_S)).exp();
    let behind = found[front - 30] - START_K;
    assert!(behind > 0.8 * expected_k, "{behind} K behind a front of {expected_k} K");
    let total: f64 = found.iter().map(|at_k| at_k - START_K).sum();
    assert!((total / (100.0 * CELLS as f64 / 4.0) - 1.0).abs() < 1e-11, "{total}");
}

#[test]
fn fast_relaxation_is_fouriers_law_and_slow_relaxation_holds_heat_where_it_is() {
    let time_s = 2e-3;
    let (fourier, fast) = (rod(0.0, time_s, 100), rod(1e-9, time_s, 100));
    let difference = |one: &[f64], other: &[f64]| {
        one.iter().zip(other).fold(0.0f64, |most, (one, other)| most.max((one - other).abs()))
    };
    assert!(difference(&fourier, &fast) < 1e-2, "{}", difference(&fourier, &fast));
    let slow = rod(1e9, time_s, 100);
    let start: Vec<f64> = rod(0.0, 1e-30, 1);
    assert!(difference(&slow, &start) < 1e-6, "{}", difference(&slow, &start));
}
