//! Particles that settle before the run: they are at rest, densely packed, the same every time, and an unsuitable scene is
//! told apart from a slow one.

use std::f64::consts::FRAC_PI_3;

use stagger_coupling::{Frozen, Physics as _, Window};
use stagger_physics::particles::{Particles, Settings, Start, start};
use stagger_scene::Scene;

/// 400 equal spheres of 1 mm in a box of 7 mm side, open above: soft, so that steps are long, yet no more than a hundredth of
/// a radius deep in each other under their weight.
const SCENE: &str = r#"
duration = "1 ms"
[particles]
count = 400
radius = "0.5 mm"
material = "glass"
start = { kind = "settle", box = ["7 mm", "7 mm", "7 mm"], at = [0, 0, 0] }
contact = { law = "hertz", young = "1 MPa", poisson = 0.3 }
[materials.glass]
density = 2500
[walls.tray]
box = { lower = [0, 0, 0], upper = ["7 mm", "7 mm", "7 mm"], open = ["+z"] }
[coupling]
dt = "0.1 ms"
"#;

fn settings(overrides: &[(&str, &str)]) -> Settings {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
    Scene::parse(SCENE, "settling.toml", &overrides).unwrap().settings::<Settings>().unwrap().clone()
}

/// Packing fraction of spheres in a column of the given base: their mean height is half the bed's.
fn packing(positions: &[[f64; 3]], radii: &[f64], base_m2: f64) -> f64 {
    let volume = |radius: &f64| 4.0 * FRAC_PI_3 * radius.powi(3);
    let total: f64 = radii.iter().map(volume).sum();
    let moment: f64 = positions.iter().zip(radii).map(|(position, radius)| position[2] * volume(radius)).sum();
    total / (2.0 * moment / total * base_m2)
}

fn refused(overrides: &[(&str, &str)]) -> String {
    start::place(&settings(overrides)).unwrap_err().to_string()
}

#[test]
fn equal_spheres_without_friction_pack_densely_and_stay_where_they_are() {
    let settings = settings(&[]);
    let placed = start::place(&settings).unwrap();
    // Frictionless spheres jam near 0.64; the smooth walls of a box seven diameters wide cost a tenth of that.
    let fraction = packing(&placed.positions, &placed.radii, 49e-6);
    assert!(fraction > 0.55 && fraction < 0.64, "{fraction}");
    assert!(placed.velocities.iter().all(|velocity| *velocity == [0.0; 3]));
    // Without artificial damping, in the time of a fall by a radius, √(2R/g) = 10 ms: the speed from which they were
    // stopped, √(2 · 1e-4 g R) = 1 mm/s, would carry them 0.02 R; none moves three times as far.
    let particles = Particles::new(Settings { start: given(placed), ..settings }).unwrap();
    let (mut state, first) = particles.initial().unwrap();
    let mut reply = first.clone();
    for k in 0..10 {
        let window = Window { t_s: f64::from(k) * 1e-3, dt_s: 1e-3 };
        (state, reply) = particles.solve(&state, &Frozen::default(), window).unwrap();
        assert!(reply.not_converged.is_none());
    }
    let [before, after] = [first, reply].map(|reply| reply.fields["positions"].f64().unwrap().to_vec());
    let moved = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(moved < 0.06 * 0.5e-3, "{moved:e}");
}

fn given(placed: start::Placed) -> Start {
    Start::Given {
        positions_m: placed.positions,
        velocities_m_s: placed.velocities,
        radii_m: placed.radii,
        materials: placed.materials,
        spins_rad_s: placed.spins,
    }
}

#[test]
fn spheres_of_two_sizes_settle_with_friction_against_any_gravity_the_same_every_time() {
    // Down is along +y; the tray's wall there is the floor.
    let overrides = [
        ("particles.count", "40"),
        ("particles.groups.fine", "{ count = 80, radius = \"0.3 mm\" }"),
        ("particles.gravity", "[0, 9.81, 0]"),
        ("particles.spin", "true"),
        ("particles.friction", "{ law = \"spring\", static = 0.5, dynamic = 0.5 }"),
        ("particles.start.box", "[\"4 mm\", \"4 mm\", \"4 mm\"]"),
        ("walls.tray.box", "{ lower = [0, 0, 0], upper = [\"4 mm\", \"4 mm\", \"4 mm\"], open = [\"-y\"] }"),
    ];
    let placed = start::place(&settings(&overrides)).unwrap();
    assert_eq!(placed, start::place(&settings(&overrides)).unwrap());
    assert!(placed.radii.is_sorted_by(|a, b| a >= b) && placed.radii[40] == 0.3e-3);
    let floors = placed.positions.iter().zip(&placed.radii).filter(|(position, radius)| position[1] + *radius > 4e-3);
    // A layer of them rests on the floor, pressed into it by at most a few hundredths of a radius.
    assert!(floors.clone().count() > 8, "{}", floors.count());
    for (position, radius) in placed.positions.iter().zip(&placed.radii) {
        let inside = |x: f64| x > 0.96 * radius && x + 0.96 * radius < 4e-3;
        assert!(inside(position[0]) && inside(position[2]) && position[1] + 0.96 * radius < 4e-3, "{position:?}");
    }
    let seed = [overrides.as_slice(), &[("seed", "2")]].concat();
    assert_ne!(placed, start::place(&settings(&seed)).unwrap());
}

#[test]
fn one_sphere_comes_to_lie_on_the_floor_and_none_on_nothing() {
    assert!(start::place(&settings(&[("particles.count", "0")])).unwrap().positions.is_empty());
    let one = start::place(&settings(&[("particles.count", "1"), ("particles.start.until", "1e-7")])).unwrap();
    // Under its weight it lies δ = (3 m g (1 − ν²)/(4 √R E))^{2/3} deep in the floor.
    let weight = 4.0 * FRAC_PI_3 * 0.125e-9 * 2500.0 * 9.81;
    let depth = (0.75 * weight * 0.91 / (0.5e-3f64.sqrt() * 1e6)).powf(2.0 / 3.0);
    // With 1e-7 m g R it still swings about it by √(2 · 1e-7 R/(1.5 δ)) of δ, 0.011 here.
    let found = 0.5e-3 - one.positions[0][2];
    assert!((found / depth - 1.0).abs() < 0.02, "{found:e} instead of {depth:e}");
}

#[test]
fn walls_stand_still_while_particles_settle() {
    let fixed = start::place(&settings(&[("particles.count", "30")])).unwrap();
    let falling = [("particles.count", "30"), ("walls.tray.motion", "{ kind = \"constant\", velocity = [0, 0, -1] }")];
    assert_eq!(fixed, start::place(&settings(&falling)).unwrap());
}

#[test]
fn what_cannot_settle_is_told() {
    let lid = refused(&[("walls.tray.box.open", "[]")]);
    assert!(lid.contains("reach into walls") && lid.contains("`tray`"), "{lid}");
    let sieve = [
        ("particles.count", "20"),
        ("walls.tray.box.open", "[\"+z\", \"-z\"]"),
        ("particles.start.longest", "\"50 ms\""),
    ];
    let sieve = refused(&sieve);
    assert!(
        sieve.contains("not at rest after 5e-2 s") && sieve.contains("20 of 20 particles touch nothing"),
        "{sieve}"
    );
    let ball = "{ kind = \"settle\", sphere = \"3.5 mm\", at = [\"3.5 mm\", \"3.5 mm\", \"3.5 mm\"] }";
    let ball = refused(&[("particles.start", ball), ("particles.count", "150")]);
    assert!(ball.contains("packing fraction in the start region is 0.437"), "{ball}");
}

#[test]
fn a_scene_is_checked_without_settling() {
    let endless = settings(&[("walls.tray.box.open", "[\"+z\", \"-z\"]"), ("particles.start.longest", "1e9")]);
    let quick = endless.clone().without_settling();
    assert!(matches!(quick.start, Start::SequentialAddition { .. }));
    assert_eq!(Particles::new(quick).unwrap().initial().unwrap().1.fields["positions"].rows(), 400);
}
