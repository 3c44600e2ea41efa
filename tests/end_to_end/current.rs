//! A run with an electrical current: the same bits however it is run, and where its node dies.

use super::program::{Workplace, json, said, scenes, signal, stagger};

/// A tenth of a second of sintering.toml about the time the current is switched on, with the potential model, which has
/// equations to solve; a checkpoint every ten steps.
fn scene() -> Workplace {
    let text = std::fs::read_to_string(scenes().join("sintering.toml")).unwrap();
    let (before, after) = text.split_once("[current]").unwrap();
    let (_, after) = after.split_once("[coupling]").unwrap();
    let text = format!(
        "{}[current]\nstarts = 0.45\n[recovery]\ncheckpoint = 10\n[coupling]{after}",
        before
            .replace("[walls.lower]", "[walls.lower]\npotential = 0")
            .replace("[walls.upper]", "[walls.upper]\ncurrent = \"1 kA\"")
    );
    Workplace::of(&text.replace("duration = \"1 s\"", "duration = \"0.6 s\""))
}

#[test]
fn the_current_is_the_same_in_processes_threads_and_solved_again_and_after_its_node_died() {
    let place = scene();
    let recorded = place.path("many.mcap");
    let many = json(&place.run(&["--json", "--record", recorded.to_str().unwrap()]));
    let joule = many["ledger"]["current"]["lost"]["joule"].as_f64().unwrap();
    assert!(joule > 0.0 && many["imbalance"]["current"].as_f64().unwrap().abs() < 1e-9, "{}", many["imbalance"]);
    for arguments in [&["--in-process", "--threads", "1"][..], &["--in-process", "--threads", "2"], &["--threads", "2"]]
    {
        let other = json(&place.run(&[arguments, &["--json", "--no-record"]].concat()));
        assert_eq!(other["hash"], many["hash"], "{arguments:?}");
        assert_eq!(other["ledger"], many["ledger"], "{arguments:?}");
    }
    let verified = json(&stagger().args(["verify", "--json"]).arg(&recorded).output().unwrap());
    assert_eq!(verified["hash"], many["hash"]);

    let run = place.start(&["--record", "killed.mcap", "--json"]);
    place.wait_for_file("killed.mcap", std::fs::metadata(&recorded).unwrap().len() / 3);
    signal("KILL", place.node("current"));
    let output = run.wait_with_output().unwrap();
    let summary = json(&output);
    assert_eq!(summary["hash"], many["hash"]);
    assert_eq!(summary["restarts"][0]["node"], "current", "{}", said(&output));
    place.wait_until_empty();
}
