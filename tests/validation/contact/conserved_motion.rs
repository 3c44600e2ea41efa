//! What motion keeps whatever its steps: a charge's speed in a magnetic field, angular momentum where surfaces rub.

use nalgebra::Vector3;
use stagger_coupling::{Physics as _, Reply, math};
use stagger_physics::{
    common::{Shape, Wall},
    particles::{Particles, Settings, Start, State},
};
use stagger_scene::Scene;

use super::{
    bed::{Sphere, entry, field, mass, run},
    spin::spins,
};

type Vec3 = Vector3<f64>;

const SCENE: &str = r#"
duration = 1
[materials.matter]
density = 1000
[particles]
count = 1
radius = 1
material = "matter"
start = { box = [9, 9, 9] }
gravity = [0, 0, 0]
contact = { stiffness = 1e3 }
[coupling]
dt = 1
"#;

/// Of the scene's matter, in kg/m³.
const DENSITY: f64 = 1000.0;

/// Spheres with what `extra` adds to `[particles]`, and its tables after it; `scene` is [`SCENE`] or like it.
fn settings(scene: &str, spheres: &[Sphere], extra: &str) -> Settings {
    let text = scene.replace("[coupling]", &format!("{extra}\n[coupling]"));
    let settings = Scene::parse(&text, "kept.toml", &[]).unwrap().settings::<Settings>().unwrap().clone();
    let start = Start::Given {
        positions_m: spheres.iter().map(|sphere| sphere.0).collect(),
        velocities_m_s: spheres.iter().map(|sphere| sphere.1).collect(),
        radii_m: spheres.iter().map(|sphere| sphere.2).collect(),
        materials: vec![0; spheres.len()],
        spins_rad_s: Vec::new(),
    };
    Settings { start, ..settings }
}

fn particles(spheres: &[Sphere], extra: &str) -> Particles {
    Particles::new(settings(SCENE, spheres, extra)).unwrap()
}

/// Vectors by row.
fn vectors(reply: &Reply, name: &str) -> Vec<Vec3> {
    field(reply, name).as_chunks::<3>().0.iter().map(|&row| row.into()).collect()
}

/// The only particle's velocity after so many windows.
fn velocity(particles: &Particles, windows: usize, dt_s: f64) -> Vec3 {
    vectors(&run(particles, windows, dt_s, |_, _| ()).1, "velocities")[0]
}

/// 3 C/kg in 2 T: 6 rad/s.
const TURNING: &str = "[particles.electromagnetic]\ncharge = 3\nmagnetic = [0, 0, 2]";
const ALONE: [Sphere; 1] = [([0.0; 3], [1.0, 0.0, 0.25], 1.0)];

#[test]
fn a_magnetic_field_keeps_the_speed_over_a_hundred_thousand_turns() {
    // 2 rad a substep; substeps of an uneven window, and windows of one substep.
    let charge = particles(&ALONE, &format!("integrator = {{ kind = \"verlet\", substep = 0.3333 }}\n{TURNING}"));
    let turns = 1e5 * std::f64::consts::TAU / 6.0;
    // A window of at most two thousand radii.
    let velocity = velocity(&charge, 100, turns / 100.0);
    let speed = velocity.norm() / 1.0625f64.sqrt();
    // Two rotations in each of 3e5 substeps, rounded: 1e-16 in each, nearly at random.
    assert!((speed - 1.0).abs() < 1e-11, "{speed}");
    assert!((velocity.z - 0.25).abs() < 1e-15);
}

#[test]
fn the_trapezoidal_rule_at_one_half_keeps_the_speed_too() {
    let speed = |phi: f64| {
        let rule =
            format!("integrator = {{ kind = \"trapezoidal\", phi = {phi}, tolerance = 1e-13, iterations = 100 }}");
        let charge = particles(&ALONE, &format!("{rule}\n{TURNING}"));
        velocity(&charge, 1000, 0.05).norm() / 1.0625f64.sqrt()
    };
    assert!((speed(0.5) - 1.0).abs() < 1e-10, "{}", speed(0.5));
    // Backward Euler takes 1/√(1 + θ²) of what turns in each step.
    assert!(speed(1.0) < 0.5);
}

#[test]
fn helix_and_drift_are_of_second_order_beside_drag() {
    // m v̇ = q (E + v × B) − c v: with w = v_x + i v_y, ẇ = −(γ + iω) w + q E/m.
    let (omega, gamma, field) = (6.0f64, 0.4f64, 3.0 * 0.5);
    let mass = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI;
    let viscosity = gamma * mass / (6.0 * std::f64::consts::PI);
    let end = 1.5f64;
    let exact = {
        let square = gamma * gamma + omega * omega;
        let steady = [field * gamma / square, -field * omega / square];
        let (sine, cosine) = math::sin_cos(omega * end);
        let (x, y) = (1.0 - steady[0], -steady[1]);
        let decay = math::exp(-gamma * end);
        Vec3::new(
            steady[0] + decay * (x * cosine + y * sine),
            steady[1] + decay * (y * cosine - x * sine),
            0.25 * decay,
        )
    };
    let error = |substep: f64| {
        let extra = format!(
            "integrator = {{ kind = \"verlet\", substep = {substep} }}\ndrag = {{ viscosity = {viscosity} }}\n{TURNING}\n\
             electric = [0.5, 0, 0]"
        );
        (velocity(&particles(&ALONE, &extra), 3, end / 3.0) - exact).norm()
    };
    let errors = [0.02, 0.01, 0.005].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 2.0).abs() < 0.1 && errors[2] < 1e-3, "{errors:?}");
    }
}

#[test]
fn charges_that_bounce_keep_their_energy_to_the_integrator_s_order() {
    let spheres = [([0.0, 0.0, 1.5], [1.0, 0.3, 0.2], 1.0), ([2.5, 0.4, 1.4], [-1.0, 0.0, -0.5], 1.0)];
    let drift = |substep: f64| {
        let extra = format!("integrator = {{ kind = \"verlet\", substep = {substep} }}\n{TURNING}");
        let settings = settings(&SCENE.replace("1e3 }", "1e7 }"), &spheres, &extra);
        let shape = Shape::Box { lower_m: [-2.0, -2.0, 0.0], upper_m: [4.0; 3], open: Vec::new() };
        let walls = vec![Wall::fixed("w", shape, None)];
        let charges = Particles::new(Settings { walls, ..settings }).unwrap();
        let energy = |reply: &Reply| entry(reply, "kinetic") + entry(reply, "elastic");
        let before = energy(&charges.initial().unwrap().1);
        let (_, reply) = run(&charges, 40, 0.25, |_, _| ());
        (energy(&reply) / before - 1.0).abs()
    };
    let [coarse, fine] = [4e-3, 1e-3].map(drift);
    assert!(coarse < 1e-3 && fine < 1e-4, "{coarse:e} {fine:e}");
}

/// Angular momentum about the origin of each particle on its orbit, and that of its spin, in kg m²/s.
fn angular_momenta((state, reply): &(State, Reply)) -> Vec<[Vec3; 2]> {
    let (positions, velocities) = (vectors(reply, "positions"), vectors(reply, "velocities"));
    let (radii, spins) = (field(reply, "radii"), spins(state));
    let of = |i: usize| {
        let mass = mass(radii[i], DENSITY);
        let inertia = 0.4 * mass * radii[i].powi(2);
        [positions[i].cross(&velocities[i]) * mass, Vec3::from(spins[i]) * inertia]
    };
    (0..radii.len()).map(of).collect()
}

/// Sum over all particles, and the sum of the sizes of what their spins have.
fn whole(momenta: &[[Vec3; 2]]) -> (Vec3, f64) {
    (momenta.iter().flatten().sum(), momenta.iter().map(|[_, spin]| spin.norm()).sum())
}

const RUBBING: [&str; 3] = [
    "friction = { law = \"spring\", static = 0.5, dynamic = 0.5 }",
    "friction = { law = \"regularised\", stiffness = 1e6, static = 0.5, dynamic = 0.5 }",
    "friction = { law = \"spring\", static = 0.5, dynamic = 0.5 }\nrolling = { rolling = 0.1, torsion = 0.1 }\n\
     overlap-bond = { stiffness = 1e3, strain = 1e-3, shear-stiffness = 1e5 }",
];

#[test]
fn two_spheres_that_rub_keep_their_angular_momentum() {
    for (radius, friction) in [1.0, 0.3, 4.0].into_iter().flat_map(|radius| RUBBING.map(|friction| (radius, friction)))
    {
        let spheres = [([0.0, 0.0, -1.0], [0.1, 0.02, 0.025], 1.0), ([0.05, 0.0, radius], [-0.1, 0.0, -0.025], radius)];
        let change = |arm: &str| {
            let extra = format!("spin = true\nlever-arm = \"{arm}\"\n{friction}");
            let pair = particles(&spheres, &extra);
            let start = whole(&angular_momenta(&pair.initial().unwrap())).0;
            let (end, turned) = whole(&angular_momenta(&run(&pair, 20, 0.05, |_, _| ())));
            let size = |(place, velocity, radius): Sphere| {
                mass(radius, DENSITY) * Vec3::from(place).norm() * Vec3::from(velocity).norm()
            };
            let orbits: f64 = spheres.into_iter().map(size).sum();
            let made = (end - start).norm();
            (made / (turned + orbits), made / turned)
        };
        let (kept, _) = change("contact-point");
        assert!(kept < 1e-13, "R = {radius}, {friction}: {kept:e}");
        // The monograph's arms are longer together than the distance, by the overlap.
        let (_, made) = change("radius");
        assert!(made > 1e-5 && made < 0.2, "R = {radius}, {friction}: {made:e}");
    }
}

#[test]
fn a_crowd_that_rubs_keeps_its_angular_momentum() {
    // A ball of 200 spheres of two sizes, stirred and thrown together.
    let side = 6;
    let mut spheres = Vec::new();
    for k in 0..side * side * side {
        let place = [k % side, (k / side) % side, k / (side * side)].map(|index| f64::from(index) - 2.5);
        let radius = if k % 3 == 0 { 0.5 } else { 0.4 };
        let [x, y, z] = place;
        let velocity = [-0.3 * x - 0.2 * y + 0.05 * math::sin(f64::from(k) * 0.7), -0.3 * y + 0.2 * x, -0.3 * z];
        spheres.push((place, velocity, radius));
    }
    let crowd = particles(&spheres, &format!("spin = true\n{}", RUBBING[0]));
    let start = whole(&angular_momenta(&crowd.initial().unwrap())).0;
    let last = run(&crowd, 40, 0.05, |_, _| ());
    assert!(entry(&last.1, "friction").abs() > 0.0);
    let (end, turned) = whole(&angular_momenta(&last));
    let (change, size) = ((end - start).norm(), start.norm());
    assert!(turned > 1e-3 * size, "they spin: {turned:e} of {size:e}");
    assert!(change < 1e-11 * (size + turned), "{change:e} of {size:e}");
}
