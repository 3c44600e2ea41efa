//! One-phase Stefan problem on a chain: the front of melting moves as s = 2 λ √(α t).

use stagger_physics::thermal::{PhaseChange, Phases, Settings, Solver, Thermal};

use super::{
    Contacts, HEAT_CAPACITY_J_KG_K, Physics as _, RADIUS_M, SOLVERS, TIME_S, block, enthalpy, settings, solve, wall,
};

/// λ e^{λ²} erf λ = Ste/√π with Ste = 0.1 (Neumann's solution; Alexiades & Solomon 1993, section 2.1).
const LAMBDA: f64 = 0.220_016;
const MELTING_K: f64 = 1000.0;
/// The wall is 50 K hotter, and C·50 K is a tenth of the latent heat.
const WALL_K: f64 = 1050.0;
const LATENT_J_KG: f64 = HEAT_CAPACITY_J_KG_K * (WALL_K - MELTING_K) / 0.1;

/// λ from the molten length of a chain when the front should have passed `depth` particles, in `windows` steps.
fn lambda(solver: Solver, depth: u32, windows: u32, width_k: f64) -> f64 {
    let count = 2 * depth + 10;
    let mut enthalpy = enthalpy(solver);
    let melting = Some(PhaseChange { from_k: MELTING_K, width_k, latent_j_kg: LATENT_J_KG });
    enthalpy.materials[0].phases = Some(Phases { melting, boiling: None });
    let thermal = Thermal::new(Settings {
        temperature_k: MELTING_K,
        walls: vec![wall(Some(WALL_K)), wall(None)],
        phi: 1.0,
        tolerance: 1e-9,
        iterations: 5000,
        enthalpy: Some(enthalpy),
        ..settings(count as usize)
    })
    .unwrap();
    let chain: Contacts = block(1, count);
    assert_eq!(chain.radii_m[0], RADIUS_M);
    let (mut state, _) = thermal.initial().unwrap();
    // α = G d²/(m C) = d²/TIME_S: lengths in distances of particles, times in TIME_S.
    let time = (f64::from(depth) / (2.0 * LAMBDA)).powi(2);
    let mut melted = 0.0;
    for _ in 0..windows {
        let (next, reply) = solve(&thermal, &state, &chain, &chain, time * TIME_S / f64::from(windows)).unwrap();
        assert!(reply.not_converged.is_none(), "{:?}", reply.figures);
        melted = reply.fields["melted"].f64().unwrap().iter().sum();
        state = next;
    }
    melted / (2.0 * time.sqrt())
}

#[test]
fn the_front_converges_to_neumanns_solution() {
    // The chain's error falls with the number of particles the front has passed, the step's with their time: both are
    // refined together, 4 n² windows for n particles.
    let errors = [5, 10, 20]
        .map(|depth| (lambda(Solver::ConjugateGradient, depth, 4 * depth * depth, 0.0) / LAMBDA - 1.0).abs());
    println!("one-phase Stefan, Ste 0.1: relative errors of λ {errors:?}");
    assert!(errors[2] < 5e-3, "{errors:?}");
    let order = (errors[0] / errors[2]).log2() / 2.0;
    assert!(order > 0.9, "order {order} of {errors:?}");
}

#[test]
fn both_solvers_and_a_narrow_band_find_the_same_front() {
    let [sweeps, gradients] = SOLVERS.map(|solver| lambda(solver, 8, 200, 0.0));
    // The tolerance is 1e-9 of 1050 K a window, a share of 2e-9 of the latent heat; 200 windows.
    assert!((sweeps / gradients - 1.0).abs() < 1e-5, "{sweeps}, {gradients}");
    let band = lambda(Solver::ConjugateGradient, 8, 200, 0.5);
    // A band of 1 % of the wall's excess shifts the front by about as much.
    assert!((band / gradients - 1.0).abs() < 2e-2, "{band}, {gradients}");
}
