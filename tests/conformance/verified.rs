//! `verify --with`: a program in the place of a recorded node is found right, or found out.

use std::{
    path::{Path, PathBuf},
    process::{Command, ExitCode, Output},
};

use serde_json::Value;
use stagger_physics::thermal::{Settings, Thermal};
use stagger_runtime::node::plug_in;
use tempfile::TempDir;

use super::NODE;

/// The built-in thermal physics as a plug-in of somebody's own; `wrong` ones weigh the window's end alone.
pub fn thermal(wrong: bool) -> ExitCode {
    plug_in::main(|setup| {
        let scene = setup.scene()?;
        let mut settings = scene.settings::<Settings>().ok_or("the scene has no [thermal]")?.clone();
        settings.phi = if wrong { 1.0 } else { settings.phi };
        Ok(Thermal::new(settings)?)
    })
}

/// Records a small run with more settings.
fn recorded(set: &[&str]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/quick.toml");
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(["run", scene, "--set", "particles.count=40", "--record"]).arg(&path);
    let output = command.args(set.iter().flat_map(|set| ["--set", set])).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    (folder, path)
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Verifies the thermal node of a recording with this program as `node`.
fn verify(recording: &Path, node: &str, more: &[&str]) -> Output {
    let own = std::env::current_exe().unwrap();
    let command = format!("{} --exact as_a_node --nocapture", own.display());
    let mut verify = Command::new(env!("CARGO_BIN_EXE_stagger"));
    verify.arg("verify").arg(recording).args(["--node", "thermal", "--json", "--with", &command]).args(more);
    verify.env(NODE, node).output().unwrap()
}

fn result(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", said(output)))
}

#[test]
fn a_program_that_gives_the_same_bits_verifies_and_one_that_does_not_is_found_out() {
    let (_folder, path) = recorded(&[]);
    let same = verify(&path, "thermal", &[]);
    assert_eq!(same.status.code(), Some(0), "{}", said(&same));
    let same = result(&same);
    let own = Command::new(env!("CARGO_BIN_EXE_stagger"))
        .args(["verify", "--json", "--node", "thermal"])
        .arg(&path)
        .output()
        .unwrap();
    // As many trials and fields as the built-in physics solves in the program itself.
    assert_eq!(same, result(&own));
    assert!(same["trials"]["thermal"].as_u64().unwrap() > 50 && same["difference"].is_null(), "{same}");

    let other = verify(&path, "thermal-of-another-phi", &[]);
    assert_eq!(other.status.code(), Some(1), "{}", said(&other));
    let difference = result(&other)["difference"].clone();
    assert_eq!((&difference["node"], &difference["field"]), (&"thermal".into(), &"temperature".into()));
    assert!(difference["at"].as_str().unwrap().starts_with("step "), "{difference}");
    assert!(difference["index"].is_u64() && difference["recorded"] != difference["computed"], "{difference}");
    // The two rules differ by far less than the temperature itself.
    let near = verify(&path, "thermal-of-another-phi", &["--tolerance", "0.1"]);
    assert_eq!(near.status.code(), Some(0), "{}", said(&near));
}

#[test]
fn slow_nodes_acceleration_and_a_start_from_a_checkpoint_are_played_as_they_were() {
    let set = ["recovery.checkpoint=7", "coupling.acceleration=iqn-ils", "coupling.every.thermal=3"];
    let (folder, path) = recorded(&set);
    let rest = folder.path().join("rest.mcap");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/quick.toml");
    let mut resume = Command::new(env!("CARGO_BIN_EXE_stagger"));
    resume.args(["run", scene, "--set", "particles.count=40", "--resume"]).arg(format!("{}@30", path.display()));
    let output = resume.args(set.iter().flat_map(|set| ["--set", set])).arg("--record").arg(&rest).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    for recording in [&path, &rest] {
        let output = verify(recording, "thermal", &[]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(result(&output)["difference"].is_null());
        let output = verify(recording, "thermal-of-another-phi", &[]);
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    }
}

#[test]
fn what_cannot_be_verified_says_why_at_once() {
    let (_folder, path) = recorded(&["record.level=accepted"]);
    let output = verify(&path, "thermal", &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("Only a recording at level \"all\""), "{}", said(&output));
    let verify = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_stagger")).arg("verify").arg(&path).args(arguments).output();
        let output = output.unwrap();
        (output.status.code(), said(&output))
    };
    for (arguments, code, expected) in [
        (
            &["--node", "thermal", "--with", "false"][..],
            1,
            "`thermal` by its own program, at its start: expected a liveliness token",
        ),
        (&["--node", "thermal", "--with", "no-such-program"], 1, "no-such-program"),
        (&["--node", "thermal", "--with", "'"], 2, "a quote has no end"),
        (&["--with", "true"], 2, "--node"),
    ] {
        let (found, said) = verify(arguments);
        assert!(found == Some(code) && said.contains(expected), "{arguments:?}: {found:?}, {said}");
    }
}

#[test]
fn the_built_in_node_as_a_command_verifies_in_a_scene_with_files() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let quick = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/quick.toml")).unwrap();
    let start = quick.lines().find(|line| line.starts_with("start     =")).unwrap();
    let text = quick
        .replace(start, "start     = { kind = \"file\", path = \"bed.csv\" }")
        .replace("count     = 100\n", "")
        .replace("radius    = { mean = \"25 um\", spread = \"5 um\" }\n", "");
    std::fs::write(&scene, text).unwrap();
    std::fs::write(folder.path().join("bed.csv"), "x,y,z,radius\n0,0,2e-5,2e-5\n1e-5,0,6.1e-5,2e-5\n").unwrap();
    let path = folder.path().join("run.mcap");
    let mut run = Command::new(env!("CARGO_BIN_EXE_stagger"));
    let output = run.arg("run").arg(&scene).arg("--record").arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    // The recording holds them.
    std::fs::remove_file(folder.path().join("bed.csv")).unwrap();
    let script = folder.path().join("thermal.sh");
    let line = "exec \"$STAGGER_PROGRAM\" node thermal --scene \"$STAGGER_SCENE\" --files \"$STAGGER_FILES\" \
                --connect \"$STAGGER_CONNECT\" --run \"$STAGGER_RUN\" --child\n";
    std::fs::write(&script, line).unwrap();
    let mut verify = Command::new(env!("CARGO_BIN_EXE_stagger"));
    verify.args(["verify", "--node", "thermal", "--with"]).arg(format!("sh '{}'", script.display()));
    let output = verify.arg(&path).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("no difference"));
}
