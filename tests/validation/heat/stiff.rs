//! Steps far above the explicit limit, by both solvers.

use stagger_physics::thermal::{PhaseChange, Phases, Settings, Solver, Thermal};

use super::{SOLVERS, TIME_S, block, enthalpy, grown, joule, observed_order, settings, solve, temperatures, wall};

#[test]
fn the_trapezoidal_rule_has_its_order_with_both_solvers() {
    let exact = 300.0 * (-3.0_f64).exp();
    for solver in SOLVERS {
        for (phi, order) in [(0.5, 2.0), (1.0, 1.0), (0.0, 1.0)] {
            let thermal = Thermal::new(Settings { phi, enthalpy: Some(enthalpy(solver)), ..settings(2) }).unwrap();
            let observed = observed_order(|windows| (grown(&thermal, windows) - exact).abs());
            // As in temperature form.
            assert!((observed - order).abs() < 0.06, "{solver:?}, φ = {phi}: order {observed} instead of {order}");
        }
    }
}

/// The explicit limit of the block: its stiffest particle has six contacts, 2/(λ_max) = TIME_S/6.
const EXPLICIT_LIMIT_S: f64 = TIME_S / 6.0;

#[test]
fn a_thousand_explicit_limits_in_one_step_take_few_iterations_and_the_two_solvers_agree() {
    let (side, layers) = (6, 20);
    let bed = block(side, layers);
    let of = |solver| {
        let walls = vec![wall(Some(500.0)), wall(Some(300.0))];
        let enthalpy = Some(enthalpy(solver));
        let of = Settings { walls, enthalpy, phi: 1.0, tolerance: 1e-11, ..settings((side * side * layers) as usize) };
        Thermal::new(Settings { iterations: 100_000, ..of }).unwrap()
    };
    let [sweeps, gradients] = SOLVERS.map(|solver| {
        let thermal = of(solver);
        let state = thermal.state(vec![300.0; (side * side * layers) as usize]).unwrap();
        solve(&thermal, &state, &bed, &bed, 1000.0 * EXPLICIT_LIMIT_S).unwrap().1
    });
    assert!(sweeps.not_converged.is_none() && gradients.not_converged.is_none());
    // Each is within twice its tolerance of the solution (see `trapezoidal`).
    for (a, b) in temperatures(&sweeps).iter().zip(temperatures(&gradients)) {
        assert!((a - b).abs() < 4e-11 * 500.0, "{a}, {b}");
    }
    let (many, few) = (sweeps.figures["iterations"], gradients.figures["iterations"]);
    let linear = gradients.figures["linear iterations"];
    println!("1000 explicit limits: {many} sweeps; {few} iterations of Newton's with {linear} of conjugate gradients");
    // Linear equations: one step and its check, or a second where rounding asks for it. √κ = √(1 + 2·166·6…) ≈ 45.
    assert!(few <= 3.0 && linear < 150.0 && many > 1000.0, "{many}, {few}, {linear}");
}

#[test]
fn one_huge_step_is_the_steady_profile() {
    let chain = block(1, 30);
    let walls = vec![wall(Some(500.0)), wall(Some(300.0))];
    let enthalpy = Some(enthalpy(Solver::ConjugateGradient));
    let of = Settings { walls, enthalpy, phi: 1.0, tolerance: 1e-9, ..settings(30) };
    let thermal = Thermal::new(of).unwrap();
    let state = thermal.state(vec![300.0; 30]).unwrap();
    let (_, reply) = solve(&thermal, &state, &chain, &chain, 1e8 * TIME_S).unwrap();
    assert!(reply.not_converged.is_none(), "{:?}", reply.figures);
    for (z, temperature) in temperatures(&reply).iter().enumerate() {
        let expected = 500.0 - 200.0 * (z as f64 + 0.5) / 30.0;
        // The transient has decayed by (π/30)²·10⁸ to 2e-4 K. Eight roundings of the heat that passes, 4·10⁸ times m C θ, are
        // as much again.
        assert!((temperature - expected).abs() < 6e-4, "layer {z}: {temperature} K instead of {expected} K");
    }
}

#[test]
fn newton_ends_while_fronts_of_melting_and_boiling_cross_the_bed_in_one_step() {
    let (side, layers) = (4, 25);
    let bed = block(side, layers);
    let count = (side * side * layers) as usize;
    for widths_k in [[0.0, 0.0], [1e-3, 1e-3], [50.0, 50.0]] {
        let mut enthalpy = enthalpy(Solver::ConjugateGradient);
        enthalpy.materials[0].phases = Some(Phases {
            melting: Some(PhaseChange { from_k: 1600.0, width_k: widths_k[0], latent_j_kg: 2.6e5 }),
            boiling: Some(PhaseChange { from_k: 3000.0, width_k: widths_k[1], latent_j_kg: 6e6 }),
        });
        let walls = vec![wall(Some(5000.0)), wall(Some(300.0))];
        let of = Settings { walls, phi: 1.0, tolerance: 1e-9, enthalpy: Some(enthalpy), ..settings(count) };
        let thermal = Thermal::new(of).unwrap();
        let mut state = thermal.state(vec![300.0; count]).unwrap();
        let (mut stored_j, mut most) = (0.0, 0.0_f64);
        for _ in 0..5 {
            let (next, reply) = solve(&thermal, &state, &bed, &bed, 1000.0 * EXPLICIT_LIMIT_S).unwrap();
            assert!(reply.not_converged.is_none(), "{widths_k:?}: {:?}", reply.figures);
            most = most.max(reply.figures["iterations"]);
            let now_j = joule(&reply.ledger, "heat") + joule(&reply.ledger, "latent");
            let in_j = -joule(&reply.ledger, "to_walls") - joule(&reply.ledger, "missed");
            // 400 particles of some 10 µJ, each rounded a few times; what passes the walls is larger.
            assert!((now_j - stored_j - in_j).abs() < 1e-13 * (now_j.abs() + in_j.abs()), "{now_j} {stored_j} {in_j}");
            (state, stored_j) = (next, now_j);
        }
        println!("fronts through 25 layers, bands {widths_k:?} K: at most {most} iterations of Newton's");
        assert!(most < 100.0);
    }
}
