//! The house rules that a machine can see.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

/// Crates in the order of their dependencies, and the ones each may depend on.
const ORDER: [(&str, &[&str]); 5] = [
    ("messages", &[]),
    ("solver", &["stagger-messages"]),
    ("recordings", &["stagger-messages", "stagger-solver"]),
    ("nodes", &["stagger-messages", "stagger-solver", "stagger-recordings"]),
    // A program of its own beside the recordings.
    ("recordings/view", &["stagger-messages", "stagger-solver", "stagger-recordings"]),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files of the repository under `folder` that end in one of `endings`, without build output.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if name != "target" && !name.starts_with('.') {
                found.extend(files(&path, endings));
            }
        } else if endings.iter().any(|ending| name.ends_with(ending)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn shown(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().display().to_string()
}

#[test]
fn dependencies_run_one_way() {
    for (folder, allowed) in ORDER {
        let manifest = std::fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = manifest.parse().unwrap();
        let names = manifest["dependencies"].as_table().unwrap().keys();
        let ours: Vec<_> = names.filter(|name| name.starts_with("stagger-")).collect();
        assert!(ours.iter().all(|name| allowed.contains(&name.as_str())), "{folder} depends on {ours:?}");
    }
}

#[test]
fn messages_and_solver_do_no_io() {
    for folder in ["messages/src", "solver/src"] {
        for file in files(&root().join(folder), &[".rs"]) {
            let text = std::fs::read_to_string(&file).unwrap();
            for forbidden in
                ["std::fs", "std::net", "std::process", "std::time::Instant", "SystemTime", "async fn", "thread_rng"]
            {
                // A test beside the code may read a scene.
                let code = text.split("#[cfg(test)]").next().unwrap();
                let is_test = file.file_name().unwrap().to_string_lossy().contains("tests");
                assert!(is_test || !code.contains(forbidden), "{} uses {forbidden}", shown(&file));
            }
        }
    }
}

#[test]
fn one_file_knows_each_of_zenoh_mcap_rerun_and_arrow() {
    let expected = [
        ("zenoh", "nodes/src/link.rs"),
        ("mcap", "recordings/src/container.rs"),
        ("rerun", "recordings/view/src/show.rs"),
        ("arrow", "recordings/view/src/arrow_files.rs"),
    ];
    for (library, only) in expected {
        let mut importers = Vec::new();
        for folder in ["messages", "solver", "recordings", "nodes"] {
            for file in files(&root().join(folder), &[".rs"]) {
                let text = std::fs::read_to_string(&file).unwrap();
                let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
                let path = format!("{library}::");
                let names = |line: &str| {
                    line.match_indices(&path)
                        .any(|(at, _)| !line[..at].ends_with(|before: char| before.is_alphanumeric() || before == '_'))
                };
                // The bench's floor is Zenoh without this program.
                if code.into_iter().any(names) && !shown(&file).contains("/benches/") {
                    importers.push(shown(&file).replace("nodes/../", ""));
                }
            }
        }
        assert_eq!(importers, [only], "files that import {library}");
    }
}

#[test]
fn no_source_file_is_past_600_lines() {
    for file in files(&root(), &[".rs", ".py", ".proto"]) {
        let lines = std::fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= 600, "{} has {lines} lines: probably two ideas", shown(&file));
    }
}

#[test]
fn no_test_is_ignored_and_nothing_is_left_undone() {
    // Put together here so that this file does not find itself.
    let marks =
        [["#[ign", "ore"].concat(), ["todo", "!("].concat(), ["unimplem", "ented!("].concat(), ["FIX", "ME"].concat()];
    for file in files(&root(), &[".rs", ".py"]) {
        let text = std::fs::read_to_string(&file).unwrap();
        for mark in &marks {
            assert!(!text.contains(mark.as_str()), "{} has {mark}", shown(&file));
        }
    }
}

#[test]
fn the_command_line_says_every_command_of_the_readme() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    for command in [
        "run",
        "check",
        "node",
        "coordinator",
        "router",
        "replay",
        "verify",
        "info",
        "view",
        "report",
        "export",
        "conformance",
        "new-node",
    ] {
        assert!(readme.contains(&format!("stagger {command}")), "README.md does not show `stagger {command}`");
    }
}
