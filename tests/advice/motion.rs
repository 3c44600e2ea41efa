//! Drag, spin, and the step of the motion.

use serde_json::json;

use super::truth::{Case, holds, matters};

/// A single grain above a plate.
const GRAIN: &str = r#"
duration = "20 ms"
[particles]
count    = 1
radius   = "1 mm"
material = "316L"
start    = { box = ["3 mm", "3 mm", "3 mm"], velocity = [0.5, 0, 0] }
contact  = { law = "hertz", young = "100 MPa" }
[walls.plate]
plane = { normal = [0, 0, 1] }
[coupling]
dt = { start = "20 us", limit = "50 us" }
"#;

#[test]
fn drag_is_left_out_where_a_grain_is_heavy() {
    // 1 mm of steel keeps its speed in air for a minute and a half.
    holds(
        &Case::new(GRAIN, &["particles.drag={ viscosity = \"2e-5 Pa s\" }"]),
        "particles.drag",
        "Stokes number",
        "drop",
        0.01,
    );
}

#[test]
fn drag_matters_to_fine_powder_there_or_missing() {
    let sets = [
        "particles.radius=\"10 um\"",
        "particles.start={ box = [\"1 mm\", \"1 mm\", \"1 mm\"], velocity = [1, 0, 0] }",
    ];
    let there = [&sets[..], &["particles.drag={ viscosity = \"2e-5 Pa s\" }"]].concat();
    let without = json!([{ "set": { "key": "particles.drag", "value": "none" } }]);
    matters(&Case::new(GRAIN, &there), "particles.drag", "Stokes number", "drop", &without, "mean-position", 0.01);
    let missing = Case::new(GRAIN, &sets);
    let advice = missing.advice("particles.drag", "Stokes number");
    assert_eq!(advice["verdict"], "add");
    let change = missing.edited(&advice["edits"]).run().of("mean-position") - missing.run().of("mean-position");
    // It says how much, too.
    assert!(change.abs() < advice["effects"][0]["at_most"].as_f64().unwrap() && change.abs() > 1e-4, "{change}");
}

#[test]
fn spin_is_left_out_where_friction_is_too_little_for_it() {
    let friction = "particles.friction={ law = \"spring\", static = 0.004, dynamic = 0.004 }";
    holds(&Case::new(GRAIN, &["particles.spin=true", friction]), "particles.spin", "spin energy share", "drop", 0.01);
}

#[test]
fn spin_matters_where_a_grain_rolls_there_or_missing() {
    let rough = "particles.friction={ law = \"spring\", static = 0.5, dynamic = 0.5 }";
    let long = "duration=\"60 ms\"";
    let without = json!([{ "set": { "key": "particles.spin", "value": "false" } }]);
    let spins = Case::new(GRAIN, &["particles.spin=true", rough, long]);
    matters(&spins, "particles.spin", "spin energy share", "drop", &without, "mean-position", 0.05);
    let advice = Case::new(GRAIN, &[rough, long]).advice("particles.spin", "spin energy share");
    assert_eq!(advice["verdict"], "add");
}

#[test]
fn a_step_much_finer_than_contacts_may_be_coarser() {
    // The rebound at the end of a fall of some 2 mm: in flight again at 25 ms, at the speed of the impact.
    let fine = "particles.integrator={ kind = \"verlet\", substep = \"50 ns\" }";
    holds(
        &Case::new(GRAIN, &[fine, "particles.start.velocity=[0,0,-0.5]"]),
        "particles.integrator.substep",
        "contact duration over step",
        "suffices",
        0.01,
    );
}

#[test]
fn contacts_that_a_step_jumps_are_told() {
    // Steps of the monograph's rule at half of a contact: the rebound is another.
    let coarse = [
        "particles.integrator={ kind = \"trapezoidal\", acceleration = \"anderson\", iterations = 1000 }",
        "particles.start.velocity=[0,0,-0.5]",
        "coupling.dt={ start = \"40 us\", limit = \"40 us\" }",
    ];
    let case = Case::new(GRAIN, &coarse);
    let advice = case.advice("coupling.dt.limit", "contact duration over step");
    assert_eq!(advice["verdict"], "refine", "{advice:#}");
    let (coarse, fine) = (case.run(), case.edited(&advice["edits"]).run());
    let change = fine.of("mean-position") - coarse.of("mean-position");
    assert!(change.abs() > 0.001 * fine.of("mean-position"), "{change}");
}
