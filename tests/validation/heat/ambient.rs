//! Convection and radiation to an ambient, against closed forms.

use std::f64::consts::PI;

use stagger_coupling::SolveError;
use stagger_physics::thermal::{Ambient, Enthalpy, Settings, Solver, Thermal};

use super::{
    CAPACITY_J_K, Contacts, RADIUS_M, SOLVERS, enthalpy, joule, observed_order, settings, solve, temperatures,
};

const STEFAN_BOLTZMANN: f64 = 5.670374419e-8;
const START_K: f64 = 2000.0;
const AREA: f64 = 4.0 * PI * RADIUS_M * RADIUS_M;

fn in_ambient(solver: Solver, phi: f64, ambient: Ambient) -> Thermal {
    let enthalpy = Some(Enthalpy { ambient: Some(ambient), ..enthalpy(solver) });
    Thermal::new(Settings { phi, enthalpy, ..settings(1) }).unwrap()
}

/// Temperature of a lone sphere of `START_K` after `time_s` in equal windows; asserts that what it loses is booked.
fn cooled(thermal: &Thermal, windows: u32, time_s: f64) -> f64 {
    let alone = Contacts { radii_m: vec![RADIUS_M], ..Contacts::default() };
    let mut state = thermal.state(vec![START_K]).unwrap();
    let (mut temperature_k, mut lost_j) = (START_K, 0.0);
    for _ in 0..windows {
        let (next, reply) = solve(thermal, &state, &alone, &alone, time_s / f64::from(windows)).unwrap();
        assert!(reply.not_converged.is_none());
        lost_j += joule(&reply.ledger, "convected") + joule(&reply.ledger, "radiated");
        (state, temperature_k) = (next, temperatures(&reply)[0]);
    }
    // Each window rounds m C θ.
    let rounding_j = 1e-15 * f64::from(windows) * CAPACITY_J_K * START_K;
    assert!((CAPACITY_J_K * (START_K - temperature_k) - lost_j).abs() < rounding_j);
    temperature_k
}

#[test]
fn convection_alone_decays_exponentially() {
    let ambient = Ambient { temperature_k: 400.0, convection_w_m2_k: 500.0, emissivity: 0.0, exposed: 0.5 };
    let time_s = CAPACITY_J_K / (500.0 * 0.5 * AREA);
    // Two of its times: 1600 K e⁻².
    let exact_k = 400.0 + 1600.0 * (-2.0_f64).exp();
    for solver in SOLVERS {
        for (phi, order) in [(0.0, 1.0), (0.5, 2.0), (1.0, 1.0)] {
            let thermal = in_ambient(solver, phi, ambient);
            let error = |windows| (cooled(&thermal, windows, 2.0 * time_s) - exact_k).abs();
            let observed = observed_order(error);
            assert!((observed - order).abs() < 0.06, "{solver:?}, φ = {phi}: order {observed}");
        }
        // λ² t Δt²/12 of 1600 K e⁻² with Δt = 2/1024: 1.4e-4 K.
        let thermal = in_ambient(solver, 0.5, ambient);
        assert!((cooled(&thermal, 1024, 2.0 * time_s) - exact_k).abs() < 2e-4);
    }
}

#[test]
fn radiation_to_nothing_falls_as_the_inverse_cube_root() {
    let ambient = Ambient { temperature_k: 0.0, convection_w_m2_k: 0.0, emissivity: 0.4, exposed: 1.0 };
    // θ̇ = −k θ⁴: θ = (θ₀⁻³ + 3 k t)^(−1/3); after 7/(3 k θ₀³) half of it is left.
    let rate = 0.4 * STEFAN_BOLTZMANN * AREA / CAPACITY_J_K;
    let time_s = 7.0 / (3.0 * rate * START_K.powi(3));
    for solver in SOLVERS {
        for (phi, order) in [(0.0, 1.0), (0.5, 2.0), (1.0, 1.0)] {
            let thermal = in_ambient(solver, phi, ambient);
            let error = |windows| (cooled(&thermal, windows, time_s) - 0.5 * START_K).abs();
            let observed = observed_order(error);
            // The next term of the error is larger than that of an exponential: k θ³ Δt is 1/27 at first.
            assert!((observed - order).abs() < 0.1, "{solver:?}, φ = {phi}: order {observed}");
        }
        let thermal = in_ambient(solver, 0.5, ambient);
        assert!((cooled(&thermal, 1024, time_s) - 0.5 * START_K).abs() < 5e-3);
    }
}

#[test]
fn a_step_of_any_length_ends_at_the_ambient_and_no_lower() {
    let ambient = Ambient { temperature_k: 500.0, convection_w_m2_k: 20.0, emissivity: 0.7, exposed: 1.0 };
    for solver in SOLVERS {
        for windows in [1, 3] {
            // A million times the time in which it cools, of which φ = 1 leaves 1500 K/(1 + 1.2·10⁶) in one window.
            let end_k = cooled(&in_ambient(solver, 1.0, ambient), windows, 1e6);
            assert!((end_k - 500.0).abs() < 2e-3, "{solver:?}: {end_k} K");
        }
    }
}

#[test]
fn settings_outside_their_range_are_refused() {
    let good = Ambient { temperature_k: 300.0, convection_w_m2_k: 1.0, emissivity: 0.5, exposed: 1.0 };
    for bad in [
        Ambient { temperature_k: -1.0, ..good },
        Ambient { convection_w_m2_k: f64::NAN, ..good },
        Ambient { emissivity: 1.1, ..good },
        Ambient { exposed: -0.1, ..good },
    ] {
        let enthalpy = Some(Enthalpy { ambient: Some(bad), ..enthalpy(Solver::FixedPoint) });
        assert!(matches!(Thermal::new(Settings { enthalpy, ..settings(1) }).err(), Some(SolveError::Start(_))));
    }
}
