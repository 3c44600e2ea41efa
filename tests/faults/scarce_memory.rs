//! Shared memory that is absent, full, or taken away: what would go through it goes through the socket.

use std::{
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

use super::place::{Workplace, json, laser_for, said, stagger};

/// Runs the scene in a file system of its own, after `before`; ends with 99 where this user may not have one.
fn apart(place: &Workplace, before: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new("unshare");
    // What cannot be set up is told from what fails.
    let script = format!("({before}) || exit 99; exec \"$@\"");
    command.args(["-m", "sh", "-c", &script, "sh"]).arg(stagger().get_program()).arg("run").arg(&place.scene);
    command.args(arguments).current_dir(place.path(""));
    command
}

/// Whether a folder of its own can be mounted here; says so where it cannot.
#[expect(clippy::print_stdout, reason = "who reads the test's output is to know what was left out")]
fn may_mount() -> bool {
    let mount = "mount -t tmpfs tmpfs /dev/shm";
    let may =
        Command::new("unshare").args(["-m", "sh", "-c", mount]).output().is_ok_and(|output| output.status.success());
    if !may {
        println!("skipped: this user may not mount a folder for himself");
    }
    may
}

fn warnings(output: &Output) -> Vec<String> {
    said(output).lines().filter(|line| line.contains("warning: ")).map(str::to_owned).collect()
}

#[test]
fn without_shared_memory_a_run_goes_by_the_socket_with_one_word() {
    if !may_mount() {
        return;
    }
    let place = Workplace::of(&laser_for("0.2 ms"));
    let expected = json(&place.run(&["--json", "--no-record"]));
    for before in [
        "mount -t tmpfs -o ro tmpfs /dev/shm",
        "mount -t tmpfs -o size=4k tmpfs /dev/shm",
        "mount -t tmpfs -o nr_inodes=1 tmpfs /dev/shm",
        "mount -t tmpfs -o nr_inodes=2 tmpfs /dev/shm",
        "mount -t tmpfs tmpfs /dev && mknod -m 666 /dev/null c 1 3 && mknod -m 666 /dev/urandom c 1 9",
    ] {
        let output = apart(&place, before, &["--json", "--no-record"]).output().unwrap();
        assert_eq!(json(&output)["hash"], expected["hash"], "{before}");
        let warnings = warnings(&output);
        assert!(warnings.len() == 1 && warnings[0].contains("there is no shared memory"), "{before}: {warnings:?}");
    }
}

#[test]
fn little_shared_memory_is_used_as_far_as_it_goes() {
    if !may_mount() {
        return;
    }
    let place = Workplace::of(&laser_for("0.2 ms"));
    let expected = json(&place.run(&["--json", "--no-record"]));
    for size in ["1m", "5m", "9m", "14m"] {
        let before = format!("mount -t tmpfs -o size={size} tmpfs /dev/shm");
        let output = apart(&place, &before, &["--json", "--no-record"]).output().unwrap();
        assert_eq!(json(&output)["hash"], expected["hash"], "{size}: {}", said(&output));
        assert!(!said(&output).contains("panicked"), "{size}: {}", said(&output));
    }
}

#[test]
fn a_run_whose_shared_memory_is_taken_away_goes_on_by_the_socket() {
    if !may_mount() {
        return;
    }
    let place = Workplace::of(&laser_for("2 ms"));
    let begun = Instant::now();
    let expected = json(&place.run(&["--json", "--no-record"]));
    let undisturbed = begun.elapsed();
    for after in ["rm -f /dev/shm/*", "head -c 1G /dev/zero > /dev/shm/full"] {
        let arguments = ["--json", "--record", "run.mcap"];
        let watch = format!(
            "mount -t tmpfs -o size=64m tmpfs /dev/shm; \
             (until [ \"$(stat -c %s run.mcap 2> /dev/null || echo 0)\" -gt 2000000 ]; do sleep 0.01; done; {after}) \
             > /dev/null 2>&1 &"
        );
        let begun = Instant::now();
        let run = apart(&place, &watch, &arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let output = run.wait_with_output().unwrap();
        let took = begun.elapsed();
        assert_eq!(json(&output)["hash"], expected["hash"], "{after}: {}", said(&output));
        assert!(took < 3 * undisturbed + Duration::from_secs(15), "{after}: {took:?} instead of {undisturbed:?}");
        std::fs::remove_file(place.path("run.mcap")).unwrap();
    }
}

#[test]
fn a_limit_on_the_size_of_files_is_no_signal_but_a_sentence() {
    let place = Workplace::of(&laser_for("0.3 ms"));
    let expected = json(&place.run(&["--json", "--no-record"]));
    let limited = |more: &[&str]| {
        let mut command = Command::new("sh");
        command
            .args(["-c", "ulimit -f 1000; exec \"$@\"", "sh"])
            .arg(stagger().get_program())
            .arg("run")
            .arg(&place.scene);
        command.args(more).current_dir(place.path("")).output().unwrap()
    };
    let output = limited(&["--json", "--no-record"]);
    assert_eq!(json(&output)["hash"], expected["hash"]);
    assert_eq!(warnings(&output).len(), 1, "{}", said(&output));
    assert!(said(&output).contains("ulimit -f"), "{}", said(&output));
    let output = limited(&["--record", "run.mcap"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("cannot write the recording") && said(&output).contains("ulimit -f"),
        "{}",
        said(&output)
    );
}
