//! Particles that a laser boils leave the run, and it is the same run however it is run.

use super::program::{Workplace, json, stagger};

/// quick.toml with a laser that boils a third of the particles.
const BOILING: [&str; 10] = [
    "--set",
    "thermal.phases={}",
    "--set",
    "thermal.ambient={ convection = 20, emissivity = 0.3 }",
    "--set",
    "optics.power=\"1500 W\"",
    "--set",
    "recovery.checkpoint=7",
    "--set",
    "coupling.tolerance={ positions = 1e-6, temperature = 1e-5, absorbed_power = 1e-5 }",
];

#[test]
fn vapour_leaves_and_every_way_of_running_agrees() {
    let place = Workplace::with("quick.toml");
    let recorded = place.path("run.mcap");
    let whole = json(&place.run(&[&BOILING[..], &["--json", "--record", recorded.to_str().unwrap()]].concat()));
    let hash = whole["hash"].as_str().unwrap();

    let rows = |field: &str| {
        let fields = whole["fields"].as_array().unwrap();
        fields.iter().find(|entry| entry["field"] == field).unwrap()["rows"].as_u64().unwrap()
    };
    let left = rows("positions");
    assert!(left < 80, "{left} of 100 particles are left");
    assert_eq!((rows("temperature"), rows("melted"), rows("vapourised")), (left, left, left));
    let lost = &whole["ledger"]["thermal"]["lost"];
    // 7.8 MJ/kg of some 5e-10 kg each, above 300 K, and at least as much.
    let vapour_j = lost["vapour"].as_f64().unwrap();
    let least_j = (100 - left) as f64 * 7.7e6 * 7950.0 * 4.0 / 3.0 * std::f64::consts::PI * 20e-6_f64.powi(3);
    assert!(vapour_j > least_j, "{vapour_j} J");
    assert!(lost["radiated"].as_f64().unwrap() > 0.0 && lost["convected"].as_f64().unwrap() > 0.0);
    for balance in ["thermal", "absorbed: optics to thermal"] {
        let open = whole["imbalance"][balance].as_f64().unwrap().abs();
        // Rounding of some thousand terms over some hundred windows.
        assert!(open < 1e-12, "{balance}: {open:e}");
    }

    let one = json(&place.run(&[&BOILING[..], &["--json", "--no-record", "--in-process", "--threads", "1"]].concat()));
    assert_eq!(one["hash"].as_str().unwrap(), hash);
    assert_eq!(one["ledger"], whole["ledger"]);
    let verified = json(&stagger().args(["verify", "--json"]).arg(&recorded).output().unwrap());
    assert_eq!(verified["hash"].as_str().unwrap(), hash);
    // From a checkpoint in the middle of the boiling.
    let accepted = whole["steps"]["accepted"].as_u64().unwrap();
    let from = format!("run.mcap@{}", accepted * 2 / 3);
    let rest = json(&place.run(&[&BOILING[..], &["--json", "--no-record", "--resume", &from]].concat()));
    assert_eq!(rest["hash"].as_str().unwrap(), hash);
    assert_eq!(rest["ledger"], whole["ledger"]);
    place.wait_until_empty();
}

#[test]
fn jacobi_order_and_quasi_newton_let_vapour_leave_too() {
    let place = Workplace::with("quick.toml");
    for set in ["coupling.order=\"jacobi\"", "coupling.acceleration=iqn-ils"] {
        let arguments = [&BOILING[..], &["--json", "--no-record", "--in-process", "--set", set]].concat();
        let summary = json(&place.run(&arguments));
        let lost_j = summary["ledger"]["thermal"]["lost"]["vapour"].as_f64().unwrap();
        let open = summary["imbalance"]["thermal"].as_f64().unwrap().abs();
        // A third of a hundred particles, with some 4 mJ each.
        assert!(lost_j > 0.1 && open < 1e-12, "{set}: {lost_j} J of vapour, {open:e} open");
    }
}
