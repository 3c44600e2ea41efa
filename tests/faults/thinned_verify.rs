//! Fault: a recording of chosen fields was said to differ from its solution, where it cannot be verified at all.

use super::program;

const SCENE: &str = r#"
duration = "0.1 ms"
[particles]
count = 20
radius = "25 um"
start = { box = ["0.4 mm", "0.4 mm", "0.3 mm"], velocity = [0, 0, "-0.5 m/s"] }
contact = { stiffness = "1e9 Pa", damping = "8e5 N s/m^3", softening = { rate = 1 } }
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = "320 K"
[thermal]
[coupling]
dt = "20 us"
"#;

#[test]
fn a_recording_that_lacks_fields_cannot_be_verified_and_says_so() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    let verify = |sets: &[&str]| {
        let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", *set]).collect();
        let run = ["run", "scene.toml", "--in-process", "--record", "run.mcap"];
        let _ = std::fs::remove_file(folder.path().join("run.mcap"));
        let output = program::stagger(folder.path(), &[&run[..], &sets].concat());
        assert!(output.status.success(), "{}", program::stderr(&output));
        program::stagger(folder.path(), &["verify", "run.mcap"])
    };
    for thinned in [
        "record.fields=[\"positions\", \"temperature\"]",
        "record.fields=[\"positions\", \"radii\", \"velocities\"]",
        "record.level=accepted",
        "record.every=3",
    ] {
        let output = verify(&[thinned]);
        let said = program::stderr(&output) + &program::stdout(&output);
        assert!(!output.status.success() && said.contains("the recording lacks a field"), "{thinned}: {said}");
        assert!(
            said.contains("Only a recording at level \"all\", of all fields and every step, can be verified"),
            "{thinned}: {said}"
        );
        assert!(!said.contains("difference") && !said.contains("differ"), "{thinned}: {said}");
    }
    let output = verify(&[]);
    assert!(output.status.success(), "{}", program::stderr(&output));
    assert!(program::stdout(&output).contains("  no difference\n"), "{}", program::stdout(&output));
}
