//! Fault: spheres on a wall of 2000 K got hotter than 2900 K in a long step with φ = ½, and as cold as −9·10¹⁰ K with φ = 0: the
//! flow at a step's start overshoots beyond m C/(G (1 − φ)). Nothing leaves the temperatures around it, sources excepted.

use std::path::Path;

use super::program::{field, folder, stagger, stderr, summary};

const SCENE: &str = r#"
duration = "200 ms"
[particles]
material = "316L"
start = { kind = "file", path = "spheres.csv" }
integrator = "held"
gravity = [0, 0, 0]
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = "2000 K"
[thermal]
conductance = "constriction"
[coupling]
dt = "200 ms"
"#;
const TWO: &str = "x,y,z,radius\n0,0,49.5e-6,5e-5\n0,0,148.5e-6,5e-5\n";
/// Of several sizes: the smallest one's bound is a few µs.
const CHAIN: &str =
    "x,y,z,radius\n0,0,49.5e-6,5e-5\n0,0,118.8e-6,2e-5\n0,0,188.1e-6,5e-5\n0,0,247.5e-6,1e-5\n0,0,266.9e-6,1e-5\n";

fn place() -> tempfile::TempDir {
    folder(&[("scene.toml", SCENE), ("spheres.csv", TWO), ("chain.csv", CHAIN)])
}

/// The coldest and the hottest at the end, in K, and the windows in which φ was raised.
fn ends(folder: &Path, sets: &[&str]) -> ([f64; 2], f64) {
    let summary = summary(folder, "scene.toml", sets);
    let open = summary["imbalance"]["thermal"].as_f64().unwrap();
    // A few roundings of what each window holds and passes.
    assert!(open.abs() < 1e-13, "{sets:?}: {open:e}");
    let raised = &summary["nodes"]["thermal"]["figures"]["windows of raised phi"];
    (["min", "max"].map(|which| field(&summary, "temperature")[which].as_f64().unwrap()), raised.as_f64().unwrap())
}

#[test]
fn nothing_gets_hotter_or_colder_than_what_surrounds_it_whatever_step_and_weight() {
    let place = place();
    // Tables, several materials in one list, a loss to the surroundings, phases, Newton: as long as no light falls on it.
    let table =
        r#"materials.m={ density = 8000, heat-capacity = [["300 K", 400], ["2500 K", 900]], conductivity = 20 }"#;
    let chain = r#"particles.start={ kind = "file", path = "chain.csv" }"#;
    let cases: [&[&str]; 7] = [
        &[],
        &[chain],
        &[chain, "thermal.ambient={ temperature = \"400 K\", convection = 1000, emissivity = 1 }"],
        &[chain, "thermal.phases={}"],
        &[chain, "thermal.solver=conjugate-gradient"],
        &[chain, table, "particles.material=m"],
        &[chain, "thermal.conductance=monograph"],
    ];
    for case in cases {
        for phi in ["0", "0.25", "0.5", "0.9", "1"] {
            // In the shorter steps the sweeps of the stiffest case converge within what is allowed them.
            for dt in ["200 ms", "10 ms", "0.3 ms"] {
                let sets =
                    [format!("thermal.phi={phi}"), format!("coupling.dt={{ start = \"{dt}\", limit = \"{dt}\" }}")];
                let more = ["duration=\"20 ms\"", "thermal.iterations=10000"];
                let sets: Vec<&str> = case.iter().copied().chain(sets.iter().map(String::as_str)).chain(more).collect();
                let ([coldest_k, hottest_k], raised) = ends(place.path(), &sets);
                // The thermal iteration ends within twice 1e-10 of 2000 K.
                assert!(coldest_k >= 300.0 - 1e-6, "{sets:?}: {coldest_k} K");
                assert!(hottest_k <= 2000.0 + 1e-6, "{sets:?}: {hottest_k} K");
                assert!(phi != "1" || raised == 0.0, "{sets:?}: {raised}");
            }
        }
    }
}

#[test]
fn the_end_is_the_exact_one_as_nearly_as_the_steps_allow() {
    let place = place();
    let of = |dt: &str| {
        let step = format!("coupling.dt={{ start = \"{dt}\", limit = \"{dt}\" }}");
        ends(place.path(), &["duration=\"40 ms\"", &step])
    };
    let exact = of("20 us");
    assert_eq!(exact.1, 0.0, "20 us is below the bound");
    // The bound is 9.8 ms: at 4 ms φ = ½ is of second order, at 10 ms the first window is not of it.
    for (dt, within_k, raises) in [("4 ms", 4.0, false), ("10 ms", 20.0, true)] {
        let ([coldest_k, hottest_k], raised) = of(dt);
        assert_eq!(raised > 0.0, raises, "{dt}: {raised}");
        for (found, exact) in [(coldest_k, exact.0[0]), (hottest_k, exact.0[1])] {
            assert!((found - exact).abs() < within_k, "{dt}: {found} K instead of {exact} K");
        }
    }
}

#[test]
fn a_scene_may_want_a_smaller_step_or_a_refusal_instead() {
    let place = place();
    let smaller = [
        "thermal.overshoot=smaller-step",
        "duration=\"20 ms\"",
        "coupling.dt={ start = \"10 ms\", limit = \"10 ms\" }",
    ];
    let run = summary(place.path(), "scene.toml", &smaller);
    assert!(run["steps"]["rejected"].as_u64().unwrap() > 0, "{run}");
    assert!(field(&run, "temperature")["max"].as_f64().unwrap() <= 2000.0);
    assert_eq!(run["nodes"]["thermal"]["figures"]["windows of raised phi"], 0.0, "{run}");

    let refused = stagger(
        place.path(),
        &["run", "scene.toml", "--in-process", "--no-record", "--set", "thermal.overshoot=refuse"],
    );
    assert!(!refused.status.success());
    let why = stderr(&refused);
    for part in ["at most", "thermal.phi", "row 0", "300 to 2000 K"] {
        assert!(why.contains(part), "{part} is not in {why}");
    }
}
