//! Fault: a particle that boiled within a step went on being heated to the step's end, so that the highest temperature followed
//! the step: 26 792 K at 20 µs, 3917 K at 0.5 µs, with a boiling point of 3134 K. Vapour takes no more heat than it can.

use std::path::Path;

use super::program::{folder, stagger, stderr};

/// Layers of steel that touch, under a strong beam that sweeps across.
const SCENE: &str = r#"
duration = "120 us"
[particles]
material = "316L"
start = { kind = "file", path = "bed.csv" }
integrator = "held"
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = 300
[thermal]
phases = {}
[optics]
power = "1 kW"
absorption = "5e4 1/m"
profile = { kind = "gaussian", radius = "50 um" }
path = { kind = "sweep", from = ["-0.08 mm", 0, 0], to = ["0.08 mm", 0, 0], speed = "1 m/s" }
[coupling]
dt = "20 us"
"#;
/// Five by five by four spheres of 20 µm that overlap by 1 %.
fn bed() -> String {
    let mut bed = "x,y,z,radius\n".to_owned();
    for k in 0..100 {
        let at = |place: i32, from: f64| (f64::from(place) + from) * 39.6e-6;
        let [x, y, z] = [at(k % 5, -2.0), at(k / 5 % 5, -2.0), at(k / 25, 0.5)];
        bed += &format!("{x:e},{y:e},{z:e},2e-5\n");
    }
    bed
}

/// Boiling point of 316L.
const BOILING_K: f64 = 3134.0;

/// The highest temperature that any state of a run has, in K, and its summary.
fn peak_k(folder: &Path, sets: &[&str]) -> (f64, serde_json::Value) {
    let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", *set]).collect();
    let run = ["run", "scene.toml", "--in-process", "--json", "--record", "run.mcap"];
    // Nothing is written over.
    let _ = std::fs::remove_file(folder.join("run.mcap"));
    let _ = std::fs::remove_dir_all(folder.join("series"));
    let output = stagger(folder, &[&run[..], &sets[..]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let exported = stagger(folder, &["export", "run.mcap", "--out", "series", "--csv"]);
    assert!(exported.status.success(), "{}", stderr(&exported));
    let table = std::fs::read_to_string(folder.join("series/scalars.csv")).unwrap();
    let mut lines = table.lines();
    // Names with a comma stand between quotes; what is within those is no column of its own.
    let names: String = lines.next().unwrap().split('"').step_by(2).collect::<Vec<_>>().join("quoted");
    let column = names.split(',').position(|name| name == "field temperature: max [K]").unwrap();
    let cells = lines.filter_map(|line| line.split(',').nth(column)?.parse::<f64>().ok());
    (cells.fold(0.0, f64::max), serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn nothing_that_boils_gets_hotter_than_its_boiling_point_in_any_step() {
    let folder = folder(&[("scene.toml", SCENE), ("bed.csv", &bed())]);
    let mut vapour_j = Vec::new();
    for dt in ["20 us", "8 us", "2 us", "0.5 us"] {
        let (peak_k, summary) = peak_k(folder.path(), &[&format!("coupling.dt=\"{dt}\"")]);
        assert!((peak_k - BOILING_K).abs() < 1e-9, "{dt}: {peak_k} K");
        for balance in ["thermal", "absorbed: optics to thermal"] {
            let open = summary["imbalance"][balance].as_f64().unwrap();
            // Rounding: sums of 100 particles over at most 240 windows.
            assert!(open.abs() < 1e-12, "{dt}, {balance}: {open:e}");
        }
        let [vapour, missed, absorbed] = [("lost", "vapour"), ("lost", "missed"), ("gained", "absorbed")]
            .map(|(kind, name)| summary["ledger"]["thermal"][kind][name].as_f64().unwrap());
        assert!(vapour > 0.0 && missed >= 0.0 && missed < absorbed, "{dt}: {vapour}, {missed}, {absorbed} J");
        vapour_j.push(vapour);
    }
    // What boils converges as well: each step is nearer to the finest than the one before.
    let far: Vec<f64> = vapour_j.iter().map(|found| (found / vapour_j[3] - 1.0).abs()).collect();
    assert!(far[1] < far[0] && far[2] < far[1] && far[2] < 0.1, "{vapour_j:?}");
}

#[test]
fn nor_with_a_band_several_materials_other_weights_or_an_ambient() {
    let folder = folder(&[("scene.toml", SCENE), ("bed.csv", &bed())]);
    for (set, most_k) in [
        ("thermal.phases={ boiling-band = 40 }", BOILING_K + 40.0),
        ("thermal.phi=0", BOILING_K),
        ("thermal.phi=1", BOILING_K),
        ("thermal.solver=conjugate-gradient", BOILING_K),
        ("thermal.conductance=constriction", BOILING_K),
        ("thermal.ambient={ convection = 1e4, emissivity = 0.5 }", BOILING_K),
        ("optics.fidelity=energy-balance", BOILING_K),
        ("walls.plate.temperature=6000", BOILING_K),
    ] {
        // So strong that particles boil in much less than a step.
        let (peak_k, summary) = peak_k(folder.path(), &[set, "optics.power=\"5 kW\""]);
        assert!(peak_k <= most_k + 1e-9 && peak_k >= BOILING_K, "{set}: {peak_k} K");
        let open = summary["imbalance"]["thermal"].as_f64().unwrap();
        assert!(open.abs() < 1e-12, "{set}: {open:e}");
    }
}
