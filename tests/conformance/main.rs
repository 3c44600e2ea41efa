//! `stagger conformance`: every node we ship keeps every rule, and each of a set of wrong nodes breaks the rule it is
//! wrong about, and no other.
//!
//! The nodes under test that are not in the program are in this one: it starts itself as `as_a_node`.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod plug_in;
#[path = "../../nodes/runtime/examples/probe.rs"]
mod probe;
mod verified;
mod wrong_node;

use std::process::{Command, Output};

use serde_json::Value;

/// Tells this program, started as a node, which one.
const NODE: &str = "STAGGER_TEST_NODE";

/// Not a test but a node, where a launcher started it as one.
#[test]
fn as_a_node() {
    match std::env::var(NODE).as_deref() {
        Ok("probe") if std::env::var_os("STAGGER_RUN").is_some() => {
            let code = probe::main();
            std::process::exit(i32::from(code != std::process::ExitCode::SUCCESS));
        }
        Ok(thermal @ ("thermal" | "thermal-of-another-phi")) if std::env::var_os("STAGGER_RUN").is_some() => {
            let code = verified::thermal(thermal != "thermal");
            std::process::exit(i32::from(code != std::process::ExitCode::SUCCESS));
        }
        Ok(wrong) if std::env::var_os("STAGGER_RUN").is_some() => wrong_node::run(wrong),
        _ => {}
    }
}

fn conformance(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.arg("conformance").args(arguments);
    command
}

/// The verdicts on this program as the node `node`.
fn own(node: &str) -> Output {
    let own = std::env::current_exe().unwrap();
    let mut command = conformance(&["--json", "--patience", "5", "--"]);
    command.arg(own).args(["--exact", "as_a_node", "--nocapture"]).env(NODE, node).output().unwrap()
}

/// Names of the rules with a verdict.
fn with(verdict: &str, output: &Output) -> Vec<String> {
    let said = String::from_utf8_lossy(&output.stderr);
    let findings: Value = serde_json::from_slice(&output.stdout).expect(&said);
    let rules = findings["rules"].as_array().unwrap().iter();
    rules.filter(|rule| rule["verdict"] == verdict).map(|rule| rule["rule"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn every_node_we_ship_keeps_every_rule() {
    let rays = ["--set", "optics.fidelity=rays", "--set", "optics.refractive-index=3"];
    let sound =
        "acoustics={ intensity = 100, radius = 2e-4, sound-speed = 4500, path = { kind = \"fixed\", at = [0, 0, 0] } }";
    let sound = ["--set", sound];
    for (node, set) in [
        ("particles", &[][..]),
        ("thermal", &[]),
        ("optics", &[]),
        ("optics", &rays),
        ("current", &[]),
        ("substrate", &[]),
        ("acoustics", &sound),
        ("particles", &sound),
    ] {
        let output = conformance(&[&["--json", "--node", node], set].concat()).output().unwrap();
        assert_eq!(with("fail", &output), Vec::<String>::new(), "{node}: {}", String::from_utf8_lossy(&output.stdout));
        assert_eq!(with("not-applicable", &output), Vec::<String>::new(), "{node}");
        assert_eq!(with("pass", &output).len(), 25, "{node}");
        assert_eq!(output.status.code(), Some(0));
    }
}

#[test]
fn nodes_keep_every_rule_where_particles_change_phase_too() {
    for node in ["particles", "thermal"] {
        let phases = ["--set", "thermal.phases={ boiling-band = 5 }", "--set", "thermal.solver=conjugate-gradient"];
        let output = conformance(&[&["--json", "--node", node], &phases[..]].concat()).output().unwrap();
        assert_eq!(with("fail", &output), Vec::<String>::new(), "{node}: {}", String::from_utf8_lossy(&output.stdout));
        assert_eq!(with("pass", &output).len(), 25, "{node}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn the_example_of_a_node_keeps_every_rule() {
    let output = own("probe");
    assert_eq!(with("fail", &output), Vec::<String>::new(), "{}", String::from_utf8_lossy(&output.stdout));
    assert_eq!(with("pass", &output).len(), 25);
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn a_node_written_by_the_page_keeps_every_rule_and_a_wrong_one_breaks_its_own() {
    let right = own("right");
    assert_eq!(with("fail", &right), Vec::<String>::new(), "{}", String::from_utf8_lossy(&right.stdout));
    assert_eq!(with("not-applicable", &right), Vec::<String>::new());
    let untested = with("pass", &right).into_iter().filter(|rule| wrong_node::WRONGS.iter().all(|(_, it)| it != rule));
    assert_eq!(untested.collect::<Vec<_>>(), Vec::<String>::new(), "rules that no node breaks");
    // Several at a time: most of it is waiting for what must not come.
    for wrongs in wrong_node::WRONGS.chunks(6) {
        let outputs: Vec<Output> = std::thread::scope(|scope| {
            let started: Vec<_> = wrongs.iter().map(|(wrong, _)| scope.spawn(|| own(wrong))).collect();
            started.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        for ((wrong, rule), output) in wrongs.iter().zip(outputs) {
            assert_eq!(with("fail", &output), [*rule], "{wrong}: {}", String::from_utf8_lossy(&output.stdout));
            assert_eq!(output.status.code(), Some(1), "{wrong}");
        }
    }
}

#[test]
fn the_verdicts_are_readable_and_a_command_that_is_none_is_told() {
    let output = conformance(&["--node", "optics"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.starts_with("pass  announce "), "{text}");
    assert!(
        text.trim_end().ends_with("node `optics` (stagger node optics): 25 rules kept, 0 broken, 0 not applicable")
    );
    let output = conformance(&["--node", "mine", "--", "/no/such/program"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("FAIL  announce") && text.contains("/no/such/program"), "{text}");
    let output = conformance(&["--node", "gravity"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}
