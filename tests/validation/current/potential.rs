//! Kirchhoff's laws on networks whose resistance is known.

use std::f64::consts::PI;

use stagger_coupling::SolveError;
use stagger_physics::{
    common::{Conductance, walls::Electrode},
    current::{Conductivity, Current, Method, Model, Settings, Solver, State, Transition},
};

use super::network::{AVERAGING, Network, POTENTIAL, ampere, books, density, near, of, settings, solve, step, volt};

#[test]
fn a_chain_of_n_unit_contacts_has_resistance_n() {
    for contacts in [2, 3, 10, 100, 1000] {
        let n = f64::from(contacts);
        let chain = Network::chain(contacts);
        let count = chain.radii_m.len();
        // A relative residual of 1e-12 leaves at most that times the condition, 4 n²/π², in the currents.
        let tolerance = 1e-12 * n * n;
        let reply = solve(&settings(POTENTIAL, &[volt(5.0), volt(3.0)], count), &chain);
        let currents = of(&reply, "wall_current");
        assert!(near(currents[0], 2.0 / n, tolerance) && near(currents[1], -2.0 / n, tolerance), "{n}: {currents:?}");
        assert_eq!(of(&reply, "wall_current_density"), currents, "over an area of 1 m²");
        for (i, potential) in of(&reply, "potential").into_iter().enumerate() {
            assert!(near(potential, 5.0 - 2.0 * (i + 1) as f64 / n, tolerance), "{n}, particle {i}: {potential} V");
        }
        // All of the current passes through each particle's section.
        let section_m2 = PI * chain.radii_m[0].powi(2);
        assert!(of(&reply, "current_density").iter().all(|j| near(*j, 2.0 / n / section_m2, tolerance)));
        // Each contact turns I² into heat, half of it on each side; those with walls only heat the particle.
        let heat_w = 4.0 / (n * n);
        let halves: Vec<f64> = of(&reply, "joule_power").iter().map(|power_w| 2.0 * power_w / heat_w).collect();
        let ends = if count == 1 { 4.0 } else { 3.0 };
        assert!(near(halves[0], ends, tolerance) && near(halves[count - 1], ends, tolerance), "{halves:?}");
        assert!(halves[1..].iter().take(count.saturating_sub(2)).all(|half| near(*half, 2.0, tolerance)));

        // Driven by a current, the potential is what it takes.
        let reply = solve(&settings(POTENTIAL, &[volt(-1.0), ampere(0.5)], count), &chain);
        assert!(near(reply.figures["potential at wall-1 [V]"], 0.5 * n - 1.0, tolerance));
        assert!(near(reply.figures["current at wall-0 [A]"], -0.5, tolerance));
    }
}

/// Resistance between two neighbours in the middle of a square lattice of `side`² unit contacts each way.
fn square_lattice(side: u32) -> f64 {
    let at = |x: u32, y: u32| y * side + x;
    let mut lattice = Network::of((side * side) as usize);
    for y in 0..side {
        for x in 0..side {
            lattice.pairs.extend((x + 1 < side).then(|| (at(x, y), at(x + 1, y), 1.0, 1.0)));
            lattice.pairs.extend((y + 1 < side).then(|| (at(x, y), at(x, y + 1), 1.0, 1.0)));
        }
    }
    let middle = side / 2;
    let [a, b] = [at(middle - 1, middle), at(middle, middle)];
    lattice.walls = vec![(a, 0, 1.0, 1.0), (b, 1, 1.0, 1.0)];
    let reply = solve(&settings(POTENTIAL, &[ampere(1.0), volt(0.0)], lattice.radii_m.len()), &lattice);
    let potentials = of(&reply, "potential");
    potentials[a as usize] - potentials[b as usize]
}

#[test]
fn neighbours_in_an_infinite_square_lattice_have_resistance_one_half() {
    let sides = [8, 16, 32, 64];
    let errors = sides.map(|side| square_lattice(side) - 0.5);
    // What the edges reflect of a dipole falls off with the square of their distance.
    for (pair, side) in errors.windows(2).zip(sides) {
        let order = (pair[0] / pair[1]).log2();
        println!("square lattice of {side}: error {:.3e}, order {order:.3}", pair[0]);
        assert!((order - 2.0).abs() < 0.25, "{errors:?}");
    }
    assert!(errors[3].abs() < 5e-4, "{errors:?}");
    // The edges' next term falls off with the fourth power: extrapolated by the order, 1/2 to 1e-5.
    assert!(((4.0 * errors[3] - errors[2]) / 3.0).abs() < 1e-5, "{errors:?}");
}

#[test]
fn what_the_walls_give_is_what_becomes_heat() {
    let bed = Network::random(3000);
    let sets: [&[Electrode]; 3] = [&[volt(1.0), volt(0.0)], &[volt(1e5), volt(1e5 + 1e-3)], &[ampere(3.0), volt(-2.0)]];
    for electrodes in sets {
        for conductance in [Conductance::Monograph, Conductance::Constriction] {
            for method in [Method::ConjugateGradient, Method::Jacobi] {
                let base = settings(Model::Potential { conductance }, electrodes, 3000);
                let solver = Solver { method, iterations: 1_000_000, ..base.solver };
                let reply = solve(&Settings { solver, ..base }, &bed);
                let [electrical_j, joule_j] = books(&reply);
                // The books differ by Σ V r, and the currents by Σ r: at most √3000 · 1e-12 ‖b‖ with ‖b‖ = √300 · 2 A, over 3 A.
                // Potentials of 1e5 V whose difference is 1e-3 V have eight digits less.
                let tolerance = if electrodes[0] == volt(1e5) { 1e-6 } else { 1e-9 };
                println!("{method:?}, {conductance:?}: imbalance {:.1e}", joule_j / electrical_j - 1.0);
                assert!(electrical_j > 0.0 && near(joule_j, electrical_j, tolerance), "{electrical_j} {joule_j}");
                let currents = of(&reply, "wall_current");
                assert!((currents[0] + currents[1]).abs() < tolerance * currents[0].abs(), "{currents:?}");
                assert!(of(&reply, "joule_power").iter().all(|power| *power >= 0.0));
                // No potential is beyond those of the walls, but for rounding.
                let ends = ["wall-0", "wall-1"].map(|wall| reply.figures[&format!("potential at {wall} [V]")]);
                let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                let slack = 1e-9 * high.abs().max(1.0);
                assert!(of(&reply, "potential").iter().all(|v| (low - slack..=high + slack).contains(v)));
            }
        }
    }
}

#[test]
fn what_nothing_connects_carries_exactly_nothing() {
    // 0 – 1 between the walls; 2 – 3 at wall 0 alone; 4 – 5 afloat; 6 touches by an area of 0; 7 touches an insulated wall.
    let mut islands = Network::of(8);
    islands.pairs = vec![(0, 1, 1.0, 1.0), (2, 3, 1.0, 1.0), (4, 5, 1.0, 1.0), (6, 1, 0.0, 1.0)];
    islands.walls = vec![(0, 0, 1.0, 1.0), (1, 1, 1.0, 1.0), (2, 0, 1.0, 1.0), (6, 1, 0.0, 1.0), (7, 2, 1.0, 1.0)];
    let electrodes = [volt(9.0), volt(0.0), Electrode::default(), volt(4.0)];
    let reply = solve(&settings(POTENTIAL, &electrodes, 8), &islands);
    assert_eq!(of(&reply, "potential")[2..], [9.0, 9.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(of(&reply, "joule_power")[2..], [0.0; 6]);
    assert_eq!(of(&reply, "current_density")[2..], [0.0; 6]);
    assert!(near(of(&reply, "wall_current")[0], 3.0, 1e-11));
    assert_eq!(of(&reply, "wall_current")[2], 0.0, "an electrified wall that nothing touches");
    assert_eq!(reply.figures["floating particles"].to_bits(), 4f64.to_bits());

    // Electrodes with no way between them, or nowhere for a current to go, are normal states.
    let mut apart = Network::of(3);
    apart.walls = vec![(0, 0, 1.0, 1.0), (2, 1, 1.0, 1.0)];
    for electrodes in [[volt(9.0), volt(0.0)], [volt(9.0), ampere(2.0)], [ampere(-2.0), ampere(2.0)]] {
        for network in [&apart, &Network::of(3), &Network::of(0)] {
            let reply = solve(&settings(POTENTIAL, &electrodes, network.radii_m.len()), network);
            assert_eq!(books(&reply), [0.0, 0.0]);
            assert_eq!(of(&reply, "wall_current"), [0.0, 0.0]);
            assert!(of(&reply, "potential").iter().all(|v| *v == 0.0 || *v == 9.0));
            assert!(reply.fields.values().all(|field| field.first_not_finite().is_none()));
            assert_eq!(reply.figures["iterations"].to_bits(), 0);
        }
    }
}

/// A rod of length 1 and section 1 as `count` equal pieces in a row, whose temperature rises along it.
fn rod_resistance(count: u32) -> f64 {
    let n = f64::from(count);
    let transition = Transition { gain: 3.0, rate: 0.02, reference: 600.0 };
    let mut rod = Network::of(count as usize);
    rod.pairs = (1..count).map(|i| (i - 1, i, 1.0, 1.0 / n)).collect();
    rod.walls = vec![(0, 0, 1.0, 0.5 / n), (count - 1, 1, 1.0, 0.5 / n)];
    rod.temperatures_k = (0..count).map(|i| 400.0 + 500.0 * (f64::from(i) + 0.5) / n).collect();
    let base = settings(POTENTIAL, &[volt(1.0), volt(0.0)], count as usize);
    let conductivity = Conductivity { by_temperature: Some(transition), ..Conductivity::constant(2.0) };
    let reply = solve(&Settings { conductivity, ..base }, &rod);
    of(&reply, "wall_current")[0].recip()
}

#[test]
fn a_rod_of_varying_conductivity_converges_with_the_square_of_its_pieces() {
    // ∫ dx/σ with u = γ(θ − θ_R) from −4 to 6: 1/σ = (1 + e^{−u})/(σ_R (1 + K + e^{−u})), whose primitive in u is
    // [u − K/(1+K) ln((1+K) e^u + 1)]/σ_R; x runs over 1 while u runs over 10.
    let primitive = |u: f64| u - 0.75 * (4.0 * u.exp() + 1.0).ln();
    let exact = (primitive(6.0) - primitive(-4.0)) / 2.0 / 10.0;
    let errors = [25, 50, 100, 200].map(|count| (rod_resistance(count) - exact).abs());
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        println!("rod: error {:.3e}, order {order:.3}", pair[0]);
        assert!((order - 2.0).abs() < 0.1, "{errors:?}");
    }
}

#[test]
fn a_field_that_changes_the_conductivity_is_the_one_that_flows() {
    // One particle: σ follows from its own J/σ.
    let transition = Transition { gain: 1.0, rate: 0.7, reference: 0.5 };
    let conductivity = Conductivity { by_field: Some(transition), ..Conductivity::constant(2.0) };
    let single = Network::chain(2);
    let base = settings(POTENTIAL, &[volt(2.0), volt(0.0)], 1);
    let current = Current::new(Settings { conductivity, ..base.clone() }).unwrap();
    let (state, reply) = step(&current, &State::default(), &single).unwrap();
    // Two contacts in a row by A/d = 1: I = ½ σ ΔV, so that σ is the current.
    let sigma = of(&reply, "wall_current")[0];
    let field = of(&reply, "current_density")[0] / sigma;
    assert!(near(sigma, conductivity.at(300.0, field), 1e-8), "{sigma} at {field} V/m");
    assert!(sigma > 2.2, "the transition is felt: {sigma} S/m");
    // The next window begins where this one ended.
    let again = step(&current, &state, &single).unwrap().1;
    assert!(again.figures["iterations"] <= 1.0 && near(of(&again, "wall_current")[0], sigma, 1e-8));

    // More conductive above 0.5 V/m, at which the current given needs less: it flips for ever, and says so.
    let steep = Transition { gain: 1.0, rate: 1e4, reference: 0.5 };
    let conductivity = Conductivity { by_field: Some(steep), ..Conductivity::constant(2.0) };
    let averaging = settings(AVERAGING, &[density(1.2), density(1.2)], 3);
    let current = Current::new(Settings { conductivity, ..averaging }).unwrap();
    let error = step(&current, &State::default(), &Network::chain(4)).unwrap_err();
    assert!(matches!(error, SolveError::Unsolved(_)) && error.to_string().contains("[current.by-field]"), "{error}");
}

#[test]
fn settings_outside_their_range_are_refused_and_too_few_iterations_told() {
    let base = settings(POTENTIAL, &[volt(1.0), volt(0.0)], 99);
    let both = Electrode { current_a: Some(1.0), ..volt(1.0) };
    let fall = Transition { gain: -0.6, rate: 1.0, reference: 300.0 };
    for bad in [
        Settings { conductivity: Conductivity::constant(0.0), ..base.clone() },
        Settings {
            conductivity: Conductivity { reference_s_m: 1.0, by_temperature: Some(fall), by_field: Some(fall) },
            ..base.clone()
        },
        Settings { ends_s: 0.0, ..base.clone() },
        Settings { solver: Solver { tolerance: f64::NAN, ..base.solver }, ..base.clone() },
        settings(POTENTIAL, &[both], 1),
        settings(POTENTIAL, &[volt(f64::INFINITY)], 1),
        settings(Model::Averaging { heat_share: 1.5 }, &[], 1),
    ] {
        assert!(matches!(Current::new(bad).err(), Some(SolveError::Start(_))));
    }
    let current = Current::new(Settings { solver: Solver { iterations: 5, ..base.solver }, ..base }).unwrap();
    let error = step(&current, &State::default(), &Network::chain(100)).unwrap_err();
    assert!(!error.retry() && error.to_string().contains("99 unknowns"), "{error}");
    let mut overlapping = Network::chain(100);
    overlapping.pairs[3].3 = 0.0;
    let error = step(&current, &State::default(), &overlapping).unwrap_err();
    assert!(error.retry() && error.to_string().contains("`contact_distance` is 0 in row 3"), "{error}");
}
