//! Friction: rolling from sliding, oblique impacts, rest and sliding on an incline.

use std::f64::consts::PI;

use stagger_coupling::Physics;
use stagger_physics::{
    common::{Shape, Wall},
    particles::{ContactLaw, Friction, Integrator, Particles, Settings, Start},
};

use super::{bed::*, spin::spins};

const GRAVITY: f64 = 9.81;

fn spring(static_coefficient: f64, dynamic_coefficient: f64, damping_ratio: Option<f64>) -> Friction {
    Friction::Spring { stiffness_ratio: None, damping_ratio, static_coefficient, dynamic_coefficient }
}

/// A sphere that rests on the floor under gravity at an angle to it, with overlap from the law's equilibrium.
fn at_rest(young: f64, radius: f64, density: f64, tangent: f64) -> Settings {
    let cosine = 1.0 / f64::hypot(1.0, tangent);
    let law = ContactLaw::Hertz { young_pa: young, poisson: 0.3 };
    let pressing = mass(radius, density) * GRAVITY * cosine;
    let overlap = (0.75 * pressing / (young / 0.91 * radius.sqrt())).powf(2.0 / 3.0);
    let mut settings = settings(law, density, &[([0.0, 0.0, radius - overlap], [0.0; 3], radius)]);
    settings.walls = vec![floor()];
    settings.gravity_m_s2 = [GRAVITY * tangent * cosine, 0.0, -GRAVITY * cosine];
    settings
}

fn thrown(mut settings: Settings, velocity: [f64; 3]) -> Settings {
    if let Start::Given { velocities_m_s, .. } = &mut settings.start {
        velocities_m_s[0] = velocity;
    }
    settings
}

#[test]
fn sliding_turns_into_rolling_with_either_law() {
    let (radius, slip, speed, dt_s) = (0.01, 0.3, 0.5, 1e-4);
    let regularised =
        Friction::Regularised { stiffness_n_m3: 1e14, static_coefficient: slip, dynamic_coefficient: slip };
    for friction in [regularised, spring(slip, slip, Some(0.5))] {
        let mut settings = thrown(at_rest(1e8, radius, 2000.0, 0.0), [speed, 0.0, 0.0]);
        settings.friction = Some(friction);
        settings.spin = true;
        settings.integrator = Integrator::Verlet { substep_s: Some(1e-6) };
        let particles = Particles::new(settings).unwrap();
        let rolls = 2.0 * speed / (7.0 * slip * GRAVITY);
        let before = entry(&particles.initial().unwrap().1, "kinetic");
        let (mut since, mut lost) = (f64::INFINITY, 0.0);
        let (state, reply) = run(&particles, 600, dt_s, |k, reply| {
            let time = (k + 1) as f64 * dt_s;
            lost += entry(reply, "friction");
            let velocity = field(reply, "velocities")[0];
            if time < 0.99 * rolls {
                // A constant force, which Verlet integrates exactly; rounding of 5e4 substeps.
                close(velocity, speed - slip * GRAVITY * time, 1e-10);
            }
            if velocity < speed * (5.0 / 7.0 + 1e-4) {
                since = since.min(time);
            }
        });
        // Sticking decays within a millisecond or two, an eighth of what is left of the run; then nothing brakes.
        close(field(&reply, "velocities")[0], speed * 5.0 / 7.0, 1e-9);
        close(spins(&state)[0][1], speed * 5.0 / 7.0 / radius, 1e-9);
        close(lost, before * 2.0 / 7.0, 1e-8);
        // A window's grain is 0.2 %, the last of sticking shows as 1e-4 of the speed for half a millisecond.
        close(since, rolls, 0.012);
    }
}

/// A sphere that touches the floor at `velocity`, with a law for which a touch takes `substeps` of `substep_s`.
fn touching(law: ContactLaw, density: f64, radius: f64, velocity: [f64; 3], substep_s: f64) -> Settings {
    let mut settings = settings(law, density, &[([0.0, 0.0, radius], velocity, radius)]);
    settings.walls = vec![floor()];
    settings.spin = true;
    settings.integrator = Integrator::Verlet { substep_s: Some(substep_s) };
    settings
}

/// Velocity and spin, in m/s and rad/s, after a sphere has touched the floor; energy has not grown.
fn after_impact(settings: Settings, duration_s: f64) -> ([f64; 3], [f64; 3]) {
    let particles = Particles::new(settings).unwrap();
    let before = entry(&particles.initial().unwrap().1, "kinetic");
    let (state, reply) = run(&particles, 1, duration_s, |_, _| ());
    assert_eq!(reply.fields["wall_contact_area"].rows(), 0);
    // Verlet's own error of the energy is the square of the substep over the contact, below 1e-6 here.
    assert!(entry(&reply, "kinetic") + entry(&reply, "rotational") < before * (1.0 + 1e-6));
    let velocity = field(&reply, "velocities");
    ([velocity[0], velocity[1], velocity[2]], spins(&state)[0])
}

/// Radius of the sphere of Kharaz, Gorham & Salman (2001), in m, and its speed in m/s.
const OXIDE: (f64, f64) = (2.5e-3, 3.9);

/// That sphere, of aluminium oxide, at an angle from the normal (Chung & Ooi 2011, test 4).
fn oxide(friction: Friction, restitution: f64, angle: f64) -> Settings {
    let (radius, speed) = OXIDE;
    let law = ContactLaw::Hertz { young_pa: 3.8e11, poisson: 0.23 };
    let mut settings = touching(law, 4000.0, radius, [speed * angle.sin(), 0.0, -speed * angle.cos()], 1e-9);
    settings.contact.restitution = Some(restitution);
    settings.friction = Some(friction);
    settings
}

#[test]
fn an_oblique_impact_that_slides_throughout_takes_the_friction_of_its_normal_impulse() {
    let slip = 0.092;
    let regularised =
        Friction::Regularised { stiffness_n_m3: 1e25, static_coefficient: slip, dynamic_coefficient: slip };
    // With the spring, friction follows the elastic and damping force together while they press, and is none while they
    // would pull: more than μ times the normal impulse by the share of that pull.
    for (friction, restitution, departs) in [
        (regularised, 1.0, 0.0),
        (regularised, 0.98, 0.0),
        (regularised, 0.8, 0.0),
        (spring(slip, slip, None), 1.0, 0.0),
        (spring(slip, slip, None), 0.98, 1e-4),
        (spring(slip, slip, None), 0.8, 5e-3),
    ] {
        for degrees in [35.0f64, 45.0, 60.0, 80.0] {
            let angle = degrees.to_radians();
            let (velocity, spin) = after_impact(oxide(friction, restitution, angle), 4e-5);
            let (radius, speed) = OXIDE;
            let (normal, along) = (speed * angle.cos(), speed * angle.sin());
            let impulse = slip * (1.0 + restitution) * normal;
            // 13 000 substeps a contact, with a damping force that begins as the fourth root of the overlap.
            close(velocity[2], restitution * normal, 1e-5);
            close(along - velocity[0], impulse, 1e-5 + departs);
            close(spin[1], 2.5 * impulse / radius, 1e-5 + departs);
        }
    }
}

#[test]
fn friction_never_pushes_the_way_a_contact_slides() {
    // Damped strongly: the damper of the tangential spring is at first far above what friction allows.
    let (slip, angle) = (0.092, 45f64.to_radians());
    let particles = Particles::new(oxide(spring(slip, slip, None), 0.8, angle)).unwrap();
    let (mut before, mut pressed, mut rubbed) = ([OXIDE.1 * angle.sin(), -OXIDE.1 * angle.cos()], 0.0, 0.0);
    run(&particles, 2000, 1e-8, |k, reply| {
        let velocity = field(reply, "velocities");
        let (along, normal) = (before[0] - velocity[0], velocity[2] - before[1]);
        assert!(along >= 0.0, "window {k}: {along:e} m/s");
        pressed += normal.max(0.0);
        rubbed += along;
        before = [velocity[0], velocity[2]];
    });
    // Ten substeps a window and one window in which pressing turns into pulling.
    close(rubbed, slip * pressed, 1e-5);
}

#[test]
fn a_sphere_that_rolls_against_a_wall_climbs_and_turns_slower() {
    // Normal velocity and spin alone, as in Chung & Ooi (2011), tests 5 and 6: the spin is that of rolling, on a floor
    // that then is gone.
    let (radius, slip) = (0.01, 0.1);
    let mut rolls = thrown(at_rest(1e8, radius, 2000.0, 0.0), [0.7, 0.0, 0.0]);
    rolls.friction = Some(spring(0.3, 0.3, Some(0.5)));
    rolls.spin = true;
    rolls.integrator = Integrator::Verlet { substep_s: Some(1e-6) };
    let (state, reply) = run(&Particles::new(rolls.clone()).unwrap(), 1, 0.1, |_, _| ());
    let (speed, spin) = (field(&reply, "velocities")[0], spins(&state)[0][1]);
    close(speed, 0.5, 1e-9);
    close(spin * radius, speed, 1e-9);
    let at = field(&reply, "positions")[0];
    let shape = Shape::plane([at + 1.02 * radius, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    let walls = vec![Wall::fixed("wall", shape, None)];
    let hits = Settings { walls, gravity_m_s2: [0.0; 3], friction: Some(spring(slip, slip, None)), ..rolls };
    let (state, reply) = run_from(&Particles::new(hits).unwrap(), (state, reply), 1, 2e-3, |_, _| ());
    assert_eq!(reply.fields["wall_contact_area"].rows(), 0);
    let velocity = field(&reply, "velocities");
    // Elastic; some 300 substeps a contact, of second order.
    close(velocity[0], -speed, 1e-4);
    close(velocity[2], 2.0 * slip * speed, 1e-4);
    close(spin - spins(&state)[0][1], 2.5 * 2.0 * slip * speed / radius, 1e-4);
}

#[test]
fn a_contact_that_does_not_slip_swings_back_as_its_stiffness_ratio_says() {
    // Without slip the contact point is an oscillator of mass 2m/7 and stiffness κ k, let go after half a period of the
    // normal one: its velocity is cos(π √(7κ/2)) of what it was. κ = 2/7 turns it about (Walton's β = 1).
    let (radius, stiffness, along) = (0.01, 1e5, 0.1);
    let contact_s = PI * (mass(radius, 4000.0) / stiffness).sqrt();
    for ratio in [2.0 / 7.0, 0.4, 0.6, 8.0f64 / 7.0] {
        let (kept, left) = (PI * (3.5 * ratio).sqrt()).sin_cos();
        for substeps in [1000.0, 4000.0] {
            let law = ContactLaw::Linear { stiffness_n_m: stiffness };
            let mut settings = touching(law, 4000.0, radius, [along, 0.0, -1.0], contact_s / substeps);
            let stick = 1e4;
            settings.friction = Some(Friction::Spring {
                stiffness_ratio: Some(ratio),
                damping_ratio: None,
                static_coefficient: stick,
                dynamic_coefficient: stick,
            });
            let (velocity, spin) = after_impact(settings, 1.1 * contact_s);
            let surface = (velocity[0] - spin[1] * radius) / along;
            // What the spring still holds is let go up to a substep late, at a rate of ω_t sin; the rest is of second
            // order. Slip at the very end, where nothing presses, takes 1e-5.
            let late = kept.abs() * PI * (3.5 * ratio).sqrt() / substeps;
            assert!((surface - left).abs() < 2.0 * late + 30.0 / substeps.powi(2) + 1e-5, "{ratio}: {surface} {left}");
        }
    }
}

#[test]
fn oblique_rebounds_have_the_shape_of_maw_barber_and_fawcett() {
    // ψ = 2(1−ν)/(μ(2−ν)) v_t/v_n of the contact point, before and after (Maw, Barber & Fawcett 1976). χ as there.
    let (slip, poisson, radius) = (0.1, 0.3, 0.01);
    let scale = 2.0 * (1.0 - poisson) / (slip * (2.0 - poisson));
    let chi = 7.0 * (1.0 - poisson) / (2.0 * (2.0 - poisson));
    let rebound = |psi: f64| {
        let law = ContactLaw::Hertz { young_pa: 1e9, poisson };
        let mut settings = touching(law, 4000.0, radius, [psi / scale, 0.0, -1.0], 2e-8);
        settings.friction = Some(spring(slip, slip, None));
        let (velocity, spin) = after_impact(settings, 4e-4);
        scale * (velocity[0] - spin[1] * radius)
    };
    // Steep impacts stick and return with the way they came, flatter ones swing back, and the flattest slide throughout,
    // ψ2 = ψ1 − 4χ. There the elastic contact stops sliding at ψ1 = 4χ − 1; the spring, without its micro-slip, at 5.3.
    assert!((0.0..=0.5).contains(&rebound(0.5)));
    let middle: Vec<f64> = [2.0, 3.0, 4.0, 4.0 * chi - 1.0].map(rebound).to_vec();
    assert!(middle.iter().all(|psi| (-1.5..-0.4).contains(psi)), "{middle:?}");
    assert!(middle[1] < middle[0] && middle[2] < middle[1] && middle[3] > middle[2], "{middle:?}");
    for psi in [5.5, 6.5, 10.0] {
        // 10 000 substeps a contact.
        assert!((rebound(psi) - (psi - 4.0 * chi)).abs() < 1e-6);
    }
}

#[test]
fn the_spring_holds_a_block_on_an_incline_up_to_the_angle_of_friction() {
    // Without spin the sphere is a block. Gravity comes on at once: the critically damped spring then holds up to
    // 1 + e^{−2} times the weight along the incline, so that tan 0.42 asks for 0.477 of the static coefficient 0.5; the
    // dynamic one would not hold it.
    let (radius, young, tangent) = (0.01, 1e8, 0.42);
    let mut settings = at_rest(young, radius, 2000.0, tangent);
    settings.friction = Some(spring(0.5, 0.4, Some(1.0)));
    settings.integrator = Integrator::Verlet { substep_s: Some(5e-6) };
    let particles = Particles::new(settings).unwrap();
    let mut places = Vec::new();
    run(&particles, 20, 0.05, |_, reply| places.push(field(reply, "positions")[0]));
    let weight = mass(radius, 2000.0) * GRAVITY / f64::hypot(1.0, tangent);
    let overlap = (0.75 * weight / (young / 0.91 * radius.sqrt())).powf(2.0 / 3.0);
    // Mindlin: 8 G* a with G* = G/(2 − ν) of the sphere on a rigid wall. The spring's own error is ½ (ω Δt)², 6e-5.
    let shear = 8.0 * (young / 2.6) / 1.7 * (radius * overlap).sqrt();
    close(places[0], weight * tangent / shear, 2e-4);
    // After 0.05 s, some hundred times the spring's decay, it stands still but for rounding of 2e5 substeps.
    assert!(places.iter().all(|place| (place / places[0] - 1.0).abs() < 1e-9), "{places:?}");
}

#[test]
fn a_block_slides_down_a_steeper_incline_at_the_dynamic_coefficient() {
    let mut settings = at_rest(1e8, 0.01, 2000.0, 0.6);
    settings.friction = Some(spring(0.5, 0.4, Some(0.3)));
    let particles = Particles::new(settings).unwrap();
    let mut speeds = Vec::new();
    run(&particles, 10, 0.1, |_, reply| speeds.push(field(reply, "velocities")[0]));
    let gained = 0.1 * GRAVITY * (0.6 - 0.4) / f64::hypot(1.0, 0.6);
    // A constant force; rounding of some 1e4 substeps.
    assert!(speeds.windows(2).all(|pair| ((pair[1] - pair[0]) / gained - 1.0).abs() < 1e-10), "{speeds:?}");
    // The spring takes less than a millisecond of the first window.
    close(speeds[0], gained, 0.01);
}

#[test]
fn the_regularised_law_creeps_where_the_spring_holds() {
    // It resists with K_f A Δt v, so that a block creeps at m g sin α/(K_f A Δt): the faster, the finer the step.
    let (radius, tangent, stiffness) = (0.01, 0.2, 1e12);
    for substep_s in [1e-5, 2e-5] {
        let mut settings = at_rest(1e8, radius, 2000.0, tangent);
        settings.friction = Some(Friction::Regularised {
            stiffness_n_m3: stiffness,
            static_coefficient: 0.5,
            dynamic_coefficient: 0.4,
        });
        settings.integrator = Integrator::Verlet { substep_s: Some(substep_s) };
        let (_, reply) = run(&Particles::new(settings).unwrap(), 1, 0.2, |_, _| ());
        let along = mass(radius, 2000.0) * GRAVITY * tangent / f64::hypot(1.0, tangent);
        let area = field(&reply, "wall_contact_area")[0];
        // It has settled for hundreds of its relaxation times; rounding is left.
        close(field(&reply, "velocities")[0], along / (stiffness * area * substep_s), 1e-8);
    }
}

#[test]
fn a_sphere_rolls_down_an_incline_at_five_sevenths() {
    for friction in [
        spring(0.5, 0.4, Some(0.5)),
        Friction::Regularised { stiffness_n_m3: 1e14, static_coefficient: 0.5, dynamic_coefficient: 0.4 },
    ] {
        let radius = 0.01;
        let mut settings = at_rest(1e8, radius, 2000.0, 0.3);
        settings.friction = Some(friction);
        settings.spin = true;
        let (state, reply) = run(&Particles::new(settings).unwrap(), 5, 0.1, |_, _| ());
        let speed = 0.5 * 5.0 / 7.0 * GRAVITY * 0.3 / f64::hypot(1.0, 0.3);
        let (along, turning) = (field(&reply, "velocities")[0], spins(&state)[0][1] * radius);
        // Whatever friction does, m v + I ω/R is what gravity gives; rounding is left.
        close((along + 0.4 * turning) / 1.4, speed, 1e-10);
        // The regularised law lets it slip by 2/7 m g sin α/(K_f A Δt), here some 1e-3 of the speed.
        assert!((along - turning).abs() < 2e-3 * speed);
    }
}
