//! No particle, one, many in one place, and sizes far apart.

use stagger_physics::particles::{ContactLaw, Friction, Particles, Rolling, Settings};

use crate::{bed::*, outcome::*};

#[test]
fn no_particle_and_a_lonely_one() {
    for integrator in INTEGRATORS {
        for law in laws(1e8) {
            let none = Settings { integrator, ..rich(law, 2000.0, &[]) };
            let ran = outcome(&none, &[], 1e-2, 5e-2).ran();
            assert!(ran.reply.fields.values().all(|field| field.rows() == 0));
            let one = [([0.0; 3], [1.0, -2.0, 0.0], 0.05)];
            let mut settings = Settings { integrator, ..rich(law, 2000.0, &one) };
            settings.gravity_m_s2 = [0.0, 0.0, -10.0];
            let ran = outcome(&settings, &one, 1e-2, 5e-2).ran();
            let at = field(&ran.reply, "positions");
            // A parabola, which both rules follow exactly.
            let expected = [0.05, -0.1, -0.5 * 10.0 * 0.0025];
            assert!((0..3).all(|axis| (at[axis] - expected[axis]).abs() < 1e-13), "{at:?}");
            assert!(ran.imbalance < 1e-13, "{:e}", ran.imbalance);
        }
    }
}

#[test]
fn particles_in_one_place_or_nearly_part_with_their_energy() {
    for integrator in INTEGRATORS {
        for law in laws(1e8) {
            for apart in [0.0, 1e-300, 1e-162, 1e-140, 1e-16] {
                let spheres = [([0.0; 3], [0.0; 3], 0.05), ([apart, 0.0, 0.0], [0.0; 3], 0.05)];
                let settings = Settings { integrator, ..settings(law, 2000.0, &spheres) };
                let ran = resolved(&settings, &spheres, 8.0, 0.0).ran();
                // Elastic: the whole depth is released, within either rule's error at 25 to 40 steps a contact.
                assert!(ran.imbalance < 1e-2, "{law:?} {apart:e} {integrator:?}: {:e}", ran.imbalance);
                assert!(ran.drift < 1e-14, "{law:?} {apart:e}: {:e}", ran.drift);
                assert_eq!(ran.reply.fields["contact_area"].rows(), 0, "{law:?} {apart:e}: they have parted");
            }
        }
    }
}

#[test]
fn a_million_particles_in_one_cell_are_refused_by_name() {
    let spheres: Vec<Sphere> = (0..1_000_000).map(|k| ([1e-9 * f64::from(k), 0.0, 0.0], [0.0; 3], 1.0)).collect();
    let cause = Particles::new(settings(laws(1e6)[0], 1000.0, &spheres)).unwrap_err().to_string();
    assert!(cause.contains("more than 1000 neighbours a particle"), "{cause}");
}

#[test]
fn three_hundred_particles_in_one_place_burst_apart() {
    let spheres: Vec<Sphere> = vec![([0.0; 3], [0.0; 3], 0.5); 300];
    for integrator in INTEGRATORS {
        let settings = Settings { integrator, ..settings(laws(1e6)[0], 1000.0, &spheres) };
        let ran = outcome(&settings, &spheres, 1e-3, 2e-2).ran();
        assert!(ran.drift < 1e-13, "{integrator:?}: {:e}", ran.drift);
        // The trapezoidal rule has windows as long as it converges in, a third of a contact: its error is a share of them.
        let bound = if integrator == VERLET { 1e-2 } else { 0.2 };
        assert!(ran.imbalance < bound, "{integrator:?}: {:e}", ran.imbalance);
    }
}

#[test]
fn a_crowd_that_resists_rolling_keeps_its_books() {
    // Hundreds in each other by more than their radius, at places and speeds of a sequence without pattern: each has so many
    // contacts that together they would turn it about, from step to step.
    let part = |k: u32, root: f64| (f64::from(k) * root.sqrt()).fract() - 0.5;
    for count in [30, 300] {
        let spheres: Vec<Sphere> = (0..count)
            .map(|k| {
                let at = [2.0, 3.0, 5.0].map(|root| 0.5 * part(k, root));
                (at, [7.0, 11.0, 13.0].map(|root| part(k, root)), 0.5)
            })
            .collect();
        let imbalance = |rolling: Option<f64>| {
            let mut settings = rich(laws(1e6)[2], 1000.0, &spheres);
            settings.rolling = rolling.map(|rolling| Rolling { rolling, torsion: rolling });
            outcome(&settings, &spheres, 1e-3, 2e-2).ran().imbalance
        };
        let without = imbalance(None);
        for coefficient in [0.1, 1.0, 10.0] {
            let with = imbalance(Some(coefficient));
            // Rolling resistance adds no error of its own; 20 % more or less is chance.
            assert!(with < 1.5 * without + 1e-3, "{count}, {coefficient}: {with:e}, without {without:e}");
        }
    }
}

#[test]
fn a_sphere_meets_one_a_thousand_or_a_million_times_smaller() {
    for integrator in INTEGRATORS {
        for radius in [1e-3, 1e-6] {
            // Stiff, as far as steps of a mass of 1e-14 kg can be counted.
            for law in laws(if radius < 1e-5 { 1e5 } else { 1e8 }) {
                // The larger one is as good as a wall.
                let spheres = [([0.0; 3], [0.0; 3], 1.0), ([0.0, 0.0, 1.0 + 1.5 * radius], [0.0, 0.0, -1.0], radius)];
                let settings = Settings { integrator, ..rich(law, 2000.0, &spheres) };
                let ran = resolved(&settings, &spheres, 6.0, 0.6 * radius).ran();
                let speed = field(&ran.reply, "velocities")[5];
                // The strain δ/(R_i + R_j) of the overlap laws hardly feels so small a sphere, which sinks in; 0.7 with the others.
                let sinks = matches!(law, ContactLaw::Overlap { .. });
                assert!(sinks || (0.6..0.8).contains(&speed), "{law:?} {radius:e} {integrator:?}: {speed} m/s");
                assert!(ran.drift < 1e-13, "{law:?} {radius:e} {integrator:?}: {:e}", ran.drift);
                assert!(ran.imbalance < 1e-2, "{law:?} {radius:e} {integrator:?}: {:e}", ran.imbalance);
            }
        }
    }
}

#[test]
fn far_from_the_origin_a_contact_is_what_it_is_there() {
    // 1e6 m away, positions are good to 1e-10 m, 1e-4 of the overlap.
    for integrator in INTEGRATORS {
        for law in laws(1e6) {
            for friction in [None, Some(SPRING)] {
                let end = |offset: f64| {
                    let mut spheres = collision(0.05, 0.5, 1e-3);
                    for sphere in &mut spheres {
                        sphere.0 = sphere.0.map(|x| x + offset);
                    }
                    let mut settings = Settings { integrator, ..settings(law, 2000.0, &spheres) };
                    (settings.friction, settings.spin) = (friction, friction.is_some());
                    let ran = resolved(&settings, &spheres, 4.0, 2e-3).ran();
                    assert!(ran.imbalance < 1e-2, "{law:?} {integrator:?} {offset:e}: {:e}", ran.imbalance);
                    field(&ran.reply, "velocities").to_vec()
                };
                let (near, far) = (end(0.0), end(1e6));
                let difference = near.iter().zip(&far).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // 1e-4 of what a spring of that overlap gives; windows are cut where they are by the same share.
                assert!(difference < 1e-2, "{law:?} {integrator:?} {friction:?}: {difference:e} m/s");
            }
        }
    }
}

#[test]
fn particles_at_rest_far_from_the_origin_converge() {
    // Their increments are below the rounding of where they are.
    let spheres: Vec<Sphere> = (0..8).map(|k| ([1e6 + 1.999e-3 * f64::from(k), 1e6, 1e6], [0.0; 3], 1e-3)).collect();
    let mut settings = Settings { integrator: TRAPEZOIDAL, ..settings(laws(1e6)[2], 2000.0, &spheres) };
    settings.contact.restitution = Some(0.5);
    settings.friction =
        Some(Friction::Regularised { stiffness_n_m3: 1e6, static_coefficient: 0.5, dynamic_coefficient: 0.4 });
    let ran = outcome(&settings, &spheres, 1e-6, 1e-4).ran();
    assert_eq!(ran.cuts, 0);
}
