//! The critical step that is reported, against the true one: 2/ω of the stiffest vibration, and what Verlet does there.

use nalgebra::{DMatrix, DVector};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use super::{
    forces::{At, Evaluator},
    state_at::state_at_start,
};
use crate::{
    common::{Shape, Vec3, Wall, random::uniform},
    particles::{
        exchange::external_fields::ExternalFields,
        model::{
            Model,
            state::{Forces, State},
        },
        settings::{ContactLaw, Friction, Material, Settings, Start},
        start,
    },
};

const LINEAR: ContactLaw = ContactLaw::Linear { stiffness_n_m: 1e4 };
const LAWS: [ContactLaw; 3] = [
    LINEAR,
    ContactLaw::Hertz { young_pa: 1e9, poisson: 0.3 },
    ContactLaw::Overlap { stiffness_pa: 1e8, exponent: 2.0 },
];

/// Spheres at rest between walls, free to spin.
fn settings(spheres: &[(Vec3, f64)], walls: Shape, law: ContactLaw) -> Settings {
    let start = Start::Given {
        positions_m: spheres.iter().map(|(position, _)| (*position).into()).collect(),
        velocities_m_s: vec![[0.0; 3]; spheres.len()],
        radii_m: spheres.iter().map(|(_, radius)| *radius).collect(),
        materials: vec![0; spheres.len()],
        spins_rad_s: Vec::new(),
    };
    let material = Material { name: "matter".into(), density_kg_m3: 2500.0, stiffness: None, poisson: None };
    Settings {
        gravity_m_s2: [0.0; 3],
        walls: vec![Wall::fixed("wall", walls, None)],
        spin: true,
        skin: 0.0,
        ..Settings::new(start, material, law)
    }
}

/// Forces and moments after motion with the given velocities for a time, at the given positions.
fn evaluate(
    model: &Model,
    state: &State,
    positions: &[Vec3],
    velocities: &[Vec3],
    spins: &[Vec3],
    step_s: f64,
) -> Forces {
    let mut forces = state.forces.clone();
    let at = At { positions, velocities, spins, turning: spins, walls: &state.walls, t_s: 0.0, fraction: 0.0, step_s };
    Evaluator::new(model, state, &ExternalFields::default()).evaluate(at, &mut forces).unwrap();
    forces
}

/// The largest angular frequency of small vibrations about a state, in rad/s: normal springs yield to displacements,
/// tangential ones to the motion that stretches them, which moves the surfaces without moving the centres.
fn fastest(model: &Model, state: &State) -> f64 {
    let count = state.bodies.len();
    let none = vec![Vec3::zeros(); count];
    let flat = |forces: &Forces| -> DVector<f64> {
        DVector::from_iterator(6 * count, forces.force.iter().chain(&forces.moment).flat_map(|vector| vector.data.0[0]))
    };
    // A millionth of a radius: differences are good to about 1e-6 against curvature and rounding.
    let h = 1e-6 * state.bodies.radii.iter().copied().fold(f64::INFINITY, f64::min);
    let rest = evaluate(model, state, &state.motion.positions, &none, &none, 1.0);
    let mut stiffness = DMatrix::zeros(6 * count, 6 * count);
    for column in 0..6 * count {
        let (i, axis) = (column % (3 * count) / 3, column % 3);
        let mut yields = none.clone();
        yields[i][axis] = 1.0;
        let difference = if column < 3 * count {
            let moved = |way: f64| -> Vec<Vec3> {
                state.motion.positions.iter().zip(&yields).map(|(position, side)| position + side * way).collect()
            };
            let [before, after] = [-h, h].map(|way| flat(&evaluate(model, state, &moved(way), &none, &none, 1.0)));
            let slid = evaluate(model, state, &state.motion.positions, &yields, &none, h);
            (before - after) / (2.0 * h) + (flat(&rest) - flat(&slid)) / h
        } else {
            let angle = h / state.bodies.radii[i];
            let turned = evaluate(model, state, &state.motion.positions, &none, &yields, angle);
            (flat(&rest) - flat(&turned)) / angle
        };
        stiffness.set_column(column, &difference);
    }
    let masses = state.bodies.masses.iter().chain(&state.bodies.inertias).flat_map(|mass| [*mass; 3]);
    let roots: Vec<f64> = masses.map(f64::sqrt).collect();
    let scaled = DMatrix::from_fn(6 * count, 6 * count, |row, column| {
        0.5 * (stiffness[(row, column)] + stiffness[(column, row)]) / (roots[row] * roots[column])
    });
    scaled.symmetric_eigenvalues().max().sqrt()
}

/// Spheres of radii from 0.5 to 1.5 mm at random in a cube, none deeper in another than a tenth of their radii's sum.
fn cluster(count: usize, seed: u64) -> Vec<(Vec3, f64)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut spheres: Vec<(Vec3, f64)> = Vec::new();
    for _ in 0..1_000_000 {
        let radius = 1e-3 * (0.5 + uniform(&mut random));
        let position = Vec3::from_fn(|_, _| 1e-3 + 5e-3 * uniform(&mut random));
        if spheres.iter().all(|(other, size)| (position - other).norm() > 0.9 * (radius + size)) {
            spheres.push((position, radius));
        }
        if spheres.len() == count {
            break;
        }
    }
    spheres
}

#[test]
fn the_reported_step_is_stable_for_any_cluster_and_a_fair_share_of_the_largest_that_is() {
    let spring = Friction::Spring {
        stiffness_ratio: None,
        damping_ratio: Some(0.0),
        static_coefficient: 1.0,
        dynamic_coefficient: 1.0,
    };
    for law in LAWS {
        for seed in 0..6 {
            // Friction adds stiffness that no single motion feels whole.
            let (friction, least) = if seed % 2 == 0 { (None, 0.5) } else { (Some(spring), 1.0 / 3.0) };
            let settings = settings(&cluster(16, seed), Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), law);
            let model = start::model(Settings { friction, ..settings }).unwrap();
            let state = state_at_start(&model).unwrap();
            let share = state.critical_s * fastest(&model, &state) / 2.0;
            assert!(share < 1.0 + 1e-5 && share > least, "{law:?}, cluster {seed}: {share}");
        }
    }
}

/// Spheres of 1 mm on a cubic lattice of the given sides, all pressed into each other and into six walls by 20 µm.
fn pressed(sides: [u32; 3]) -> Model {
    let pitch = 1.98e-3;
    let [x, y, z] = sides;
    let sites = (0..x * y * z).map(|k| [k % x, k / x % y, k / (x * y)].map(|index| 0.98e-3 + f64::from(index) * pitch));
    let spheres: Vec<_> = sites.map(|site| (Vec3::from(site), 1e-3)).collect();
    let upper_m = sides.map(|side| 2.0 * 0.98e-3 + f64::from(side - 1) * pitch);
    let walls = Shape::Box { lower_m: [0.0; 3], upper_m, open: Vec::new() };
    start::model(Settings { spin: false, ..settings(&spheres, walls, LINEAR) }).unwrap()
}

/// How many times a tiny disturbance has grown after many steps of velocity Verlet, written out here.
fn growth(model: &Model, step_s: f64) -> f64 {
    let state = state_at_start(model).unwrap();
    let rest = state.motion.positions.clone();
    let none = vec![Vec3::zeros(); rest.len()];
    let (mut positions, mut velocities) = (rest.clone(), none.clone());
    let tiny = 1e-12;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for position in &mut positions {
        *position += Vec3::from_fn(|_, _| tiny * (2.0 * uniform(&mut random) - 1.0));
    }
    for _ in 0..500 {
        let forces = evaluate(model, &state, &positions, &none, &none, step_s);
        for (i, force) in forces.force.iter().enumerate() {
            velocities[i] += force * (step_s / state.bodies.masses[i]);
            positions[i] += velocities[i] * step_s;
        }
    }
    positions.iter().zip(&rest).map(|(now, then)| (now - then).norm()).fold(0.0, f64::max) / tiny
}

#[test]
fn verlet_is_stable_just_below_the_reported_step_and_not_just_above_the_true_one() {
    // One sphere between six walls, two, a row and a block. The axes vibrate apart, and the report, which adds them up, stays
    // below by up to √3.
    for (sides, least) in [([1, 1, 1], 0.57), ([2, 1, 1], 0.5), ([20, 1, 1], 0.5), ([3, 3, 3], 0.5)] {
        let model = pressed(sides);
        let state = state_at_start(&model).unwrap();
        let true_s = 2.0 / fastest(&model, &state);
        assert!(state.critical_s / true_s > least, "{sides:?}: {}", state.critical_s / true_s);
        // Below, what is left is a beat of bounded size; above, a step multiplies by e to the cosh⁻¹ of 2 · 1.02² − 1, 0.4,
        // which makes e²⁰⁰ of it, until contacts open.
        let (below, above) = (growth(&model, 0.99 * state.critical_s), growth(&model, 1.02 * true_s));
        assert!(below < 100.0 && above > 1e6, "{sides:?}: {below:e} {above:e}");
    }
}
