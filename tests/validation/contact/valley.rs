//! A sphere between faces of a mesh: one contact where they are nearly one plane, and no energy made between them.

use std::sync::Arc;

use nalgebra::Vector3;
use stagger_coupling::math;
use stagger_physics::{
    common::{
        Shape, Wall,
        walls::{Cylinder, Mesh, Side},
    },
    particles::{Particles, Settings, Start},
};
use stagger_scene::Scene;

use super::bed::{field, run};

type Vec3 = Vector3<f64>;

const SCENE: &str = r#"
duration = 1
[materials.m]
density = 2500
[particles]
count = 1
radius = 50e-6
material = "m"
start = { box = [1, 1, 1] }
gravity = [0, 0, 0]
integrator = { kind = "verlet", substep = 2e-8 }
contact = { law = "linear", spring = "1000 N/m" }
[coupling]
dt = 1
"#;
const RADIUS: f64 = 50e-6;
/// Height of the centre at the start, above all faces, and not a whole number of substeps from touching them.
const START: f64 = 1.0537 * RADIUS;

/// Velocity at the end of a sphere that starts at `place` with `velocity`.
fn bounce(shape: Shape, place: Vec3, velocity: Vec3, time_s: f64, overrides: &[(&str, &str)]) -> Vec3 {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
    let settings = Scene::parse(SCENE, "valley.toml", &overrides).unwrap().settings::<Settings>().unwrap().clone();
    let start = Start::Given {
        positions_m: vec![place.into()],
        velocities_m_s: vec![velocity.into()],
        radii_m: vec![RADIUS],
        materials: vec![0],
        spins_rad_s: Vec::new(),
    };
    let sphere = Particles::new(Settings { start, walls: vec![Wall::fixed("w", shape, None)], ..settings }).unwrap();
    let (_, reply) = run(&sphere, 1, time_s, |_, _| ());
    Vec3::from_column_slice(field(&reply, "velocities"))
}

/// Two faces 1 mm wide that rise from the y axis, by `angle`/2 each.
fn valley(angle: f64) -> Shape {
    let (sine, cosine) = math::sin_cos(0.5 * angle);
    let side = |side: f64| {
        let corner = |along: f64, y: f64| [side * along * cosine, y, along * sine];
        let [a, b, c, d] = [corner(0.0, -1e-3), corner(1e-3, -1e-3), corner(1e-3, 1e-3), corner(0.0, 1e-3)];
        [[a, b, c], [a, c, d]]
    };
    Shape::Mesh(Arc::new(Mesh::new(&[side(1.0), side(-1.0)].concat()).unwrap()))
}

const DAMPED: [(&str, &str); 3] =
    [("particles.contact.restitution", "0.5"), ("particles.contact.law", "linear"), ("particles.spin", "false")];

#[test]
fn a_sphere_rebounds_from_a_flat_valley_as_from_a_plane() {
    for law in
        [&DAMPED[..], &[("particles.contact", "{ law = \"hertz\", young = 1e8, poisson = 0.3, restitution = 0.5 }")]]
    {
        let rebound = |shape: Shape, x: f64| {
            let place = Vec3::new(x * RADIUS, 0.3e-4, START);
            bounce(shape, place, Vec3::new(0.0, 0.0, -0.5), 5e-5, law).z
        };
        let flat = rebound(Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), 0.0);
        assert!((flat / 0.25 - 1.0).abs() < 0.03, "{flat}");
        for x in [0.0, 1e-4, 0.01, 0.1, 0.3] {
            for degrees in [1e-6, 1e-5, 1e-4, 1e-3f64] {
                let found = rebound(valley(degrees.to_radians()), x);
                assert!((found / flat - 1.0).abs() < 1e-3, "{degrees} {x}: {found} {flat}");
            }
        }
    }
}

#[test]
fn the_rebound_from_a_valley_has_no_jump_with_its_angle() {
    for x in [0.0, 0.005, 0.05] {
        let rebound = |degrees: f64| {
            let place = Vec3::new(x * RADIUS, 0.3e-4, START);
            bounce(valley(degrees.to_radians()), place, Vec3::new(0.0, 0.0, -0.5), 5e-5, &DAMPED).norm()
        };
        let mut before = rebound(1e-6);
        for step in 1..=70 {
            let degrees = 1e-6 * math::powf(10.0, f64::from(step) / 10.0);
            let now = rebound(degrees);
            assert!((now - before).abs() < 0.02, "{degrees} {x}: {before} {now}");
            before = now;
        }
    }
}

#[test]
fn an_elastic_bounce_in_a_valley_keeps_its_energy() {
    for law in ["{ law = \"linear\", spring = 1000 }", "{ law = \"hertz\", young = 1e8, poisson = 0.3 }"] {
        for degrees in [1e-4, 0.1, 1.0, 5.0, 10.0, 20.0f64] {
            for x in [0.0, 0.01, 0.03, 0.1] {
                let made = |substep: &str| {
                    let place = Vec3::new(x * RADIUS, 0.3e-4, START);
                    let overrides = [("particles.contact", law), ("particles.integrator.substep", substep)];
                    let velocity = Vec3::new(0.1, 0.0, -0.5);
                    bounce(valley(degrees.to_radians()), place, velocity, 6e-5, &overrides).norm_squared() / 0.26 - 1.0
                };
                let [coarse, fine] = ["2e-8", "5e-9"].map(made);
                assert!(coarse.abs() < 1e-3 && fine.abs() < 1e-4, "{law} {degrees} {x}: {coarse:e} {fine:e}");
            }
        }
    }
}

#[test]
fn facets_of_a_drum_converge_to_the_cylinder() {
    let drum = |facets: u32| {
        let corner = |facet: u32, y: f64| {
            let angle = std::f64::consts::TAU * f64::from(facet) / f64::from(facets);
            // The facets' middles lie on the cylinder.
            let radius = 1e-3 / math::cos(std::f64::consts::PI / f64::from(facets));
            [radius * math::cos(angle), y, radius * math::sin(angle)]
        };
        let facet = |facet: u32| {
            let [a, b, c, d] = [(facet, -1e-3), (facet + 1, -1e-3), (facet + 1, 1e-3), (facet, 1e-3)]
                .map(|(facet, y)| corner(facet % facets, y));
            [[a, b, c], [a, c, d]]
        };
        Shape::Mesh(Arc::new(Mesh::new(&(0..facets).flat_map(facet).collect::<Vec<_>>()).unwrap()))
    };
    let rebound = |shape: Shape, turn: f64| {
        let outward = Vec3::new(math::cos(turn), 0.0, math::sin(turn));
        let place = outward * (1e-3 - START) + Vec3::y() * 0.3e-4;
        -bounce(shape, place, outward * 0.5, 5e-5, &DAMPED).dot(&outward)
    };
    let (through_m, axis) = ([0.0; 3], [0.0, 1.0, 0.0]);
    let cylinder = Cylinder { through_m, axis, radius_m: 1e-3, particles: Side::Inside, length_m: None };
    let smooth = rebound(Shape::Cylinder(cylinder), 0.0);
    for (facets, within) in [(36, 0.05), (360, 0.02), (3600, 0.01)] {
        let pitch = std::f64::consts::TAU / f64::from(facets);
        for turn in [0.0, 0.1, 0.25, 0.5] {
            let found = rebound(drum(facets), turn * pitch);
            assert!((found / smooth - 1.0).abs() < within, "{facets} facets, at {turn}: {found} {smooth}");
        }
    }
}
