//! Nodes that die or hang are started again and runs go on from checkpoints: always with the bits of an undisturbed run.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use stagger_recordings::{Body, Recording};

use super::program::{Workplace, json, laser_for, said, signal, stagger};

/// A few seconds of the laser scene, all three kinds of nodes at work; a checkpoint every ten steps, which are shorter than the
/// scene's own, so that there is time to disturb it.
fn scene(more: &str) -> Workplace {
    let text = laser_for("2.5 ms").replace("limit = \"40 us\"", "limit = \"20 us\"");
    assert!(text.contains("20 us"), "the scene's steps have another form now");
    Workplace::of(&format!("{text}\n[recovery]\ncheckpoint = 10\n{more}"))
}

/// Hash of an undisturbed run, and what it recorded of every field: topic, version, hash of the values.
fn undisturbed() -> (String, Vec<(String, String, u64)>) {
    let place = scene("");
    let summary = json(&place.run(&["--record", "run.mcap", "--json"]));
    assert_eq!(summary["restarts"].as_array().unwrap().len(), 0);
    (summary["hash"].as_str().unwrap().into(), fields(&place.path("run.mcap")))
}

fn fields(file: &Path) -> Vec<(String, String, u64)> {
    let mut fields = Vec::new();
    for message in Recording::open(file).unwrap().messages().unwrap() {
        let message = message.unwrap();
        if let Body::Field(received) = message.body {
            let version = received.envelope.version.unwrap().to_string();
            // A restarted node sends values again that it would have referred to.
            if let Some(field) = received.field {
                fields.push((message.topic, version, field.hash()));
            }
        }
    }
    fields.sort();
    fields
}

fn verified(file: &Path) {
    let output = stagger().arg("verify").arg(file).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("no difference"));
}

#[test]
fn killed_and_stopped_nodes_are_started_again_and_nothing_differs() {
    let (hash, whole) = undisturbed();
    for (kind, name, at_bytes) in [
        ("particles", "KILL", 3_000_000),
        ("thermal", "KILL", 9_000_000),
        ("optics", "KILL", 14_000_000),
        ("thermal", "STOP", 6_000_000),
    ] {
        let place = scene("");
        let run = place.start(&["--record", "run.mcap", "--json"]);
        place.wait_for_file("run.mcap", at_bytes);
        let begun = Instant::now();
        signal(name, place.node(kind));
        let output = run.wait_with_output().unwrap();
        let summary = json(&output);
        assert_eq!(summary["hash"], hash, "{kind} {name}");
        let restarts = summary["restarts"].as_array().unwrap();
        assert_eq!(restarts.len(), 1, "{}", said(&output));
        assert_eq!(restarts[0]["node"], kind);
        assert!(said(&output).contains(&format!("node `{kind}` is gone")), "{}", said(&output));
        // The whole rest of the run, the lease of a stopped process (5 s) and a loaded machine are in this.
        assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
        verified(&place.path("run.mcap"));
        // Nothing is there twice, and nothing is missing: repetitions were the same bits, or they would differ here.
        let recorded = fields(&place.path("run.mcap"));
        assert!(whole.iter().all(|field| recorded.binary_search(field).is_ok()), "{kind} {name}: a field is missing");
        let mut versions: Vec<_> = recorded.iter().map(|(topic, version, _)| (topic, version)).collect();
        let all = versions.len();
        versions.dedup();
        assert_eq!(all, versions.len(), "{kind} {name}: a field is there twice");
        place.wait_until_empty();
    }
}

#[test]
fn past_the_limit_of_restarts_the_run_ends_and_says_which_node_and_how_to_go_on() {
    let place = scene("restarts = 0\n");
    let run = place.start(&["--record", "run.mcap", "--json"]);
    place.wait_for_file("run.mcap", 6_000_000);
    signal("KILL", place.node("thermal"));
    let begun = Instant::now();
    let output = run.wait_with_output().unwrap();
    assert!(begun.elapsed() < Duration::from_secs(8), "{:?}", begun.elapsed());
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("node `thermal` is gone") && said(&output).contains("signal: 9"),
        "{}",
        said(&output)
    );
    assert!(said(&output).contains("--resume"), "{}", said(&output));
    place.wait_until_empty();
}

#[test]
fn after_the_coordinator_is_killed_no_node_is_left_and_the_recording_goes_on() {
    let (hash, _) = undisturbed();
    let place = scene("");
    let mut run = place.start(&["--record", "run.mcap"]);
    place.wait_for_file("run.mcap", 9_000_000);
    run.kill().unwrap();
    run.wait().unwrap();
    let begun = Instant::now();
    place.wait_until_empty();
    assert!(begun.elapsed() < Duration::from_secs(5), "the nodes outlived the run by {:?}", begun.elapsed());
    let summary = json(&place.run(&["--resume", "run.mcap", "--record", "rest.mcap", "--json"]));
    assert_eq!(summary["hash"], hash);
    verified(&place.path("rest.mcap"));
}

#[test]
fn an_interrupted_run_goes_on_from_where_it_stopped_and_counts_on() {
    let whole = scene("");
    let whole = json(&whole.run(&["--no-record", "--json"]));
    let place = scene("");
    let run = place.start(&["--record", "run.mcap", "--json"]);
    place.wait_for_file("run.mcap", 6_000_000);
    signal("INT", run.id());
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    let first: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let output = place.run(&["--resume", "run.mcap", "--json"]);
    let rest = json(&output);
    assert_eq!(rest["hash"], whole["hash"]);
    // Steps, iterations, step sizes and energy are those of the whole run; the wall clock and the work are not.
    assert_eq!(rest["steps"], whole["steps"]);
    assert_eq!(rest["ledger"], whole["ledger"]);
    let reached = first["steps"]["accepted"].as_u64().unwrap();
    assert!(place.path(&format!("scene-from-{reached}.mcap")).is_file(), "it goes on from the step it stopped at");
    let earlier = reached / 2;
    let from = format!("run.mcap@{earlier}");
    let again = json(&place.run(&["--resume", &from, "--no-record", "--json"]));
    assert_eq!(again["hash"], whole["hash"]);
}

#[test]
fn acceleration_and_slow_nodes_go_on_from_a_checkpoint_as_if_nothing_had_been() {
    let place = Workplace::with("quick.toml");
    let settings = [
        "--set",
        "recovery.checkpoint=7",
        "--set",
        "coupling.acceleration=iqn-ils",
        "--set",
        "coupling.every.thermal=3",
        "--json",
    ];
    let whole = json(&place.run(&[&settings[..], &["--record", "run.mcap"]].concat()));
    verified(&place.path("run.mcap"));
    // Step 28 is none of the slow node's: it goes on in the middle of its window.
    let rest = json(&place.run(&[&settings[..], &["--resume", "run.mcap@30", "--record", "rest.mcap"]].concat()));
    assert_eq!(rest["hash"], whole["hash"]);
    assert_eq!(rest["steps"], whole["steps"]);
    verified(&place.path("rest.mcap"));
}

#[test]
fn a_node_that_dies_before_it_announces_itself_is_started_again() {
    let place = Workplace::with("quick.toml");
    let whole = json(&place.run(&["--no-record", "--json"]));
    let script = place.path("thermal.sh");
    // It fails the first time, and is the built-in node the second.
    let text = format!(
        "#!/bin/sh\nif [ ! -e {mark} ]; then : > {mark}; exit 7; fi\nexec {stagger} node thermal --scene \"$STAGGER_SCENE\" \
         --connect \"$STAGGER_CONNECT\" --run \"$STAGGER_RUN\" --child\n",
        mark = place.path("mark").display(),
        stagger = env!("CARGO_BIN_EXE_stagger"),
    );
    std::fs::write(&script, text).unwrap();
    let command = format!("thermal=sh {}", script.display());
    let output = place.run(&["--no-record", "--json", "--node", &command]);
    let summary = json(&output);
    assert_eq!(summary["hash"], whole["hash"]);
    assert_eq!(summary["restarts"][0]["node"], "thermal");
    place.wait_until_empty();
}

#[test]
fn a_node_that_hangs_is_taken_for_dead_after_the_time_set() {
    // A stopped process keeps its token for the length of the lease, 5 s: a shorter patience comes first.
    let place = scene("hang = \"1 s\"\n");
    let run = place.start(&["--record", "run.mcap", "--json"]);
    place.wait_for_file("run.mcap", 6_000_000);
    signal("STOP", place.node("optics"));
    let output = run.wait_with_output().unwrap();
    let summary = json(&output);
    assert!(said(&output).contains("no answer for 1 s"), "{}", said(&output));
    assert_eq!(summary["restarts"][0]["node"], "optics");
    place.wait_until_empty();
}

#[test]
fn what_cannot_be_resumed_says_why() {
    let place = Workplace::with("quick.toml");
    json(&place.run(&["--record", "run.mcap", "--json"]));
    for (arguments, expected) in [
        (vec!["--resume", "absent.mcap"], "absent.mcap"),
        (vec!["--resume", "run.mcap", "--set", "seed=3"], "another scene"),
        (vec!["--resume", "run.mcap@3"], "no checkpoint at or before step 3"),
        (vec!["--resume", "run.mcap@x"], "expected a recording, or a recording and a step"),
    ] {
        let output = place.run(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(expected), "{arguments:?}: {}", said(&output));
    }
}
