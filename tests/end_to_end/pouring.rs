//! Particles that come and go in whole runs: the same bits however a scene is run, resumed or restarted.

use std::path::Path;

use serde_json::Value;
use stagger_recordings::{Recording, Steps};

use super::program::{Workplace, json, said, signal, stagger};

/// A dispenser over a warm plate with walls on three sides: particles leave over the fourth while others come. Gravity is such
/// that they settle within milliseconds.
const SCENE: &str = r#"
title = "poured"
duration = "4 ms"
seed = 3
[particles]
count = 30
radius = { mean = "25 um", spread = "5 um" }
start = { box = ["0.3 mm", "0.3 mm", "0.4 mm"], velocity = [0, 0, "-0.5 m/s"] }
contact = { stiffness = "1e9 Pa", restitution = 0.2, softening = { rate = 1 } }
friction = { law = "spring" }
rolling = 0.3
spin = true
gravity = [0, 0, -500]
[particles.pour.hopper]
disc = { centre = [0, 0, "0.6 mm"], radius = "0.12 mm" }
rate = "4e4 1/s"
velocity = [0, 0, "-0.5 m/s"]
until = "3 ms"
[particles.domain]
lower = ["-0.3 mm", "-0.3 mm", 0]
upper = ["0.3 mm", "0.3 mm", "1 mm"]
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = "400 K"
[walls.sides]
box = { lower = ["-0.15 mm", "-0.15 mm", "-1 mm"], upper = ["0.2 mm", "0.15 mm", "2 mm"], open = ["+x"] }
[thermal]
[coupling]
dt = { start = "1 us", limit = "20 us" }
[recovery]
checkpoint = 10
"#;

const LASER: &str = r#"
[optics]
power = "10 W"
absorption = "1e4 1/m"
profile = { kind = "gaussian", radius = "100 um" }
path = { kind = "sweep", from = ["-0.15 mm", 0, 0], to = ["0.15 mm", 0, 0], speed = "1 m/s" }
starts = "0.5 ms"
"#;

fn scenes() -> [String; 2] {
    [SCENE.to_owned(), format!("{SCENE}{LASER}")]
}

fn verified(place: &Workplace, file: &str) -> Value {
    json(&stagger().args(["verify", "--json"]).arg(place.path(file)).output().unwrap())
}

/// Ids of the particles after each accepted step, and at the start.
fn ids(file: &Path) -> Vec<Vec<u32>> {
    let mut newest = Steps::default();
    let messages = Recording::open(file).unwrap().messages().unwrap();
    let steps = messages.filter_map(|message| newest.take(message.unwrap()).step);
    steps.map(|step| step.fields["ids"].u32().unwrap().to_vec()).collect()
}

#[test]
fn in_one_process_and_many_with_any_threads_resumed_and_solved_again_the_bits_are_the_same() {
    let place = Workplace::of(&scenes()[1]);
    let whole = json(&place.run(&["--record", "run.mcap", "--json"]));
    let hash = &whole["hash"];
    for arguments in [&["--in-process", "--threads", "1"][..], &["--in-process", "--threads", "2"], &["--threads", "2"]]
    {
        let other = json(&place.run(&[arguments, &["--json", "--no-record"]].concat()));
        assert_eq!(&other["hash"], hash, "{arguments:?}");
        assert_eq!((&other["steps"], &other["ledger"]), (&whole["steps"], &whole["ledger"]), "{arguments:?}");
    }
    assert_eq!(&verified(&place, "run.mcap")["hash"], hash);
    // In the middle of the pouring; nodes and a process of its own go on alike.
    for arguments in [
        &["--resume", "run.mcap@100", "--record", "rest.mcap"][..],
        &["--resume", "run.mcap@100", "--no-record", "--in-process"],
    ] {
        let rest = json(&place.run(&[arguments, &["--json"]].concat()));
        assert_eq!(&rest["hash"], hash, "{arguments:?}");
        assert_eq!((&rest["steps"], &rest["ledger"]), (&whole["steps"], &whole["ledger"]), "{arguments:?}");
    }
    verified(&place, "rest.mcap");
    place.wait_until_empty();
}

#[test]
fn numbers_are_given_once_and_the_energy_of_all_that_comes_and_goes_is_booked() {
    for scene in scenes() {
        let place = Workplace::of(&scene);
        let summary = json(&place.run(&["--record", "run.mcap", "--json"]));
        let steps = ids(&place.path("run.mcap"));
        assert_eq!(steps[0], (0..30).collect::<Vec<_>>());
        let mut next = 30;
        for pair in steps.windows(2) {
            let (before, after) = (&pair[0], &pair[1]);
            assert!(
                after.is_sorted() && after.iter().all(|id| *id >= next || before.contains(id)),
                "{before:?} {after:?}"
            );
            next = next.max(after.last().map_or(0, |last| last + 1));
        }
        // 120 came, and some went over the edge.
        let left = steps.last().unwrap().len();
        assert!(next == 150 && (60..145).contains(&left), "{next} {left}");
        assert_eq!(summary["nodes"]["particles"]["figures"]["particles"], left as f64);
        let imbalance = summary["imbalance"].as_object().unwrap();
        for (name, share) in imbalance {
            let bound = match name.as_str() {
                // The integrator's error.
                "particles" => 5e-3,
                // Power that changed by less than a tenth of its tolerance, 1e-6, in the last iteration is not booked again.
                "absorbed: optics to thermal" => 1e-9,
                _ => 1e-12,
            };
            assert!(share.as_f64().unwrap().abs() < bound, "{name}: {share}");
        }
        for node in ["particles", "thermal"] {
            assert!(summary["ledger"][node]["lost"]["removed"].as_f64().unwrap() != 0.0, "{node}");
        }
        assert!(summary["ledger"]["particles"]["gained"]["poured"].as_f64().unwrap() > 0.0);
    }
}

#[test]
fn jacobi_order_acceleration_and_slow_nodes_follow_who_comes_and_goes() {
    // Half of it, all of which pours.
    let place = Workplace::of(&scenes()[1].replace("duration = \"4 ms\"", "duration = \"2 ms\""));
    for settings in [
        &["--set", "coupling.order=jacobi"][..],
        &["--set", "coupling.acceleration=iqn-ils"],
        &["--set", "coupling.every.optics=3"],
        &["--set", "coupling.every.optics=3"],
        &["--set", "coupling.every.thermal=2"],
    ] {
        let whole = json(&place.run(&[settings, &["--record", "run.mcap", "--json"]].concat()));
        let one = json(&place.run(&[settings, &["--no-record", "--in-process", "--json"]].concat()));
        assert_eq!(one["hash"], whole["hash"], "{settings:?}");
        assert_eq!(verified(&place, "run.mcap")["hash"], whole["hash"], "{settings:?}");
        let rest = json(&place.run(&[settings, &["--resume", "run.mcap@60", "--no-record", "--json"]].concat()));
        assert_eq!(rest["hash"], whole["hash"], "{settings:?}");
    }
}

#[test]
fn killed_while_particles_are_poured_a_node_is_started_again_to_the_same_bits() {
    let scene = &scenes()[1];
    let place = Workplace::of(scene);
    let whole = json(&place.run(&["--record", "run.mcap", "--json"]));
    let numbers = ids(&place.path("run.mcap"));
    let bytes = std::fs::metadata(place.path("run.mcap")).unwrap().len();
    for kind in ["particles", "thermal", "optics"] {
        let place = Workplace::of(scene);
        let run = place.start(&["--record", "run.mcap", "--json"]);
        // A third of the run, of which three quarters pour.
        place.wait_for_file("run.mcap", bytes / 3);
        signal("KILL", place.node(kind));
        let output = run.wait_with_output().unwrap();
        let summary = json(&output);
        assert_eq!(summary["hash"], whole["hash"], "{kind}");
        assert_eq!(summary["ledger"], whole["ledger"], "{kind}");
        assert_eq!(summary["restarts"][0]["node"], kind, "{}", said(&output));
        verified(&place, "run.mcap");
        assert_eq!(ids(&place.path("run.mcap")), numbers, "{kind}");
        place.wait_until_empty();
    }
}
