//! Recorded nodes in a run: the same bits where nothing else changed, and a word where they have no answer.

use serde_json::Value;

use super::program::{Workplace, json, laser_for, said, signal, stagger};

/// A place with a recorded run of the small scene, and its summary.
fn recorded(set: &[&str]) -> (Workplace, Value) {
    let place = Workplace::with("quick.toml");
    let arguments = set.iter().flat_map(|set| ["--set", set]);
    let summary =
        json(&place.run(&["--json", "--record", "run.mcap"].into_iter().chain(arguments).collect::<Vec<_>>()));
    (place, summary)
}

#[test]
fn a_run_with_recorded_nodes_has_the_bits_of_the_recorded_run() {
    for set in [&[][..], &["coupling.acceleration=iqn-ils", "coupling.every.thermal=3"]] {
        let (place, whole) = recorded(set);
        let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
        for nodes in [
            &["particles"][..],
            &["thermal"],
            &["optics"],
            &["particles", "optics"],
            &["particles", "optics", "thermal"],
        ] {
            for more in [&["--no-record"][..], &["--in-process", "--record", "again.mcap"]] {
                let replayed: Vec<String> = nodes.iter().map(|node| format!("{node}=run.mcap")).collect();
                let replayed = replayed.iter().flat_map(|node| ["--replayed", node]);
                let arguments: Vec<&str> = ["--json"].into_iter().chain(replayed).chain(more.iter().copied()).collect();
                let again = json(&place.run(&[arguments, set.clone()].concat()));
                for what in ["hash", "steps", "ledger", "imbalance"] {
                    assert_eq!(again[what], whole[what], "{what}, {nodes:?}, {more:?}");
                }
                for node in ["particles", "optics", "thermal"] {
                    assert_eq!(again["nodes"][node]["figures"], whole["nodes"][node]["figures"], "{node}");
                }
            }
        }
        // Such a run is recorded as any other, and says what answered.
        let told = json(&stagger().args(["info", "--json"]).arg(place.path("again.mcap")).output().unwrap());
        let from = place.path("run.mcap");
        assert_eq!(told["replayed"].as_object().unwrap().len(), 3);
        assert!(from.ends_with(told["replayed"]["optics"].as_str().unwrap()), "{told}");
        let verified = json(&stagger().args(["verify", "--json"]).arg(place.path("again.mcap")).output().unwrap());
        assert_eq!(verified["hash"], whole["hash"]);
        place.wait_until_empty();
    }
}

#[test]
fn one_physics_is_changed_against_the_others_as_they_were() {
    let (place, whole) = recorded(&[]);
    let others = ["--replayed", "particles=run.mcap", "--replayed", "optics=run.mcap"];
    let output = place.run(&[&["--json", "--record", "other.mcap", "--set", "thermal.phi=1"][..], &others].concat());
    let other = json(&output);
    assert!(said(&output).contains("note: run.mcap is of another scene or other --set values"), "{}", said(&output));
    let field = |summary: &Value, name: &str| {
        let fields = summary["fields"].as_array().unwrap();
        fields.iter().find(|field| field["field"] == name).unwrap()["hash"].clone()
    };
    assert_ne!(field(&other, "temperature"), field(&whole, "temperature"));
    assert_eq!(field(&other, "positions"), field(&whole, "positions"));
    for what in ["accepted", "rejected", "iterations", "time_s", "dt_min_s", "dt_max_s"] {
        assert_eq!(other["steps"][what], whole["steps"][what], "{what}");
    }
    // What was solved live can be verified.
    let output = stagger().args(["verify", "--node", "thermal"]).arg(place.path("other.mcap")).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn a_trial_that_was_never_recorded_is_told_with_what_to_do() {
    let (place, _) = recorded(&[]);
    let replayed = ["--no-record", "--replayed", "particles=run.mcap", "--replayed", "optics=run.mcap"];
    let thinned = ["--set", "record.level=accepted", "--record", "thinned.mcap"];
    json(&place.run(&[&["--json"][..], &thinned].concat()));
    for (more, expected) in [
        // More iterations.
        (
            &["--set", "coupling.default-tolerance=1e-13"][..],
            &["is needed, but was never recorded: `", "has not converged in step ", "Loosen coupling.tolerance"][..],
        ),
        // Another window: the last one is cut.
        (
            &["--set", "duration=\"0.95 ms\""],
            &[
                "node `",
                "replayed from run.mcap, which holds no `",
                "its window was 2e-5 s from t =",
                "keep the recorded duration",
            ],
        ),
        // More steps.
        (&["--set", "duration=\"2 ms\""], &["holds no `", "the recording ends after step 56", "shorten the duration"]),
    ] {
        let output = place.run(&[&replayed[..], more].concat());
        assert_eq!(output.status.code(), Some(1), "{more:?}: {}", said(&output));
        assert!(expected.iter().all(|part| said(&output).contains(part)), "{more:?}: {}", said(&output));
    }
    let output = place.run(&["--no-record", "--replayed", "particles=thinned.mcap"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("of step 1, attempt 1, iteration 1: fields of this iteration were left out"),
        "{}",
        said(&output)
    );
    place.wait_until_empty();
}

#[test]
fn what_cannot_be_replayed_is_told_before_anything_starts() {
    let (place, _) = recorded(&[]);
    json(&place.run(&["--json", "--record", "smaller.mcap", "--set", "coupling.dt.limit=\"10 us\""]));
    for (arguments, expected) in [
        (&["--replayed", "particle=run.mcap"][..], "has no node `particle`: it has optics, particles, thermal"),
        (&["--replayed", "particles=absent.mcap"], "--replayed particles=absent.mcap: cannot open"),
        (&["--replayed", "particles"], "expected KEY=VALUE"),
        (&["--replayed", "thermal=run.mcap", "--node", "thermal=mine"], "what runs `thermal` is said twice"),
        (&["--replayed", "thermal=run.mcap", "--replayed", "optics=smaller.mcap"], "took other steps or iterations"),
    ] {
        let output = place.run(&[arguments, &["--no-record"]].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(expected), "{arguments:?}: {}", said(&output));
    }
}

#[test]
fn recorded_nodes_go_on_from_a_checkpoint_and_back_to_one() {
    let quick = ["--set", "recovery.checkpoint=7"];
    let (place, whole) = recorded(&quick[1..]);
    let rest = ["--json", "--no-record", "--resume", "run.mcap@30", "--replayed", "particles=run.mcap"];
    assert_eq!(json(&place.run(&[&rest[..], &quick].concat()))["hash"], whole["hash"]);

    // A live node dies: the recorded ones go back with it.
    let place = Workplace::of(&format!("{}\n[recovery]\ncheckpoint = 10\n", laser_for("2.5 ms")));
    let whole = json(&place.run(&["--json", "--record", "run.mcap"]));
    let run = place.start(&["--json", "--record", "again.mcap", "--replayed", "particles=run.mcap"]);
    place.wait_for_file("again.mcap", 6_000_000);
    signal("KILL", place.node("thermal"));
    let again = json(&run.wait_with_output().unwrap());
    assert_eq!((&again["hash"], &again["restarts"][0]["node"]), (&whole["hash"], &"thermal".into()));
}
