//! Contact: collisions against Hertz's theory and the monograph's law, settling, neighbours and walls; and, in a file
//! for each, what else a contact does.

mod anderson;
mod bed;
mod bond;
mod conservation;
mod conserved_motion;
mod determinism;
mod friction;
mod integration;
mod invariance;
mod order;
mod restitution;
mod rolling;
mod spin;
mod substep;
mod valley;

use std::f64::consts::PI;

use stagger_coupling::{Frozen, Physics, SolveError, Window};
use stagger_messages::{Field, Fields, Measure, Port, energy::Kind};
use stagger_physics::{
    common::{Shape, Wall},
    particles::{
        ContactLaw, Drag, Friction, Group, Integrator, Material, Pair, Particles, Radius, Settings, Start, StartRegion,
    },
};

use self::bed::*;

/// Largest overlap in m, peak force in N on the first particle, and duration in s of a collision.
fn collide(settings: Settings, mass: f64, pairs: &str, reach: f64, dt_s: f64, windows: usize) -> (f64, f64, f64) {
    let particles = Particles::new(settings).unwrap();
    let (mut overlap, mut force, mut touching) = (0.0f64, 0.0f64, 0usize);
    let mut before = field(&particles.initial().unwrap().1, "velocities").to_vec();
    run(&particles, windows, dt_s, |_, reply| {
        let velocity = field(reply, "velocities");
        let change: f64 = (0..3).map(|axis| (velocity[axis] - before[axis]).powi(2)).sum();
        force = force.max(mass * change.sqrt() / dt_s);
        before = velocity.to_vec();
        if let Some(distance) = field(reply, &format!("{pairs}_distance")).first() {
            overlap = overlap.max(reach - distance);
            touching += 1;
        }
    });
    (overlap, force, touching as f64 * dt_s)
}

#[test]
fn two_glass_spheres_collide_as_hertz_says() {
    // Chung & Ooi (2011), test 1.
    let law = ContactLaw::Hertz { young_pa: 4.8e10, poisson: 0.2 };
    let spheres =
        [([-0.01 - 1e-7, 0.0, 0.0], [10.0, 0.0, 0.0], 0.01), ([0.01 + 1e-7, 0.0, 0.0], [-10.0, 0.0, 0.0], 0.01)];
    let mut settings = settings(law, 2800.0, &spheres);
    settings.integrator = Integrator::Verlet { substep_s: Some(1e-8) };
    let (overlap, force, duration) = collide(settings, mass(0.01, 2800.0), "contact", 0.02, 1e-8, 4200);
    // 4000 windows a contact: second-order errors of 1e-7, the published digits, and a window's grain in the duration.
    close(force, 10_696.9, 1e-5);
    close(overlap, 274.11e-6, 2e-5);
    close(duration, 40.34e-6, 5e-4);
    // Hertz's contact time 2.94328 δ/v at the closing speed.
    close(duration, 2.943_28 * overlap / 20.0, 5e-4);
}

#[test]
fn an_aluminium_sphere_rebounds_from_a_rigid_wall() {
    // Chung & Ooi (2011), test 2. The published figures, 11 369.9 N and 731.7 µs, follow from ν = 0.30.
    let law = ContactLaw::Hertz { young_pa: 7e10, poisson: 0.3 };
    let mut settings = settings(law, 2699.0, &[([0.0, 0.0, 0.1 + 1e-9], [0.0, 0.0, -0.2], 0.1)]);
    settings.walls = vec![floor()];
    settings.integrator = Integrator::Verlet { substep_s: Some(2e-7) };
    let (_, force, duration) = collide(settings, mass(0.1, 2699.0), "wall_contact", 0.1, 2e-7, 3700);
    close(force, 11_369.9, 1e-5);
    close(duration, 731.7e-6, 6e-4);
}

/// The monograph's law p = 2, R 0.05 m, ρ 2000, K_p 1e8, closing at 2 m/s, first touch after 5e-7 s.
fn monograph(integrator: Integrator) -> Settings {
    let spheres =
        [([-0.05 - 5e-7, 0.0, 0.0], [1.0, 0.0, 0.0], 0.05), ([0.05 + 5e-7, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.05)];
    Settings { integrator, ..settings(OVERLAP, 2000.0, &spheres) }
}

#[test]
fn the_monographs_law_collides_as_its_integral_says() {
    let settings = monograph(Integrator::Verlet { substep_s: Some(2e-6) });
    let (overlap, force, duration) = collide(settings, mass(0.05, 2000.0), "contact", 0.1, 2e-6, 4900);
    // 4700 windows a contact, as above; the figures carry six digits.
    close(overlap, 7.239_07e-3, 2e-6);
    close(force, 574.32, 2e-5);
    close(duration, 9.5047e-3, 5e-4);
}

#[test]
fn a_grain_settles_at_stokes_speed() {
    let mut settings = settings(OVERLAP, 7800.0, &[([0.0; 3], [0.0; 3], 25e-6)]);
    settings.gravity_m_s2 = [0.0, 0.0, -9.81];
    settings.drag = Some(Drag { viscosity_pa_s: 1.8e-5, velocity_m_s: [0.0; 3] });
    // Windows short enough that the grain moves less than its radius in a substep.
    settings.integrator = Integrator::Verlet { substep_s: Some(2e-5) };
    let particles = Particles::new(settings).unwrap();
    let (speed, time) = (0.590_417, 0.060_185_2);
    run(&particles, 60, 0.01, |k, reply| {
        let expected = -speed * (1.0 - (-(k as f64 + 1.0) * 0.01 / time).exp());
        // (Δt/τ)² is 1e-7; the constants are given to six digits.
        close(field(reply, "velocities")[2], expected, 2e-6);
    });
    close(speed, 0.5904, 1e-4);
}

/// A loose cloud that falls together: lattice points drawn towards the centre.
fn cloud(side: i32, spacing: f64, speed: f64) -> Vec<([f64; 3], [f64; 3], f64)> {
    let mut particles = Vec::new();
    for x in 0..side {
        for y in 0..side {
            for z in 0..side {
                let seed = f64::from(x * 7 + y * 13 + z * 29);
                let at = [x, y, z].map(|c| (f64::from(c) - 0.5 * f64::from(side - 1)) * spacing);
                let jitter = [(1.3 * seed).sin(), (2.1 * seed).cos(), (0.7 * seed).sin()];
                let position = [0, 1, 2].map(|axis| at[axis] + 0.02 * jitter[axis]);
                let velocity = [0, 1, 2].map(|axis| -speed * at[axis] + 0.3 * jitter[2 - axis]);
                particles.push((position, velocity, 1.0 + 0.1 * jitter[0]));
            }
        }
    }
    particles
}

#[test]
fn the_neighbour_list_gives_what_all_pairs_give() {
    let cloud = cloud(5, 2.3, 0.5);
    let end = |skin| {
        let law = ContactLaw::Overlap { stiffness_pa: 1e6, exponent: 2.0 };
        let mut settings = settings(law, 1000.0, &cloud);
        settings.skin = skin;
        settings.contact.damping_n_s_m3 = 1e3;
        run(&Particles::new(settings).unwrap(), 20, 0.05, |_, _| ()).1
    };
    // A skin of a thousand radii lists all pairs once. The order of the sums differs, and with it their rounding, which
    // grows by the collisions of 20 windows.
    let all_pairs = end(1000.0);
    assert!(all_pairs.fields["contact_area"].rows() > 50);
    for skin in [0.0, 0.05, 0.4] {
        let listed = end(skin);
        let pairs = field(&listed, "positions").iter().zip(field(&all_pairs, "positions"));
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-11, "skin {skin}: {worst:e}");
    }
}

#[test]
fn a_contact_is_listed_once_and_the_revision_tells_a_change() {
    let cloud = cloud(4, 2.2, 0.3);
    let settings = settings(ContactLaw::Overlap { stiffness_pa: 1e6, exponent: 2.0 }, 1000.0, &cloud);
    let particles = Particles::new(settings).unwrap();
    let mut before = particles.initial().unwrap().1.fields["contact_pairs"].clone();
    let mut changes = 0;
    run(&particles, 100, 0.01, |_, reply| {
        let pairs = &reply.fields["contact_pairs"];
        let rows = pairs.u32().unwrap().as_chunks::<2>().0;
        let mut sorted = rows.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        assert!(sorted.len() == rows.len() && rows.iter().all(|[i, j]| i < j));
        let changed = pairs.values() != before.values();
        assert_eq!(pairs.support.revision, before.support.revision + u64::from(changed));
        assert_eq!(reply.fields["contact_area"].support, pairs.support);
        assert_eq!(reply.fields["contact_distance"].support, pairs.support);
        changes += usize::from(changed);
        before = pairs.clone();
    });
    assert!(changes > 10 && changes < 100, "{changes}");
}

#[test]
fn a_box_holds_its_particles_and_their_energy() {
    let (half, radius) = (0.3, 0.05);
    let shape = Shape::Box { lower_m: [-half; 3], upper_m: [half; 3], open: Vec::new() };
    let mut settings = settings(OVERLAP, 2000.0, &[]);
    let radii = Radius::Uniform { mean_m: radius, spread_m: 0.01 };
    settings.groups = vec![Group { name: "balls".into(), count: 30, radius: radii, material: 0 }];
    let region = StartRegion::Box { lower_m: [-half; 3], upper_m: [half; 3] };
    settings.start = Start::SequentialAddition { region, velocity_m_s: [0.9, 0.5, -1.1] };
    settings.walls = vec![floor_below(), Wall::fixed("box", shape, None)];
    settings.gravity_m_s2 = [0.0, 0.0, -9.81];
    let particles = Particles::new(settings).unwrap();
    let before = energy(&particles.initial().unwrap().1, Kind::Stored);
    let kinetic = entry(&particles.initial().unwrap().1, "kinetic");
    let mut hits = 0;
    let (_, last) = run(&particles, 200, 0.005, |_, reply| {
        let walls = reply.fields["wall_contact_pairs"].u32().unwrap();
        hits += walls.len() / 2;
        assert!(walls.as_chunks::<2>().0.iter().all(|[particle, wall]| *particle < 30 && *wall == 1));
        // Held with at most a third of a radius of overlap at these speeds.
        assert!(field(reply, "positions").iter().all(|x| x.abs() < half - 0.6 * radius));
    });
    assert!(hits > 100, "{hits}");
    // A second of bouncing at the automatic substep.
    assert!((energy(&last, Kind::Stored) - before).abs() < 2e-3 * kinetic);
}

/// A wall that nothing reaches.
fn floor_below() -> Wall {
    Wall::fixed("below", Shape::plane([0.0, 0.0, -10.0], [0.0, 0.0, 1.0]), None)
}

#[test]
fn each_material_has_its_own_restitution_at_a_wall() {
    let fall = |x: f64| ([x, 0.0, 0.05 + 1e-6], [0.0, 0.0, -1.0], 0.05);
    let mut settings = settings(OVERLAP, 2000.0, &[fall(0.0), fall(1.0)]);
    settings.materials.push(Material { name: "other".into(), ..settings.materials[0].clone() });
    if let Start::Given { materials, .. } = &mut settings.start {
        materials[1] = 1;
    }
    settings.contact.restitution = Some(0.8);
    settings.pairs = vec![Pair {
        between: ["other".into(), "floor".into()],
        damping_n_s_m3: None,
        restitution: Some(0.4),
        static_coefficient: None,
        dynamic_coefficient: None,
        rolling: None,
        torsion: None,
    }];
    settings.walls = vec![floor()];
    let (_, reply) = run(&Particles::new(settings).unwrap(), 60, 5e-4, |_, _| ());
    let velocities = field(&reply, "velocities");
    // The automatic substep resolves a contact by 25.
    close(velocities[2], 0.8, 0.02);
    close(velocities[5], 0.4, 0.02);
}

#[test]
fn contact_forces_are_written_where_asked_for_and_are_those_of_the_law() {
    // 1 µm between two spheres of 1 mm, and 2 µm into the floor.
    let spheres = [([0.0, 0.0, 0.998e-3], [0.0; 3], 1e-3), ([1.999e-3, 0.0, 1e-3], [0.0; 3], 1e-3)];
    let mut settings = settings(ContactLaw::Hertz { young_pa: 1e7, poisson: 0.3 }, 2500.0, &spheres);
    settings.walls = vec![floor()];
    let quiet = Particles::new(settings.clone()).unwrap().initial().unwrap().1;
    assert!(!quiet.fields.contains_key("contact_normal_force"));
    settings.writes_contact_forces = true;
    let reply = Particles::new(settings).unwrap().initial().unwrap().1;
    // F = 4/3 E* √R* δ^{3/2} (Hertz); with one modulus E* = E / (2 (1 − ν²)), against the rigid floor E / (1 − ν²).
    let force =
        |modulus_pa: f64, radius_m: f64, overlap_m: f64| 4.0 / 3.0 * modulus_pa * radius_m.sqrt() * overlap_m.powf(1.5);
    let plane_pa = 1e7 / (1.0 - 0.09);
    let distance_m = field(&reply, "contact_distance")[0];
    let expected_n = force(0.5 * plane_pa, 0.5e-3, 2e-3 - distance_m);
    close(field(&reply, "contact_normal_force")[0], expected_n, 1e-12);
    close(field(&reply, "wall_contact_normal_force")[0], force(plane_pa, 1e-3, 2e-6), 1e-9);
}
