//! The squeezed pair as two nodes.

use std::collections::BTreeMap;

use stagger_coupling::{Local, Participant};
use stagger_physics::{
    common::{Shape, Wall},
    particles::{Contact, ContactLaw, Integrator, Material, Particles, Settings as Motion, Start},
    thermal::{Conductance, Overshoot, Settings as Heat, Thermal},
};

use super::{
    monolithic::{DENSITY, GAP, HEAT, RADIUS, SOFTENING, START, STIFFNESS, State, WALLS, reference, trapezoidal},
    run, settings,
};

fn wall(name: &str, at: f64, normal: f64, temperature_k: f64) -> Wall {
    Wall::fixed(name, Shape::plane([at, 0.0, 0.0], [normal, 0.0, 0.0]), Some(temperature_k))
}

fn members(integrator: Integrator, phi: f64) -> BTreeMap<String, Box<dyn Participant>> {
    let walls = vec![wall("cold", 0.0, 1.0, WALLS[0]), wall("hot", GAP, -1.0, WALLS[1])];
    let start = Start::Given {
        positions_m: vec![[START[0], 0.0, 0.0], [START[1], 0.0, 0.0]],
        velocities_m_s: vec![[START[2], 0.0, 0.0], [START[3], 0.0, 0.0]],
        radii_m: vec![RADIUS; 2],
        materials: vec![0; 2],
        spins_rad_s: Vec::new(),
    };
    let material = Material { name: "matter".into(), density_kg_m3: DENSITY, stiffness: None, poisson: None };
    let law = ContactLaw::Overlap { stiffness_pa: STIFFNESS, exponent: 2.0 };
    let motion = Motion {
        seed: 0,
        temperature_k: START[4],
        contact: Contact {
            softening_rate: SOFTENING.0,
            softening_reference_k: SOFTENING.1,
            softening_floor_pa: 0.0,
            ..Contact::new(law)
        },
        gravity_m_s2: [0.0; 3],
        walls: walls.clone(),
        integrator,
        ..Motion::new(start, material, law)
    };
    let heat = Heat {
        count: 2,
        temperature_k: START[4],
        density_kg_m3: DENSITY,
        heat_capacity_j_kg_k: HEAT.1,
        conductivity_w_m_k: HEAT.0,
        conductance: Conductance::Monograph,
        walls,
        phi,
        solid: None,
        overshoot: Overshoot::Implicit,
        start: None,
        pour_temperature_k: None,
        enthalpy: None,
        tolerance: 1e-15,
        iterations: 1000,
    };
    BTreeMap::from([
        (
            "particles".to_owned(),
            Box::new(Local::new("particles", Particles::new(motion).unwrap())) as Box<dyn Participant>,
        ),
        ("thermal".to_owned(), Box::new(Local::new("thermal", Thermal::new(heat).unwrap()))),
    ])
}

fn staggered(phi: f64, duration_s: f64, steps: usize, tolerance: f64) -> State {
    // An increment of a window is some 1e-3 of a position, so that rounding shows at 1e-13 of it.
    let integrator = Integrator::Trapezoidal { phi, tolerance: 1e-12, iterations: 1000, anderson_depth: 0 };
    end(members(integrator, phi), duration_s, steps, tolerance)
}

fn end(members: BTreeMap<String, Box<dyn Participant>>, duration_s: f64, steps: usize, tolerance: f64) -> State {
    let (fields, decisions) = run(members, &settings(duration_s / steps as f64, tolerance, 60), duration_s);
    assert!(decisions.iter().all(|decision| decision.verdict() != stagger_messages::Verdict::Reject));
    let [x, v, t] = ["positions", "velocities", "temperature"].map(|name| fields[name].f64().unwrap());
    [x[0], x[3], v[0], v[3], t[0], t[1]]
}

/// Largest difference, with positions and velocities in m and m/s and temperatures in units of 100 K.
fn difference(a: &State, b: &State) -> f64 {
    (0..6).map(|i| (a[i] - b[i]).abs() / if i < 4 { 1.0 } else { 100.0 }).fold(0.0, f64::max)
}

const DURATION_S: f64 = 0.4;

#[test]
fn staggered_to_a_tight_tolerance_equals_one_solve_of_all_unknowns() {
    for phi in [0.5, 1.0] {
        let whole = trapezoidal(phi, DURATION_S, 40);
        // Each window stops at a change of 1e-11 of its increment or value (some 4 in units of 100 K), after which the
        // contraction (below 0.1) leaves a tenth of it; forty windows add to 2e-10 at the most.
        let tight = difference(&staggered(phi, DURATION_S, 40, 1e-11), &whole);
        assert!(tight < 2e-10, "φ = {phi}: {tight:e}");
        // And the tolerance is what decides: a loose one leaves a difference that is larger, and below it.
        let loose = difference(&staggered(phi, DURATION_S, 40, 1e-3), &whole);
        assert!(loose > 10.0 * tight && loose < 40.0 * 1e-3, "φ = {phi}: {loose:e}");
    }
}

#[test]
fn the_order_in_the_window_is_two_for_the_midpoint_and_one_for_backward_euler() {
    let exact = reference(DURATION_S, 40_000);
    for (phi, expected) in [(0.5, 2.0), (1.0, 1.0)] {
        let errors = [40, 80, 160].map(|steps| difference(&staggered(phi, DURATION_S, steps, 1e-11), &exact));
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            // The next term of the error is of the order Δt smaller, Δt ω being below 0.1.
            assert!((order - expected).abs() < 0.12, "φ = {phi}: order {order} from {errors:?}");
        }
    }
}

#[test]
fn verlet_substeps_with_interpolated_temperatures_keep_the_second_order_of_the_window() {
    let exact = reference(DURATION_S, 40_000);
    let errors = [20, 40, 80].map(|steps| {
        // Substeps far below the window, so that the window alone decides the error.
        let integrator = Integrator::Verlet { substep_s: Some(DURATION_S / 20_000.0) };
        difference(&end(members(integrator, 0.5), DURATION_S, steps, 1e-11), &exact)
    });
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 2.0).abs() < 0.15, "order {order} from {errors:?}");
    }
}
