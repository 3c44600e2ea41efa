//! A point source that moves over a half-space (Rosenthal 1946), and where light and heat on the surface go.

use std::f64::consts::PI;

use stagger_messages::{Field, Measure, Port, energy::Kind};
use stagger_physics::{
    common::grid::{CellGrid, Fine, graded_edges},
    solid::{Face, Settings, Solid},
};

use super::*;

/// `surface_light` on the top of a grid.
fn light(grid: &CellGrid, power_w: Vec<f64>) -> Frozen {
    let port = std::sync::Arc::new(Port::f64("surface_light", "W", "solid-surface", 1, Measure::None));
    assert_eq!(power_w.len(), grid.layer(2, true).len());
    let field = Field::new(&port, 0, power_w).unwrap();
    let fields = stagger_messages::Fields::from([(field.name().to_owned(), field)]);
    Frozen { start: fields.clone(), end: fields }
}

#[test]
fn a_moving_point_source_is_rosenthals_away_from_it() {
    // Lengths in α/V: the source leaves a wake a few of them wide. Half of the plate, as y = 0 is a plane of symmetry.
    let speed_m_s = 0.8;
    let unit_m = DIFFUSIVITY_M2_S / speed_m_s;
    let power_w = 1.0;
    let fine = |from: f64, to: f64| Some(Fine { from_m: from * unit_m, to_m: to * unit_m, growth: 1.25 });
    let cell_m = 0.25 * unit_m;
    let grid = CellGrid {
        name: "plate".into(),
        edges_m: [
            graded_edges(-15.0 * unit_m, 30.0 * unit_m, cell_m, fine(8.0, 21.0)),
            graded_edges(0.0, 20.0 * unit_m, cell_m, fine(0.0, 2.5)),
            graded_edges(-20.0 * unit_m, 0.0, cell_m, fine(-2.5, 0.0)),
        ],
    };
    let solid = Solid::new(Settings { tolerance: 1e-7, ..settings(grid.clone()) }).unwrap();
    let [x_m, y_m, z_m] = [0, 1, 2].map(|axis| grid.middles_m(axis));
    let (nx, ny) = (x_m.len(), y_m.len());
    let steps = 200;
    let (from_m, to_m) = (0.0, 20.0 * unit_m);
    let dt_s = (to_m - from_m) / speed_m_s / f64::from(steps);
    let (mut state, _) = solid.initial().unwrap();
    let mut last = Reply::default();
    for step in 0..steps {
        // In the middle of the window, on the two cells on either side: the point of attack is then the source's own.
        let at_m = from_m + speed_m_s * dt_s * (f64::from(step) + 0.5);
        let after = x_m.partition_point(|x| *x <= at_m);
        let share = (at_m - x_m[after - 1]) / (x_m[after] - x_m[after - 1]);
        let mut arrived_w = vec![0.0; nx * ny];
        (arrived_w[after - 1], arrived_w[after]) = (0.5 * power_w * (1.0 - share), 0.5 * power_w * share);
        let window = Window { t_s: f64::from(step) * dt_s, dt_s };
        let (next, reply) = solid.solve(&state, &light(&grid, arrived_w), window).unwrap();
        assert!(reply.not_converged.is_none());
        (state, last) = (next, reply);
    }
    let temperatures_k = last.fields["solid_temperature"].f64().unwrap();
    let mut worst = 0.0f64;
    let mut points = 0;
    for (k, z) in z_m.iter().enumerate() {
        for (j, y) in y_m.iter().enumerate() {
            for (i, x) in x_m.iter().enumerate() {
                let ahead_m = x - to_m;
                let distance_m = (ahead_m * ahead_m + y * y + z * z).sqrt();
                // Away from the source by six cells, and not farther than its field has come.
                let is_there = (1.5..3.0).contains(&(distance_m / unit_m)) && ahead_m < 0.5 * unit_m;
                if !is_there {
                    continue;
                }
                let exponent = -speed_m_s * (distance_m + ahead_m) / (2.0 * DIFFUSIVITY_M2_S);
                let expected_k = power_w / (2.0 * PI * CONDUCTIVITY_W_M_K * distance_m) * exponent.exp();
                let scale_k = power_w / (2.0 * PI * CONDUCTIVITY_W_M_K * distance_m);
                let error = (temperatures_k[grid.row([i, j, k])] - START_K - expected_k).abs() / scale_k;
                worst = worst.max(error);
                points += 1;
            }
        }
    }
    println!("Rosenthal: worst error {worst:.3} of P/(2πKr) at {points} points, {} cells", grid.len());
    assert!(points > 100 && worst < 0.05, "{worst} at {points} points");
}

#[test]
fn what_is_absorbed_reflected_and_let_through_is_all_that_arrives() {
    let grid = CellGrid::regular("plate", [0.0; 3], [1e-4; 3], [4, 4, 10]);
    let light_of = Light { absorptivity: 0.4, absorption_1_m: Some(2e4) };
    let mut faces = [Face::Insulated; 6];
    faces[5] = Face::Ambient { temperature_k: 300.0, convection_w_m2_k: 1e3, emissivity: 0.5 };
    let solid = Solid::new(Settings { faces, light: light_of, ..settings(grid.clone()) }).unwrap();
    let (state, _) = solid.initial().unwrap();
    let arrived_w: Vec<f64> = scattered(16);
    let total_w: f64 = arrived_w.iter().sum();
    let window = Window { t_s: 0.0, dt_s: 1e-3 };
    let (_, reply) = solid.solve(&state, &light(&grid, arrived_w), window).unwrap();
    let lost =
        |name: &str| reply.ledger.iter().find(|entry| entry.name == name && entry.kind() == Kind::Lost).unwrap().joule;
    assert!((lost("reflected") / (0.6 * total_w * 1e-3) - 1.0).abs() < 1e-12);
    let through_j = 0.4 * total_w * 1e-3 * (-2.0f64).exp();
    assert!((lost("through") / through_j - 1.0).abs() < 1e-12, "{} J", lost("through"));
    let held_j = sum_j(&reply.ledger, Kind::Stored);
    let books_j = sum_j(&reply.ledger, Kind::Gained) - sum_j(&reply.ledger, Kind::Lost);
    assert!((held_j / books_j - 1.0).abs() < 1e-10, "{held_j} and {books_j} J");
    assert!(lost("convected") > 0.0 && lost("radiated") > 0.0);
}
