//! Modes of a slab and of a box, orders of convergence, interfaces.

use std::f64::consts::PI;

use stagger_coupling::Physics as _;
use stagger_physics::{
    common::grid::{CellGrid, FaceMean, Fine, graded_edges},
    solid::{Face, Level, Settings, Solid},
};

use super::*;

const LENGTH_M: f64 = 1e-3;
const DECAY_1_S: f64 = DIFFUSIVITY_M2_S * PI * PI / (LENGTH_M * LENGTH_M);

/// Largest error of the first mode of a slab between two faces at the temperature of the start, over its amplitude, after it
/// has decayed by a factor e.
fn error_of_mode(axis: usize, edges_m: &[f64], level: Level, steps: u32) -> f64 {
    let mut grid = CellGrid { name: "slab".into(), edges_m: [0, 1, 2].map(|_| vec![0.0, 1e-4]) };
    grid.edges_m[axis] = edges_m.to_vec();
    let middles_m = grid.middles_m(axis);
    let mut faces = [Face::Insulated; 6];
    faces[2 * axis] = Face::Held { temperature_k: START_K };
    faces[2 * axis + 1] = faces[2 * axis];
    let solid = Solid::new(Settings { level, faces, ..settings(grid) }).unwrap();
    let amplitude_k = 100.0;
    let mode = |at_m: f64, factor: f64| START_K + amplitude_k * factor * (PI * at_m / LENGTH_M).sin();
    let state = solid.state(middles_m.iter().map(|at_m| mode(*at_m, 1.0)).collect()).unwrap();
    let (_, reply) = run(&solid, state, steps, 1.0 / DECAY_1_S / f64::from(steps));
    let expected = middles_m.iter().map(|at_m| mode(*at_m, (-1.0f64).exp()));
    let errors = temperatures_k(&reply).iter().zip(expected).map(|(found, expected)| (found - expected).abs());
    errors.fold(0.0, f64::max) / amplitude_k
}

fn equal(cells: u32) -> Vec<f64> {
    (0..=cells).map(|edge| LENGTH_M * f64::from(edge) / f64::from(cells)).collect()
}

#[test]
fn a_slabs_mode_decays_as_it_must_with_second_order_in_the_cells() {
    let crank_nicolson = Level::Implicit { phi: 0.5 };
    for axis in 0..3 {
        let errors = [8, 16, 32].map(|cells| error_of_mode(axis, &equal(cells), crank_nicolson, 400));
        let order = (errors[0] / errors[2]).log2() / 2.0;
        println!("mode along {axis}: errors {errors:?}, order {order:.2} in the cells");
        assert!((order - 2.0).abs() < 0.1 && errors[2] < 1e-3, "{errors:?}");
    }
    // Graded: neighbours differ by 8 %, less where they are refined.
    let graded = |cells: f64| {
        let fine = Fine { from_m: 0.4e-3, to_m: 0.5e-3, growth: 1.0 + 0.64 / cells };
        error_of_mode(2, &graded_edges(0.0, LENGTH_M, 1e-4 / cells, Some(fine)), crank_nicolson, 400)
    };
    let errors = [4.0, 8.0, 16.0].map(graded);
    let order = (errors[0] / errors[2]).log2() / 2.0;
    println!("graded: errors {errors:?}, order {order:.2}");
    assert!(order > 1.7, "{errors:?}");
}

#[test]
fn the_order_in_the_step_is_two_with_half_the_weight_and_one_with_all() {
    // The error in the cells is taken out by one of them, with steps so small that theirs is nothing.
    let finest = error_of_mode(0, &equal(32), Level::Implicit { phi: 0.5 }, 1000);
    for (phi, expected) in [(0.5, 2.0), (1.0, 1.0)] {
        let of = |steps| (error_of_mode(0, &equal(32), Level::Implicit { phi }, steps) - finest).abs();
        let errors = [10, 20, 40].map(of);
        let order = (errors[0] / errors[2]).log2() / 2.0;
        println!("phi {phi}: errors {errors:?}, order {order:.2} in the step");
        assert!((order - expected).abs() < 0.15, "{errors:?}");
    }
}

#[test]
fn explicit_substeps_find_the_same() {
    let cells = equal(16);
    let implicit = error_of_mode(0, &cells, Level::Implicit { phi: 0.5 }, 400);
    let explicit = error_of_mode(0, &cells, Level::Explicit { share: 0.1 }, 3);
    assert!((implicit - explicit).abs() < 0.2 * implicit, "{implicit}, {explicit}");
}

#[test]
fn two_layers_in_series_are_exact_with_harmonic_faces_and_first_order_with_arithmetic_ones() {
    // Steady flow through two layers of equal thickness, 10 and 1000 W/(m K): all but 1/101 of the difference falls off in the
    // first one.
    let flux_error = |cells: usize, face_mean: FaceMean| {
        let grid = CellGrid::regular("layers", [0.0; 3], [LENGTH_M, 1e-4, 1e-4], [cells, 1, 1]);
        let kinds = (0..cells).map(|cell| u16::from(2 * cell >= cells)).collect();
        let mut faces = [Face::Insulated; 6];
        faces[0] = Face::Held { temperature_k: START_K + 100.0 };
        faces[1] = Face::Held { temperature_k: START_K };
        let solid = Solid::new(Settings {
            kinds,
            faces,
            face_mean,
            materials: vec![matter(10.0), matter(1000.0)],
            ..settings(grid)
        })
        .unwrap();
        let (state, _) = solid.initial().unwrap();
        let (_, reply) = run(&solid, state, 40, 100.0);
        let first_k = temperatures_k(&reply)[0];
        let flux = (START_K + 100.0 - first_k) * 10.0 / (0.5 * LENGTH_M / cells as f64);
        let expected = 100.0 / (0.5 * LENGTH_M / 10.0 + 0.5 * LENGTH_M / 1000.0);
        (flux / expected - 1.0).abs()
    };
    for cells in [2, 4, 8] {
        let error = flux_error(cells, FaceMean::Harmonic);
        assert!(error < 1e-7, "harmonic, {cells} cells: {error:e}");
    }
    let errors = [8, 16, 32].map(|cells| flux_error(cells, FaceMean::Arithmetic));
    let order = (errors[0] / errors[2]).log2() / 2.0;
    println!("flux through layers with arithmetic faces: errors {errors:?}, order {order:.2}");
    assert!((order - 1.0).abs() < 0.1, "{errors:?}");
}
