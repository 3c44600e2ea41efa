//! Speeds and steps far out of range.

use stagger_coupling::{Frozen, Physics, Window};
use stagger_physics::particles::{Integrator, Particles, Settings};

use crate::{bed::*, outcome::*};

#[test]
fn a_step_far_too_large_is_cut_or_refused_and_never_wrong() {
    for integrator in [
        VERLET,
        TRAPEZOIDAL,
        Integrator::Verlet { substep_s: Some(1.0) },
        Integrator::Verlet { substep_s: Some(1e300) },
    ] {
        for law in laws(1e6) {
            for dt_s in [1e-1, 1e2, 1e6, 1e300] {
                let spheres = collision(0.05, 0.5, 1e-3);
                let settings = Settings { integrator, ..settings(law, 2000.0, &spheres) };
                // As the coordinator cuts them.
                let ran = outcome(&settings, &spheres, dt_s, 0.1).ran();
                assert!(ran.drift < 1e-13, "{law:?} {dt_s:e} {integrator:?}: {:e}", ran.drift);
                // Where the scene sets the substep, a contact has three at least, good to some per cent of its energy. For the
                // trapezoidal rule the scene's step is the only one, and so coarse a contact's energy is as wrong as it says.
                let bound = match integrator {
                    Integrator::Verlet { substep_s: None } => 2e-2,
                    Integrator::Verlet { .. } => 0.1,
                    _ => 2.0,
                };
                assert!(ran.imbalance < bound, "{law:?} {dt_s:e} {integrator:?}: {:e}", ran.imbalance);
                let velocities = field(&ran.reply, "velocities");
                assert!(velocities[0] < 0.0 && velocities[3] > 0.0, "they have met: {velocities:?}");
            }
            // Asked for whole, a window of 1e300 s is not solved.
            let settings = Settings { integrator, ..settings(law, 2000.0, &collision(0.05, 0.5, 1e-3)) };
            let particles = Particles::new(settings).unwrap();
            let (state, _) = particles.initial().unwrap();
            let (_, reply) = particles.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s: 1e300 }).unwrap();
            check(&reply);
            assert!(reply.not_converged.is_some(), "{law:?} {integrator:?}");
        }
    }
}

#[test]
fn a_window_that_is_no_length_is_refused_by_name() {
    let particles = Particles::new(settings(OVERLAP, 2000.0, &collision(0.05, 0.5, 1e-3))).unwrap();
    let (state, _) = particles.initial().unwrap();
    for dt_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let cause = particles.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s }).unwrap_err().to_string();
        assert!(cause.contains("cannot be solved"), "{cause}");
    }
}

#[test]
fn speeds_from_hardly_any_to_those_that_no_energy_holds() {
    for integrator in INTEGRATORS {
        for law in laws(1e8) {
            for speed in [1e-200, 1e-100, 1e-9, 1e-3, 1.0, 1e3] {
                let spheres = collision(0.05, speed, 0.0);
                let settings = Settings { integrator, ..settings(law, 2000.0, &spheres) };
                // The square of the smallest underflows: nothing moves as far as energy is concerned.
                let dt_s = contact_s(&settings).map_or(1e-2, |contact_s| contact_s / 40.0);
                match outcome(&settings, &spheres, dt_s, 120.0 * dt_s) {
                    Outcome::Ran(ran) => assert!(
                        ran.imbalance < 5e-2 && ran.drift < 1e-13,
                        "{law:?} {speed:e} {integrator:?}: {:e} {:e}",
                        ran.imbalance,
                        ran.drift
                    ),
                    Outcome::Refused(cause) => panic!("{law:?} {speed:e} {integrator:?}: {cause}"),
                }
            }
            for speed in [1e160, 1e200, 1e308] {
                let spheres = collision(0.05, 1.0, 1e-3);
                let mut spheres = [spheres[0], spheres[1], ([7.0, 0.0, 0.0], [0.0, speed, 0.0], 0.05)];
                let cause = outcome(&Settings { integrator, ..settings(law, 2000.0, &spheres) }, &spheres, 1e-3, 1e-2)
                    .refused();
                assert!(cause.contains("`kinetic energy` is inf in row 2"), "{speed:e}: {cause}");
                // Which one is told whatever the order.
                spheres.swap(0, 2);
                let cause = outcome(&Settings { integrator, ..settings(law, 2000.0, &spheres) }, &spheres, 1e-3, 1e-2)
                    .refused();
                assert!(cause.contains("in row 0"), "{speed:e}: {cause}");
            }
        }
    }
}

#[test]
fn a_particle_too_fast_for_any_step_is_refused_by_what_it_asks_for() {
    // 1e100 m/s is a finite energy, but 1e105 radii in a microsecond.
    for integrator in INTEGRATORS {
        let spheres = [([0.0; 3], [1e100, 0.0, 0.0], 0.05)];
        let settings = Settings { integrator, ..settings(laws(1e8)[0], 2000.0, &spheres) };
        let particles = Particles::new(settings).unwrap();
        let (state, _) = particles.initial().unwrap();
        let (_, reply) = particles.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s: 1e-6 }).unwrap();
        check(&reply);
        assert!(reply.not_converged.is_some(), "{integrator:?}");
    }
}
