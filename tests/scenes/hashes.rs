//! One hash for each scene, the same for everybody: on every processor, with registers of every width, with any number of
//! threads, in one process or many, stopped and resumed.
//!
//! Hashes are of runs shortened to some tens of steps, in `hashes.txt`. Where a change of the physics moves them,
//! `STAGGER_BLESS=1 cargo test --release -p stagger-cli --test scenes hash_of` writes the file anew.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
    process::Command,
    sync::Mutex,
};

use serde_json::Value;

/// A shortened scene of the file.
#[derive(Clone)]
pub struct Shortened {
    /// File of the scene.
    pub scene: String,
    /// The `--set` that shortens it.
    pub set: String,
    hash: String,
}

impl Shortened {
    /// The scene's entry.
    pub fn of(scene: &str) -> Self {
        let all = all();
        all.into_iter().find(|known| known.scene == scene).unwrap_or_else(|| panic!("hashes.txt has no {scene}"))
    }
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenes/hashes.txt")
}

/// Scene, shortening and hash of each line that is no comment.
fn all() -> Vec<Shortened> {
    let text = std::fs::read_to_string(file()).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let entry = |line: &str| {
        let words: Vec<_> = line.split_whitespace().collect();
        let [scene, set, hash] = words[..] else { panic!("hashes.txt: {line}") };
        Shortened { scene: scene.into(), set: set.into(), hash: hash.into() }
    };
    lines.map(entry).collect()
}

/// Puts another hash into the file; tests run side by side.
fn bless(scene: &str, hash: &str) {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock().unwrap();
    let text = std::fs::read_to_string(file()).unwrap();
    let mut new = String::new();
    for line in text.lines() {
        match line.split_whitespace().next() {
            Some(known) if known == scene => {
                let (before, _) = line.rsplit_once(' ').unwrap();
                writeln!(new, "{before} {hash}").unwrap();
            }
            _ => writeln!(new, "{line}").unwrap(),
        }
    }
    std::fs::write(file(), new).unwrap();
}

/// Runs a shortened scene with more arguments and in an environment.
fn run(shortened: &Shortened, arguments: &[&str], environment: &[(&str, &str)]) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(&shortened.scene);
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.arg("run").arg(path).arg("--json");
    for set in [&shortened.set, "recovery.checkpoint=1", "recovery.start=300", "record.level=accepted"] {
        command.args(["--set", set]);
    }
    let output = command.args(arguments).envs(environment.iter().copied()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}, {arguments:?}, {environment:?}: {said}", shortened.scene);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Every machine's hash is that of the file.
fn check(scene: &str) {
    let shortened = Shortened::of(scene);
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("run.mcap");
    let recording = recording.to_str().unwrap();
    let run = |arguments: &[&str], environment: &[(&str, &str)]| run(&shortened, arguments, environment);

    // As anybody runs it: a process for each node, as many threads and lanes as the machine has.
    let plain = run(&["--record", recording], &[]);
    let hash = plain["hash"].as_str().unwrap();
    let accepted = plain["steps"]["accepted"].as_u64().unwrap();
    assert!(accepted >= 12, "{scene} has {accepted} steps");

    // What an older processor's C library would take, one number at a time, one thread.
    let old = [("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"), ("STAGGER_SIMD", "scalar")];
    let narrow = run(&["--in-process", "--threads", "1", "--no-record"], &old);
    assert_eq!(narrow["hash"], hash, "{scene}: one thread, scalar, without fused instructions in the C library");
    assert_eq!(narrow["steps"], plain["steps"], "{scene}");
    for width in stagger_physics::common::width::available().into_iter().skip(1) {
        let other = run(&["--in-process", "--threads", "2", "--no-record"], &[("STAGGER_SIMD", width)]);
        assert_eq!(other["hash"], hash, "{scene}: two threads, {width}");
    }

    let half = format!("{recording}@{}", accepted / 2);
    let resumed = run(&["--in-process", "--no-record", "--resume", &half], &[]);
    assert_eq!(resumed["hash"], hash, "{scene}: resumed at step {}", accepted / 2);

    if std::env::var_os("STAGGER_BLESS").is_some() {
        bless(scene, hash);
    } else {
        assert_eq!(hash, shortened.hash, "{scene}: if the physics was meant to change, see tests/scenes/hashes.rs");
    }
}

macro_rules! hashes {
    ($($test:ident $scene:literal)*) => {
        $(#[test]
        fn $test() {
            check($scene);
        })*

        #[test]
        fn every_scene_has_a_hash() {
            let mut scenes: Vec<_> = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")).unwrap()
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .filter(|name| name.ends_with(".toml"))
                .collect();
            scenes.sort();
            assert_eq!(scenes, [$($scene),*]);
            assert_eq!(all().into_iter().map(|known| known.scene).collect::<Vec<_>>(), scenes);
        }
    };
}
hashes! {
    hash_of_acoustic_pulse "acoustic-pulse.toml"
    hash_of_deposition_laser "deposition-laser.toml"
    hash_of_deposition "deposition.toml"
    hash_of_electric_deposition "electric-deposition.toml"
    hash_of_falling_powder "falling-powder.toml"
    hash_of_laser_rays "laser-rays.toml"
    hash_of_mixed_powder "mixed-powder.toml"
    hash_of_pile "pile.toml"
    hash_of_piston "piston.toml"
    hash_of_plate_track "plate-track.toml"
    hash_of_quick "quick.toml"
    hash_of_sintering "sintering.toml"
    hash_of_substrate "substrate.toml"
    hash_of_three_lasers "three-lasers.toml"
}
