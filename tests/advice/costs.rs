//! Only what a scene needs: a physics that is not named has no process, no key and no message, and what nobody reads is not
//! sent.

use std::{path::Path, process::Command};

use serde_json::Value;

fn call(arguments: &[&str], folder: &Path) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_stagger")).args(arguments).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn scene(name: &str) -> String {
    format!("{}/../../scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_physics_that_is_not_named_has_no_process_no_topic_and_no_message() {
    let folder = tempfile::tempdir().unwrap();
    let run = call(&["run", &scene("falling-powder"), "--record", "r.mcap", "--json"], folder.path());
    let nodes: Vec<&String> = run["nodes"].as_object().unwrap().keys().collect();
    assert_eq!(nodes, ["particles"]);
    let info = call(&["info", "r.mcap", "--json"], folder.path());
    let topics = info["topics"].as_object().unwrap();
    assert!(topics.keys().any(|topic| topic.starts_with("field/particles/")));
    for absent in ["thermal", "optics", "current", "substrate", "acoustics"] {
        assert!(!topics.keys().any(|topic| topic.contains(absent)), "{absent} in {topics:?}");
    }
}

#[test]
fn fields_that_nobody_reads_are_not_sent() {
    let folder = tempfile::tempdir().unwrap();
    for mode in [&[][..], &["--in-process"]] {
        let exchanged = |name: &str, more: &[&str]| {
            let scene = scene(name);
            let run = call(&[&["run", &scene, "--json"], more, mode].concat(), folder.path());
            let of = |node: &str, what: &str| run["nodes"][node][what].as_u64();
            let [particles, optics] = ["particles", "optics"].map(|node| [of(node, "exchanges"), of(node, "bytes")]);
            (particles, optics, run["hash"].clone(), run["steps"]["iterations"].as_u64().unwrap())
        };
        // Alone, nobody reads the particles: nothing is sent, and everything where a recorder listens.
        let (alone, _, hash, iterations) = exchanged("falling-powder", &["--no-record"]);
        assert_eq!(alone, [Some(0), Some(0)]);
        let (heard, _, same, _) = exchanged("falling-powder", &["--record", "r.mcap", "--overwrite"]);
        assert!(heard[0] >= Some(iterations), "{heard:?} in {iterations} iterations");
        assert_eq!(hash, same);
        // Of five fields the laser writes, one is read: absorbed_power.
        let (_, optics, hash, iterations) = exchanged("quick", &["--no-record"]);
        assert_eq!(optics[0], Some(iterations));
        let (_, recorded, same, _) = exchanged("quick", &["--record", "r.mcap", "--overwrite"]);
        assert_eq!(recorded[0], Some(4 * iterations));
        assert_eq!(hash, same);
    }
}
