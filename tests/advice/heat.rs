//! Temperature, surroundings, phases and current.

use serde_json::json;

use super::truth::{Case, holds, matters};

/// Grains at rest, side by side on a lattice: they touch, and do not conduct.
pub const BED: &str = r#"
duration = "2 ms"
[particles]
count      = 64
radius     = "25 um"
material   = "316L"
start      = { kind = "lattice", box = ["0.201 mm", "0.201 mm", "0.201 mm"] }
integrator = "held"
[walls.plate]
plane       = { normal = [0, 0, 1] }
temperature = "300 K"
[walls.sides]
box = { lower = ["-0.101 mm", "-0.101 mm", "-1 mm"], upper = ["0.101 mm", "0.101 mm", "1 mm"] }
[thermal]
[coupling]
dt        = { start = "10 us", limit = "50 us" }
tolerance = { temperature = 1e-7 }
"#;

/// A laser over all of it.
pub const LIGHT: &str = "optics={ power = \"1 W\", absorption = \"1e5 1/m\", profile = { kind = \"top-hat\", radius = \"0.2 mm\" }, \
                         path = { kind = \"fixed\", at = [0, 0, 0] } }";

/// Falling powder and a plate that is a little warmer.
const FALLING: &str = r#"
duration = "2 ms"
[particles]
count    = 100
radius   = { mean = "25 um", spread = "5 um" }
material = "316L"
start    = { box = ["0.4 mm", "0.4 mm", "0.3 mm"], velocity = [0, 0, "-0.5 m/s"] }
contact  = { stiffness = "1e9 Pa", damping = "8e5 N s/m^3", softening = { rate = 1 } }
friction = { stiffness = "1e12 N/m^3" }
[walls.plate]
plane       = { normal = [0, 0, 1] }
temperature = "320 K"
[walls.sides]
box = { lower = ["-0.2 mm", "-0.2 mm", "-1 mm"], upper = ["0.2 mm", "0.2 mm", "1 mm"] }
[thermal]
[coupling]
dt        = { start = "1 us", limit = "20 us" }
tolerance = { temperature = 1e-6, positions = 1e-6 }
"#;

#[test]
fn temperature_is_left_out_where_a_warm_plate_has_no_time() {
    // The peak may be that of the plate, 20 K of 300 K.
    holds(&Case::new(FALLING, &[]), "thermal", "Fourier number over the run", "drop", 0.07);
}

#[test]
fn temperature_matters_on_a_hot_plate() {
    let case = Case::new(FALLING, &["walls.plate.temperature=\"1500 K\"", "duration=\"20 ms\""]);
    let without = json!([
        { "delete": { "key": "thermal" } },
        { "delete": { "key": "coupling.tolerance.temperature" } },
    ]);
    let about = ("thermal", "Fourier number over the run");
    matters(&case, about.0, about.1, "drop", &without, "mean-temperature", 0.01);
}

#[test]
fn surroundings_are_left_out_where_there_is_no_time() {
    let ambient = "thermal.ambient={ convection = \"100 W/(m^2 K)\", emissivity = 0.5 }";
    let weak = LIGHT.replace("1 W", "50 mW");
    let case = Case::new(BED, &[ambient, &weak, "optics.ends=\"1 ms\""]);
    holds(&case, "thermal.ambient", "radiated share", "drop", 0.1);
}

#[test]
fn surroundings_matter_to_hot_grains_there_or_missing() {
    let hot = LIGHT.replace("1 W", "10 W");
    let hot = [hot.as_str(), "duration=\"30 ms\"", "optics.ends=\"2 ms\"", "walls.plate.temperature=\"300 K\""];
    let there = [&hot[..], &["thermal.ambient={ emissivity = 0.8 }"]].concat();
    let without = json!([{ "delete": { "key": "thermal.ambient" } }]);
    let (about, number) = ("thermal.ambient", "radiated share");
    matters(&Case::new(BED, &there), about, number, "drop", &without, "mean-temperature", 0.01);
    let missing = Case::new(BED, &hot);
    let advice = missing.advice(about, number);
    assert_eq!(advice["verdict"], "add", "{advice:#}");
    let with = missing.edited(&advice["edits"]).run();
    let change_k = (with.of("mean-temperature") - missing.run().of("mean-temperature")).abs();
    assert!(change_k > 3.0 && change_k < advice["effects"][0]["at_most"].as_f64().unwrap(), "{change_k}");
}

#[test]
fn phases_are_left_out_where_nothing_melts() {
    let weak = LIGHT.replace("1 W", "100 mW");
    holds(&Case::new(BED, &[&weak, "thermal.phases={}"]), "thermal.phases", "heat over heat to melt", "drop", 0.01);
}

#[test]
fn phases_matter_where_it_melts_there_or_missing() {
    // 2 mJ on 64 grains of 0.26 uJ/K: some 120 K a millijoule and grain; all of it is above the solidus.
    let strong = LIGHT.replace("1 W", "20 W");
    let there = Case::new(BED, &[&strong, "thermal.phases={ vapour = false }"]);
    let without = json!([{ "delete": { "key": "thermal.phases" } }]);
    let (about, number) = ("thermal.phases", "heat over heat to melt");
    matters(&there, about, number, "drop", &without, "mean-temperature", 0.05);
    let missing = Case::new(BED, &[&strong]);
    assert_eq!(missing.advice(about, number)["verdict"], "add");
    assert!(missing.run().of("peak-temperature") > 1658.0);
}

/// Grains between two electrodes.
const CURRENT: [&str; 5] = [
    "particles.start={ kind = \"settle\", box = [\"0.2 mm\", \"0.2 mm\", \"0.3 mm\"] }",
    "particles.contact={ stiffness = \"1e8 Pa\", damping = \"2e5 N s/m^3\" }",
    "walls.plate.current-density=\"1e6 A/m^2\"",
    "current={ model = \"averaging\" }",
    "coupling.tolerance.joule_power=1e-6",
];

#[test]
fn a_current_that_heats_nothing_is_left_out() {
    // J²/(σ ρ C) = 1e12/(1.3e6 · 4e6) = 0.19 K/s.
    holds(&Case::new(BED, &CURRENT), "current", "Joule heating", "drop", 0.01);
    let tension = [
        CURRENT[0],
        CURRENT[1],
        "walls.left={ plane = { through = [\"-0.1 mm\", 0, 0], normal = [1, 0, 0] }, potential = \"10 uV\" }",
        "walls.right={ plane = { through = [\"0.1 mm\", 0, 0], normal = [-1, 0, 0] }, potential = 0 }",
        "current={ model = \"potential\" }",
        CURRENT[4],
    ];
    holds(&Case::new(BED, &tension), "current", "Joule heating", "drop", 0.1);
}

#[test]
fn a_current_that_heats_is_kept() {
    let strong = [&CURRENT[..], &["walls.plate.current-density=\"1e9 A/m^2\""]].concat();
    let without = json!([
        { "delete": { "key": "current" } },
        { "set": { "key": "coupling.tolerance", "value": "{ temperature = 1e-7 }" } },
    ]);
    let case = Case::new(BED, &strong);
    matters(&case, "current", "Joule heating", "drop", &without, "mean-temperature", 0.01);
    let advice = case.advice("current", "Joule heating");
    // Not above what it said, either.
    assert!(case.run().of("peak-temperature") - 300.0 < advice["effects"][1]["at_most"].as_f64().unwrap());
}

#[test]
fn conduction_is_left_out_where_heat_stays_and_matters_where_it_spreads() {
    let weak = LIGHT.replace("1 W", "100 mW");
    let falling = [weak.as_str(), "walls.plate.temperature=\"300 K\""];
    let poor = [&falling[..], &["materials.316L.conductivity=0.01"]].concat();
    // The bound counts twelve contacts of a settled bed for all the run.
    holds(&Case::new(FALLING, &poor), "thermal.conductance", "Péclet number", "drop", 0.05);
    let without = json!([{ "set": { "key": "materials.316L.conductivity", "value": "0" } }]);
    let good = [&falling[..], &["materials.316L.conductivity=100", "duration=\"8 ms\""]].concat();
    let strong = LIGHT.replace("0.2 mm", "0.05 mm");
    let good = [&good[1..], &[strong.as_str()]].concat();
    let case = Case::new(FALLING, &good);
    matters(&case, "thermal.conductance", "Péclet number", "drop", &without, "mean-temperature", 0.01);
}

#[test]
fn a_grain_is_lumped_where_its_biot_number_is_small() {
    // One grain, cooled from 600 K in gas of 300 K. The mean temperature of a sphere with surface transfer is
    // Σ 6 Bi²/(ζ²(ζ² + Bi² − Bi)) e^{−ζ² α t/R²}, 1 − ζ cot ζ = Bi = h R/K (Carslaw & Jaeger 1959, section 9.4).
    const GRAIN: &str = r#"
        duration = "4 s"
        [materials.slow]
        density = 1000
        heat-capacity = 1000
        conductivity = 1
        [particles]
        count       = 1
        radius      = "1 mm"
        material    = "slow"
        temperature = "600 K"
        gravity     = [0, 0, 0]
        integrator  = "held"
        start       = { box = ["3 mm", "3 mm", "3 mm"] }
        [thermal]
        [coupling]
        dt = "10 ms"
    "#;
    let exact = |biot: f64, fourier: f64| -> f64 {
        let root = |k: usize| {
            let (mut low, mut high) = (k as f64 * std::f64::consts::PI, (k + 1) as f64 * std::f64::consts::PI);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if 1.0 - middle / middle.tan() < biot { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        let term = |zeta: f64| {
            6.0 * biot * biot / (zeta * zeta * (zeta * zeta + biot * biot - biot)) * (-zeta * zeta * fourier).exp()
        };
        (0..40).map(|k| term(root(k))).sum()
    };
    // α t/R² = 1e-6 · 4/1e-6 = 4.
    for (transfer, suffices) in [(100.0, true), (250.0, true), (5000.0, false)] {
        let ambient = format!("thermal.ambient={{ temperature = 300, convection = {transfer} }}");
        let case = Case::new(GRAIN, &[&ambient, if suffices { "duration=\"4 s\"" } else { "duration=\"0.2 s\"" }]);
        let advice = case.advice("thermal", "Biot number");
        assert_eq!(advice["verdict"] == "suffices", suffices, "{advice:#}");
        let fourier = if suffices { 4.0 } else { 0.2 };
        let error_k = (case.run().of("mean-temperature") - 300.0 - 300.0 * exact(transfer * 1e-3, fourier)).abs();
        if suffices {
            assert!(error_k < advice["effects"][0]["at_most"].as_f64().unwrap(), "{transfer}: {error_k} K");
        } else {
            assert!(error_k > 15.0, "{error_k} K");
        }
    }
}
