//! Fault: pictures were due at sums of steps that miss their time by a rounding, and were left for the step after.
//!
//! Its brothers wait for a time, too (dispensers, motions and fields that are switched, the end of a current): unit tests
//! beside `checks::reached` and the dispensers.

use std::path::Path;

use super::program;

const SCENE: &str = r#"
duration = "1 s"
[particles]
count = 1
radius = "25 um"
integrator = "held"
start = { kind = "lattice", box = ["0.1 mm", "0.1 mm", "0.1 mm"] }
[coupling]
dt = "0.1 s"
"#;

/// Messages for other programs' viewers in the recording of a run.
fn messages(folder: &Path, [duration, dt, frames]: [&str; 3]) -> u64 {
    let sets = [format!("duration={duration}"), format!("coupling.dt={dt}"), format!("record.frames={frames}")];
    let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", set.as_str()]).collect();
    let _ = std::fs::remove_file(folder.join("run.mcap"));
    let run = ["run", "scene.toml", "--in-process", "--record", "run.mcap"];
    let output = program::stagger(folder, &[&run[..], &sets].concat());
    assert!(output.status.success(), "{}", program::stderr(&output));
    let info = program::stagger(folder, &["info", "run.mcap", "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    info["topics"]["display"]["messages"].as_u64().unwrap()
}

#[test]
fn there_are_as_many_pictures_as_the_scene_says() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    let count = |run| messages(folder.path(), run);
    // As many as where every step has one.
    for [duration, dt, frames] in [["1 s", "0.1 s", "10"], ["1 ms", "10 us", "100"], ["0.7 s", "7 ms", "100"]] {
        let (found, expected) = (count([duration, dt, frames]), count([duration, dt, "100000"]));
        assert_eq!(found, expected, "{duration} by {dt}, {frames} frames");
    }
    // And of steps in between as many as of steps of that length.
    assert_eq!(count(["1 ms", "10 us", "20"]), count(["1 ms", "50 us", "100000"]));
    assert_eq!(count(["1 s", "1 ms", "10"]), count(["1 s", "0.1 s", "100000"]));
}
