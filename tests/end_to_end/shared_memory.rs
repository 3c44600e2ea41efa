//! Fields between processes of one host: how much memory is locked for them, and what happens where little may be.

use std::process::{Command, Output, Stdio};

use super::program::{Workplace, json, laser_for, said, signal, stagger};

/// A recorded run that may lock so many kB; ends with 99 where this user may lock less than that.
fn limited(place: &Workplace, limit_kb: &str) -> Command {
    // Root may lock what it likes, unless it lacks the capability for that.
    let script = "ulimit -l $0 || exit 99; \
                  if [ $(id -u) = 0 ]; then exec setpriv --bounding-set -ipc_lock \"$@\"; else exec \"$@\"; fi";
    let mut command = Command::new("sh");
    command.args(["-c", script, limit_kb]).arg(stagger().get_program());
    command
        .arg("run")
        .arg(&place.scene)
        .args(["--json", "--record", "limited.mcap", "--overwrite"])
        .current_dir(place.path(""));
    command
}

fn may_not(output: &Output) -> bool {
    output.status.code() == Some(99)
}

/// What a process has locked, in kB.
fn locked_kb(pid: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmLck:"))?.split_whitespace().next()?.parse().ok()
}

#[test]
fn a_small_scene_locks_little_memory() {
    let place = Workplace::of(&laser_for("0.3 ms"));
    let mut run = place.start(&["--record", "run.mcap"]);
    let mut most = 0;
    while run.try_wait().unwrap().is_none() {
        most = place.processes().into_iter().filter_map(locked_kb).fold(most, u64::max);
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    // Three segments of 2 MiB, and what Zenoh keeps for each; nothing where this user may lock too little for that.
    assert!(most < 24_000, "{most} kB are locked");
}

#[test]
fn whoever_may_lock_little_memory_gets_the_same_bits_without_a_warning() {
    let place = Workplace::of(&laser_for("0.3 ms"));
    let free = json(&place.run(&["--json", "--record", "free.mcap"]));
    for limit_kb in ["0", "64", "8192", "65536"] {
        let output = limited(&place, limit_kb).output().unwrap();
        if may_not(&output) {
            continue;
        }
        assert!(!said(&output).contains("warning"), "{limit_kb} kB: {}", said(&output));
        assert_eq!(json(&output)["hash"], free["hash"], "{limit_kb} kB");
    }
}

#[test]
fn a_stopped_node_to_which_fields_go_by_the_socket_is_the_only_one_that_is_started_again() {
    let place = Workplace::of(&laser_for("2.5 ms"));
    let free = json(&place.run(&["--json", "--no-record"]));
    for kind in ["thermal", "optics"] {
        let mut command = limited(&place, "64");
        let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        place.wait_for_file("limited.mcap", 6_000_000);
        signal("STOP", place.node(kind));
        let output = run.wait_with_output().unwrap();
        let summary = json(&output);
        let restarts = summary["restarts"].as_array().unwrap();
        assert_eq!(restarts.len(), 1, "{}", said(&output));
        assert_eq!((&restarts[0]["node"], &summary["hash"]), (&kind.into(), &free["hash"]));
        std::fs::remove_file(place.path("limited.mcap")).unwrap();
    }
}
