//! Ends that nobody wished for: each is told, nothing recorded is lost, no process is left.

use std::time::{Duration, Instant};

use super::program::{Workplace, said, signal, stagger};

/// A run of some minutes, to be ended early.
fn long() -> Workplace {
    Workplace::with("deposition-laser.toml")
}

#[test]
fn a_killed_run_leaves_a_readable_recording_and_no_process() {
    let place = long();
    let mut run = place.start(&["--record", "run.mcap"]);
    place.wait_for_file("run.mcap", 8_000_000);
    let size = std::fs::metadata(place.path("run.mcap")).unwrap().len();
    run.kill().unwrap();
    run.wait().unwrap();
    let begun = Instant::now();
    place.wait_until_empty();
    assert!(begun.elapsed() < Duration::from_secs(5), "the nodes outlived the run by {:?}", begun.elapsed());
    let info = stagger().args(["info", "--json"]).arg(place.path("run.mcap")).output().unwrap();
    assert_eq!(info.status.code(), Some(3), "{}", said(&info));
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!(info["complete"], false);
    let read: u64 = info["topics"].as_object().unwrap().values().map(|topic| topic["bytes"].as_u64().unwrap()).sum();
    // All that had reached the file reads back, but for one chunk that was being written.
    assert!(read + 6_000_000 > size, "{read} of {size} bytes read back");
    let verified = stagger().arg("verify").arg(place.path("run.mcap")).output().unwrap();
    assert_eq!(verified.status.code(), Some(3), "{}", said(&verified));
    assert!(String::from_utf8_lossy(&verified.stdout).contains("no difference"));
}

#[test]
fn a_killed_node_that_may_not_be_started_again_ends_the_run_at_once_and_is_named() {
    for kind in ["particles", "thermal", "optics"] {
        let place = long();
        let run = place.start(&["--record", "run.mcap", "--set", "recovery.restarts=0"]);
        place.wait_for_file("run.mcap", 2_000_000);
        signal("KILL", place.node(kind));
        let begun = Instant::now();
        let output = run.wait_with_output().unwrap();
        assert!(begun.elapsed() < Duration::from_secs(8), "{kind}: {:?}", begun.elapsed());
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains(&format!("node `{kind}` is gone")), "{}", said(&output));
        assert!(said(&output).contains("signal: 9"), "{}", said(&output));
        place.wait_until_empty();
        let info = stagger().args(["info"]).arg(place.path("run.mcap")).output().unwrap();
        assert_eq!(info.status.code(), Some(0), "a run that failed still closes its recording: {}", said(&info));
    }
}

#[test]
fn an_interrupted_run_ends_after_its_step_and_says_so() {
    let place = long();
    let run = place.start(&["--record", "run.mcap", "--json"]);
    place.wait_for_file("run.mcap", 2_000_000);
    signal("INT", run.id());
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["completed"], false);
    assert!(summary["steps"]["accepted"].as_u64().unwrap() > 0);
    place.wait_until_empty();
    let info = stagger().args(["info", "--json"]).arg(place.path("run.mcap")).output().unwrap();
    assert!(info.status.success(), "{}", said(&info));
}

#[test]
fn a_node_that_cannot_start_ends_the_run_with_its_words() {
    let place = Workplace::with("quick.toml");
    let output = place.run(&["--no-record", "--node", "thermal=sh -c exit"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("node `thermal` is gone, in its start"), "{}", said(&output));
    place.wait_until_empty();
}

#[test]
fn a_disk_that_is_full_is_told_and_the_run_is_not_silently_unrecorded() {
    let place = Workplace::with("quick.toml");
    let output = place.run(&["--record", "/dev/full"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("/dev/full") || said(&output).contains("No space left"), "{}", said(&output));
    place.wait_until_empty();
}
