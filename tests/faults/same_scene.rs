//! Fault: a value set on the command line that the scene has anyway made another scene, which could not be gone on with.

use super::program;

const SCENE: &str = r#"
duration = "0.2 ms"
[particles]
count = 10
radius = "25 um"
start = { box = ["0.3 mm", "0.3 mm", "0.2 mm"] }
[walls.plate]
plane = { normal = [0, 0, 1] }
[coupling]
dt = "10 us"
[recovery]
checkpoint = 5
"#;

#[test]
fn a_run_goes_on_with_its_scene_however_that_is_written() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    let run = |scene: &str, arguments: &[&str]| {
        program::stagger(folder.path(), &[&["run", scene, "--in-process", "--json"], arguments].concat())
    };
    let hash = |output: &std::process::Output| {
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        summary["hash"].as_str().unwrap().to_owned()
    };
    let whole = run("scene.toml", &["--record", "whole.mcap"]);
    assert!(whole.status.success(), "{}", program::stderr(&whole));
    let respelled = format!("# The same.\nseed = 1\n{}", SCENE.replace("\"10 us\"", "1e-5"));
    std::fs::write(folder.path().join("respelled.toml"), respelled).unwrap();
    for (scene, sets) in [
        ("scene.toml", vec![]),
        ("scene.toml", vec!["--set", "coupling.iterations=8"]),
        ("scene.toml", vec!["--set", "particles.gravity=[0, 0, -9.81]", "--set", "record.every=1"]),
        ("respelled.toml", vec![]),
    ] {
        let resumed = run(scene, &[&["--resume", "whole.mcap@10", "--no-record"], &sets[..]].concat());
        assert!(resumed.status.success(), "{scene} {sets:?}: {}", program::stderr(&resumed));
        assert_eq!(hash(&resumed), hash(&whole));
    }
    // Another value is named.
    let other = run("scene.toml", &["--resume", "whole.mcap@10", "--no-record", "--set", "coupling.iterations=9"]);
    let said = program::stderr(&other);
    assert!(!other.status.success() && said.contains("coupling.iterations was 8 and is 9"), "{said}");
}
