//! Fault: the imbalance was divided by the difference of the ends, so that what came back hid every error.
//!
//! A sphere bounces between walls without loss, two spheres circle each other, a charge circles in a magnetic field: at
//! the end each has the energy it began with, but for an error. That error is a share of the energy that was turned over,
//! and the same one whoever tells it.

use serde_json::Value;

use super::program;

const BOUNCE: &str = r#"
duration = "2 ms"
[particles]
start = { kind = "file", path = "one.csv" }
contact = { law = "hertz", young = "1e9 Pa", restitution = 1 }
gravity = [0, 0, 0]
[walls.a]
box = { lower = [0, 0, 0], upper = ["0.5 mm", "0.5 mm", "0.5 mm"] }
[coupling]
dt = "20 us"
[recovery]
checkpoint = 30
"#;
const ONE: &str = "x,y,z,radius,vx,vy,vz\n1e-4,2.5e-4,2.5e-4,5e-5,0.5,0,0\n";

/// Two masses on a Kepler ellipse; one period.
const ORBIT: &str = r#"
duration = 61.399602476789305
[materials.m]
density = 1000
[particles]
start = { kind = "file", path = "two.csv" }
material = "m"
gravity = [0, 0, 0]
integrator = { kind = "trapezoidal", tolerance = 1e-13, iterations = 200 }
[particles.near-field]
attraction = 0.01
attraction-exponent = 2
repulsion = 0
[coupling]
dt = 0.15349900619197326
default-tolerance = 1e-12
iterations = 50
"#;
const TWO: &str = "x,y,z,radius,vx,vy,vz\n1,0,0,0.1,0,0.10233267079464885,0\n-1,0,0,0.1,0,-0.10233267079464885,0\n";

/// One turn of a charge in a magnetic field, in 20 steps.
const CHARGE: &str = r#"
duration = "1.047197551 s"
[materials.m]
density = 1000
[particles]
start = { kind = "file", path = "charge.csv" }
material = "m"
gravity = [0, 0, 0]
contact = { stiffness = 1e3 }
[particles.electromagnetic]
charge = 3
magnetic = [0, 0, 2]
[coupling]
dt = "0.05 s"
"#;
const AT_1_M_S: &str = "x,y,z,radius,vx,vy,vz\n0,0,0,1,1,0,0\n";

fn imbalance(summary: &Value) -> f64 {
    summary["imbalance"]["particles"].as_f64().unwrap()
}

/// Change of the kinetic energy over the largest there was, as the ledger says, less what it says was exchanged.
fn expected(summary: &Value) -> f64 {
    let account = &summary["ledger"]["particles"];
    let sum =
        |side: &str| account[side].as_object().unwrap().values().map(|joule| joule.as_f64().unwrap()).sum::<f64>();
    let error_j = sum("stored") - sum("initial") - sum("gained") + sum("lost");
    error_j / account["ranges"]["stored"]["kinetic"][1].as_f64().unwrap()
}

#[test]
fn a_bounce_without_loss_is_off_by_its_error_over_its_energy() {
    let folder = program::folder(&[("scene.toml", BOUNCE), ("one.csv", ONE)]);
    let summary = program::summary(folder.path(), "scene.toml", &[]);
    let share = imbalance(&summary);
    // A few impacts of 3.4 us, each of some dozens of substeps, exact to a thousandth or so of the energy: not the whole of it.
    assert!(share.abs() < 1e-3, "{share:e}");
    assert!((share / expected(&summary) - 1.0).abs() < 1e-9, "{share:e}, expected {:e}", expected(&summary));
    // With substeps far too coarse for the impact the fault is seen as large as it is.
    let coarse = program::summary(folder.path(), "scene.toml", &["particles.integrator.substep=0.4 us"]);
    assert!(imbalance(&coarse).abs() > 10.0 * share.abs(), "{:e} and {share:e}", imbalance(&coarse));
}

#[test]
fn the_share_is_the_same_in_the_summary_the_recording_and_after_going_on() {
    let folder = program::folder(&[("scene.toml", BOUNCE), ("one.csv", ONE)]);
    let json = |arguments: &[&str]| -> Value {
        let output = program::stagger(folder.path(), arguments);
        assert!(output.status.success(), "{}", program::stderr(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let thinned = ["--set", "record.level=accepted", "--set", "record.every=7"];
    let whole = json(&["run", "scene.toml", "--in-process", "--record", "whole.mcap", "--json"]);
    let told = json(&["info", "whole.mcap", "--json"]);
    assert_eq!(told["imbalance"], whole["imbalance"]);
    let processes = json(&[&["run", "scene.toml", "--record", "thinned.mcap", "--json"], &thinned[..]].concat());
    assert_eq!(processes["imbalance"], whole["imbalance"]);
    assert_eq!(json(&["info", "thinned.mcap", "--json"])["imbalance"], whole["imbalance"]);
    // Gone on from the middle: by whom it is run, and by what is recorded of it.
    let resumed = ["run", "scene.toml", "--in-process", "--resume", "whole.mcap@60", "--record", "rest.mcap", "--json"];
    let rest = json(&resumed);
    assert_eq!((&rest["imbalance"], &rest["ledger"]), (&whole["imbalance"], &whole["ledger"]));
    let told = json(&["info", "rest.mcap", "--json"]);
    assert_eq!(told["imbalance"], whole["imbalance"]);
    assert_eq!(told["nodes"]["particles"]["ledger"], whole["ledger"]["particles"]);
}

#[test]
fn an_orbit_and_a_charge_in_a_magnetic_field_do_not_hide_their_errors() {
    let folder = program::folder(&[("orbit.toml", ORBIT), ("two.csv", TWO)]);
    let orbit = program::summary(folder.path(), "orbit.toml", &[]);
    // The period's error is of second order in 400 steps: (2 pi/400)^2 is 2e-4.
    assert!(imbalance(&orbit).abs() < 1e-3, "{:e}", imbalance(&orbit));
    // They fly apart: nothing is exchanged, and nothing is wrong.
    let apart = program::summary(folder.path(), "orbit.toml", &["particles.near-field.attraction=0"]);
    assert!(imbalance(&apart).abs() < 1e-12, "{:e}", imbalance(&apart));
    let charge = program::folder(&[("scene.toml", CHARGE), ("charge.csv", AT_1_M_S)]);
    let summary = program::summary(charge.path(), "scene.toml", &[]);
    // A field that does no work: what the energy changes by is the error, of the whole energy and not of itself.
    let share = imbalance(&summary);
    let account = &summary["ledger"]["particles"];
    let [initial, stored, gained] = [("initial", "kinetic"), ("stored", "kinetic"), ("gained", "fields")]
        .map(|(side, name)| account[side][name].as_f64().unwrap());
    let most = account["ranges"]["stored"]["kinetic"][1].as_f64().unwrap();
    assert!(most >= initial.max(stored));
    assert!((share - (stored - initial - gained) / most).abs() < 1e-12, "{share:e}");
    assert!(share.abs() < 0.95, "{share:e}");
}
