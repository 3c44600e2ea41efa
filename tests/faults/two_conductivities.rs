//! Fault: spheres of two conductivities in series between two walls passed 5.5 times too much heat, or current, with
//! `conductance = "constriction"`. A contact has the harmonic mean, and a wall held at a temperature or a potential takes 4 K a.

use super::program::{folder, summary};

const SPHERES: &str = "x,y,z,radius,material\n0.00095,0,0,0.001,a\n0.00285,0,0,0.001,b\n";
/// Overlaps of 5 % of R, at the walls too: a² = R² (1 − 0.95²).
const SPOT_M: f64 = 1e-3 * 0.312_249_899_919_919_85;

const HEAT: &str = r#"
duration = "10 ms"
[materials.a]
density = 1
heat-capacity = 1
conductivity = 20
[materials.b]
density = 1
heat-capacity = 1
conductivity = 1
[particles]
start = { kind = "file", path = "spheres.csv" }
material = "a"
gravity = [0, 0, 0]
integrator = "held"
[walls.left]
plane = { normal = [1, 0, 0] }
temperature = 400
[walls.right]
plane = { through = [0.0038, 0, 0], normal = [-1, 0, 0] }
temperature = 300
[thermal]
conductance = "constriction"
solver = "conjugate-gradient"
phi = 1
[coupling]
dt = "1 ms"
"#;

/// Heat in W that passes from wall to wall in the steady state: three resistances in series.
fn through_w(a: f64, b: f64) -> f64 {
    let resistance_k_w = [4.0 * a, 2.0 * (2.0 * a * b / (a + b)), 4.0 * b].map(|k| 1.0 / (k * SPOT_M));
    100.0 / resistance_k_w.iter().sum::<f64>()
}

#[test]
fn heat_passes_two_materials_as_resistances_in_series() {
    let folder = folder(&[("scene.toml", HEAT), ("spheres.csv", SPHERES)]);
    for (a, b) in [(20.0, 1.0), (400.0, 0.1), (20.0, 20.0)] {
        let sets = [format!("materials.a.conductivity={a}"), format!("materials.b.conductivity={b}")];
        let summary = summary(folder.path(), "scene.toml", &sets.each_ref().map(String::as_str));
        let temperature = super::program::field(&summary, "temperature");
        let [coldest_k, hottest_k] = ["min", "max"].map(|which| temperature[which].as_f64().unwrap());
        // What the left wall gives, and the right one takes.
        let left_w = 4.0 * a * SPOT_M * (400.0 - hottest_k);
        let right_w = 4.0 * b * SPOT_M * (coldest_k - 300.0);
        let expected_w = through_w(a, b);
        for found_w in [left_w, right_w] {
            // The solver's 1e-10 of 400 K and the roundings of steps of 10⁵ explicit limits, times the best contact's conductance.
            let rounding = 1e-6 * 4.0 * a * SPOT_M;
            assert!((found_w - expected_w).abs() < rounding, "{a}, {b}: {found_w} W instead of {expected_w} W");
        }
    }
}

const CURRENT: &str = r#"
duration = 1
[materials.a]
density = 1
electrical-conductivity = 100
[particles]
start = { kind = "file", path = "spheres.csv", materials = ["a"] }
material = "a"
gravity = [0, 0, 0]
integrator = "held"
[walls.left]
plane = { normal = [1, 0, 0] }
potential = 3
[walls.right]
plane = { through = [0.0038, 0, 0], normal = [-1, 0, 0] }
potential = 1
[current]
model = "potential"
conductance = "constriction"
[coupling]
dt = 0.5
"#;

#[test]
fn a_wall_at_a_potential_gives_current_to_a_spot_of_4_sigma_a() {
    let spheres = SPHERES.replace(",b", ",a");
    let folder = folder(&[("scene.toml", CURRENT), ("spheres.csv", &spheres)]);
    let summary = summary(folder.path(), "scene.toml", &[]);
    let heat_j = summary["ledger"]["current"]["lost"]["joule"].as_f64().unwrap();
    // 2 V over 1/(4 σ a) + 1/(2 σ a) + 1/(4 σ a) = 1/(σ a), for 1 s.
    let expected_j = 2.0 * 2.0 * 100.0 * SPOT_M;
    assert!((heat_j / expected_j - 1.0).abs() < 1e-8, "{heat_j} J instead of {expected_j} J");
}
