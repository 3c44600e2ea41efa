//! Grains on a plate: what they lose to it, it gains, cell by cell and to rounding.

use std::ops::ControlFlow;

use stagger_scene::{Scene, run_in_process};

const SCENE: &str = r#"
    duration = "0.4 ms"
    [particles]
    temperature = "900 K"
    material    = "316L"
    integrator  = "held"
    start       = { kind = "file", path = "grains.csv", unit = "um" }
    [walls.plate]
    plane = { normal = [0, 0, 1] }
    [grids.plate]
    lower = ["-60 um", "-60 um", "-60 um"]
    upper = ["60 um", "60 um", 0]
    cell  = "10 um"
    [solid]
    grid        = "plate"
    wall        = "plate"
    temperature = "300 K"
    [thermal]
    [coupling]
    dt = "20 us"
"#;

/// Four grains that press half a micrometre into the plate.
const GRAINS: &str = "x,y,z,radius\n-20,-20,19.5,20\n20,-20,19.5,20\n-20,20,19.5,20\n20,20,19.5,20\n";

#[test]
fn what_grains_lose_to_a_plate_it_gains() {
    for (set, enthalpy) in [("thermal.solver", "\"fixed-point\""), ("thermal.solver", "\"conjugate-gradient\"")] {
        let scene = Scene::parse_with_files(SCENE, "grains.toml", &[(set.into(), enthalpy.into())], &|_| {
            Ok(GRAINS.as_bytes().to_vec())
        })
        .unwrap();
        let mut last_k = f64::INFINITY;
        let run = run_in_process(&scene, |step| {
            let fields = step.fields();
            let mean = |name: &str| fields[name].f64().unwrap().iter().sum::<f64>() / fields[name].rows() as f64;
            let grains_k = mean("temperature");
            assert!(grains_k < last_k, "{grains_k} K after {last_k} K");
            last_k = grains_k;
            assert!(mean("solid_temperature") > 300.0);
            ControlFlow::Continue(())
        })
        .unwrap();
        let ledger = serde_json::to_value(&run.ledger).unwrap();
        let of = |node: &str, side: &str| ledger["nodes"][node][side]["surface_heat"].as_f64().unwrap();
        let (given_j, taken_j) = (of("thermal", "lost"), of("solid", "gained"));
        assert!(given_j > 0.0 && (given_j / taken_j - 1.0).abs() < 1e-12, "{given_j} and {taken_j} J");
        for node in ["thermal", "solid"] {
            let sum = |side: &str| {
                let entries = ledger["nodes"][node][side].as_object().unwrap();
                entries.values().map(|joule| joule.as_f64().unwrap()).sum::<f64>()
            };
            let imbalance_j = sum("stored") - sum("initial") - sum("gained") + sum("lost");
            assert!(imbalance_j.abs() < 1e-9 * given_j, "{node}: {imbalance_j} J of {given_j} J");
        }
        // Heat is where the grains stand: under the four of them, not in the corners.
        let surface_k = run.fields["surface_temperature"].f64().unwrap();
        assert!(surface_k[4 + 12 * 4] > surface_k[0] + 1.0, "{} and {} K", surface_k[4 + 12 * 4], surface_k[0]);
    }
}
