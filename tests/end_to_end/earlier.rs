//! A recording of an earlier program is read, verified, reported and gone on with by this one.

use std::path::{Path, PathBuf};

use crate::program::{Workplace, stagger};

/// The hash of its final fields, as the program that wrote it said.
const HASH: &str = "3f12a31b97fcbc1b";

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/end_to_end/fixtures").join(name)
}

fn json(arguments: &[&str]) -> serde_json::Value {
    let output = stagger().args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_recording_of_an_earlier_program_is_read_verified_and_reported() {
    let recording = fixture("recorded.mcap");
    let recording = recording.to_str().unwrap();
    let info = json(&["info", recording, "--json"]);
    assert_eq!((&info["steps_accepted"], &info["complete"]), (&10.into(), &true.into()));
    let verified = json(&["verify", recording, "--json"]);
    assert!(verified["difference"].is_null(), "{verified}");
    assert_eq!(verified["hash"], HASH);
    assert_eq!(verified["trials"].as_object().unwrap().len(), 3);
    let place = tempfile::tempdir().unwrap();
    for arguments in [vec!["report", recording, "--out", "page.html"], vec!["export", recording, "--out", "series"]] {
        let output = stagger().args(&arguments).current_dir(place.path()).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn a_recording_of_an_earlier_program_is_gone_on_with() {
    let place = Workplace::of(&std::fs::read_to_string(fixture("recorded.toml")).unwrap());
    let recording = fixture("recorded.mcap");
    let output = place.run(&["--json", "--no-record", "--resume", &format!("{}@5", recording.display())]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["hash"], HASH);
}
