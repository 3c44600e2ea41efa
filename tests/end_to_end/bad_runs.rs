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
    let quick = std::fs::read_to_string(super::program::scenes().join("quick.toml")).unwrap();
    let place = Workplace::of(&format!("{quick}\n[nodes.second]\nphysics = \"thermal\"\n"));
    let output = place.run(&[]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let expected = "field `temperature` is written by both `second` and `thermal`";
    assert!(said(&output).contains(expected), "{}", said(&output));
    let check = stagger().arg("check").arg(&place.scene).output().unwrap();
    assert_eq!(check.status.code(), Some(2));
    assert!(said(&check).contains(expected), "{}", said(&check));
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
