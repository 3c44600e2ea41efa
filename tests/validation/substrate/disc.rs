//! Loads spread over their contact discs.

use std::f64::consts::{PI, TAU};

use super::{POINT_M, Tensor, difference, divergence, load, norm, plane_integral, stress_at};
use stagger_physics::substrate::{Load, NEAR_RADII};

/// Point loads over the disc of radius 1 in the shares of Hertz's pressure: ρ = sin θ, midpoint rule.
fn as_points(whole: &Load, rings: u32, turns: u32) -> Vec<Load> {
    let mut loads = Vec::new();
    for ring in 0..rings {
        let theta = (f64::from(ring) + 0.5) / f64::from(rings) * 0.5 * PI;
        // p ρ dρ dφ = 3F/(2π) cos²θ sin θ dθ dφ.
        let share =
            3.0 / TAU * theta.cos().powi(2) * theta.sin() * (0.5 * PI / f64::from(rings)) * (TAU / f64::from(turns));
        for turn in 0..turns {
            let angle = TAU * f64::from(turn) / f64::from(turns);
            loads.push(Load {
                x_m: theta.sin() * angle.cos(),
                y_m: theta.sin() * angle.sin(),
                normal_n: share * whole.normal_n,
                tangential_n: whole.tangential_n.map(|force| share * force),
                radius_m: POINT_M,
            });
        }
    }
    loads
}

#[test]
fn the_closed_form_is_the_sum_of_point_loads_over_the_disc() {
    for (normal_n, tangential_n) in [(1.0, [0.0; 2]), (0.0, [1.0, 0.0]), (0.6, [-0.3, 0.8])] {
        let whole = load(normal_n, tangential_n, 1.0);
        for (rings, tolerance) in [(200, 4e-5), (400, 1e-5)] {
            let points = as_points(&whole, rings, 200);
            for at in [
                [0.0, 0.0, 0.5],
                [0.3, -0.2, 0.4],
                [1.0, 0.0, 0.3],
                [0.9, 0.8, 0.5],
                [2.0, -1.0, 0.0],
                [-3.0, 1.0, 2.0],
            ] {
                let (spread, sum) = (stress_at(0.3, &[whole], at), stress_at(0.3, &points, at));
                // Second order in the rings: twice as many leave a quarter.
                assert!(difference(spread, sum) < tolerance * norm(spread), "{at:?}: {spread:?} {sum:?}");
            }
        }
    }
}

#[test]
fn the_surface_carries_the_pressure_and_nothing_beside_it() {
    let a = 0.7;
    let loads = [load(2.0, [0.5, -0.3], a)];
    let stress = |rho: f64| stress_at(0.3, &loads, [0.8 * rho, 0.6 * rho, 0.0]);
    let traction = |rho: f64| 1.5 / (PI * a * a) * (1.0 - (rho / a).powi(2)).max(0.0).sqrt();
    for rho in [0.0, 0.2, 0.5, 0.69, 0.71, 1.0, 5.0] {
        let found = stress(rho);
        for (component, force) in [(2, 2.0), (5, 0.5), (4, -0.3)] {
            // Rounding of the closed form, over (γ/a)³.
            assert!((found[component] + force * traction(rho)).abs() < 1e-11, "{rho}: {found:?}");
        }
        assert!(found.iter().all(|value| value.is_finite()));
    }
    // On the disc's very edge too, where the closed form has 0/0.
    let edge = stress_at(0.3, &loads, [a, 0.0, 0.0]);
    assert!(edge.iter().all(|value| value.is_finite()) && edge[2].abs() < 1e-12, "{edge:?}");
}

#[test]
fn hertz_s_stress_on_the_axis() {
    let (a, nu) = (0.5, 0.3);
    let p0 = 1.5 / (PI * a * a);
    let stress = |z: f64| stress_at(nu, &[load(1.0, [0.0; 2], a)], [0.0, 0.0, z]);
    for z in [1e-6, 0.1, 0.24, 0.5, 2.0] {
        // Johnson 1985, eq. 3.45.
        let t: f64 = z / a;
        let below = 1.0 / (1.0 + t * t);
        let radial = -p0 * ((1.0 + nu) * (1.0 - t * (1.0 / t).atan()) - 0.5 * below);
        let found = stress(z);
        let expected: Tensor = [radial, radial, -p0 * below, 0.0, 0.0, 0.0];
        assert!(difference(found, expected) < 1e-12 * p0, "{z}: {found:?} {expected:?}");
    }
    // The largest shear stress, 0.31 p0, lies 0.48 a below the surface.
    let shear = |z: f64| 0.5 * (stress(z)[0] - stress(z)[2]);
    let deepest = (1..1000).map(|k| f64::from(k) * 1e-3).max_by(|x, y| shear(*x).total_cmp(&shear(*y))).unwrap();
    assert!((deepest / a - 0.48).abs() < 5e-3 && (shear(deepest) / p0 - 0.31).abs() < 5e-4, "{deepest}");
}

#[test]
fn a_spread_load_is_in_equilibrium_and_all_of_it_arrives() {
    let loads = [load(2.0, [0.7, -0.4], 1.0)];
    for at in [[0.3, -0.5, 0.4], [0.0, 0.0, 0.5], [1.0, 0.1, 0.3]] {
        let errors = [8e-3, 4e-3, 2e-3].map(|h| divergence(0.25, &loads, at, h));
        for pair in errors.windows(2) {
            assert!(((pair[0] / pair[1]).log2() - 2.0).abs() < 0.02, "{at:?}: {errors:?}");
        }
    }
    // Beyond 16 radii it is a point load, 0.002 of which crosses the plane out there, two per cent of it wrongly placed.
    let sum = plane_integral(0.3, &loads, 0.5);
    for (found, expected) in sum[2..].iter().zip([-2.0, 0.0, 0.4, -0.7]) {
        assert!((found - expected).abs() < 1e-4, "{sum:?}");
    }
}

#[test]
fn far_away_a_spread_load_is_a_point_load() {
    // Within NEAR_RADII the closed form acts; the difference falls as (a/γ)².
    let direction = [0.6, 0.3, (1.0f64 - 0.45).sqrt()];
    let error = |radii: f64| {
        let at = direction.map(|x| radii * x);
        let stress = |radius_m| stress_at(0.3, &[load(1.0, [0.5, -0.2], radius_m)], at);
        difference(stress(1.0), stress(POINT_M)) * radii * radii
    };
    for radii in [4.0, 7.9] {
        let order = (error(radii) / error(2.0 * radii)).log2();
        // The next term is of order (a/γ)⁴: a sixteenth of it at four radii.
        assert!((order - 2.0).abs() < 0.15, "{radii}: {order}");
    }
    // What is neglected beyond: at most 2 % of ‖F‖/(2πγ²), in any direction.
    let mut largest: f64 = 0.0;
    for (turn, rise) in (0..16).flat_map(|turn| (0..=16).map(move |rise| (f64::from(turn), f64::from(rise)))) {
        let (turn, rise) = (TAU * turn / 16.0, 0.5 * PI * rise / 16.0);
        let gamma = 0.999 * NEAR_RADII;
        let at = [turn.cos() * rise.cos(), turn.sin() * rise.cos(), rise.sin()].map(|x| gamma * x);
        for (normal_n, tangential_n) in [(1.0, [0.0; 2]), (0.0, [1.0, 0.0])] {
            let stress = |radius_m| stress_at(0.3, &[load(normal_n, tangential_n, radius_m)], at);
            largest = largest.max(difference(stress(1.0), stress(POINT_M)) * TAU * gamma * gamma);
        }
    }
    assert!((0.005..0.02).contains(&largest), "{largest}");
}
