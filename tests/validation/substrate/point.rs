//! Boussinesq's and Cerruti's point loads.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::{POINT_M, Tensor, difference, divergence, load, norm, plane_integral, stress_at};

#[test]
fn boussinesq_s_normal_stress_at_two_distances() {
    let at = |x: f64| stress_at(0.3, &[load(1.0, [0.0; 2], POINT_M)], [x, 0.0, 1.0])[2];
    // −3/(2π) and −3/(2π 2^{5/2}), to the digits they are known by.
    assert!((at(0.0) + 0.47746).abs() < 5e-6 && (at(1.0) + 0.08440).abs() < 5e-6, "{} {}", at(0.0), at(1.0));
}

/// Boussinesq's stress in cylindrical coordinates as printed (Johnson 1985, eq. 3.20), turned to x and y.
fn boussinesq(nu: f64, force: f64, [x, y, z]: [f64; 3]) -> Tensor {
    let rho2 = x * x + y * y;
    let (rho, gamma) = (rho2.sqrt(), (rho2 + z * z).sqrt());
    let hoop = (1.0 - 2.0 * nu) * (z / gamma.powi(3) - (1.0 - z / gamma) / rho2);
    let radial = (1.0 - 2.0 * nu) * (1.0 - z / gamma) / rho2 - 3.0 * rho2 * z / gamma.powi(5);
    let shear = -3.0 * rho * z * z / gamma.powi(5);
    let (c, s) = (x / rho, y / rho);
    [
        radial * c * c + hoop * s * s,
        radial * s * s + hoop * c * c,
        -3.0 * z.powi(3) / gamma.powi(5),
        (radial - hoop) * c * s,
        shear * s,
        shear * c,
    ]
    .map(|value| value * force / TAU)
}

/// Cerruti's stress of a load along x as printed (Johnson 1985, eq. 3.76; Zohdi 2018, eq. 9.5).
fn cerruti(nu: f64, force: f64, [x, y, z]: [f64; 3]) -> Tensor {
    let g = (x * x + y * y + z * z).sqrt();
    let u = g + z;
    let (g2, g3, g5) = (g * g, g.powi(3), g.powi(5));
    let k = 1.0 - 2.0 * nu;
    let (a, b) = (g3 * u * u, g2 * u.powi(3));
    [
        -3.0 * x.powi(3) / g5 + k * (x / g3 - 3.0 * x / (g * u * u) + x.powi(3) / a + 2.0 * x.powi(3) / b),
        -3.0 * x * y * y / g5 + k * (x / g3 - x / (g * u * u) + x * y * y / a + 2.0 * x * y * y / b),
        -3.0 * x * z * z / g5,
        -3.0 * x * x * y / g5 + k * (-y / (g * u * u) + x * x * y / a + 2.0 * x * x * y / b),
        -3.0 * x * y * z / g5,
        -3.0 * x * x * z / g5,
    ]
    .map(|value| value * force / TAU)
}

proptest! {
    #[test]
    fn stress_is_that_printed(x in 0.1..2.0f64, y in -2.0..2.0f64, z in 0.0..2.0f64, nu in -0.9..0.5f64) {
        let at = [x, y, z];
        // Rounding: a dozen operations on terms of which none exceeds the largest by much; the printed form loses digits
        // where z is almost γ, which x keeps it from.
        let scale = 1e-13 * 400.0;
        let normal = stress_at(nu, &[load(1.5, [0.0; 2], POINT_M)], at);
        prop_assert!(difference(normal, boussinesq(nu, 1.5, at)) < scale * norm(normal));
        let tangential = stress_at(nu, &[load(0.0, [1.5, 0.0], POINT_M)], at);
        prop_assert!(difference(tangential, cerruti(nu, 1.5, at)) < scale * norm(tangential));
        let gamma = (x * x + y * y + z * z).sqrt();
        let trace = normal[0] + normal[1] + normal[2];
        prop_assert!((trace + 1.5 * (1.0 + nu) * z / (PI * gamma.powi(3))).abs() < scale * norm(normal));
    }

    #[test]
    fn a_load_turned_about_the_normal_turns_the_stress(
        x in -2.0..2.0f64, y in -2.0..2.0f64, z in 0.01..2.0f64, turn in 0.0..TAU, nu in 0.0..0.5f64, radius in 1e-3..1.0f64,
    ) {
        let (c, s) = (turn.cos(), turn.sin());
        let (fx, fy) = (0.8, -0.3);
        let [xx, yy, zz, xy, yz, zx] = stress_at(nu, &[load(1.0, [fx, fy], radius)], [x, y, z]);
        let turned = [
            c * c * xx + s * s * yy - 2.0 * c * s * xy,
            s * s * xx + c * c * yy + 2.0 * c * s * xy,
            zz,
            c * s * (xx - yy) + (c * c - s * s) * xy,
            s * zx + c * yz,
            c * zx - s * yz,
        ];
        let force = [c * fx - s * fy, s * fx + c * fy];
        let found = stress_at(nu, &[load(1.0, force, radius)], [c * x - s * y, s * x + c * y, z]);
        // The disc's closed form loses (γ/a)³ of the digits, at most 16³.
        prop_assert!(difference(found, turned) < 1e-10 * norm(turned), "{found:?} {turned:?}");
    }
}

#[test]
fn the_axis_is_a_limit_like_any_other() {
    let both = [load(1.0, [0.4, -0.2], POINT_M)];
    let on = stress_at(0.3, &both, [0.0, 0.0, 1.0]);
    // σ_xx on the axis is F (1−2ν)/(4π z²): the printed form is 0/0 there.
    assert!((on[0] - 0.4 / (4.0 * PI)).abs() < 1e-15 && (on[1] - on[0]).abs() < 1e-15, "{on:?}");
    for rho in [1e-3, 1e-6, 1e-9] {
        let off = stress_at(0.3, &both, [0.6 * rho, 0.8 * rho, 1.0]);
        // The slope of the stress along the surface is some ‖σ‖ per depth.
        assert!(difference(on, off) < 3.0 * rho * norm(on) + 1e-15, "{rho}: {on:?} {off:?}");
    }
}

#[test]
fn a_plane_below_carries_the_whole_load() {
    let sum = plane_integral(0.3, &[load(2.0, [0.7, -0.4], POINT_M)], 1.0);
    // The midpoint rule's error is (π/40000)² of the integrand's curvature, some ten.
    for (found, expected) in sum[2..].iter().zip([-2.0, 0.0, 0.4, -0.7]) {
        assert!((found - expected).abs() < 1e-7, "{sum:?}");
    }
}

#[test]
fn stress_is_in_equilibrium() {
    let loads = [load(1.0, [0.7, -0.4], POINT_M)];
    for at in [[0.3, -0.5, 0.4], [0.0, 0.0, 1.0], [1.2, 0.1, 0.2]] {
        let errors = [4e-3, 2e-3, 1e-3].map(|h| divergence(0.25, &loads, at, h));
        // Second order: the divergence is the differences' error alone.
        for pair in errors.windows(2) {
            assert!(((pair[0] / pair[1]).log2() - 2.0).abs() < 0.02, "{at:?}: {errors:?}");
        }
        assert!(errors[2] < 1e-3, "{at:?}: {errors:?}");
    }
}
