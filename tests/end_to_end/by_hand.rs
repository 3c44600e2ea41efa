//! Nodes started by hand, over TCP, and a recording published again.

use std::{
    process::Stdio,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use serde_json::Value;
use stagger_messages::keys;
use stagger_runtime::link::{Link, Role};

use super::program::{Workplace, json, said, stagger};

/// An address whose port is free now.
pub fn free_address() -> String {
    std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}

fn endpoint() -> String {
    format!("tcp/{}", free_address())
}

/// The summary of a coordinator and some nodes, each started on its own.
fn by_hand(place: &Workplace, kinds: &[&str], more: &[&str]) -> Value {
    let listen = endpoint();
    let mut coordinator = stagger();
    coordinator.arg("coordinator").arg(&place.scene).args(["--listen", &listen, "--no-record", "--json"]).args(more);
    let coordinator = coordinator.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut coordinator = coordinator.unwrap();
    // It says the run's name, as a user would read it.
    let mut line = String::new();
    let mut said = std::io::BufReader::new(coordinator.stderr.take().unwrap());
    std::io::BufRead::read_line(&mut said, &mut line).unwrap();
    let run = line.split_whitespace().skip_while(|word| *word != "run").nth(1).unwrap().to_owned();
    let awaited = line.trim_end().rsplit_once(" for ").unwrap().1;
    assert!(kinds.iter().all(|kind| awaited.contains(kind)) && awaited.split(", ").count() == kinds.len(), "{line}");
    let nodes: Vec<_> = kinds
        .iter()
        .map(|kind| {
            let mut node = stagger();
            node.args(["node", kind, "--run", &run, "--connect", &listen, "--scene"]).arg(&place.scene);
            node.stdin(Stdio::null()).spawn().unwrap()
        })
        .collect();
    let output = coordinator.wait_with_output().unwrap();
    for mut node in nodes {
        assert!(node.wait().unwrap().success());
    }
    json(&output)
}

#[test]
fn nodes_started_by_hand_give_the_same_hash_also_among_recorded_ones() {
    let place = Workplace::with("quick.toml");
    let recorded = place.path("run.mcap");
    let alone = json(&place.run(&["--json", "--record", recorded.to_str().unwrap()]));
    assert_eq!(by_hand(&place, &["optics", "thermal", "particles"], &[])["hash"], alone["hash"]);
    let [optics, particles] = ["optics", "particles"].map(|node| format!("{node}={}", recorded.display()));
    let again = by_hand(&place, &["thermal"], &["--replayed", &optics, "--replayed", &particles]);
    assert_eq!((&again["hash"], &again["steps"]), (&alone["hash"], &alone["steps"]));
}

#[test]
fn a_node_of_another_scene_is_refused() {
    let place = Workplace::with("quick.toml");
    let node = format!(
        "{} node thermal --child --run $STAGGER_RUN --connect $STAGGER_CONNECT --scene {} --set seed=8",
        env!("CARGO_BIN_EXE_stagger"),
        place.scene.display()
    );
    let script = place.path("node.sh");
    std::fs::write(&script, node).unwrap();
    let output = place.run(&["--no-record", "--node", &format!("thermal=sh {}", script.display())]);
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("`thermal` does not belong to this run: it was started with another scene"));
    place.wait_until_empty();
}

#[test]
fn a_replay_publishes_every_message_on_the_keys_of_its_run() {
    let place = Workplace::with("quick.toml");
    let recorded = place.path("run.mcap");
    let summary = json(&place.run(&["--json", "--record", recorded.to_str().unwrap()]));
    let listen = endpoint();
    let mut replay = stagger();
    replay.args(["replay", "--speed", "inf", "--listen", &listen]).arg(&recorded);
    let replay = replay.stdout(Stdio::piped()).spawn().unwrap();
    let heard = Arc::new(AtomicU64::new(0));
    let link = Link::open(&Role::Node { connect: listen }, None).unwrap();
    let count = Arc::clone(&heard);
    let subscription = link.subscribe(&keys::all(summary["run"].as_str().unwrap()), move |_| {
        count.fetch_add(1, Ordering::Relaxed);
    });
    let output = replay.wait_with_output().unwrap();
    drop(subscription);
    assert!(output.status.success());
    let messages = summary["recording"]["messages"].as_u64().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), format!("replayed {messages} messages"));
    assert_eq!(heard.load(Ordering::Relaxed), messages);
}

#[cfg(not(feature = "quic"))]
#[test]
fn a_program_without_quic_says_how_to_get_it() {
    let place = Workplace::with("quick.toml");
    let mut command = stagger();
    command.arg("coordinator").arg(&place.scene).args(["--run", "guarded", "--listen", "quic/localhost:7447"]);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("`cargo build --release --features quic`"), "{}", said(&output));
}
