//! Nodes that say strange things, that leave processes behind, or that do not hear that their run is over.

use std::{
    net::TcpListener,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use super::place::{Workplace, json, laser_for, said, signal, stagger};

/// The built-in thermal node as a plug-in that a shell starts after `before`.
fn thermal_after(before: &str) -> String {
    let node = "exec \"$STAGGER_PROGRAM\" node thermal --run=$STAGGER_RUN --connect=$STAGGER_CONNECT --scene=$STAGGER_SCENE --child";
    format!("thermal=sh -c '{before}; {node}'")
}

#[test]
fn what_a_plug_in_says_may_be_any_bytes_and_of_any_length() {
    let place = Workplace::with("quick.toml");
    let expected = json(&place.run(&["--json", "--no-record"]));
    let loud = "printf \"W\\344rme \\033[2J\\n\" >&2; head -c 30000000 /dev/zero | tr \"\\0\" x >&2";
    let output = place.run(&["--json", "--no-record", "--node", &thermal_after(loud)]);
    assert_eq!(json(&output)["hash"], expected["hash"]);
    let told = said(&output);
    assert!(told.contains("[thermal] W\u{fffd}rme \\u{1b}[2J"), "{told}");
    assert!(told.len() < 20_000 && told.contains("bytes more"), "{} bytes", told.len());
    assert!(!output.stderr.contains(&0x1b));
}

#[test]
fn last_words_after_bytes_that_are_no_text_are_told() {
    let place = Workplace::with("quick.toml");
    let words = "thermal=sh -c 'printf \"W\\344\\n\" >&2; sleep 0.3; echo the real reason >&2; exit 5'";
    let output = place.run(&["--no-record", "--node", words]);
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("exit status: 5") && said(&output).contains("the real reason"), "{}", said(&output));
    assert!(!said(&output).contains("SIGPIPE"), "{}", said(&output));
}

#[test]
fn a_start_that_can_only_fail_again_is_not_tried_again() {
    let place = Workplace::with("quick.toml");
    for command in ["sh -c 'echo usage >&2; exit 2'", "sh -c 'exec no-such-program-at-all'"] {
        let output = place.run(&["--no-record", "--node", &format!("thermal={command}")]);
        assert_eq!(output.status.code(), Some(1));
        assert!(!said(&output).contains("it is started again"), "{}", said(&output));
    }
}

#[test]
fn a_process_that_a_plug_in_started_does_not_keep_the_run_from_ending() {
    let place = Workplace::with("quick.toml");
    let expected = json(&place.run(&["--json", "--no-record"]));
    let started = format!("sleep 60 & echo $! > {}", place.path("left").display());
    let begun = Instant::now();
    let output = place.run(&["--json", "--record", "run.mcap", "--node", &thermal_after(&started)]);
    let took = begun.elapsed();
    let left: u32 = std::fs::read_to_string(place.path("left")).unwrap().trim().parse().unwrap();
    signal("KILL", left);
    assert_eq!(json(&output)["hash"], expected["hash"]);
    assert!(took < Duration::from_secs(20), "{took:?}");
    assert!(said(&output).contains("lives on"), "{}", said(&output));
    let info = stagger().args(["info", "--json"]).arg(place.path("run.mcap")).output().unwrap();
    assert_eq!(json(&info)["complete"], true);
}

#[test]
fn a_second_interrupt_ends_a_run_at_once_and_its_nodes_with_it() {
    let place = Workplace::of(&laser_for("20 ms"));
    let run = place.start(&["--record", "run.mcap"]);
    place.wait_for_file("run.mcap", 1_000_000);
    // The step under way does not end any more.
    signal("STOP", place.node("thermal"));
    signal("INT", run.id());
    std::thread::sleep(Duration::from_millis(300));
    let begun = Instant::now();
    signal("INT", run.id());
    let output = run.wait_with_output().unwrap();
    assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    // The system wakes a stopped process whose parent is gone.
    place.wait_until_empty();
    assert!(begun.elapsed() < Duration::from_secs(8), "{:?}", begun.elapsed());
}

#[test]
fn a_node_ends_with_its_parent_whatever_it_does() {
    let place = Workplace::of(&laser_for("20 ms"));
    // One window takes hours.
    let endless = ["--set", "particles.integrator={ kind = \"verlet\", substep = \"1e-15 s\" }", "--no-record"];
    let mut run = place.start(&endless);
    let node = place.node("particles");
    let begun = Instant::now();
    // It works when it has used a second of the processor.
    while processor_s(node) < 1.0 {
        assert!(begun.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    let begun = Instant::now();
    place.wait_until_empty();
    assert!(begun.elapsed() < Duration::from_secs(6), "{:?}", begun.elapsed());
}

/// The time a process has used, in s.
fn processor_s(pid: u32) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace().collect();
    let ticks: f64 = fields.get(11..13).unwrap_or_default().iter().map(|ticks| ticks.parse::<f64>().unwrap()).sum();
    ticks / 100.0
}

#[test]
fn a_node_that_waits_for_a_connection_ends_with_its_parent() {
    // It accepts and says nothing.
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = Workplace::with("quick.toml");
    let mut node = stagger();
    node.args([
        "node",
        "thermal",
        "--child",
        "--run",
        "r",
        "--connect",
        &format!("tcp/{}", silent.local_addr().unwrap()),
    ]);
    node.arg("--scene").arg(&place.scene).stdin(Stdio::piped()).stderr(Stdio::null());
    let mut node = node.spawn().unwrap();
    let _accepted = silent.accept().unwrap();
    drop(node.stdin.take());
    let begun = Instant::now();
    assert!(!node.wait().unwrap().success());
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
}

#[test]
fn a_node_started_by_hand_ends_with_its_coordinator_whatever_it_does() {
    let place = Workplace::of(&laser_for("20 ms"));
    let endpoint = format!("unixsock-stream/{}", place.path("hub.sock").display());
    let endless = ["--set", "particles.integrator={ kind = \"verlet\", substep = \"1e-15 s\" }"];
    let mut coordinator = stagger();
    coordinator.arg("coordinator").arg(&place.scene).args(endless);
    coordinator.args(["--no-record", "--run", "r", "--listen", &endpoint]).stdout(Stdio::null()).stderr(Stdio::null());
    let mut coordinator = coordinator.spawn().unwrap();
    let start = |kind| {
        let mut node: Command = stagger();
        node.args(["node", kind, "--run", "r", "--connect", &endpoint, "--scene"]).arg(&place.scene).args(endless);
        node.stdin(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let mut nodes = ["optics", "thermal", "particles"].map(start);
    let begun = Instant::now();
    while processor_s(nodes[2].id()) < 1.0 {
        assert!(begun.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
    }
    coordinator.kill().unwrap();
    coordinator.wait().unwrap();
    let begun = Instant::now();
    for node in &mut nodes {
        assert!(!node.wait().unwrap().success());
    }
    assert!(begun.elapsed() < Duration::from_secs(12), "{:?}", begun.elapsed());
}

#[test]
fn a_coordinator_that_was_suspended_goes_on_and_its_recording_is_whole() {
    let place = Workplace::of(&laser_for("1 ms"));
    let expected = json(&place.run(&["--json", "--no-record"]));
    let run = place.start(&["--json", "--record", "run.mcap"]);
    place.wait_for_file("run.mcap", 2_000_000);
    signal("STOP", run.id());
    // Longer than the lease, so that every node takes it for dead.
    std::thread::sleep(Duration::from_secs(8));
    signal("CONT", run.id());
    let output = run.wait_with_output().unwrap();
    assert_eq!(json(&output)["hash"], expected["hash"]);
    for command in ["info", "verify"] {
        let read = stagger().arg(command).arg(place.path("run.mcap")).output().unwrap();
        assert!(read.status.success(), "{command}: {}", said(&read));
    }
}
