//! Fields between processes of one host: how much memory is locked for them, and what happens where little may be.

use std::process::Command;

use super::program::{Workplace, json, said, stagger};

/// The laser scene for 0.3 ms: three nodes, fields of 24 kB and less.
fn scene() -> Workplace {
    let text = std::fs::read_to_string(super::program::scenes().join("deposition-laser.toml")).unwrap();
    let text = text.replace("duration = \"8 ms\"", "duration = \"0.3 ms\"");
    assert!(text.contains("0.3 ms"), "the scene's duration has another form now");
    Workplace::of(&text)
}

/// What a process has locked, in kB.
fn locked_kb(pid: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmLck:"))?.split_whitespace().next()?.parse().ok()
}

#[test]
fn a_small_scene_locks_little_memory() {
    let place = scene();
    let mut run = place.start(&["--record", "run.mcap"]);
    let mut most = 0;
    while run.try_wait().unwrap().is_none() {
        most = place.processes().into_iter().filter_map(locked_kb).fold(most, u64::max);
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    // Three segments of 2 MiB, and what Zenoh keeps for each.
    assert!((1..24_000).contains(&most), "{most} kB are locked");
}

#[test]
fn whoever_may_lock_little_memory_gets_the_same_bits_without_a_warning() {
    let place = scene();
    let free = json(&place.run(&["--json", "--record", "free.mcap"]));
    for limit_kb in ["0", "64", "8192", "65536"] {
        // Root may lock what it likes, unless it lacks the capability for that.
        let script = "ulimit -l $0 || exit 99; \
                      if [ $(id -u) = 0 ]; then exec setpriv --bounding-set -ipc_lock \"$@\"; else exec \"$@\"; fi";
        let mut command = Command::new("sh");
        command.args(["-c", script, limit_kb]).arg(stagger().get_program());
        command.arg("run").arg(place.path("scene.toml")).args(["--json", "--record", "limited.mcap"]);
        let output = command.current_dir(place.path("")).output().unwrap();
        if output.status.code() == Some(99) {
            // A user who may lock less cannot try more.
            continue;
        }
        assert!(!said(&output).contains("warning"), "{limit_kb} kB: {}", said(&output));
        assert_eq!(json(&output)["hash"], free["hash"], "{limit_kb} kB");
    }
}
