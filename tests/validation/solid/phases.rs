//! Melting on a grid: bounds, energy, and Neumann's front.

use stagger_coupling::Physics as _;
use stagger_messages::energy::Kind;
use stagger_physics::{
    common::{PhaseChange, Phases, grid::CellGrid},
    solid::{Face, Level, Settings, Solid},
};

use super::*;

const MELTING_K: f64 = 1000.0;
const LATENT_J_KG: f64 = 2.5e5;

fn melting(width_k: f64) -> HeatMaterial {
    let melting = Some(PhaseChange { from_k: MELTING_K, width_k, latent_j_kg: LATENT_J_KG });
    HeatMaterial { phases: Some(Phases { melting, boiling: None }), ..matter(CONDUCTIVITY_W_M_K) }
}

#[test]
fn nothing_leaves_the_range_of_what_surrounds_it_at_a_thousand_explicit_limits() {
    for width_k in [0.0, 40.0] {
        let cells = 12;
        let width_m = 1e-5;
        let upper_m = width_m * cells as f64;
        let mut faces = [Face::Insulated; 6];
        faces[5] = Face::Held { temperature_k: 1500.0 };
        faces[4] = Face::Held { temperature_k: 400.0 };
        let solid = Solid::new(Settings {
            faces,
            materials: vec![melting(width_k)],
            ..settings(CellGrid::regular("block", [0.0; 3], [upper_m; 3], [cells; 3]))
        })
        .unwrap();
        let start: Vec<f64> = scattered(cells.pow(3)).iter().map(|share| 400.0 + 1100.0 * share).collect();
        let mut state = solid.state(start).unwrap();
        let limit_s = width_m * width_m / (6.0 * DIFFUSIVITY_M2_S);
        for factor in [1.0, 1e3, 1e3, 1e3, 1e6] {
            let before = state.clone();
            let (next, reply) = run(&solid, state, 1, factor * limit_s);
            for &at_k in temperatures_k(&reply) {
                // The tolerance is a share of the largest temperature.
                assert!((400.0 - 1e-7..=1500.0 + 1e-7).contains(&at_k), "{at_k} K at {factor} limits");
            }
            let change_j = sum_j(&reply.ledger, Kind::Stored) - stored_j(&solid, &before);
            let left_j = sum_j(&reply.ledger, Kind::Lost) - sum_j(&reply.ledger, Kind::Gained);
            // Roundings of what passes the cells: the factor times what they hold.
            let held_j = cells.pow(3) as f64 * width_m.powi(3) * DENSITY_KG_M3 * (LATENT_J_KG + 6e5);
            let allowed_j = 1e-15 * held_j * (10.0 + factor);
            assert!((change_j + left_j).abs() < allowed_j, "{change_j:e} + {left_j:e} J at {factor} limits");
            state = next;
        }
    }
}

/// What a state holds: by a window in which nothing can happen.
fn stored_j(solid: &Solid, state: &State) -> f64 {
    let window = Window { t_s: 0.0, dt_s: 1e-30 };
    let (_, reply) = solid.solve(state, &Frozen::default(), window).unwrap();
    sum_j(&reply.ledger, Kind::Stored)
}

/// λ e^{λ²} erf λ = Ste/√π with Ste = 0.1 (Neumann's solution; Alexiades & Solomon 1993, section 2.1).
const LAMBDA: f64 = 0.220_016;

/// Relative error of the front's depth, where it has passed half of a slab.
fn front_error(cells: u32, steps: u32) -> f64 {
    let length_m = 1e-3;
    let latent_j_kg = HEAT_CAPACITY_J_KG_K * 50.0 / 0.1;
    let mut faces = [Face::Insulated; 6];
    faces[4] = Face::Held { temperature_k: MELTING_K + 50.0 };
    let phases = Phases { melting: Some(PhaseChange { from_k: MELTING_K, width_k: 0.0, latent_j_kg }), boiling: None };
    let solid = Solid::new(Settings {
        faces,
        temperature_k: MELTING_K,
        materials: vec![HeatMaterial { phases: Some(phases), ..matter(CONDUCTIVITY_W_M_K) }],
        ..settings(CellGrid::regular("slab", [0.0; 3], [1e-4, 1e-4, length_m], [1, 1, cells as usize]))
    })
    .unwrap();
    let front_m = 0.5 * length_m;
    let time_s = (front_m / (2.0 * LAMBDA)).powi(2) / DIFFUSIVITY_M2_S;
    let (state, _) = solid.initial().unwrap();
    let (_, reply) = run(&solid, state, steps, time_s / f64::from(steps));
    let melted: f64 = reply.fields["solid_melted"].f64().unwrap().iter().sum();
    (melted * length_m / f64::from(cells) / front_m - 1.0).abs()
}

#[test]
fn the_front_of_melting_converges_to_neumanns_solution() {
    let errors = [(10, 50), (20, 200), (40, 800)].map(|(cells, steps)| front_error(cells, steps));
    let order = (errors[0] / errors[2]).log2() / 2.0;
    println!("Stefan's problem on a grid: errors {errors:?}, order {order:.2} in the cells");
    assert!(errors[2] < 5e-3 && order > 0.9, "{errors:?}");
}

#[test]
fn explicit_substeps_melt_as_much() {
    let grid = || CellGrid::regular("rod", [0.0; 3], [1e-4, 1e-5, 1e-5], [10, 1, 1]);
    let mut faces = [Face::Insulated; 6];
    faces[0] = Face::Flux { flux_w_m2: 2e9 };
    let of = |level: Level, steps: u32| {
        let solid = Solid::new(Settings { faces, level, materials: vec![melting(0.0)], ..settings(grid()) }).unwrap();
        let (state, _) = solid.initial().unwrap();
        let (_, reply) = run(&solid, state, steps, 2e-4 / f64::from(steps));
        reply.fields["solid_melted"].f64().unwrap().iter().sum::<f64>()
    };
    let (implicit, explicit) = (of(Level::Implicit { phi: 1.0 }, 2000), of(Level::Explicit { share: 0.2 }, 4));
    assert!(implicit > 1.0 && (implicit / explicit - 1.0).abs() < 0.01, "{implicit}, {explicit}");
}
