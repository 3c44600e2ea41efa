//! Fault: with several materials the energy-balance fidelity spread light by volume, so that light particles got hotter. All heat
//! alike: Δθ = W/Σ m C (Zohdi 2018, eq. 6.39).

use super::program::{field, folder, summary};

const SCENE: &str = r#"
duration = "1 ms"
[materials.heavy]
density = 8000
heat-capacity = 500
conductivity = 40
[materials.light]
density = 2700
heat-capacity = [["200 K", 800], ["400 K", 1000]]
conductivity = 200
[particles]
material = "heavy"
start = { kind = "file", path = "spheres.csv" }
integrator = "held"
gravity = [0, 0, 0]
[thermal]
[optics]
fidelity = "energy-balance"
power = "20 mW"
profile = { kind = "gaussian", radius = "80 um" }
path = { kind = "fixed", at = [0, 0, 0] }
[coupling]
dt = "50 us"
"#;
const SPHERES: &str = "x,y,z,radius,material\n0,0,0,5e-5,heavy\n0,0,1e-3,5e-5,light\n0,1e-3,0,2e-5,light\n";

#[test]
fn particles_of_several_materials_heat_alike() {
    let folder = folder(&[("scene.toml", SCENE), ("spheres.csv", SPHERES)]);
    // Of one number at all temperatures, and by a table, whose value at the start counts: 900 J/(kg K) at 300 K.
    for (set, tolerance_k) in [("materials.light.heat-capacity=900", 1e-9), ("thermal.phi=0.5", 0.1)] {
        let summary = summary(folder.path(), "scene.toml", &[set]);
        let [coldest_k, hottest_k] =
            ["min", "max"].map(|which| field(&summary, "temperature")[which].as_f64().unwrap());
        let volume = |radius_m: f64| 4.0 / 3.0 * std::f64::consts::PI * radius_m * radius_m * radius_m;
        let capacity_j_k = 8000.0 * 500.0 * volume(5e-5) + 2700.0 * 900.0 * (volume(5e-5) + volume(2e-5));
        let expected_k = 300.0 + 20e-3 * 1e-3 / capacity_j_k;
        assert!((coldest_k - expected_k).abs() < tolerance_k, "{set}: {coldest_k} K instead of {expected_k} K");
        assert!((hottest_k - expected_k).abs() < tolerance_k, "{set}: {hottest_k} K instead of {expected_k} K");
        assert!(hottest_k > 304.0);
    }
}
