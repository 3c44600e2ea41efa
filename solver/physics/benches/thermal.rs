//! Time of one window of the particles' temperature on one thread: `cargo bench -p stagger-physics --bench thermal`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::{f64::consts::PI, hint::black_box, sync::Arc, time::Instant};

use stagger_coupling::{Frozen, Physics, Window};
use stagger_messages::{Field, Fields, Port, Values};
use stagger_physics::{
    common::{Shape, Wall},
    thermal::{Conductance, Enthalpy, Material, Overshoot, PhaseChange, Phases, Settings, Solver, Table, Thermal},
};

const RADIUS_M: f64 = 25e-6;
const AREA_M2: f64 = 1e-10;
const DISTANCE_M: f64 = 48e-6;
const DENSITY_KG_M3: f64 = 7950.0;
const CAPACITY_J_KG_K: f64 = 500.0;
const CONDUCTIVITY_W_M_K: f64 = 15.0;

/// A simple-cubic bed of `side`³ spheres on a hot plate, with light on its top layer.
struct Bed {
    side: u32,
    pairs: Vec<u32>,
}

impl Bed {
    fn new(side: u32) -> Self {
        let index = |x: u32, y: u32, z: u32| (z * side + y) * side + x;
        let mut pairs = Vec::new();
        for z in 0..side {
            for y in 0..side {
                for x in 0..side {
                    let here = index(x, y, z);
                    for (inside, there) in [
                        (x + 1 < side, index(x + 1, y, z)),
                        (y + 1 < side, index(x, y + 1, z)),
                        (z + 1 < side, index(x, y, z + 1)),
                    ] {
                        if inside {
                            pairs.extend([here, there]);
                        }
                    }
                }
            }
        }
        Self { side, pairs }
    }

    fn count(&self) -> usize {
        self.side.pow(3) as usize
    }

    fn contacts(&self) -> usize {
        self.pairs.len() / 2
    }

    fn fields(&self, thermal: &Thermal, power_w: f64) -> Fields {
        let layer = (self.side * self.side) as usize;
        let values = |port: &Port| -> Values {
            match port.field.as_str() {
                "radii" => vec![RADIUS_M; self.count()].into(),
                "absorbed_power" => {
                    let lit = self.count() - layer;
                    (0..self.count()).map(|i| if i >= lit { power_w } else { 0.0 }).collect::<Vec<_>>().into()
                }
                "contact_pairs" => self.pairs.clone().into(),
                "contact_area" => vec![AREA_M2; self.contacts()].into(),
                "contact_distance" => vec![DISTANCE_M; self.contacts()].into(),
                "wall_contact_pairs" => (0..layer as u32).flat_map(|i| [i, 0]).collect::<Vec<_>>().into(),
                "wall_contact_area" => vec![AREA_M2; layer].into(),
                _ => vec![0.5 * DISTANCE_M; layer].into(),
            }
        };
        let reads = thermal.ports().reads.into_iter();
        reads.map(|port| (port.field.clone(), Field::new(&Arc::new(port.clone()), 0, values(&port)).unwrap())).collect()
    }
}

fn thermal(count: usize, enthalpy: Option<Enthalpy>) -> Thermal {
    Thermal::new(Settings {
        count,
        temperature_k: 300.0,
        pour_temperature_k: None,
        start: None,
        density_kg_m3: DENSITY_KG_M3,
        heat_capacity_j_kg_k: CAPACITY_J_KG_K,
        conductivity_w_m_k: CONDUCTIVITY_W_M_K,
        conductance: Conductance::Monograph,
        walls: vec![Wall::fixed("plate", Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), Some(600.0))],
        phi: 0.5,
        solid: None,
        overshoot: Overshoot::Implicit,
        tolerance: 1e-8,
        iterations: 100_000,
        enthalpy,
    })
    .unwrap()
}

fn enthalpy(solver: Solver, with_phases: bool) -> Enthalpy {
    let phases = with_phases.then_some(Phases {
        melting: Some(PhaseChange { from_k: 1658.0, width_k: 65.0, latent_j_kg: 2.6e5 }),
        boiling: Some(PhaseChange { from_k: 3134.0, width_k: 0.0, latent_j_kg: 6.1e6 }),
    });
    let steel = Material {
        name: "316L".into(),
        density_kg_m3: DENSITY_KG_M3,
        heat_capacity_j_kg_k: Table::constant(CAPACITY_J_KG_K),
        conductivity_w_m_k: Table::constant(CONDUCTIVITY_W_M_K),
        phases,
    };
    Enthalpy { materials: vec![steel], solver, ambient: None }
}

fn main() {
    let mass_kg = DENSITY_KG_M3 * 4.0 / 3.0 * PI * RADIUS_M.powi(3);
    // The time in which one contact carries a particle's heat; six contacts make the explicit limit a sixth of it.
    let limit_s = mass_kg * CAPACITY_J_KG_K * DISTANCE_M / (CONDUCTIVITY_W_M_K * AREA_M2) / 6.0;
    println!(
        "{:>9} {:>9} {:>10} {:>26} {:>7} {:>7} {:>10} {:>12} {:>12}",
        "particles", "contacts", "dt/limit", "form", "sweeps", "linear", "best ms", "ns/particle", "ns/contact"
    );
    for side in [22, 46] {
        let bed = Bed::new(side);
        for share in [0.3, 1000.0] {
            let dt_s = share * limit_s;
            // Melts the top layer half within ten short windows, and boils some of it in a long one.
            let power_w = mass_kg * 8e5 / (if share > 1.0 { dt_s } else { 10.0 * dt_s });
            for (form, of) in [
                ("temperature", None),
                ("sweeps", Some(enthalpy(Solver::FixedPoint, false))),
                ("gradients", Some(enthalpy(Solver::ConjugateGradient, false))),
                ("sweeps, phases", Some(enthalpy(Solver::FixedPoint, true))),
                ("gradients, phases", Some(enthalpy(Solver::ConjugateGradient, true))),
            ] {
                let thermal = thermal(bed.count(), of);
                let fields = bed.fields(&thermal, power_w);
                let frozen = Frozen { start: fields.clone(), end: fields };
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
                let (best_s, figures) = pool.install(|| {
                    let (mut state, _) = thermal.initial().unwrap();
                    let mut best_s = f64::INFINITY;
                    let mut figures = std::collections::BTreeMap::new();
                    for _ in 0..if share > 1.0 { 1 } else { 10 } {
                        let start = Instant::now();
                        let (next, reply) =
                            thermal.solve(&state, black_box(&frozen), Window { t_s: 0.0, dt_s }).unwrap();
                        best_s = best_s.min(start.elapsed().as_secs_f64());
                        (state, figures) = (next, reply.figures);
                    }
                    (best_s, figures)
                });
                let figure = |name: &str| figures.get(name).copied().unwrap_or(0.0);
                println!(
                    "{:>9} {:>9} {share:>10} {form:>26} {:>7} {:>7} {:>10.2} {:>12.0} {:>12.0}",
                    bed.count(),
                    bed.contacts(),
                    figure("iterations"),
                    figure("linear iterations"),
                    1e3 * best_s,
                    1e9 * best_s / bed.count() as f64,
                    1e9 * best_s / bed.contacts() as f64
                );
            }
        }
    }
}
