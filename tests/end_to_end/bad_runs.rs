//! Scenes that are well written and cannot run: told before anything is started, all reasons at once, with exit code 2.

use super::program::{Workplace, said, stagger};

const THERMAL: &str = "title = \"t\"\nduration = \"1 ms\"\n[thermal]\n[coupling]\ndt = \"10 us\"\n";

#[test]
fn a_scene_file_that_is_not_there_is_named() {
    let output = stagger().args(["run", "scenes/no-such.toml"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("cannot read the scene scenes/no-such.toml: No such file"), "{}", said(&output));
    assert!(said(&output).contains("hint:"), "{}", said(&output));
}

#[test]
fn a_field_that_nobody_writes_is_named_with_its_reader() {
    let place = Workplace::of(THERMAL);
    let output = place.run(&[]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    for field in ["radii", "contact_pairs", "wall_contact_area"] {
        assert!(said(&output).contains(&format!("`thermal` reads `{field}` [")), "{}", said(&output));
    }
    assert!(said(&output).contains("none of the nodes (thermal) writes"), "{}", said(&output));
}

#[test]
fn a_field_that_two_nodes_write_is_named_with_both() {
    let place = Workplace::with("quick.toml");
    // A node of the user's own says only when it runs what it writes.
    let line = "exec $0 node thermal --name second --child --run $STAGGER_RUN --connect $STAGGER_CONNECT --scene $1";
    let script = place.path("node.sh");
    std::fs::write(&script, line.replace("$0", env!("CARGO_BIN_EXE_stagger"))).unwrap();
    let command = format!("second=sh {} {}", script.display(), place.scene.display());
    let output = place.run(&["--no-record", "--node", &command]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let expected =
        "field `temperature` is written by both `second` and `thermal`, and `particles` reads one: remove one of them";
    assert!(said(&output).contains(expected), "{}", said(&output));
    place.wait_until_empty();
}

#[test]
fn a_physics_may_run_under_another_name_and_only_once() {
    let quick = std::fs::read_to_string(super::program::scenes().join("quick.toml")).unwrap();
    let renamed = format!("{quick}\n[nodes.heat]\nphysics = \"thermal\"\n");
    let place = Workplace::of(&renamed);
    let summary = super::program::json(&place.run(&["--no-record", "--json"]));
    assert!(summary["nodes"]["heat"]["solves"].as_u64().unwrap() > 0 && summary["nodes"]["thermal"].is_null());
    let place = Workplace::of(&format!("{renamed}[nodes.second]\nphysics = \"thermal\"\n"));
    let check = stagger().arg("check").arg(&place.scene).output().unwrap();
    assert_eq!(check.status.code(), Some(2));
    assert!(said(&check).contains("is written by both `heat` and `second`"), "{}", said(&check));
}

#[test]
fn a_scene_with_mistakes_is_refused_with_file_line_and_key() {
    let quick = std::fs::read_to_string(super::program::scenes().join("quick.toml")).unwrap();
    let place = Workplace::of(&quick.replacen("[coupling]", "[coupling]\niteration = 5", 1));
    let output = place.run(&[]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let line = 1 + quick.lines().position(|line| line == "[coupling]").unwrap() + 1;
    assert!(said(&output).contains(&format!("scene.toml:{line}: coupling.iteration")), "{}", said(&output));
    assert!(said(&output).contains("did you mean `iterations`?"), "{}", said(&output));
}

#[test]
fn a_recording_that_is_none_is_refused() {
    let place = Workplace::with("quick.toml");
    for command in ["info", "verify", "replay"] {
        let output = stagger().arg(command).arg(&place.scene).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{command}: {}", said(&output));
        assert!(said(&output).contains("scene.toml"), "{command}: {}", said(&output));
    }
}
