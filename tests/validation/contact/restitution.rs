//! Normal damping: what is left of the speed, at any speed and with any law.

use std::f64::consts::PI;

use super::bed::*;
use stagger_coupling::Physics;
use stagger_messages::energy::Kind;
use stagger_physics::particles::{ContactLaw, Integrator, Particles, Settings};

const RADIUS: f64 = 0.05;
const DENSITY: f64 = 2000.0;
const LINEAR: ContactLaw = ContactLaw::Linear { stiffness_n_m: 1e6 };
const HERTZ: ContactLaw = ContactLaw::Hertz { young_pa: 1e9, poisson: 0.25 };

/// A sphere that begins to touch the floor, or another one that comes as fast from the other side.
fn impact(law: ContactLaw, speed: f64, with_floor: bool) -> Settings {
    let up = ([0.0, 0.0, RADIUS], [0.0, 0.0, -speed], RADIUS);
    let down = ([0.0, 0.0, -RADIUS], [0.0, 0.0, speed], RADIUS);
    let spheres = if with_floor { vec![up] } else { vec![up, down] };
    let walls = if with_floor { vec![floor()] } else { Vec::new() };
    Settings { walls, ..settings(law, DENSITY, &spheres) }
}

/// Shares of the speed and of the kinetic energy that are left, and of the energy that is booked as lost to damping, after
/// a contact in `substeps` or more substeps.
fn rebound(mut settings: Settings, speed: f64, substeps: f64) -> [f64; 3] {
    // The contact time of the elastic sphere from the automatic substep, which is 1/25 of it.
    let automatic = Particles::new(settings.clone()).unwrap();
    let probe = run(&automatic, 1, 1e-9, |_, _| ()).1;
    let contact_s = probe.figures["shortest contact time over substep"] * probe.figures["substep [s]"];
    settings.integrator = Integrator::Verlet { substep_s: Some(contact_s / substeps) };
    let particles = Particles::new(settings).unwrap();
    let before = energy(&particles.initial().unwrap().1, Kind::Stored);
    let mut damped = 0.0;
    // Damping makes a contact longer, here not over thrice.
    let (_, reply) = run(&particles, 1, 3.0 * contact_s, |_, reply| damped += entry(reply, "contact_damping"));
    assert_eq!(reply.fields["wall_contact_area"].rows() + reply.fields["contact_area"].rows(), 0);
    [field(&reply, "velocities")[2] / speed, entry(&reply, "kinetic") / before, damped / before]
}

/// Bound of what Verlet adds to a restitution e in n substeps: a damping force 2ζω v that jumps where the contact begins
/// and ends may be seen up to a substep (π/ω)/n late or early at either end.
fn jump(restitution: f64, substeps: f64) -> f64 {
    let logarithm = f64::ln(restitution);
    let damping_ratio = -logarithm / PI.hypot(logarithm);
    4.0 * damping_ratio * PI / substeps
}

#[test]
fn a_linear_contact_with_a_damping_ratio_of_0_215454_leaves_half_the_speed() {
    assert!((jump(0.5, 4.0 * PI) - 0.215_454).abs() < 5e-7);
    for with_floor in [true, false] {
        for speed in [0.01, 0.3, 5.0] {
            let mut settings = impact(LINEAR, speed, with_floor);
            settings.contact.restitution = Some(0.5);
            for substeps in [500.0, 4000.0] {
                let [speed_left, ..] = rebound(settings.clone(), speed, substeps);
                close(speed_left, 0.5, jump(0.5, substeps));
            }
        }
    }
}

#[test]
fn every_law_and_speed_leaves_the_restitution_that_is_set() {
    let overlap = ContactLaw::Overlap { stiffness_pa: 1e12, exponent: 2.0 };
    let flatter = ContactLaw::Overlap { stiffness_pa: 1e10, exponent: 1.0 };
    // The overlap law is a power of the overlap δ only while that is small: here it is up to 8e-3 of the radius, and the
    // law's next term δ/(4R). Without a jump Verlet's error is of second order.
    for (law, departs) in [(LINEAR, 0.0), (HERTZ, 1e-4), (overlap, 1e-3), (flatter, 1e-3)] {
        for restitution in [0.95, 0.5, 0.1] {
            for speed in [1e-3, 0.03, 1.0] {
                for with_floor in [true, false] {
                    let mut settings = impact(law, speed, with_floor);
                    settings.contact.restitution = Some(restitution);
                    let [speed_left, energy_left, damped] = rebound(settings, speed, 4000.0);
                    let jump = if law == LINEAR { jump(restitution, 4000.0) } else { 0.0 };
                    close(speed_left, restitution, departs + jump);
                    // The balance is of second order: (π/4000)² is 6e-7.
                    close(energy_left + damped, 1.0, 2e-6);
                }
            }
        }
    }
}

#[test]
fn the_damping_constant_takes_what_first_order_theory_gives() {
    // A linear spring with the damping c A, A = 2πRδ: over δ = (v/ω) sin ωt the damping takes
    // ∫ 2πR c δ δ̇² dt = (4π/3) R c v³/ω², of ½ m v² a share of (8π/3) R c v/k.
    let (stiffness, speed, share) = (1e6, 0.01, 1e-3);
    let mut settings = impact(LINEAR, speed, true);
    settings.contact.damping_n_s_m3 = share * stiffness / (8.0 / 3.0 * PI * RADIUS * speed);
    let [speed_left, _, damped] = rebound(settings, speed, 4000.0);
    // The next order is as large as the share itself.
    close(damped, share, 2.0 * share);
    close(1.0 - speed_left * speed_left, share, 2.0 * share);
}
