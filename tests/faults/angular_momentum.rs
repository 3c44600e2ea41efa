//! Fault: friction made angular momentum.
//!
//! Friction turned each sphere at the arm R, and R_i + R_j is longer than the distance of spheres that overlap: two spheres that rub
//! past each other ended with 0.25 % more angular momentum than friction had moved between them. The arms now end at the contact
//! point. Crowds and unequal spheres are in tests/validation/contact/conserved_motion.rs.

use stagger_coupling::{Frozen, Physics as _, Reply, Window};
use stagger_physics::particles::{Particles, Settings, Start};
use stagger_scene::Scene;

const SCENE: &str = r#"
duration = 2e-3
[materials.m]
density = 2500
young = 1e7
poisson = 0.3
[particles]
count = 2
radius = 5e-4
start = { box = [1, 1, 1] }
material = "m"
gravity = [0, 0, 0]
spin = true
contact = "hertz"
friction = { law = "spring", static = 0.5, dynamic = 0.5 }
integrator = { kind = "verlet", substep = 1e-7 }
[coupling]
dt = 1e-5
"#;

/// Orbital angular momentum about y, and that of the spins, in kg m²/s: equal spheres that meet point to point spin alike, by
/// their energy.
fn angular_momenta(reply: &Reply) -> (f64, f64) {
    let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 5e-4f64.powi(3);
    let inertia = 0.4 * mass * 5e-4f64.powi(2);
    let [positions, velocities] = ["positions", "velocities"].map(|name| reply.fields[name].f64().unwrap());
    let rows = positions.as_chunks::<3>().0.iter().zip(velocities.as_chunks::<3>().0);
    let orbit: f64 = rows.map(|(r, v)| mass * (r[2] * v[0] - r[0] * v[2])).sum();
    let rotational = reply.ledger.iter().find(|entry| entry.name == "rotational").unwrap().joule;
    (orbit, 2.0 * inertia * (rotational / inertia).sqrt())
}

/// Angular momentum made over that which friction moved, of two spheres that rub past each other.
fn made(lever_arm: &str) -> f64 {
    let overrides = [("particles.lever-arm".into(), lever_arm.into())];
    let settings = Scene::parse(SCENE, "pair.toml", &overrides).unwrap().settings::<Settings>().unwrap().clone();
    let start = Start::Given {
        positions_m: vec![[0.0, 0.0, -0.000_500_25], [0.0, 0.0, 0.000_500_25]],
        velocities_m_s: vec![[0.1, 0.0, 0.025], [-0.1, 0.0, -0.025]],
        radii_m: vec![5e-4; 2],
        materials: vec![0; 2],
        spins_rad_s: Vec::new(),
    };
    let pair = Particles::new(Settings { start, ..settings }).unwrap();
    let (mut state, mut reply) = pair.initial().unwrap();
    let (before, _) = angular_momenta(&reply);
    for window in 0..200 {
        let window = Window { t_s: f64::from(window) * 1e-5, dt_s: 1e-5 };
        (state, reply) = pair.solve(&state, &Frozen::default(), window).unwrap();
    }
    let (orbit, spin) = angular_momenta(&reply);
    assert!(spin.abs() > 0.01 * before.abs(), "they spin: {spin:e} of {before:e}");
    // Friction slows the orbit, and the spins turn on in its sense.
    ((orbit.abs() + spin - before.abs()) / spin).abs()
}

#[test]
fn two_spheres_that_rub_keep_their_angular_momentum() {
    let kept = made("contact-point");
    assert!(kept < 1e-9, "{kept:e}");
    let book = made("radius");
    assert!(book > 1e-4, "the monograph's arms: {book:e}");
}
