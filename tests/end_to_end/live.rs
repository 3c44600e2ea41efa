//! Joining a run that goes on, as `stagger view` does.

use std::{collections::BTreeMap, path::Path, time::Duration};

use bytes::Bytes;
use stagger_messages::{Version, keys};
use stagger_recordings::{Recorder, RecorderOptions, Recording, RunInfo, Steps};
use stagger_runtime::{
    link::{
        Link, Role,
        endpoint::{socket, socket_folder},
    },
    run::view::follow,
};

use super::program::{Workplace, json};

/// A run of some seconds.
const SCENE: [&str; 4] = ["--set", "particles.count=300", "--json", "--record"];

/// The fields of every state in a recording that has fields of its own.
fn states(path: &Path) -> BTreeMap<Version, BTreeMap<String, Bytes>> {
    let mut steps = Steps::default();
    let messages = Recording::open(path).unwrap().messages().unwrap();
    let states = messages.filter_map(|message| steps.take(message.unwrap()).step).filter(|step| step.recorded);
    let bytes = states.map(|step| {
        let fields = step.fields.iter().map(|(name, field)| (name.clone(), field.values().bytes().clone()));
        (step.version, fields.collect())
    });
    bytes.collect()
}

/// The run that a process coordinates, by the folder of its socket.
fn run_of(pid: u32) -> String {
    let folders = std::fs::read_dir(std::env::temp_dir()).unwrap();
    let names = folders.filter_map(|entry| entry.unwrap().file_name().into_string().ok());
    let mut runs = names.filter_map(|name| name.strip_prefix("stagger-scene-").map(|rest| format!("scene-{rest}")));
    runs.find(|run| run.ends_with(&format!("-{pid}"))).unwrap()
}

#[test]
fn whoever_joins_late_sees_every_field_as_it_is_and_changes_nothing() {
    let place = Workplace::with("deposition-laser.toml");
    let [whole, late] = ["whole.mcap", "late.mcap"].map(|name| place.path(name));
    let alone = json(&place.run(&[&SCENE[..], &["alone.mcap"]].concat()));
    let run = place.start(&[&SCENE[..], &["whole.mcap"]].concat());
    place.wait_for_file("whole.mcap", 2_000_000);

    let name = run_of(run.id());
    let link = Link::open(&Role::Node { connect: socket(&socket_folder(&name)) }, None).unwrap();
    let about = link.query(&keys::manifest(&name, "coordinator"), Duration::from_secs(5)).unwrap();
    let info: RunInfo = serde_json::from_slice(&about[0].payload).unwrap();
    let file = std::fs::File::create(&late).unwrap();
    let options = RecorderOptions { joined: true, ..RecorderOptions::default() };
    let recorder = Recorder::create(file, &info, options).unwrap();
    let following = follow(&link, &name, recorder.sender(), || panic!("the file is full")).unwrap();
    let summary = json(&run.wait_with_output().unwrap());
    drop(following);
    recorder.finish().unwrap();

    assert_eq!(summary["hash"], alone["hash"]);
    let (whole, late) = (states(&whole), states(&late));
    assert!(late.len() > 100 && late.len() < whole.len(), "{} of {} states", late.len(), whole.len());
    // The first may lie between two states: the nodes answer while they iterate. It has every field all the same.
    let (_, first) = late.first_key_value().unwrap();
    assert!(first.keys().eq(whole.values().next().unwrap().keys()), "{:?}", first.keys());
    for (version, fields) in late.iter().skip(1) {
        let differs = fields.iter().find(|(name, bytes)| whole[version].get(*name) != Some(bytes));
        assert!(differs.is_none(), "{:?} at {version:?}", differs.map(|(name, _)| name));
    }
}
