//! The parameters of the laws over decades.

use stagger_physics::{
    common::{Shape, Wall},
    particles::{Friction, Integrator, Settings},
};

use crate::{bed::*, outcome::*};

#[test]
fn stiffness_over_ten_decades() {
    for integrator in INTEGRATORS {
        for stiffness in [1e2, 1e4, 1e6, 1e8, 1e10, 1e12] {
            for law in laws(stiffness) {
                let spheres = collision(0.05, 0.5, 1e-5);
                let settings = Settings { integrator, ..settings(law, 2000.0, &spheres) };
                let ran = resolved(&settings, &spheres, 4.0, 2e-5).ran();
                assert!(ran.imbalance < 2e-2, "{law:?} {integrator:?}: {:e}", ran.imbalance);
                assert!(ran.drift < 1e-13, "{law:?} {integrator:?}: {:e}", ran.drift);
            }
        }
    }
}

#[test]
fn restitution_from_nearly_none_to_all() {
    for integrator in INTEGRATORS {
        for law in laws(1e7) {
            for restitution in [1e-300, 1e-6, 1e-2, 1.0] {
                let spheres = [([0.0, 0.0, 0.051], [0.0, 0.0, -1.0], 0.05)];
                let mut settings = Settings { integrator, ..settings(law, 2000.0, &spheres) };
                settings.contact.restitution = Some(restitution);
                settings.walls = vec![floor()];
                let ran = resolved(&settings, &spheres, 5.0, 1e-3).ran();
                let speed = field(&ran.reply, "velocities")[2];
                assert!(ran.imbalance < 2e-2, "{law:?} {restitution:e} {integrator:?}: {:e}", ran.imbalance);
                if restitution == 1.0 {
                    assert!((speed - 1.0).abs() < 1e-2, "{law:?} {integrator:?}: {speed} m/s");
                } else {
                    assert!(speed.abs() < 0.2, "{law:?} {restitution:e} {integrator:?}: {speed} m/s");
                }
            }
        }
    }
}

#[test]
fn friction_of_any_stiffness_takes_energy_and_gives_none() {
    for integrator in INTEGRATORS {
        for stiffness_n_m3 in [0.0, 1.0, 1e6, 1e10, 1e300] {
            let spheres = collision(0.05, 0.5, 1e-5);
            let mut settings = Settings { integrator, ..settings(laws(1e7)[2], 2000.0, &spheres) };
            settings.friction =
                Some(Friction::Regularised { stiffness_n_m3, static_coefficient: 0.5, dynamic_coefficient: 0.4 });
            settings.spin = true;
            accept_or_refuse(&settings, &spheres, stiffness_n_m3 > 1e15);
        }
        for ratio in [1e-6, 1.0, 1e3, 1e6] {
            let spheres = collision(0.05, 0.5, 1e-5);
            let mut settings = Settings { integrator, ..settings(laws(1e7)[2], 2000.0, &spheres) };
            settings.friction = Some(Friction::Spring {
                stiffness_ratio: Some(ratio),
                damping_ratio: Some(0.1),
                static_coefficient: 0.5,
                dynamic_coefficient: 0.4,
            });
            settings.spin = true;
            accept_or_refuse(&settings, &spheres, ratio > 1e5);
        }
    }
}

/// A collision keeps its energy and momentum, or, where no step may resolve it, is refused for that.
fn accept_or_refuse(settings: &Settings, spheres: &[Sphere], may_refuse: bool) {
    let Settings { friction, integrator, .. } = settings;
    match resolved(settings, spheres, 3.0, 2e-5) {
        Outcome::Ran(ran) => {
            assert!(ran.imbalance < 2e-2, "{friction:?} {integrator:?}: {:e}", ran.imbalance);
            assert!(ran.drift < 1e-13, "{friction:?} {integrator:?}: {:e}", ran.drift);
        }
        Outcome::Refused(cause) => {
            let named = cause.contains("asks for less") || cause.contains("substeps");
            assert!(may_refuse && named, "{friction:?} {integrator:?}: {cause}");
        }
    }
}

#[test]
fn a_particle_in_the_corner_of_many_walls() {
    // Pressed into six walls at once, and squeezed between two that overlap it by half its radius.
    let wall = |name: &str, at: [f64; 3], normal: [f64; 3]| Wall::fixed(name, Shape::plane(at, normal), None);
    for integrator in INTEGRATORS {
        for law in laws(1e7) {
            for gap in [0.099, 0.05] {
                let spheres = [([0.0; 3], [0.3, -0.2, 0.1], 0.05)];
                let mut settings = Settings { integrator, ..rich(law, 2000.0, &spheres) };
                settings.gravity_m_s2 = [3.0, -2.0, -9.0];
                settings.walls = (0..6)
                    .map(|side| {
                        let towards = if side % 2 == 0 { 1.0 } else { -1.0 };
                        let vector = |size: f64| std::array::from_fn(|axis| if axis == side / 2 { size } else { 0.0 });
                        wall(&format!("side {side}"), vector(-0.5 * gap * towards), vector(towards))
                    })
                    .collect();
                let ran = outcome(&settings, &spheres, 1e-4, 0.05).ran();
                // Three walls hold it; it may hang clear of the others.
                assert!(ran.reply.fields["wall_contact_area"].rows() >= 3, "{law:?} {integrator:?}");
                let at = field(&ran.reply, "positions");
                assert!(at.iter().all(|x| x.abs() < 0.01), "{law:?} {integrator:?}: {at:?}");
                assert!(ran.imbalance < 2e-2, "{law:?} {integrator:?}: {:e}", ran.imbalance);
            }
        }
    }
}

#[test]
fn without_gravity_what_rests_stays_to_the_last_bit() {
    for integrator in [VERLET, TRAPEZOIDAL, Integrator::Verlet { substep_s: Some(1e300) }] {
        let spheres = [([0.0; 3], [0.0; 3], 0.05), ([0.2, 0.0, 0.0], [0.0; 3], 0.05)];
        let settings = Settings { integrator, ..rich(laws(1e8)[0], 2000.0, &spheres) };
        let ran = outcome(&settings, &spheres, 1e6, 1e7).ran();
        assert_eq!(field(&ran.reply, "positions"), [0.0, 0.0, 0.0, 0.2, 0.0, 0.0]);
        assert_eq!(ran.cuts, 0);
    }
}
