//! Nothing that is read, and nothing that was there, is written over without being asked to be.

use std::{
    fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use super::program::{folder, stagger, stderr, stdout};

/// Two physics, so that one of them can be replayed.
const SCENE: &str = r#"
duration = "0.2 ms"
[particles]
start = { kind = "file", path = "bed.csv", unit = "um" }
[walls.plate]
plane = { normal = [0, 0, 1] }
[thermal]
[coupling]
dt = "10 us"
[recovery]
checkpoint = 5
"#;
const BED: &str = "x,y,z,radius\n0,0,25,25\n50,0,25,25\n";
/// The same for long enough to be looked at while it goes on.
const LONG: [&str; 2] = ["--set", "duration=60"];

fn place() -> tempfile::TempDir {
    folder(&[("scene.toml", SCENE), ("bed.csv", BED)])
}

fn run(folder: &Path, more: &[&str]) -> (Option<i32>, String) {
    let output = stagger(folder, &[&["run", "scene.toml", "--in-process"], more].concat());
    (output.status.code(), stderr(&output))
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_recording_takes_the_place_of_nothing() {
    let place = place();
    let folder = place.path();
    let recording = folder.join("scene.mcap");
    assert_eq!(run(folder, &[]).0, Some(0));
    let first = fs::read(&recording).unwrap();

    // Of the same scene, and of another: the name has a number, which is told.
    let output = stagger(folder, &["run", "scene.toml", "--in-process", "--json", "--set", "seed=7"]);
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["recording"]["path"], "scene-2.mcap");
    assert!(stderr(&output).contains("scene.mcap exists already: this run is recorded in scene-2.mcap"));
    assert_eq!(run(folder, &["--replayed", "particles=scene.mcap"]).0, Some(0));
    assert_eq!(fs::read(&recording).unwrap(), first);
    assert_eq!(names(folder), ["bed.csv", "scene-2.mcap", "scene-3.mcap", "scene.mcap", "scene.toml"]);

    // A name that is given is taken or refused, before anything is written.
    fs::write(folder.join("thesis.txt"), "years of work").unwrap();
    let (code, said) = run(folder, &["--record", "thesis.txt"]);
    assert!(code == Some(2) && said.contains("thesis.txt exists already\nhint: --overwrite replaces it"), "{said}");
    assert_eq!(run(folder, &["--overwrite", "--set", "seed=8"]).0, Some(0));
    assert_ne!(fs::read(&recording).unwrap(), first);
    // Nothing is lost with the empty file that mktemp makes.
    fs::write(folder.join("made.mcap"), "").unwrap();
    assert_eq!(run(folder, &["--record", "made.mcap"]).0, Some(0));
    assert_eq!(fs::read(folder.join("thesis.txt")).unwrap(), b"years of work");
}

#[test]
fn an_output_that_is_an_input_is_refused_by_every_name_it_has() {
    let place = place();
    let folder = place.path();
    assert_eq!(run(folder, &["--record", "run.mcap"]).0, Some(0));
    symlink("run.mcap", folder.join("soft.mcap")).unwrap();
    fs::hard_link(folder.join("run.mcap"), folder.join("hard.mcap")).unwrap();
    fs::write(folder.join("zenoh.json5"), "{ transport: { link: { tls: { root_ca_certificate: 'ca.pem' } } } }")
        .unwrap();
    fs::write(folder.join("ca.pem"), "a certificate").unwrap();
    fs::write(folder.join("node.py"), "a program").unwrap();
    let before: Vec<_> = names(folder).iter().map(|name| fs::read(folder.join(name)).unwrap()).collect();
    let run = ["run", "scene.toml", "--in-process", "--overwrite", "--record"];
    let coordinator = ["coordinator", "scene.toml", "--listen", "tcp/127.0.0.1:0", "--config", "zenoh.json5"];
    let with = |output: &'static str, more: &[&'static str]| [&run[..], &[output], more].concat();
    let cases = [
        with("scene.toml", &[]),
        with("bed.csv", &[]),
        with("./run.mcap", &["--resume", "run.mcap"]),
        with("soft.mcap", &["--resume", "run.mcap@5"]),
        with("hard.mcap", &["--replayed", "particles=run.mcap"]),
        with("run.mcap", &["--files", "soft.mcap"]),
        with("node.py", &["--node", "thermal=python3 node.py"]),
        [&coordinator[..], &["--overwrite", "--record", "ca.pem"]].concat(),
        [&coordinator[..], &["--overwrite", "--record", "zenoh.json5"]].concat(),
        vec!["report", "run.mcap", "--out", "run.mcap"],
        vec!["report", "run.mcap", "--out", "hard.mcap", "--overwrite"],
    ];
    for case in cases {
        let output = stagger(folder, &case);
        assert_eq!(output.status.code(), Some(2), "{case:?}: {}", stderr(&output));
        assert!(
            stderr(&output).contains("which this command reads: it is not written over"),
            "{case:?}: {}",
            stderr(&output)
        );
    }
    let after: Vec<_> = names(folder).iter().map(|name| fs::read(folder.join(name)).unwrap()).collect();
    assert!(before == after, "{:?}", names(folder));
}

#[test]
fn two_runs_in_one_folder_have_a_recording_each() {
    let place = place();
    let runs: Vec<_> = (0..4)
        .map(|seed: u32| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
            command.args(["run", "scene.toml", "--in-process", "--set", &format!("seed={seed}")]);
            command.current_dir(place.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
        })
        .collect();
    for mut run in runs {
        assert_eq!(run.wait().unwrap().code(), Some(0));
    }
    for name in ["scene.mcap", "scene-2.mcap", "scene-3.mcap", "scene-4.mcap"] {
        let verified = stagger(place.path(), &["verify", name]);
        assert_eq!(verified.status.code(), Some(0), "{name}: {}", stderr(&verified));
    }
}

#[test]
fn a_recording_under_way_is_said_to_be_and_is_not_replaced() {
    let place = place();
    let folder = place.path();
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(["run", "scene.toml", "--in-process"]).args(LONG).current_dir(folder);
    let mut run = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let path = folder.join("scene.mcap");
    while fs::metadata(&path).map_or(0, |about| about.len()) < 100_000 {
        assert_eq!(run.try_wait().unwrap(), None, "it has ended");
        std::thread::sleep(Duration::from_millis(10));
    }
    let info = stagger(folder, &["info", "scene.mcap", "--json"]);
    assert_eq!(info.status.code(), Some(3));
    assert!(stderr(&info).contains("scene.mcap is still being written"), "{}", stderr(&info));
    let told: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!((&told["being_written"], &told["damage"]), (&true.into(), &serde_json::Value::Null));
    let info = stdout(&stagger(folder, &["info", "scene.mcap"]));
    assert!(info.contains("it goes on") && info.contains("still being written"), "{info}");
    let report = stagger(folder, &["report", "scene.mcap", "--out", "page.html"]);
    assert!(report.status.code() == Some(3) && stderr(&report).contains("still being written"), "{}", stderr(&report));
    let over = stagger(folder, &["run", "scene.toml", "--in-process", "--overwrite"]);
    assert!(
        over.status.code() == Some(2) && stderr(&over).contains("still being written by a run"),
        "{}",
        stderr(&over)
    );

    // Killed, it is cut off.
    run.kill().unwrap();
    run.wait().unwrap();
    let info = stagger(folder, &["info", "scene.mcap", "--json"]);
    assert!(info.status.code() == Some(3) && stderr(&info).contains("is cut off"), "{}", stderr(&info));
    let replay = stagger(folder, &["replay", "scene.mcap", "--now", "--speed", "inf"]);
    assert!(replay.status.code() == Some(3) && stderr(&replay).contains("is cut off"), "{}", stderr(&replay));
}

#[test]
fn a_run_that_does_not_begin_leaves_no_file_and_speaks_of_none() {
    let place = place();
    let folder = place.path();
    assert_eq!(run(folder, &["--record", "run.mcap"]).0, Some(0));
    let recorded = fs::read(folder.join("run.mcap")).unwrap();
    // What a killed run left here before its head was whole goes with the next one.
    fs::write(folder.join(".stagger-1-0.part"), "half a head").unwrap();
    for command in ["thermal=/no/such/program", "thermal=false"] {
        let more = ["--node", command, "--overwrite", "--record", "run.mcap", "--set", "recovery.restarts=0"];
        let output = stagger(folder, &[&["run", "scene.toml"], &more[..]].concat());
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(
            !stderr(&output).contains("what was recorded") && !stderr(&output).contains("--resume"),
            "{}",
            stderr(&output)
        );
        // Nor is the environment printed that a command was given.
        assert!(!stderr(&output).contains("STAGGER_RUN"), "{}", stderr(&output));
    }
    assert_eq!(fs::read(folder.join("run.mcap")).unwrap(), recorded);
    assert_eq!(names(folder), ["bed.csv", "run.mcap", "scene.toml"]);
}

#[test]
fn pages_and_exports_replace_only_their_like() {
    let place = place();
    let folder = place.path();
    assert_eq!(run(folder, &["--record", "run.mcap"]).0, Some(0));
    let code = |arguments: &[&str]| stagger(folder, arguments).status.code();
    for _ in 0..2 {
        assert_eq!(code(&["report", "run.mcap"]), Some(0));
        assert_eq!(code(&["export", "run.mcap", "--out", "out", "--csv", "--vtp"]), Some(0));
    }
    for (name, command) in [
        ("notes.html", &["report", "run.mcap", "--out", "notes.html"][..]),
        ("out/scalars.csv", &["export", "run.mcap", "--out", "out", "--csv"]),
        ("out/particles-000000.vtp", &["export", "run.mcap", "--out", "out"]),
        ("out/particles.pvd", &["export", "run.mcap", "--out", "out"]),
    ] {
        fs::write(folder.join(name), "mine").unwrap();
        let output = stagger(folder, command);
        assert_eq!(output.status.code(), Some(2), "{name}: {}", stderr(&output));
        assert!(stderr(&output).contains("exists already\nhint: --overwrite"), "{name}: {}", stderr(&output));
        assert_eq!(fs::read(folder.join(name)).unwrap(), b"mine");
        assert_eq!(code(&[command, &["--overwrite"]].concat()), Some(0), "{name}");
    }
}

#[test]
fn a_pipe_that_nobody_reads_is_not_waited_for_against_the_users_will() {
    let place = place();
    let folder = place.path();
    assert!(Command::new("mkfifo").arg(folder.join("pipe.mcap")).status().unwrap().success());
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(["run", "scene.toml", "--in-process", "--record", "pipe.mcap"]).current_dir(folder);
    let run = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    // Long enough that the word is said which tells what it waits for.
    std::thread::sleep(Duration::from_millis(2500));
    assert!(Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap().success());
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("waiting for somebody to read pipe.mcap"), "{}", stderr(&output));
    for (record, what) in [(".", "is a folder"), ("/dev/null/x", "cannot write")] {
        let (code, said) = self::run(folder, &["--record", record]);
        assert!(code.is_some_and(|code| code == 1 || code == 2) && said.contains(what), "{said}");
    }
    assert_eq!(self::run(folder, &["--record", "/dev/null"]).0, Some(0));
}
