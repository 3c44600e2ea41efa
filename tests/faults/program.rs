//! The program on a small scene: a folder with its files, one run, its summary.
#![allow(dead_code)] // Each fault needs a part of this; all parts are needed by some.

use std::{
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

/// A temporary folder with `files`, each a name and its contents.
pub fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, contents) in files {
        std::fs::write(folder.path().join(name), contents).unwrap();
    }
    folder
}

/// Runs `stagger` with `arguments` in `folder` until it ends.
pub fn stagger(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stagger")).args(arguments).current_dir(folder).output().unwrap()
}

/// What a run in one process, without a recording, prints with `--json`; it must succeed.
pub fn summary(folder: &Path, scene: &str, sets: &[&str]) -> Value {
    let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", *set]).collect();
    let output = stagger(folder, &[&["run", scene, "--in-process", "--no-record", "--json"], &sets[..]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A field of a summary by its name.
pub fn field<'a>(summary: &'a Value, name: &str) -> &'a Value {
    let fields = summary["fields"].as_array().unwrap();
    fields.iter().find(|field| field["field"] == name).unwrap_or_else(|| panic!("no field {name} in {summary}"))
}

/// What a command wrote to its standard error.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What a command wrote to its standard output.
pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}
