//! Scenes of a few particles, and what is read out of their replies.

use std::f64::consts::FRAC_PI_3;

use stagger_coupling::{Frozen, Physics, Reply, Window};
use stagger_messages::energy::Kind;
use stagger_physics::{
    common::{Shape, Wall},
    particles::{Contact, ContactLaw, Integrator, LeverArm, Material, Particles, Settings, Start, State},
};

pub const OVERLAP: ContactLaw = ContactLaw::Overlap { stiffness_pa: 1e8, exponent: 2.0 };
pub const VERLET: Integrator = Integrator::Verlet { substep_s: None };

/// Position in m, velocity in m/s and radius in m of a particle.
pub type Sphere = ([f64; 3], [f64; 3], f64);

/// Elastic, frictionless particles in vacuum.
pub fn settings(law: ContactLaw, density_kg_m3: f64, particles: &[Sphere]) -> Settings {
    let start = Start::Given {
        positions_m: particles.iter().map(|particle| particle.0).collect(),
        velocities_m_s: particles.iter().map(|particle| particle.1).collect(),
        radii_m: particles.iter().map(|particle| particle.2).collect(),
        materials: vec![0; particles.len()],
        spins_rad_s: Vec::new(),
    };
    let material = Material { name: "matter".into(), density_kg_m3, stiffness: None, poisson: None };
    Settings {
        contact: Contact { softening_floor_pa: 0.0, ..Contact::new(law) },
        gravity_m_s2: [0.0; 3],
        // Closed forms are of spheres that hardly overlap; what the arm to the contact point keeps is in `conserved_motion`.
        lever_arm: LeverArm::Radius,
        integrator: VERLET,
        ..Settings::new(start, material, law)
    }
}

pub fn floor() -> Wall {
    Wall::fixed("floor", Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), None)
}

pub fn mass(radius: f64, density: f64) -> f64 {
    4.0 * FRAC_PI_3 * radius.powi(3) * density
}

pub fn field<'a>(reply: &'a Reply, name: &str) -> &'a [f64] {
    reply.fields[name].f64().unwrap()
}

/// Sum of the ledger's entries of one kind, in J.
pub fn energy(reply: &Reply, kind: Kind) -> f64 {
    reply.ledger.iter().filter(|entry| entry.kind() == kind).map(|entry| entry.joule).sum()
}

pub fn entry(reply: &Reply, name: &str) -> f64 {
    reply.ledger.iter().find(|entry| entry.name == name).unwrap().joule
}

/// Solves `count` windows of `dt_s`, all converged, and shows each reply to `look`.
pub fn run(particles: &Particles, count: usize, dt_s: f64, look: impl FnMut(usize, &Reply)) -> (State, Reply) {
    run_from(particles, particles.initial().unwrap(), count, dt_s, look)
}

/// The same from a state, at t = 0.
pub fn run_from(
    particles: &Particles,
    (mut state, mut reply): (State, Reply),
    count: usize,
    dt_s: f64,
    mut look: impl FnMut(usize, &Reply),
) -> (State, Reply) {
    for k in 0..count {
        let window = Window { t_s: k as f64 * dt_s, dt_s };
        (state, reply) = particles.solve(&state, &Frozen::default(), window).unwrap();
        assert!(reply.not_converged.is_none(), "window {k}");
        look(k, &reply);
    }
    (state, reply)
}

#[track_caller]
pub fn close(value: f64, expected: f64, relative: f64) {
    assert!((value / expected - 1.0).abs() < relative, "{value:e} instead of {expected:e}");
}

/// Order of convergence from the errors of successive halvings.
pub fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}
