//! Fault: a constant relaxation that cannot reach the tolerance within the iterations rejected every step, smaller and
//! smaller, for hours and without a word.

use super::program;

/// Two spheres that soften as they warm: the temperature is fed back to the motion.
const SCENE: &str = r#"
duration = "40 us"
[particles]
count = 20
radius = "25 um"
start = { box = ["0.3 mm", "0.3 mm", "0.2 mm"], velocity = [0, 0, "-0.5 m/s"] }
contact = { stiffness = "1e9 Pa", damping = "8e5 N s/m^3", softening = { rate = 1 } }
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = "320 K"
[thermal]
[optics]
power = "10 W"
absorption = "1e4 1/m"
profile = { kind = "gaussian", radius = "100 um" }
path = { kind = "fixed", at = [0, 0, 0] }
[coupling]
dt = "10 us"
tolerance = { temperature = 1e-9 }
"#;

#[test]
fn check_says_what_a_constant_relaxation_cannot_reach() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    let check = |sets: &[&str]| {
        let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", *set]).collect();
        program::stagger(folder.path(), &[&["check", "scene.toml"], &sets[..]].concat())
    };
    let output = check(&["coupling.acceleration=constant"]);
    assert!(output.status.success());
    let said = program::stderr(&output);
    for word in ["`temperature` may never converge", "0.5", "7.8e-3", "1.0e-9", "coupling.iterations = 31", "aitken"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let quiet = ["coupling.acceleration=constant", "coupling.iterations=31"];
    for sets in [&quiet[..], &["coupling.acceleration=aitken"], &[]] {
        assert!(!program::stderr(&check(sets)).contains("may never converge"), "{sets:?}");
    }
    let output =
        program::stagger(folder.path(), &["check", "scene.toml", "--json", "--set", "coupling.acceleration=constant"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["warnings"].as_array().unwrap().len(), 1, "{report}");
}

#[test]
fn a_run_that_only_rejects_says_so_and_ends() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    // A minimum far away, as it is in a scene that wants to be on the safe side.
    let sets = [
        "--set",
        "coupling.acceleration=constant",
        "--set",
        "coupling.dt.minimum=1e-300 s",
        "--set",
        "coupling.dt.start=10 us",
    ];
    let scene = SCENE.replace("dt = \"10 us\"", "dt = { start = \"10 us\" }");
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let run = |more: &[&str]| {
        program::stagger(
            folder.path(),
            &[&["run", "scene.toml", "--in-process", "--no-record"], &sets[..], more].concat(),
        )
    };
    let output = run(&[]);
    assert_eq!(output.status.code(), Some(1));
    let said = program::stderr(&output);
    for word in [
        "was rejected 10 times",
        "was rejected 50 times",
        "`temperature` did not converge in 8 iterations",
        " the least",
        "tolerance 1.0e-9",
        "shrinks to 0.500 of itself",
        "coupling.iterations",
        "aitken",
        "coupling.rejections",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let said = program::stderr(&run(&["--set", "coupling.rejections=3"]));
    assert!(said.contains("was rejected 3 times"), "{said}");
    // Enough iterations, or none of it, and the run ends where it should.
    for cure in ["coupling.iterations=40", "coupling.acceleration=aitken", "coupling.acceleration=none"] {
        let output = run(&["--set", cure]);
        assert!(output.status.success(), "{cure}: {}", program::stderr(&output));
    }
}
