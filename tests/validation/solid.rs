//! Heat in a solid on a grid against closed forms: modes, interfaces, phases, moving sources, second sound.

mod contacts;
mod modes;
mod phases;
mod second_sound;
mod sources;

use stagger_coupling::{Frozen, Physics, Reply, Window};
use stagger_messages::{Energy, energy::Kind};
use stagger_physics::{
    common::{
        HeatMaterial, Table,
        grid::{CellGrid, FaceMean},
    },
    solid::{Face, Level, Light, Settings, Solid, State, Track},
};

const CONDUCTIVITY_W_M_K: f64 = 20.0;
const DENSITY_KG_M3: f64 = 8000.0;
const HEAT_CAPACITY_J_KG_K: f64 = 500.0;
/// α = K/(ρ C), in m²/s.
const DIFFUSIVITY_M2_S: f64 = CONDUCTIVITY_W_M_K / (DENSITY_KG_M3 * HEAT_CAPACITY_J_KG_K);
const START_K: f64 = 300.0;

fn matter(conductivity_w_m_k: f64) -> HeatMaterial {
    HeatMaterial {
        name: "metal".into(),
        density_kg_m3: DENSITY_KG_M3,
        heat_capacity_j_kg_k: Table::constant(HEAT_CAPACITY_J_KG_K),
        conductivity_w_m_k: Table::constant(conductivity_w_m_k),
        phases: None,
    }
}

/// An insulated block of one metal.
fn settings(grid: CellGrid) -> Settings {
    Settings {
        grid,
        materials: vec![matter(CONDUCTIVITY_W_M_K)],
        kinds: Vec::new(),
        temperature_k: START_K,
        level: Level::Implicit { phi: 1.0 },
        face_mean: FaceMean::Harmonic,
        faces: [Face::Insulated; 6],
        evaporation: None,
        light: Light { absorptivity: 1.0, absorption_1_m: None },
        relaxation_s: 0.0,
        tolerance: 1e-11,
        iterations: 60,
        track: Track { along: 0, border_k: 0.0, part_m: [0.0, 1.0], cooling_k: None },
        wall: None,
    }
}

/// `steps` windows of `dt_s` from a state; what the last one replied.
fn run(solid: &Solid, mut state: State, steps: u32, dt_s: f64) -> (State, Reply) {
    let mut last = Reply::default();
    for step in 0..steps {
        let window = Window { t_s: f64::from(step) * dt_s, dt_s };
        let (next, reply) = solid.solve(&state, &Frozen::default(), window).unwrap();
        assert!(reply.not_converged.is_none(), "step {step}: {:?}, {:?}", reply.not_converged, reply.figures);
        (state, last) = (next, reply);
    }
    (state, last)
}

fn temperatures_k(reply: &Reply) -> &[f64] {
    reply.fields["solid_temperature"].f64().unwrap()
}

/// Sum of a ledger's entries of one kind, in J.
fn sum_j(ledger: &[Energy], kind: Kind) -> f64 {
    ledger.iter().filter(|entry| entry.kind() == kind).map(|entry| entry.joule).sum()
}

/// Numbers from 0 to 1 without a pattern.
fn scattered(rows: usize) -> Vec<f64> {
    (0..rows as u64).map(|row| (row * 7919 % 10_007) as f64 / 10_007.0).collect()
}
