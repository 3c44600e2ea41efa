//! Time of a current solve through a bed of 10⁵ particles: `cargo bench -p stagger-physics --bench current`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::{collections::BTreeMap, sync::Arc, time::Instant};

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use stagger_coupling::{Frozen, Physics, Reply, Window};
use stagger_messages::{Field, Fields, Values};
use stagger_physics::{
    common::{Conductance, Shape, Wall, walls::Electrode},
    current::{Conductivity, Current, Method, Model, Settings, Solver, State},
};

/// Particles along each side of the bed, which lies between two electrified walls.
const SIDE: u32 = 46;

/// A bed as a cubic lattice of 47 layers with nine of ten contacts, of areas that differ by a factor of up to a hundred;
/// rows are numbered at random, as those of a bed that was poured.
struct Bed {
    radii: Vec<f64>,
    pairs: Vec<u32>,
    areas: Vec<f64>,
    walls: Vec<u32>,
}

fn bed() -> Bed {
    let mut random = ChaCha8Rng::from_seed([1; 32]);
    let mut uniform = || random.next_u64() as f64 / u64::MAX as f64;
    let layers = SIDE + 1;
    let count = SIDE * SIDE * layers;
    let mut rows: Vec<u32> = (0..count).collect();
    for last in (1..rows.len()).rev() {
        rows.swap(last, (uniform() * (last + 1) as f64) as usize % (last + 1));
    }
    let at = |x: u32, y: u32, z: u32| rows[(x + SIDE * (y + SIDE * z)) as usize];
    let (mut pairs, mut areas, mut walls) = (Vec::new(), Vec::new(), Vec::new());
    for z in 0..layers {
        for y in 0..SIDE {
            for x in 0..SIDE {
                let others = [
                    (x + 1 < SIDE).then(|| at(x + 1, y, z)),
                    (y + 1 < SIDE).then(|| at(x, y + 1, z)),
                    (z + 1 < layers).then(|| at(x, y, z + 1)),
                ];
                for other in others.into_iter().flatten() {
                    if uniform() < 0.9 {
                        pairs.extend([at(x, y, z), other]);
                        areas.push(1e-10 * 10f64.powf(-2.0 * uniform()));
                    }
                }
            }
        }
    }
    for y in 0..SIDE {
        for x in 0..SIDE {
            walls.extend([at(x, y, 0), 0, at(x, y, layers - 1), 1]);
        }
    }
    Bed { radii: vec![25e-6; count as usize], pairs, areas, walls }
}

fn fields(current: &Current, bed: &Bed, areas: &[f64]) -> Fields {
    let touches = bed.walls.len() / 2;
    let values = |name: &str| -> Values {
        match name {
            "radii" => bed.radii.clone().into(),
            "contact_pairs" => bed.pairs.clone().into(),
            "contact_area" => areas.to_vec().into(),
            "contact_distance" => vec![49e-6; areas.len()].into(),
            "wall_contact_pairs" => bed.walls.clone().into(),
            "wall_contact_area" => vec![1e-10; touches].into(),
            _ => vec![24.5e-6; touches].into(),
        }
    };
    let reads = current.ports().reads.into_iter();
    let field = |port: stagger_messages::Port| {
        let values = values(&port.field);
        (port.field.clone(), Field::new(&Arc::new(port), 0, values).unwrap())
    };
    reads.map(field).collect::<BTreeMap<_, _>>()
}

fn main() {
    let bed = bed();
    let (particles, contacts) = (bed.radii.len(), bed.areas.len());
    println!("{particles} particles, {contacts} contacts between them, {} with walls", bed.walls.len() / 2);
    println!("{:<46} {:>7} {:>10} {:>9} {:>12} {:>11}", "", "threads", "iterations", "ms", "µs/particle", "µs/contact");
    let wall = |name: &str, potential_v: f64, current_density: f64| Wall {
        electrode: Electrode {
            potential_v: Some(potential_v),
            current_a: None,
            current_density_a_m2: Some(current_density),
        },
        ..Wall::fixed(name, Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), None)
    };
    let settings = Settings {
        count: particles,
        model: Model::Potential { conductance: Conductance::Monograph },
        conductivity: Conductivity::constant(1e6),
        temperature_k: 300.0,
        walls: vec![wall("lower", 0.0, 0.0), wall("upper", 1.0, 1e5)],
        starts_s: 0.0,
        ends_s: f64::INFINITY,
        solver: Solver { method: Method::ConjugateGradient, tolerance: 1e-12, iterations: 1_000_000 },
    };
    let window = Window { t_s: 0.0, dt_s: 1.0 };
    let report = |what: &str, threads: usize, solve: &(dyn Fn() -> Reply + Sync)| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let once = || {
            let start = Instant::now();
            let reply = pool.install(solve);
            (start.elapsed().as_secs_f64(), reply.figures["iterations"])
        };
        let (best, iterations) =
            (0..5).map(|_| once()).fold((f64::INFINITY, 0.0), |best, run| (run.0.min(best.0), run.1));
        let per = |count: usize| 1e6 * best / count as f64;
        let (ms, each, contact) = (1e3 * best, per(particles), per(contacts));
        println!("{what:<46} {threads:>7} {iterations:>10} {ms:>9.1} {each:>12.2} {contact:>11.2}");
    };
    for threads in [1, 2] {
        let current = Current::new(settings.clone()).unwrap();
        let at = fields(&current, &bed, &bed.areas);
        let still = Frozen { start: at.clone(), end: at };
        let (state, _) = current.solve(&State::default(), &still, window).unwrap();
        report("potential, cold", threads, &|| current.solve(&State::default(), &still, window).unwrap().1);
        report("potential, warm, nothing changed", threads, &|| current.solve(&state, &still, window).unwrap().1);
        for change in [1e-8, 1e-5, 1e-2] {
            let moved: Vec<f64> =
                bed.areas.iter().zip(0..).map(|(area, i)| area * (1.0 + change * f64::from(i % 3))).collect();
            let end = fields(&current, &bed, &moved);
            let frozen = Frozen { start: end.clone(), end };
            report(&format!("potential, warm, contacts changed by {change:.0e}"), threads, &|| {
                current.solve(&state, &frozen, window).unwrap().1
            });
        }
        let averaging = Model::Averaging { heat_share: 1.0 };
        let current = Current::new(Settings { model: averaging, ..settings.clone() }).unwrap();
        report("averaging, cold", threads, &|| current.solve(&State::default(), &still, window).unwrap().1);
    }
    let (model, solver) = (Model::Averaging { heat_share: 1.0 }, settings.solver);
    for (method, tolerance) in [(Method::Jacobi, 1e-3), (Method::Jacobi, 1e-5), (Method::ConjugateGradient, 1e-5)] {
        let solver = Solver { method, tolerance, ..solver };
        let current = Current::new(Settings { model, solver, ..settings.clone() }).unwrap();
        let at = fields(&current, &bed, &bed.areas);
        let still = Frozen { start: at.clone(), end: at };
        report(&format!("averaging, {method:?}, to {tolerance:.0e}"), 2, &|| {
            current.solve(&State::default(), &still, window).unwrap().1
        });
    }
}
