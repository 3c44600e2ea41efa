//! What a window books: means, switching, warm starts, particles that come and go.

use stagger_coupling::{Frozen, Physics, Window};
use stagger_physics::current::{Conductivity, Current, Settings, State, Transition};

use super::network::{Network, POTENTIAL, WINDOW, books, fields, near, of, settings, solve, step, volt};

/// Heat in J of one second in `windows` windows, in which the contacts' areas grow as e^t.
fn heat_of_growing_contacts(windows: u32) -> f64 {
    let current = Current::new(settings(POTENTIAL, &[volt(1.0), volt(0.0)], 4)).unwrap();
    let at = |k: u32| {
        let mut chain = Network::chain(5);
        let area_m2 = (f64::from(k) / f64::from(windows)).exp();
        chain.pairs.iter_mut().chain(&mut chain.walls).for_each(|contact| contact.2 = area_m2);
        fields(&current, &chain)
    };
    let (mut state, mut heat_j) = (State::default(), 0.0);
    for k in 0..windows {
        let dt_s = f64::from(windows).recip();
        let window = Window { t_s: f64::from(k) * dt_s, dt_s };
        let (next, reply) = current.solve(&state, &Frozen { start: at(k), end: at(k + 1) }, window).unwrap();
        heat_j += books(&reply)[1];
        state = next;
    }
    heat_j
}

#[test]
fn heat_over_time_is_second_order_in_the_window() {
    // V²/R with R = 5 e^{−t}.
    let exact_j = (1f64.exp() - 1.0) / 5.0;
    let errors = [4, 8, 16].map(|windows| (heat_of_growing_contacts(windows) - exact_j).abs());
    for pair in errors.windows(2) {
        assert!(((pair[0] / pair[1]).log2() - 2.0).abs() < 0.02, "{errors:?}");
    }
}

#[test]
fn a_current_that_is_switched_heats_for_its_share_of_the_window() {
    let chain = Network::chain(4);
    let base = settings(POTENTIAL, &[volt(2.0), volt(0.0)], 3);
    let current = Current::new(Settings { starts_s: 0.25, ends_s: 2.5, ..base }).unwrap();
    let end = fields(&current, &chain);
    let frozen = Frozen { start: end.clone(), end };
    let (mut state, mut shares, mut on) = (State::default(), Vec::new(), Vec::new());
    for t_s in [-1.0, 0.0, 1.0, 2.0, 3.0] {
        let (next, reply) = current.solve(&state, &frozen, Window { t_s, dt_s: 1.0 }).unwrap();
        let [electrical_j, joule_j] = books(&reply);
        assert!((electrical_j - joule_j).abs() < 1e-12);
        shares.push(joule_j);
        on.push(of(&reply, "wall_current")[0]);
        state = next;
    }
    // 2 V over four unit contacts in a row: 1 W.
    let exact = [0.0, 0.75, 1.0, 0.5, 0.0];
    assert!(shares.iter().zip(exact).all(|(share, exact)| (share - exact).abs() < 1e-11), "{shares:?}");
    assert!(near(on[1], 0.5, 1e-11) && near(on[2], 0.5, 1e-11));
    assert_eq!([on[0], on[3], on[4]], [0.0; 3], "at the window's end");
}

#[test]
fn the_last_solution_is_the_next_start() {
    let current = Current::new(settings(POTENTIAL, &[volt(1.0), volt(0.0)], 3000)).unwrap();
    let mut bed = Network::random(3000);
    let (state, first) = step(&current, &State::default(), &bed).unwrap();
    let again = step(&current, &state, &bed).unwrap().1;
    assert_eq!(again.figures["iterations"].to_bits(), 0);
    assert_eq!(of(&again, "potential"), of(&first, "potential"));
    // Contacts that change by a part in 1e8 need fewer iterations than a start from nothing.
    bed.pairs.iter_mut().for_each(|pair| pair.2 *= 1.0 + 1e-8 * f64::from(pair.0 % 3));
    let moved = step(&current, &state, &bed).unwrap().1;
    let cold = step(&current, &State::default(), &bed).unwrap().1;
    let [electrical_j, joule_j] = books(&moved);
    assert!(near(joule_j, electrical_j, 1e-9), "the residual from a warm start: {electrical_j} {joule_j}");
    assert!(moved.figures["iterations"] < 0.6 * cold.figures["iterations"], "{:?} {:?}", moved.figures, cold.figures);
}

#[test]
fn particles_that_come_and_go_keep_what_is_known_of_them() {
    let hot = Transition { gain: 3.0, rate: 0.1, reference: 500.0 };
    let conductivity = Conductivity { by_temperature: Some(hot), ..Conductivity::constant(1.0) };
    let base = settings(POTENTIAL, &[volt(1.0), volt(0.0)], 3);
    let base = Settings { conductivity, ..base };
    let current = Current::new(base.clone()).unwrap();
    let mut before = Network::chain(4);
    before.temperatures_k = vec![900.0, 300.0, 400.0];
    let (state, _) = step(&current, &State::default(), &before).unwrap();

    // Particle 1 leaves and particle 9 comes, in a row that nobody had; the temperatures are still those from before.
    let mut now = before.clone();
    now.ids = vec![2, 0, 9];
    now.revisions = [5, 0];
    let frozen = Frozen { start: fields(&current, &before), end: fields(&current, &now) };
    let (_, reply) = current.solve(&state, &frozen, WINDOW).unwrap();
    let mut same = Network::chain(4);
    // The new one has the temperature of the scene.
    same.temperatures_k = vec![400.0, 900.0, 300.0];
    let expected = solve(&base, &same);
    for (found, expected) in of(&reply, "joule_power").iter().zip(of(&expected, "joule_power")) {
        assert!(near(*found, expected, 1e-11), "{found} instead of {expected}");
    }
    // Without ids it cannot be known whose they are.
    let mut frozen = Frozen { start: fields(&current, &before), end: fields(&current, &now) };
    for fields in [&mut frozen.start, &mut frozen.end] {
        fields.remove("ids");
    }
    let error = current.solve(&State::default(), &frozen, WINDOW).unwrap_err().to_string();
    assert!(error.contains("`temperature` is of 3 particles at revision 0, but there are 3 at revision 5"), "{error}");
}
