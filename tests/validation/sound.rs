//! The push of sound (Zohdi 2018, ch. 11): reflection and transmission in closed form, power that is neither made nor
//! lost, and what the particles make of the force.

use std::{f64::consts::PI, sync::Arc};

use nalgebra::Vector3;
use stagger_coupling::{Frozen, Physics, Reply, Window};
use stagger_messages::{Field, Fields, Measure, Port};
use stagger_physics::{
    acoustics::{Acoustics, Interface, Settings, SoundBeam},
    common::{
        beam::{Path, Pulses},
        rays::{Limits, Pattern, Sampling},
    },
    particles::Particles,
};
use stagger_scene::Scene;

/// Â = 18, c̃ = 1/3.
const INTERFACE: Interface = Interface {
    fluid_density_kg_m3: 1000.0,
    fluid_sound_speed_m_s: 1500.0,
    density_kg_m3: 6000.0,
    sound_speed_m_s: 4500.0,
};

type Spheres = [(Vector3<f64>, f64)];

fn settings(count: usize, rays: usize) -> Settings {
    let beam = SoundBeam {
        intensity_w_m2: 100.0,
        radius_m: 1.0,
        direction: [0.0, 0.0, -1.0],
        path: Path::Fixed { at_m: [0.0; 3] },
        starts_s: 0.0,
        ends_s: f64::INFINITY,
        pulses: None,
    };
    let limits = Limits { threshold: 1e-9, reflections: 1000 };
    let sampling = Sampling { count: rays, pattern: Pattern::Stratified, limits };
    Settings { count, beam, interface: INTERFACE, sampling, walls: vec![[0.0, 0.0, 1.0]] }
}

/// One window over spheres at rest.
fn solve(settings: Settings, spheres: &Spheres, window: Window) -> Reply {
    let acoustics = Acoustics::new(settings).unwrap();
    let on = |port: Port| {
        let values: Vec<f64> = match port.field.as_str() {
            "positions" => spheres.iter().flat_map(|(centre, _)| [centre.x, centre.y, centre.z]).collect(),
            _ => spheres.iter().map(|(_, radius)| *radius).collect(),
        };
        (port.field.clone(), Field::new(&Arc::new(port), 0, values).unwrap())
    };
    let fields: Fields = acoustics.ports().reads.into_iter().map(on).collect();
    let frozen = Frozen { start: fields.clone(), end: fields };
    acoustics.solve(&(), &frozen, window).unwrap().1
}

const SECOND: Window = Window { t_s: 0.0, dt_s: 1.0 };

fn forces(reply: &Reply) -> Vec<Vector3<f64>> {
    reply.fields["acoustic_force"].f64().unwrap().chunks_exact(3).map(Vector3::from_column_slice).collect()
}

fn joule(reply: &Reply, name: &str) -> f64 {
    reply.ledger.iter().find(|energy| energy.name == name).unwrap().joule
}

/// Overlapping balls about the origin.
fn cluster() -> Vec<(Vector3<f64>, f64)> {
    let corners = (0..125u32).map(|k| [k % 5, k / 5 % 5, k / 25].map(|side| 0.25 * (f64::from(side) - 2.0)));
    // Off the lattice by the golden angle, so that no ray meets two alike.
    let turned =
        |(k, at): (u32, [f64; 3])| (Vector3::from(at) + Vector3::repeat(0.03 * (2.4 * f64::from(k)).sin()), 0.15);
    (0..).zip(corners).map(turned).collect()
}

#[test]
fn sound_reflects_as_the_impedances_say() {
    // ((18 − 1)/(18 + 1))² = 0.800554; the monograph's eq. 11.11 prints 0.944.
    assert!((INTERFACE.reflectance(1.0) - 0.800_554).abs() < 5e-7);
    let critical = 19.4712_f64;
    let at = |degrees: f64| INTERFACE.reflectance(degrees.to_radians().cos());
    // The angle is given to 1e-4 degrees.
    assert!(at(critical - 1e-4) < 1.0 && at(critical + 1e-4).to_bits() == 1.0f64.to_bits() && at(89.0) >= 1.0);
    // Â cosθ_i = cosθ_t with sinθ_t = 3 sinθ_i has no root for Â = 18: R only grows.
    let rises = (0..19).all(|degree| at(f64::from(degree)) < at(f64::from(degree + 1)));
    assert!(rises);
    // Snell: the transmitted ray is a unit vector in the plane of incidence, at three times the sine.
    let normal = Vector3::new(0.0, 0.0, 1.0);
    for angle in [0.0, 0.1, 0.3] {
        let (sine, cosine) = f64::sin_cos(angle);
        let along = INTERFACE.transmitted(&Vector3::new(sine, 0.0, -cosine), &normal, cosine).unwrap();
        assert!((along.norm() - 1.0).abs() < 1e-14 && (along.x - 3.0 * sine).abs() < 1e-14 && along.z < 0.0);
    }
    assert!(INTERFACE.transmitted(&Vector3::new(0.6, 0.0, -0.8), &normal, 0.8).is_none());
    // Equal media: all goes through, straight on.
    let same = Interface { density_kg_m3: 1000.0, sound_speed_m_s: 1500.0, ..INTERFACE };
    assert!(same.reflectance(0.3).abs() < 1e-15);
}

#[test]
fn a_sphere_is_pushed_by_the_integral_over_its_lit_cap() {
    // F = ∫ √(I (1−R) ρ_t c_t) (−t·z) 2π r dr over sinθ = r < c̃. In s = r/c̃ = sinψ, smooth in ψ: midpoint rule.
    let n = 20_000;
    let width = 0.5 * PI / f64::from(n);
    let ring = |k: i32| {
        let (sine, transmitted) = ((f64::from(k) + 0.5) * width).sin_cos();
        let radius = sine / 3.0;
        let cosine = (1.0 - radius * radius).sqrt();
        let pressure = (100.0 * (1.0 - INTERFACE.reflectance(cosine)) * 6000.0 * 4500.0).sqrt();
        let normal = Vector3::new(radius, 0.0, cosine);
        let along = INTERFACE.transmitted(&Vector3::new(0.0, 0.0, -1.0), &normal, cosine).unwrap();
        pressure * -along.z * 2.0 * PI * radius * transmitted / 3.0 * width
    };
    let exact: f64 = (0..n).map(ring).sum();
    let force = |rays: usize| forces(&solve(settings(1, rays), &[(Vector3::zeros(), 1.0)], SECOND))[0];
    let error = |rays: usize| (force(rays).z / -exact - 1.0).abs();
    // Beyond the critical angle nothing pushes: how many rays fall inside it jumps with their number, so the error is of
    // the order of one ray's share, 9/N of those inside.
    for rays in [1_000, 10_000, 100_000] {
        println!("{rays} rays: force off by {:.1e}", error(rays));
        assert!(error(rays) < 9.0 / rays as f64, "{rays} rays: {}", error(rays));
    }
    // To the side it has no reason to go: the sum of equal pushes in all directions, a ray's share of it.
    let sideways = force(10_000).xy().norm() / exact;
    assert!(sideways < 1e-3, "{sideways}");
}

#[test]
fn all_sound_is_transmitted_passes_escapes_or_is_left_over() {
    let spheres = cluster();
    let reply = solve(settings(spheres.len(), 20_000), &spheres, SECOND);
    let [sound, transmitted, passed, escaped, residual] =
        ["sound", "transmitted", "passed", "escaped", "residual"].map(|name| joule(&reply, name));
    assert!((sound / (100.0 * PI) - 1.0).abs() < 1e-15);
    // Rounding of 20000 rays, each sum apart.
    assert!((transmitted + passed + escaped + residual - sound).abs() < 1e-13 * sound);
    assert!(transmitted > 0.01 * sound && passed > 0.1 * sound && escaped > 0.01 * sound && residual < 1e-3 * sound);
    assert!(reply.figures["reflections"] > 5_000.0);
    // Pushed on the whole along the beam.
    let total: Vector3<f64> = forces(&reply).iter().sum();
    assert!(total.z < 0.0 && total.xy().norm() < -0.1 * total.z, "{total}");
}

#[test]
fn a_pulse_counts_by_its_time_in_the_window() {
    let spheres = cluster();
    let pulsed = |pulses, window| {
        let settings = settings(spheres.len(), 500);
        let beam = SoundBeam { pulses, starts_s: 1.0, ..settings.beam.clone() };
        forces(&solve(Settings { beam, ..settings }, &spheres, window))
    };
    let pulses = Some(Pulses { period_s: 1.0, on_s: 0.25 });
    let steady = pulsed(None, Window { t_s: 2.0, dt_s: 1.0 });
    for (window, share) in [
        (Window { t_s: 0.0, dt_s: 1.0 }, 0.0),
        (Window { t_s: 1.0, dt_s: 1.0 }, 0.25),
        (Window { t_s: 2.0, dt_s: 0.25 }, 1.0),
        (Window { t_s: 2.5, dt_s: 0.5 }, 0.0),
    ] {
        for (found, steady) in pulsed(pulses, window).iter().zip(&steady) {
            assert!((found - steady * share).norm() <= 1e-14 * steady.norm(), "{window:?}");
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let spheres = cluster();
    let bits = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let reply = pool.install(|| solve(settings(spheres.len(), 5_000), &spheres, SECOND));
        reply.fields["acoustic_force"].f64().unwrap().iter().map(|force| force.to_bits()).collect::<Vec<_>>()
    };
    let one = bits(1);
    for threads in [2, 3, 5] {
        assert_eq!(one, bits(threads), "with {threads} threads");
    }
}

/// Two particles under a given push: `start` and `integrator` in the words of a scene.
fn pushed(start: &str, integrator: &str, push_n: [f64; 6], dt_s: f64, windows: u32) -> (Fields, f64) {
    let text = format!(
        "duration = 1\nmaterials.stuff = {{ density = 1000 }}\n[particles]\ncount = 2\nradius = 1e-3\nmaterial = \"stuff\"\n\
         gravity = [0, 0, 0]\nstart = {start}\nintegrator = {integrator}\n\
         contact = {{ law = \"linear\", spring = \"10 N/m\", restitution = 1 }}\n\
         [acoustics]\nintensity = 1\nradius = 1\nsound-speed = 4500\npath = {{ kind = \"fixed\", at = [0, 0, 0] }}\n\
         [coupling]\ntolerance = {{ positions = 1e-6, acoustic_force = 1e-6 }}\ndt = {{ start = 1e-3, limit = 1e-3 }}\n"
    );
    let scene = Scene::parse(&text, "pushed.toml", &[]).unwrap();
    let particles = Particles::new(scene.settings::<stagger_physics::particles::Settings>().unwrap().clone()).unwrap();
    let port = Port::f64("acoustic_force", "N", "particles", 3, Measure::None);
    assert_eq!(particles.ports().reads, [port.as_sum().as_optional()]);
    let force = Field::new(&Arc::new(port), 0, push_n.to_vec()).unwrap();
    let fields = Fields::from([("acoustic_force".to_owned(), force)]);
    let frozen = Frozen { start: fields.clone(), end: fields };
    let (mut state, mut reply) = particles.initial().unwrap();
    let stored = |reply: &Reply| {
        use stagger_messages::energy::Kind;
        let stored = reply.ledger.iter().filter(|energy| energy.kind() == Kind::Stored);
        stored.map(|energy| energy.joule).sum::<f64>()
    };
    let (before, mut work) = (stored(&reply), 0.0);
    for k in 0..windows {
        (state, reply) = particles.solve(&state, &frozen, Window { t_s: f64::from(k) * dt_s, dt_s }).unwrap();
        assert!(reply.not_converged.is_none());
        work += joule(&reply, "sound_work");
    }
    let balance = (stored(&reply) - before - work) / work;
    (reply.fields, balance)
}

#[test]
fn a_push_moves_particles_by_newtons_law_and_its_work_is_booked() {
    let apart = "{ kind = \"lattice\", spacing = 4, box = [\"20 mm\", \"10 mm\", \"10 mm\"] }";
    let mass = 1000.0 * 4.0 / 3.0 * PI * 1e-9;
    for integrator in ["\"verlet\"", "{ kind = \"trapezoidal\", phi = 0.5, tolerance = 1e-12 }"] {
        let push = [1e-6, 0.0, 0.0, 0.0, -2e-6, 1e-6];
        let (from, _) = pushed(apart, integrator, push, 1e-9, 1);
        let (fields, balance) = pushed(apart, integrator, push, 2e-3, 50);
        let [start, end] = [&from, &fields].map(|fields| fields["positions"].f64().unwrap().to_vec());
        let velocities = fields["velocities"].f64().unwrap();
        for axis in 0..6 {
            // Both rules are exact for a constant force: rounding of fifty windows. The start is 5e-19 s² off.
            let (velocity, way) = (push[axis] / mass * 0.1, 0.5 * push[axis] / mass * 0.01);
            assert!((velocities[axis] - velocity).abs() < 1e-12 * 0.1, "{integrator}: {}", velocities[axis]);
            assert!((end[axis] - start[axis] - way).abs() < 1e-14, "{integrator}: {}", end[axis] - start[axis]);
        }
        assert!(balance.abs() < 1e-12, "{integrator}: {balance}");
    }
}

#[test]
fn the_balance_of_pushed_particles_in_contact_is_second_order() {
    let close = "{ kind = \"lattice\", box = [\"4.2 mm\", \"2.1 mm\", \"2.1 mm\"] }";
    // Touching, they are pressed together and swing about F/k, 2 % of their distance; 1 ms is a third of the period, which
    // the coarse steps resolve with 29. Substeps are as long as the windows.
    let balance = |dt_s: f64| {
        let integrator = format!("{{ kind = \"verlet\", substep = {dt_s} }}");
        pushed(close, &integrator, [4e-4, 0.0, 0.0, -4e-4, 0.0, 0.0], dt_s, (1e-3 / dt_s).round() as u32).1.abs()
    };
    let (coarse, fine) = (balance(1e-4), balance(1.25e-5));
    let order = (coarse / fine).log2() / 3.0;
    println!("work against energy: {coarse:.1e} and {fine:.1e} with an eighth of the step, order {order:.2}");
    assert!((1.8..2.2).contains(&order) && coarse < 2e-2, "{coarse} and {fine}: order {order}");
}
