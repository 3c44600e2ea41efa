//! What a shell may do to a program: long folders, odd names, closed streams, odd environments, kills.

use std::{
    fs,
    io::Write as _,
    path::Path,
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

use super::program::{folder, stderr, stdout};

const SCENE: &str = r#"
duration = "0.1 ms"
[particles]
start = { kind = "file", path = "bed.csv", unit = "um" }
[walls.plate]
plane = { normal = [0, 0, 1] }
[thermal]
[coupling]
dt = "10 us"
"#;
const BED: &str = "x,y,z,radius\n0,0,25,25\n50,0,25,25\n";

fn place() -> tempfile::TempDir {
    folder(&[("scene.toml", SCENE), ("bed.csv", BED)])
}

/// The program in `folder`, which is its temporary directory too.
fn stagger(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.current_dir(folder).env("TMPDIR", folder).stdin(Stdio::null());
    command
}

fn hash(output: &Output) -> String {
    assert!(output.status.success(), "{}", stderr(output));
    let text = stdout(output);
    text.lines().find_map(|line| line.trim().strip_prefix("hash of the final fields")).unwrap().trim().to_owned()
}

fn leftovers(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    entries.filter(|name| name.starts_with("stagger-")).collect()
}

#[test]
fn a_scene_may_be_called_anything() {
    let place = place();
    let expected = hash(&stagger(place.path()).args(["run", "scene.toml", "--no-record"]).output().unwrap());
    for name in ["Ölbad", "粉末", "(1)", "%x", "-x", ".x", "-", "$x#?*", "a b"] {
        let scene = format!("./{name}.toml");
        fs::copy(place.path().join("scene.toml"), place.path().join(&scene)).unwrap();
        let output = stagger(place.path()).args(["run", &scene]).output().unwrap();
        assert_eq!(hash(&output), expected, "{name}");
        assert!(place.path().join(format!("{name}.mcap")).is_file(), "{name}");
    }
    let output = stagger(place.path()).args(["run", "--no-record", "--", "-x.toml"]).output().unwrap();
    assert_eq!(hash(&output), expected);
}

#[test]
fn a_temporary_directory_with_a_long_name_is_done_without_and_one_that_is_not_there_is_told() {
    let place = place();
    let long = place.path().join("x".repeat(90));
    let odd = place.path().join("a#b?c");
    fs::create_dir(&long).unwrap();
    fs::create_dir(&odd).unwrap();
    let scene = format!("{}.toml", "s".repeat(60));
    fs::copy(place.path().join("scene.toml"), place.path().join(&scene)).unwrap();
    let run = |folder: &Path| {
        stagger(place.path()).args(["run", &scene, "--no-record"]).env("TMPDIR", folder).output().unwrap()
    };
    for folder in [&long, &odd, Path::new("")] {
        hash(&run(folder));
    }
    let output = run(&place.path().join("absent"));
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("hint: TMPDIR names the folder"), "{}", stderr(&output));
}

#[test]
fn a_scene_may_come_from_standard_input_or_a_pipe_and_so_may_its_files() {
    let place = place();
    let expected = hash(&stagger(place.path()).args(["run", "scene.toml", "--no-record"]).output().unwrap());
    let cases = [&["run", "-"][..], &["run", "/dev/stdin", "--in-process"], &["run", "/dev/stdin"]];
    for arguments in cases {
        let mut command = stagger(place.path());
        command.args(arguments).stdin(Stdio::piped());
        // The first as a pipe, the last as a file.
        if arguments == ["run", "/dev/stdin"] {
            command.stdin(fs::File::open(place.path().join("scene.toml")).unwrap());
        }
        let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        if let Some(mut input) = run.stdin.take() {
            input.write_all(SCENE.as_bytes()).unwrap();
        }
        assert_eq!(hash(&run.wait_with_output().unwrap()), expected, "{arguments:?}");
    }
    // Particles that can be read only once.
    fs::remove_file(place.path().join("bed.csv")).unwrap();
    assert!(Command::new("mkfifo").arg(place.path().join("bed.csv")).status().unwrap().success());
    let run = stagger(place.path())
        .args(["run", "scene.toml", "--no-record"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    fs::write(place.path().join("bed.csv"), BED).unwrap();
    assert_eq!(hash(&run.wait_with_output().unwrap()), expected);
}

#[test]
fn closed_streams_end_no_run_and_hold_none() {
    let place = place();
    for closed in ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"] {
        let line = format!("exec '{}' run scene.toml --no-record {closed}", env!("CARGO_BIN_EXE_stagger"));
        let mut command = Command::new("sh");
        command.args(["-c", &line]).current_dir(place.path()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut run = command.spawn().unwrap();
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = run.try_wait().unwrap() {
                break status;
            }
            assert!(begun.elapsed() < Duration::from_secs(60), "{closed}: it hangs");
            std::thread::sleep(Duration::from_millis(10));
        };
        assert_eq!(status.code(), Some(0), "{closed}");
    }
}

#[test]
fn an_odd_environment_is_told_and_not_a_panic() {
    let place = place();
    let run = |name: &str, value: &str| {
        stagger(place.path()).args(["run", "scene.toml", "--no-record"]).env(name, value).output().unwrap()
    };
    for value in ["nonsense", "(app: (worker_threads: 0))", ""] {
        let output = run("ZENOH_RUNTIME", value);
        assert_eq!(output.status.code(), Some(2), "{value}: {}", stderr(&output));
        assert!(stderr(&output).contains("the environment variable ZENOH_RUNTIME"), "{}", stderr(&output));
    }
    for (name, value, told) in [
        ("ZENOH_RUNTIME", "(rx: (worker_threads: 2))", ""),
        ("ZENOH_CONFIG", "/no/such/file", ""),
        ("RUST_LOG", "[[[nonsense=", ""),
        ("RAYON_NUM_THREADS", "100000", "RAYON_NUM_THREADS asks for 100000 threads"),
        ("RAYON_NUM_THREADS", "many", "RAYON_NUM_THREADS is `many`, where a number is expected"),
        ("RAYON_NUM_THREADS", "0", ""),
    ] {
        let output = run(name, value);
        hash(&output);
        assert!(stderr(&output).contains(told), "{name}={value}: {}", stderr(&output));
        assert!(!told.is_empty() || stderr(&output).is_empty(), "{name}={value}: {}", stderr(&output));
    }
}

#[test]
fn threads_are_no_more_than_there_are_processors() {
    let place = place();
    let run =
        |more: &[&str]| stagger(place.path()).args(["run", "scene.toml", "--no-record"]).args(more).output().unwrap();
    for more in [&["--threads", "65536"][..], &["--threads", "65536", "--in-process"]] {
        let output = run(more);
        hash(&output);
        assert_eq!(stderr(&output).matches("--threads asks for 65536 threads").count(), 1, "{}", stderr(&output));
    }
    for nonsense in ["0", "-1", "many", ""] {
        let output = run(&["--threads", nonsense]);
        assert_eq!(output.status.code(), Some(2), "{nonsense}: {}", stderr(&output));
    }
}

/// A run that lasts until it is ended.
fn endless(place: &Path) -> std::process::Child {
    let mut command = stagger(place);
    command.args(["run", "scene.toml", "--set", "duration=600", "--record", "endless.mcap"]);
    let mut run = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    while fs::metadata(place.join("endless.mcap")).map_or(0, |about| about.len()) < 100_000 {
        assert_eq!(run.try_wait().unwrap(), None, "it has ended");
        std::thread::sleep(Duration::from_millis(10));
    }
    run
}

/// The processes below one.
fn children(of: u32) -> Vec<u32> {
    let threads =
        fs::read_dir(format!("/proc/{of}/task")).unwrap().map(|thread| thread.unwrap().path().join("children"));
    threads
        .flat_map(|path| {
            fs::read_to_string(path)
                .unwrap_or_default()
                .split(' ')
                .filter_map(|pid| pid.parse().ok())
                .collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn what_a_killed_run_left_goes_with_the_next_one_and_nothing_else_does() {
    let place = place();
    let mut run = endless(place.path());
    let mut going = endless_beside(place.path());
    run.kill().unwrap();
    run.wait().unwrap();
    assert_eq!(leftovers(place.path()).len(), 2);
    // Folders that only look like one of ours.
    fs::create_dir_all(place.path().join("stagger-results/series")).unwrap();
    fs::create_dir(place.path().join("stagger-empty")).unwrap();
    hash(&stagger(place.path()).args(["run", "scene.toml", "--no-record"]).output().unwrap());
    let left = leftovers(place.path());
    assert!(
        left.len() == 3 && left.contains(&"stagger-results".into()) && left.contains(&"stagger-empty".into()),
        "{left:?}"
    );
    assert!(left.iter().any(|name| name.ends_with(&format!("-{}", going.id()))), "{left:?}");
    going.kill().unwrap();
    going.wait().unwrap();
}

fn endless_beside(place: &Path) -> std::process::Child {
    let mut command = stagger(place);
    command.args(["run", "scene.toml", "--set", "duration=600", "--no-record"]);
    let run = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let there = |name: &String| name.ends_with(&format!("-{}", run.id()));
    while !leftovers(place).iter().any(there) {
        std::thread::sleep(Duration::from_millis(10));
    }
    run
}

#[cfg(target_os = "linux")]
#[test]
fn a_node_is_started_again_though_somebody_has_removed_the_folder_of_its_run() {
    let place = place();
    let mut run = endless(place.path());
    let ours = leftovers(place.path());
    fs::remove_dir_all(place.path().join(&ours[0])).unwrap();
    let before = children(run.id());
    let signal = |name: &str, pid: u32| {
        assert!(Command::new("kill").arg(name).arg(pid.to_string()).status().unwrap().success());
    };
    signal("-KILL", before[0]);
    let size = || fs::metadata(place.path().join("endless.mcap")).unwrap().len();
    let begun = Instant::now();
    while children(run.id()).iter().all(|child| before.contains(child)) {
        assert!(begun.elapsed() < Duration::from_secs(60), "it is not started again");
        std::thread::sleep(Duration::from_millis(20));
    }
    // It goes on: the recording grows, the run ends when it is asked to, and tells of one restart.
    let now = size();
    while size() < now + 100_000 {
        assert_eq!(run.try_wait().unwrap(), None, "it has ended");
        assert!(begun.elapsed() < Duration::from_secs(60), "it does not go on");
        std::thread::sleep(Duration::from_millis(20));
    }
    signal("-INT", run.id());
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("was removed and is made again"), "{}", stderr(&output));
    assert_eq!(leftovers(place.path()), [""; 0]);
}
