//! The monograph's averaging.

use stagger_physics::current::{Conductivity, Method, Settings, Solver};

use super::network::{AVERAGING, Network, books, density, near, of, settings, solve};

#[test]
fn walls_of_one_current_density_make_it_uniform_and_all_particles_warm_alike() {
    let (j, sigma) = (1e5, 25.0);
    let mut bed = Network::random(3000);
    bed.radii_m.iter_mut().enumerate().for_each(|(i, radius)| *radius = 1e-3 * (1.0 + (i % 7) as f64));
    let base = settings(AVERAGING, &[density(j), density(j)], 3000);
    let reply = solve(&Settings { conductivity: Conductivity::constant(sigma), ..base }, &bed);
    let rows = of(&reply, "current_density");
    assert!(rows.iter().all(|row| *row == j), "exactly");
    // dθ/dt = a J²/(σ ρ C): H/(ρ V C) is the same whatever the radius, to rounding.
    let (density_kg_m3, heat_capacity_j_kg_k) = (2000.0, 100.0);
    let exact_k_s = 0.5 * j * j / (sigma * density_kg_m3 * heat_capacity_j_kg_k);
    for (power_w, radius_m) in of(&reply, "joule_power").iter().zip(&bed.radii_m) {
        let mass_kg = density_kg_m3 * 4.0 / 3.0 * std::f64::consts::PI * radius_m.powi(3);
        assert!(near(power_w / (mass_kg * heat_capacity_j_kg_k), exact_k_s, 1e-14));
    }
    let [electrical_j, joule_j] = books(&reply);
    assert!(near(electrical_j, joule_j, 1e-12), "sums of 3000 terms");
    assert!(of(&reply, "wall_current_density").iter().all(|wall| near(*wall, j, 1e-14)));
    assert_eq!(reply.figures["iterations"].to_bits(), 0, "nothing is left to solve");
}

#[test]
fn between_different_walls_it_is_laplaces_equation_and_the_sweeps_agree() {
    let contacts = 40;
    let chain = Network::chain(contacts);
    let base = settings(AVERAGING, &[density(3.0), density(-1.0)], chain.radii_m.len());
    let solver = |method| Solver { method, iterations: 1_000_000, ..base.solver };
    let both = [Method::ConjugateGradient, Method::Jacobi]
        .map(|method| solve(&Settings { solver: solver(method), ..base.clone() }, &chain));
    let steps = f64::from(contacts - 2);
    for reply in &both {
        // The outer particles hold the walls' values; linear between them, to the residual times the condition, 4 n²/π².
        for (i, row) in of(reply, "current_density").into_iter().enumerate() {
            assert!((row - (3.0 - 4.0 * i as f64 / steps).abs()).abs() < 3e-9, "particle {i}: {row}");
        }
        assert_eq!(of(reply, "wall_current_density"), [3.0, -1.0]);
    }
    let iterations = both.map(|reply| reply.figures["iterations"]);
    println!("a chain of {contacts}: {} iterations, {} sweeps", iterations[0], iterations[1]);
    // Conjugate gradients end within as many iterations as unknowns; sweeps gain a factor cos(π/39) each.
    assert!(iterations[0] <= steps && iterations[1] > 5000.0, "{iterations:?}");
}

#[test]
fn what_touches_no_electrified_wall_carries_exactly_nothing_and_two_walls_share_a_particle() {
    let mut islands = Network::of(6);
    islands.pairs = vec![(0, 1, 2.0, 1.0), (2, 3, 1.0, 1.0), (4, 1, 0.0, 1.0)];
    islands.walls = vec![(0, 0, 3.0, 1.0), (0, 1, 1.0, 1.0), (3, 2, 1.0, 1.0), (5, 1, 0.0, 1.0)];
    let electrodes = [density(8.0), density(0.0), stagger_physics::common::walls::Electrode::default()];
    let reply = solve(&settings(AVERAGING, &electrodes, 6), &islands);
    // Particle 0 has three quarters of its wall contact at 8 A/m²; its neighbour has only it.
    assert_eq!(of(&reply, "current_density"), [6.0, 6.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(of(&reply, "joule_power")[2..], [0.0; 4]);
    assert_eq!(reply.figures["floating particles"].to_bits(), 4f64.to_bits());
    assert!(!reply.fields.contains_key("potential"));
    let none = solve(&settings(AVERAGING, &electrodes, 0), &Network::of(0));
    assert_eq!(books(&none), [0.0, 0.0]);
}
