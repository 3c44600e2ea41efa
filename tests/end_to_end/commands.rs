//! What a node that is a command of the user's own is told, and what `check --json` tells it.

use serde_json::Value;

use super::program::{Workplace, json, said, stagger};

fn check(place: &Workplace, more: &[&str]) -> Value {
    json(&stagger().arg("check").arg(&place.scene).arg("--json").args(more).output().unwrap())
}

fn setting<'a>(report: &'a Value, path: &str) -> &'a Value {
    report["settings"].as_array().unwrap().iter().find(|setting| setting["path"] == path).unwrap()
}

#[test]
fn a_scene_is_told_in_si_units_with_its_materials_resolved() {
    let place = Workplace::with("deposition-laser.toml");
    let report = check(&place, &["--set", "thermal.phi=0.75"]);
    assert_eq!(report["format"], "stagger-check/3");
    assert_eq!(report["duration_s"], 8e-3);
    assert_eq!(setting(&report, "particles.radius.mean")["si"], serde_json::json!([25e-6]));
    assert_eq!(setting(&report, "particles.radius.mean")["value"], "25 um");
    assert_eq!(setting(&report, "thermal.conductance")["si"], serde_json::json!([]));
    assert_eq!(setting(&report, "thermal.iterations")["si"], serde_json::json!([100.0]));
    assert_eq!(setting(&report, "thermal.iterations")["is_default"], true);
    let thermal = &report["physics"]["thermal"];
    // 316L, which the scene only names; the override; walls in the scene's order, the second without a temperature.
    assert_eq!((&thermal["density_kg_m3"], &thermal["phi"]), (&Value::from(7950.0), &Value::from(0.75)));
    assert_eq!(thermal["conductance"], "monograph");
    assert_eq!(
        (&thermal["walls"][0]["temperature_k"], &thermal["walls"][1]["temperature_k"]),
        (&320.0.into(), &Value::Null)
    );
    assert_ne!(report["hash"], check(&place, &[])["hash"]);
}

#[test]
fn a_scene_that_cannot_run_alone_has_its_values_and_says_why() {
    let text = "duration = \"1 ms\"\n[thermal]\n[coupling]\ndt = \"10 us\"\n";
    let place = Workplace::of(text);
    let output = stagger().arg("check").arg(&place.scene).arg("--json").output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["problem"].as_str().unwrap().contains("`thermal` reads `radii`"), "{report}");
    assert_eq!(report["physics"]["thermal"]["phi"], 0.5);
}

#[test]
fn a_command_may_be_quoted_and_finds_program_scene_and_overrides() {
    let place = Workplace::with("quick.toml");
    let set = ["--no-record", "--json", "--set", "thermal.phi=1"];
    let alone = json(&place.run(&set));
    let script = place.path("my node.sh");
    let line = r#"test "$2" = "two words" && test "$STAGGER_OVERRIDES" = '[["thermal.phi","1"]]' &&
        exec "$STAGGER_PROGRAM" node thermal --child --run $STAGGER_RUN --connect $STAGGER_CONNECT \
        --scene "$STAGGER_SCENE" --set thermal.phi=1 "$1""#;
    std::fs::write(&script, line).unwrap();
    let command = format!("thermal=sh '{}' --threads=1 \"two words\"", script.display());
    let replaced = json(&place.run(&[&set[..], &["--node", &command]].concat()));
    assert_eq!(replaced["hash"], alone["hash"]);
    place.wait_until_empty();
    let output = place.run(&["--no-record", "--node", "thermal=sh 'my node.sh"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("a quote has no end"), "{}", said(&output));
}
