//! Presets are defined by their measured errors (docs/tradeoff.md): here they are measured.

use std::{path::Path, process::Command};

use serde_json::Value;

/// Largest error of `draft`, of the scene as it stands, and of `reference` against runs that are tighter still.
const BOUNDS: [(&str, f64); 3] = [("preset draft", 0.1), ("the scene as it stands", 0.05), ("preset reference", 0.03)];

fn presets_keep_their_bounds(scene: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(scene);
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command
        .arg("tradeoff")
        .arg(&path)
        .args(["--axis", "presets", "--in-process", "--json", "--out"])
        .arg(folder.path());
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let study: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (label, bound) in BOUNDS {
        let cases = study["cases"].as_array().unwrap();
        let case = cases.iter().find(|case| case["label"] == label).unwrap_or_else(|| panic!("{scene}: no {label}"));
        for (error, quantity) in case["errors"].as_array().unwrap().iter().zip(study["quantities"].as_array().unwrap())
        {
            let error = error.as_f64().unwrap();
            assert!(error <= bound, "{scene}, {label}: error {error:e} of {quantity}");
        }
    }
}

#[test]
fn those_of_quick_scenes_keep_their_bounds() {
    for scene in ["quick.toml", "falling-powder.toml", "mixed-powder.toml", "three-lasers.toml", "sintering.toml"] {
        presets_keep_their_bounds(scene);
    }
}

#[test]
fn every_scene_has_a_draft_and_a_reference_that_can_be_run() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        for preset in ["draft", "reference"] {
            let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
            let output = command.arg("check").arg(&path).args(["--preset", preset, "--json"]).output().unwrap();
            assert!(output.status.success(), "{}: {}", path.display(), String::from_utf8_lossy(&output.stderr));
        }
    }
}
