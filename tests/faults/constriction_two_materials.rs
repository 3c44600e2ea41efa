//! Fault: with `conductance = "constriction"` a contact of two materials conducted by the mean of their conductivities, so that
//! heat flowed into an insulator. The spot lies between two half-spaces in series: 1/G = 1/(4 K₁ a) + 1/(4 K₂ a).

use std::{f64::consts::PI, path::Path};

use super::program::{field, folder, summary};

/// A hot wall, a sphere of metal on it, and a sphere of another material on that.
const SCENE: &str = r#"
duration = "20 us"
[materials.metal]
density = 8000
heat-capacity = 500
conductivity = 40
[materials.other]
density = 8000
heat-capacity = 500
conductivity = 0
[particles]
material = "metal"
start = { kind = "file", path = "spheres.csv", materials = ["metal", "other"] }
integrator = "held"
gravity = [0, 0, 0]
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = "1000 K"
[thermal]
conductance = "constriction"
[coupling]
dt = "0.5 us"
"#;
const SPHERES: &str = "x,y,z,radius,material\n0,0,49.5e-6,5e-5,0\n0,0,148.5e-6,5e-5,1\n";
const RADIUS_M: f64 = 5e-5;
const METAL_W_M_K: f64 = 40.0;

/// m C of a sphere, in J/K.
const CAPACITY_J_K: f64 = 8000.0 * 500.0 * 4.0 / 3.0 * PI * RADIUS_M * RADIUS_M * RADIUS_M;

fn run(folder: &Path, other_w_m_k: f64, more: &[&str]) -> [f64; 2] {
    let other = format!("materials.other.conductivity={other_w_m_k}");
    let summary = summary(folder, "scene.toml", &[&[other.as_str()], more].concat());
    ["min", "max"].map(|which| field(&summary, "temperature")[which].as_f64().unwrap())
}

/// Temperatures after 20 µs, metal first, by a fourth-order rule with steps so short that its error is rounding.
fn exact(other_w_m_k: f64) -> [f64; 2] {
    // The lens's plane cuts spheres that overlap by 1 % of R, and the plate cuts the lower one, 1 % of R from its centre.
    let spot_m = (RADIUS_M * RADIUS_M - (0.99 * RADIUS_M).powi(2)).sqrt();
    let wall_w_k = 4.0 * METAL_W_M_K * spot_m;
    let pair_w_k = if other_w_m_k > 0.0 { 4.0 * spot_m / (1.0 / METAL_W_M_K + 1.0 / other_w_m_k) } else { 0.0 };
    let rate = |[metal, other]: [f64; 2]| {
        let between_w = pair_w_k * (metal - other);
        [(wall_w_k * (1000.0 - metal) - between_w) / CAPACITY_J_K, between_w / CAPACITY_J_K]
    };
    let (mut at_k, steps) = ([300.0; 2], 200);
    let dt_s = 20e-6 / f64::from(steps);
    let ahead = |at: [f64; 2], by: [f64; 2], s: f64| [at[0] + s * by[0], at[1] + s * by[1]];
    for _ in 0..steps {
        let k1 = rate(at_k);
        let k2 = rate(ahead(at_k, k1, 0.5 * dt_s));
        let k3 = rate(ahead(at_k, k2, 0.5 * dt_s));
        let k4 = rate(ahead(at_k, k3, dt_s));
        for part in 0..2 {
            at_k[part] += dt_s / 6.0 * (k1[part] + 2.0 * (k2[part] + k3[part]) + k4[part]);
        }
    }
    at_k
}

#[test]
fn an_insulator_takes_nothing_and_a_bad_conductor_what_two_half_spaces_in_series_let_through() {
    let folder = folder(&[("scene.toml", SCENE), ("spheres.csv", SPHERES)]);
    for other_w_m_k in [0.0, 1.0, 40.0, 400.0] {
        let [other_k, metal_k] = run(folder.path(), other_w_m_k, &[]);
        let [exact_metal_k, exact_other_k] = exact(other_w_m_k);
        // The trapezoidal rule in steps of 0.5 µs: λ³ T Δt²/12 of the difference, λ ~ 6e2/s, and of a temperature that begins to
        // rise with the square of time some times that share.
        for (found, exact) in [(metal_k, exact_metal_k), (other_k, exact_other_k)] {
            assert!(
                (found - exact).abs() < 1e-5 * (exact - 300.0) + 1e-10,
                "{other_w_m_k}: {found} instead of {exact}"
            );
        }
    }
}

#[test]
fn an_insulator_blocks_with_tables_and_in_any_order_of_materials_but_not_by_the_monographs_mean() {
    let folder = folder(&[
        ("scene.toml", SCENE),
        ("spheres.csv", SPHERES),
        ("swapped.csv", "x,y,z,radius,material\n0,0,148.5e-6,5e-5,1\n0,0,49.5e-6,5e-5,0\n"),
    ]);
    let swapped = r#"particles.start={ kind = "file", path = "swapped.csv", materials = ["metal", "other"] }"#;
    let table = r#"materials.metal.conductivity=[["300 K", 40], ["400 K", 50]]"#;
    for more in [swapped, table, "thermal.solver=conjugate-gradient"] {
        let [other_k, metal_k] = run(folder.path(), 0.0, &[more]);
        assert!(other_k == 300.0 && metal_k > 305.0, "{more}: {other_k} K, {metal_k} K");
    }
    // Its mean is the arithmetic one, eq. 6.37: half of the metal's conductivity.
    let [other_k, metal_k] = run(folder.path(), 0.0, &["thermal.conductance=monograph"]);
    assert!(other_k > 300.0 && metal_k > other_k, "{other_k} K, {metal_k} K");
}
