//! The house rules that a machine can see.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod rooms;

use std::path::{Path, PathBuf};

/// Folders of the crates in the order of their dependencies: each may depend on those before it and on no other.
const ORDER: [&str; 9] = [
    "messages",
    "solver/coupling",
    "solver/config",
    "solver/physics",
    "solver/scene",
    "recordings",
    "nodes/runtime",
    "nodes/tools",
    "nodes/cli",
];

/// Beside the others, a program of its own and no other crate's dependency.
const BESIDE: &str = "recordings/view";

/// Folders whose code computes what is recorded.
const SOLVER: [&str; 4] = ["solver/coupling/src", "solver/config/src", "solver/physics/src", "solver/scene/src"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
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
    let manifest = |folder: &str| -> toml::Table {
        std::fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap().parse().unwrap()
    };
    let name = |folder: &str| manifest(folder)["package"]["name"].as_str().unwrap().to_owned();
    let members = manifest("")["workspace"]["members"].as_array().unwrap().clone();
    assert_eq!(members.iter().map(|member| member.as_str().unwrap()).collect::<Vec<_>>(), ORDER);
    let mut before = Vec::new();
    for folder in ORDER.into_iter().chain([BESIDE]) {
        let manifest = manifest(folder);
        for table in ["dependencies", "dev-dependencies"] {
            let names = manifest.get(table).and_then(|table| table.as_table()).into_iter().flat_map(toml::Table::keys);
            let ours: Vec<_> = names.filter(|name| name.starts_with("stagger-")).collect();
            assert!(ours.iter().all(|name| before.contains(*name)), "{folder} depends on {ours:?}");
        }
        before.push(name(folder));
    }
}

#[test]
fn messages_and_solver_do_no_io() {
    for folder in SOLVER.into_iter().chain(["messages/src"]) {
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

/// What asks the processor, the machine or chance for a number, and the only file that may.
const OF_THE_MACHINE: [(&str, &str); 9] = [
    ("Arch::new", "solver/physics/src/common/width.rs"),
    // Products of large matrices choose their instructions by the processor; that file multiplies by vectors alone.
    ("DMatrix", "solver/coupling/src/acceleration/iqn_ils.rs"),
    ("HashMap", ""),
    ("HashSet", ""),
    ("std::env", ""),
    ("available_parallelism", ""),
    ("current_num_threads", ""),
    ("is_x86_feature_detected", ""),
    (".mul_add(", ""),
];

/// Functions that the standard library takes from the system's.
const ELEMENTARY: [&str; 24] = [
    "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "sin", "cos", "sin_cos", "tan", "asin", "acos",
    "atan", "atan2", "sinh", "cosh", "tanh", "powf", "powi", "cbrt", "hypot", "to_polar",
];

/// Code of a file without its tests; nothing of a file of tests.
fn code(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    let is_test = file.components().any(|part| part.as_os_str() == "tests")
        || file.file_stem().is_some_and(|stem| stem.to_string_lossy().ends_with("tests"));
    if is_test { String::new() } else { text.split("#[cfg(test)]\nmod ").next().unwrap().to_owned() }
}

#[test]
fn no_number_depends_on_the_processor() {
    let in_code = |line: &&str| !line.trim_start().starts_with("//");
    for folder in SOLVER.into_iter().chain(["messages/src", "recordings/src"]) {
        for file in files(&root().join(folder), &[".rs"]) {
            let name = shown(&file);
            for line in code(&file).lines().filter(in_code) {
                for function in ELEMENTARY {
                    let called = [format!(".{function}("), format!("f64::{function}")];
                    let found = called.iter().any(|call| line.contains(call.as_str()));
                    assert!(!found, "{name} does not take {function} from stagger_coupling::math: {line}");
                }
                for (word, only) in OF_THE_MACHINE {
                    let found = SOLVER.contains(&folder) && line.contains(word) && name != only;
                    assert!(!found, "{name} asks the machine: {line}");
                }
            }
        }
    }
}

#[test]
fn one_file_knows_each_of_zenoh_mcap_rerun_and_arrow() {
    let expected = [
        ("zenoh", "nodes/runtime/src/link/mod.rs"),
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
                    importers.push(shown(&file));
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
fn every_source_file_says_what_it_holds() {
    for file in files(&root(), &[".rs"]) {
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(text.starts_with("//! "), "{} does not begin with what it holds", shown(&file));
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
