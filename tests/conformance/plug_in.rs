//! A node of one's own in a run: the probe adds itself to a scene.

use std::{
    io::BufRead as _,
    path::PathBuf,
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

use super::NODE;

/// A scene with the probe in it, and the folder it is in.
fn scene() -> (TempDir, PathBuf) {
    let quick = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/quick.toml");
    let own = std::env::current_exe().unwrap();
    let command = format!("[{own:?}, \"--exact\", \"as_a_node\", \"--nocapture\"]");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let text = format!("{}\n[nodes.probe]\ncommand = {command}\n", std::fs::read_to_string(quick).unwrap());
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn stagger(arguments: &[&str], scene: &PathBuf) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(arguments).arg(scene).args(["--set", "particles.count=40"]).env(NODE, "probe");
    command.output().unwrap()
}

#[test]
fn a_node_adds_itself_to_a_run_and_changes_nothing_else() {
    let (_folder, path) = scene();
    let summary = |arguments: &[&str]| -> Value {
        let output = stagger(&[&["run", "--no-record", "--json"], arguments].concat(), &path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let with = summary(&[]);
    let value = |summary: &Value, name: &str, what: &str| {
        let fields = summary["fields"].as_array().unwrap();
        fields.iter().find(|field| field["field"] == name).map(|field| field[what].clone())
    };
    // It reads the values it was coupled to: the powder lies between the plate and where it started from, and the
    // hottest it has seen is no colder than the hottest there is.
    let number = |name, what| value(&with, name, what).unwrap().as_f64().unwrap();
    assert!((1e-5..3e-4).contains(&number("mean_height", "mean")));
    assert!(number("peak_temperature", "mean") >= number("temperature", "max"));
    assert!(number("temperature", "max") > 300.0);
    // Nobody reads it: it solves once for each accepted step.
    assert_eq!(with["nodes"]["probe"]["solves"], with["steps"]["accepted"]);

    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.split("\n[nodes.probe]").next().unwrap()).unwrap();
    let without = summary(&[]);
    assert_eq!(value(&with, "temperature", "hash"), value(&without, "temperature", "hash"));
    assert_eq!(with["steps"]["accepted"], without["steps"]["accepted"]);
}

#[test]
fn check_asks_a_command_for_its_ports() {
    let (_folder, path) = scene();
    let output = stagger(&["check"], &path);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("probe, once per accepted step\n"), "{text}");
    assert!(text.contains("    reads  temperature              from thermal, this iteration\n"), "{text}");
    assert!(text.contains("    writes mean_height              1 x m on probe  (recorded only)\n"), "{text}");
    let output = stagger(&["check", "--graph", "mermaid"], &path);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.starts_with("flowchart TD\n") && text.contains("probe<br>once per accepted step"), "{text}");

    let broken = std::fs::read_to_string(&path).unwrap().replace("--nocapture", "--no-such-flag");
    std::fs::write(&path, broken).unwrap();
    let output = stagger(&["check"], &path);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("`probe`") && said.contains("no-such-flag"), "{said}");
}

#[test]
fn a_node_started_by_hand_without_its_flags_is_told_which() {
    let own = std::env::current_exe().unwrap();
    let start = |variables: &[(&str, &str)]| {
        let mut command = Command::new(&own);
        command.args(["--exact", "as_a_node", "--nocapture"]).env(NODE, "probe").env("STAGGER_RUN", "none");
        let output = command.envs(variables.iter().copied()).output().unwrap();
        assert!(!output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert!(start(&[]).contains("STAGGER_SCENE_HASH environment variable not found"), "{}", start(&[]));
    let hash = ("STAGGER_SCENE_HASH", "twelve");
    assert!(start(&[hash]).contains("is `twelve`, where a decimal number"), "{}", start(&[hash]));
}

#[test]
fn a_node_that_the_scene_does_not_name_is_told_so() {
    // As a user starts it by hand: the built-in one is hosted alike.
    let quick = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/quick.toml");
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let listen = format!("tcp/{}", listener.local_addr().unwrap());
    drop(listener);
    let program = || Command::new(env!("CARGO_BIN_EXE_stagger"));
    let mut coordinator = program();
    coordinator.args(["coordinator", quick, "--listen", &listen, "--no-record"]).stdout(Stdio::null());
    let mut coordinator = coordinator.stderr(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    let mut said = std::io::BufReader::new(coordinator.stderr.take().unwrap());
    said.read_line(&mut line).unwrap();
    let run = line.split_whitespace().skip_while(|word| *word != "run").nth(1).unwrap().to_owned();
    let node = |kind: &str, name: &str| {
        let mut node = program();
        node.args(["node", kind, "--name", name, "--run", &run, "--connect", &listen, "--scene", quick]);
        node.stdin(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let uninvited = node("thermal", "heat");
    let members = ["particles", "thermal", "optics"].map(|kind| node(kind, kind));
    let output = uninvited.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("`heat` cannot start: the run has no node of this name, but particles"), "{said}");
    assert!(members.into_iter().all(|member| member.wait_with_output().unwrap().status.success()));
    assert!(coordinator.wait().unwrap().success());
}
