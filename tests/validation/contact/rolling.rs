//! Resistance to rolling and torsion.

use stagger_coupling::Reply;
use stagger_physics::{
    common::{Shape, Wall},
    particles::{ContactLaw, Friction, Integrator, Particles, Rolling, Settings, State},
};

use super::{bed::*, spin::spins};

const RADIUS: f64 = 0.01;
const DENSITY: f64 = 2000.0;
const YOUNG: f64 = 1e8;
const GRAVITY: f64 = 9.81;
/// E/(1−ν²), in Pa.
const REDUCED: f64 = YOUNG / 0.91;

/// Overlap in m under the sphere's weight.
fn overlap() -> f64 {
    (0.75 * mass(RADIUS, DENSITY) * GRAVITY / (REDUCED * RADIUS.sqrt())).powf(2.0 / 3.0)
}

/// A sphere pressed by its weight against a wall with the normal `up`, with `velocity`, spring friction and resistance.
fn sphere(up: [f64; 3], velocity: [f64; 3], rolling: Option<Rolling>) -> Settings {
    let law = ContactLaw::Hertz { young_pa: YOUNG, poisson: 0.3 };
    let mut settings = settings(law, DENSITY, &[(up.map(|axis| axis * (RADIUS - overlap())), velocity, RADIUS)]);
    settings.walls = vec![Wall::fixed("wall", Shape::plane([0.0; 3], up), None)];
    settings.gravity_m_s2 = up.map(|axis| -GRAVITY * axis);
    settings.friction = Some(Friction::Spring {
        stiffness_ratio: None,
        damping_ratio: Some(0.5),
        static_coefficient: 0.3,
        dynamic_coefficient: 0.3,
    });
    settings.rolling = rolling;
    settings.spin = true;
    settings.integrator = Integrator::Verlet { substep_s: Some(1e-5) };
    settings
}

/// The sphere once it rolls freely.
fn rolls(up: [f64; 3], velocity: [f64; 3]) -> (State, Reply) {
    run(&Particles::new(sphere(up, velocity, None)).unwrap(), 1, 0.1, |_, _| ())
}

#[test]
fn a_rolling_sphere_stops_after_the_distance_its_resistance_gives() {
    let (state, reply) = rolls([0.0, 0.0, 1.0], [0.7, 0.0, 0.0]);
    let start = field(&reply, "positions")[0];
    let speed = field(&reply, "velocities")[0];
    close(speed, 0.5, 1e-9);
    let coefficient = 3.0;
    let settings = sphere([0.0, 0.0, 1.0], [0.0; 3], Some(Rolling { rolling: coefficient, torsion: 0.0 }));
    let particles = Particles::new(settings).unwrap();
    // The moment μ_r a m g brakes 7/5 m R².
    let braking = 5.0 / 7.0 * coefficient * (RADIUS * overlap()).sqrt() * GRAVITY / RADIUS;
    let stops_s = speed / braking;
    let dt_s = stops_s / 20.0;
    let (mut lost, mut rubbed) = (0.0, 0.0);
    let (state, reply) = run_from(&particles, (state, reply), 25, dt_s, |k, reply| {
        lost += entry(reply, "rolling");
        rubbed += entry(reply, "friction").abs();
        let left = (1.0 - (k + 1) as f64 / 20.0).max(0.0);
        // A constant moment, which Verlet integrates exactly, until the resistance eases off before rest: below the speed
        // of 8 steps of braking, 2e-4.
        assert!((field(reply, "velocities")[0] / speed - left).abs() < if k == 19 { 2e-4 } else { 1e-10 });
    });
    assert!(spins(&state)[0][1].abs() < 1e-12 * speed / RADIUS);
    // The way and the energy of those steps are the square of their speed; friction's spring took some of the energy.
    close(field(&reply, "positions")[0] - start, 0.5 * speed * stops_s, 1e-6);
    let before = 0.7 * mass(RADIUS, DENSITY) * speed * speed;
    close(lost + rubbed, before, 1e-7);
    assert!(rubbed < 1e-6 * before, "{rubbed:e} J");
}

#[test]
fn a_spin_about_the_normal_decays_linearly() {
    // The spin is that of rolling along an upright wall; then it is gone, and there is a floor below.
    let (state, reply) = rolls([1.0, 0.0, 0.0], [0.0, 0.7, 0.0]);
    let spin = spins(&state)[0][2];
    close(spin * RADIUS, 0.5, 1e-9);
    let coefficient = 0.2;
    let floor = Shape::plane([0.0, 0.0, -(RADIUS - overlap())], [0.0, 0.0, 1.0]);
    let settings = Settings {
        walls: vec![Wall::fixed("floor", floor, None)],
        friction: None,
        ..sphere([0.0, 0.0, 1.0], [0.0; 3], Some(Rolling { rolling: 0.0, torsion: coefficient }))
    };
    let particles = Particles::new(settings).unwrap();
    let braking = coefficient * (RADIUS * overlap()).sqrt() * GRAVITY / (0.4 * RADIUS * RADIUS);
    let stops_s = spin / braking;
    let before = 0.2 * mass(RADIUS, DENSITY) * (spin * RADIUS).powi(2);
    let (mut state, mut reply, mut lost) = (state, reply, 0.0);
    for k in 1..=20 {
        let dt_s = 0.1 * stops_s;
        (state, reply) = run_from(&particles, (state, reply), 1, dt_s, |_, reply| lost += entry(reply, "rolling"));
        let left = (1.0 - 0.1 * f64::from(k)).max(0.0);
        // As above: linear but for rounding, and the last steps before rest.
        assert!((spins(&state)[0][2] / spin - left).abs() < if k == 10 { 1e-4 } else { 1e-10 });
        // And nothing is lost any more at rest.
        assert!((lost / before - (1.0 - left * left)).abs() < 1e-9, "window {k}: {lost} of {before}");
    }
}

#[test]
fn a_moment_that_acts_on_is_held_at_a_turning_in_proportion_to_the_step() {
    // Half of what would overcome the resistance, at rest at the start. The resistance of one contact is at most 1/8 of
    // what would stop it in a step, so that it turns at R ω = 8 (5/2) g sin α Δt instead of resting.
    let coefficient = 0.3;
    let sine = 0.5 * coefficient * (RADIUS * overlap()).sqrt() / RADIUS;
    for substep_s in [1e-5, 2e-5] {
        let settings = Settings {
            gravity_m_s2: [GRAVITY * sine, 0.0, -GRAVITY],
            integrator: Integrator::Verlet { substep_s: Some(substep_s) },
            ..sphere([0.0, 0.0, 1.0], [0.0; 3], Some(Rolling { rolling: coefficient, torsion: 0.0 }))
        };
        let (_, reply) = run(&Particles::new(settings).unwrap(), 1, 0.1, |_, _| ());
        // It has settled for hundreds of times as long as its spring swings.
        close(field(&reply, "velocities")[0], 20.0 * GRAVITY * sine * substep_s, 1e-8);
    }
}
