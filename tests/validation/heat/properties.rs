//! Heat capacities and conductivities that depend on temperature, and several materials.

use std::f64::consts::PI;

use stagger_physics::thermal::{Enthalpy, Settings, Solver, Table, Thermal};

use super::{
    AREA_M2, CAPACITY_J_K, Contacts, DENSITY_KG_M3, DISTANCE_M, HEAT_CAPACITY_J_KG_K, Physics as _, RADIUS_M, SOLVERS,
    TIME_S, block, enthalpy, joule, settings, solve, temperatures, wall,
};

#[test]
fn heat_that_enters_is_the_integral_of_the_heat_capacity() {
    // 400 + ½ θ/K up to 1000 K, 900 above.
    let capacity = Table { points: vec![[200.0, 500.0], [1000.0, 900.0]] };
    for solver in SOLVERS {
        let mut enthalpy = enthalpy(solver);
        enthalpy.materials[0].heat_capacity_j_kg_k = capacity.clone();
        let thermal = Thermal::new(Settings { enthalpy: Some(enthalpy), ..settings(1) }).unwrap();
        let mass_kg = CAPACITY_J_K / HEAT_CAPACITY_J_KG_K;
        let (mut state, _) = thermal.initial().unwrap();
        // From 300 K to 800 K: 400·500 + ¼ (800² − 300²); on to 1500 K: 400·200 + ¼ (1000² − 800²) + 900·500; and back.
        for (heat_j_kg, end_k) in [(337_500.0, 800.0), (620_000.0, 1500.0), (-957_500.0, 300.0)] {
            let absorbed_w = vec![heat_j_kg * mass_kg / TIME_S];
            let alone = Contacts { radii_m: vec![RADIUS_M], absorbed_w, ..Contacts::default() };
            let (next, reply) = solve(&thermal, &state, &alone, &alone, TIME_S).unwrap();
            let found_k = temperatures(&reply)[0];
            // A few roundings of 1 MJ/kg over 500 J/(kg K).
            assert!((found_k - end_k).abs() < 1e-11, "{solver:?}: {found_k} K instead of {end_k} K");
            state = next;
        }
    }
}

#[test]
fn a_chain_whose_conductivity_rises_with_temperature_is_linear_in_the_integral_of_it() {
    // K = 10 + θ/(50 K): ∫K dθ = 10 θ + θ²/100. Between two particles ½ (K_i + K_j) is exactly its mean.
    let conductivity = Table { points: vec![[0.0, 10.0], [2000.0, 50.0]] };
    for solver in SOLVERS {
        let mut enthalpy = enthalpy(solver);
        enthalpy.materials[0].conductivity_w_m_k = conductivity.clone();
        let walls = vec![wall(Some(1500.0)), wall(Some(300.0))];
        let of = Settings { walls, enthalpy: Some(enthalpy), phi: 1.0, tolerance: 1e-12, ..settings(8) };
        let thermal = Thermal::new(Settings { iterations: 100_000, ..of }).unwrap();
        let chain = block(1, 8);
        let mut state = thermal.state(vec![600.0; 8]).unwrap();
        let mut profile = Vec::new();
        // The slowest mode of eight layers, 0.15/TIME_S, falls by 8 in each.
        for _ in 0..25 {
            let (next, reply) = solve(&thermal, &state, &chain, &chain, 50.0 * TIME_S).unwrap();
            assert!(reply.not_converged.is_none(), "{:?}", reply.figures);
            (state, profile) = (next, temperatures(&reply));
        }
        let integrals: Vec<f64> = profile.iter().map(|at_k| 10.0 * at_k + at_k * at_k / 100.0).collect();
        let steps: Vec<f64> = integrals.windows(2).map(|pair| pair[1] - pair[0]).collect();
        for step in &steps {
            // Twice the tolerance of 1500 K, times K of 40.
            assert!((step - steps[0]).abs() < 2e-7, "{solver:?}: {steps:?}");
        }
        let ratio = (profile[0] - profile[1]) / (profile[6] - profile[7]);
        assert!(ratio < 0.7, "the hot end conducts better: {profile:?}");
    }
}

#[test]
fn particles_of_two_materials_meet_where_their_heat_capacities_say() {
    let mut light = enthalpy(Solver::FixedPoint).materials[0].clone();
    (light.name, light.density_kg_m3) = ("light".into(), 2600.0);
    (light.heat_capacity_j_kg_k, light.conductivity_w_m_k) = (Table::constant(900.0), Table::constant(0.0));
    let capacities = [CAPACITY_J_K, 2600.0 * 900.0 * CAPACITY_J_K / (DENSITY_KG_M3 * HEAT_CAPACITY_J_KG_K)];
    for solver in SOLVERS {
        let steel = enthalpy(solver);
        let of = Enthalpy { materials: vec![steel.materials[0].clone(), light.clone()], ..steel };
        let of = Settings { enthalpy: Some(of), phi: 0.5, ..settings(2) };
        let thermal = Thermal::new(of).unwrap();
        let pair = Contacts {
            radii_m: vec![RADIUS_M; 2],
            pairs: vec![(0, 1, AREA_M2, DISTANCE_M)],
            materials: vec![1, 0],
            ..Contacts::default()
        };
        // The first is light and hot. K_ij = ½ (0 + 20): the difference decays at K A/d (1/c₀ + 1/c₁).
        let mut state = thermal.state(vec![600.0, 300.0]).unwrap();
        let rate = 0.5 * 20.0 * AREA_M2 / DISTANCE_M * (1.0 / capacities[0] + 1.0 / capacities[1]);
        let (windows, mut last) = (2000, Vec::new());
        for _ in 0..windows {
            let (next, reply) = solve(&thermal, &state, &pair, &pair, 1.0 / rate / f64::from(windows)).unwrap();
            (state, last) = (next, temperatures(&reply));
        }
        let meeting_k = (capacities[1] * 600.0 + capacities[0] * 300.0) / (capacities[0] + capacities[1]);
        let mean_k = (capacities[1] * last[0] + capacities[0] * last[1]) / (capacities[0] + capacities[1]);
        assert!((mean_k - meeting_k).abs() < 1e-9, "{solver:?}: {mean_k} K instead of {meeting_k} K");
        // The trapezoidal rule's Δt²/12 of 300 K e⁻¹ in 2000 windows: 2e-6 K.
        let left_k = last[0] - last[1];
        assert!((left_k - 300.0 * (-1.0_f64).exp()).abs() < 1e-5, "{solver:?}: {left_k} K");
    }
}

#[test]
fn what_poured_particles_are_made_of_counts() {
    let steel = enthalpy(Solver::FixedPoint);
    let mut light = steel.materials[0].clone();
    (light.name, light.density_kg_m3) = ("light".into(), 2600.0);
    let of = Enthalpy { materials: vec![steel.materials[0].clone(), light], ..steel };
    let of = Settings { enthalpy: Some(of), pour_temperature_k: Some(400.0), ..settings(1) };
    let thermal = Thermal::new(of).unwrap();
    let (state, _) = thermal.initial().unwrap();
    let at = |ids: &[u32], materials: &[u32], revision| Contacts {
        radii_m: vec![RADIUS_M; ids.len()],
        ids: ids.to_vec(),
        materials: materials.to_vec(),
        revision,
        ..Contacts::default()
    };
    let (before, after) = (at(&[0], &[0], 0), at(&[0, 1], &[0, 1], 1));
    let (state, reply) = solve(&thermal, &state, &before, &after, TIME_S).unwrap();
    let light_j = 2600.0 * 4.0 / 3.0 * PI * RADIUS_M.powi(3) * HEAT_CAPACITY_J_KG_K * 100.0;
    let poured_j = joule(&reply.ledger, "poured");
    assert!((poured_j / light_j - 1.0).abs() < 1e-14, "{poured_j} J instead of {light_j} J");
    let unknown = at(&[0, 1], &[0, 7], 1);
    let error = solve(&thermal, &state, &after, &unknown, TIME_S).unwrap_err().to_string();
    assert!(error.contains("`material` names material 7 in row 1, but there are 2"), "{error}");
}
