//! A reader that has read enough is no failure; a standard output that takes nothing is one, in one line.

use std::{
    fs::File,
    io::Read as _,
    path::Path,
    process::{Command, Stdio},
};

use super::program::{folder, stagger, stderr};

const SCENE: &str = r#"
duration = "1 ms"
[particles]
count = 1
radius = "25 um"
start = { kind = "lattice", box = ["0.1 mm", "0.1 mm", "0.1 mm"] }
[coupling]
dt = "10 us"
"#;

/// Every command that prints something and ends by itself.
const COMMANDS: [&[&str]; 14] = [
    &["--help"],
    &["--version"],
    &["run", "--help"],
    &["check", "scene.toml"],
    &["check", "scene.toml", "--json"],
    &["check", "scene.toml", "--advise"],
    &["run", "scene.toml", "--in-process", "--no-record"],
    &["run", "scene.toml", "--no-record", "--json"],
    &["info", "r.mcap"],
    &["info", "r.mcap", "--json"],
    &["verify", "r.mcap", "--json"],
    &["report", "r.mcap"],
    &["export", "r.mcap", "--out", "out", "--csv", "--vtp"],
    &["replay", "r.mcap", "--now", "--speed", "inf"],
];

fn recorded() -> tempfile::TempDir {
    let place = folder(&[("scene.toml", SCENE)]);
    let run = stagger(place.path(), &["run", "scene.toml", "--in-process", "--record", "r.mcap"]);
    assert!(run.status.success(), "{}", stderr(&run));
    place
}

fn to(folder: &Path, arguments: &[&str], output: Stdio) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(output).stderr(Stdio::piped());
    let output = command.spawn().unwrap().wait_with_output().unwrap();
    (output.status.code(), stderr(&output))
}

#[test]
fn a_reader_that_has_gone_is_no_failure_and_no_panic() {
    let place = recorded();
    for arguments in COMMANDS {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let (code, said) = to(place.path(), arguments, writer.into());
        assert_eq!(code, Some(0), "{arguments:?}: {said}");
        assert!(!said.contains("panicked") && !said.contains("error"), "{arguments:?}: {said}");
    }
    // Errors keep their codes.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    assert_eq!(to(place.path(), &["check", "absent.toml"], writer.into()).0, Some(2));
}

#[test]
fn a_full_disk_is_told_in_one_line() {
    let place = recorded();
    for arguments in COMMANDS {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let (code, said) = to(place.path(), arguments, full.into());
        assert_eq!(code, Some(1), "{arguments:?}: {said}");
        let lines: Vec<_> = said.lines().filter(|line| !line.starts_with("note: ")).collect();
        assert!(
            lines.len() == 1 && lines[0].starts_with("error: cannot write to standard output: "),
            "{arguments:?}: {said}"
        );
    }
}

#[test]
fn a_completed_run_closes_its_recording_whoever_has_stopped_to_read() {
    let place = recorded();
    let (reader, writer) = std::io::pipe().unwrap();
    let errors = writer.try_clone().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(["run", "scene.toml", "--record", "piped.mcap"]).current_dir(place.path());
    let mut run = command.stdout(writer).stderr(errors).spawn().unwrap();
    drop((command, reader));
    assert_eq!(run.wait().unwrap().code(), Some(0));
    let verified = stagger(place.path(), &["verify", "piped.mcap"]);
    assert_eq!(verified.status.code(), Some(0), "{}", stderr(&verified));
}

#[test]
fn a_standard_error_that_takes_nothing_changes_no_result() {
    let place = recorded();
    for (arguments, expected) in [
        (&["run", "scene.toml", "--record", "r.mcap"][..], 2),
        (&["run", "absent.toml"], 2),
        (&["nonsense"], 2),
        (&["run", "scene.toml"], 0),
        // It has a note to tell: the name is taken.
        (&["run", "scene.toml"], 0),
    ] {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
        let run =
            command.args(arguments).current_dir(place.path()).stdout(Stdio::null()).stderr(full).status().unwrap();
        assert_eq!(run.code(), Some(expected), "{arguments:?}");
    }
}

#[test]
fn a_reader_gets_what_it_reads() {
    let place = recorded();
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(["check", "scene.toml"]).current_dir(place.path()).stdout(Stdio::piped());
    let mut run = command.spawn().unwrap();
    let mut text = String::new();
    run.stdout.take().unwrap().read_to_string(&mut text).unwrap();
    assert!(text.contains("settings in force") && text.ends_with("(recorded only)\n"), "{text}");
    assert!(run.wait().unwrap().success());
}
