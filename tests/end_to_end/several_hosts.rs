//! Several hosts, as far as one can show it on one: through a router, and among strangers.

use std::{
    path::Path,
    process::{Child, Command, Output, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use prost::Message as _;
use stagger_messages::{
    Directive, Envelope, Failure, Field, Iterate, Measure, Port, Report, SCHEMA_VERSION, Stop, Version, codec,
    directive, keys, report,
};
use stagger_runtime::link::{Link, Role, Sample};

use super::{
    by_hand::free_address,
    program::{Workplace, json, laser_for, said, signal, stagger},
};

pub const KINDS: [&str; 3] = ["optics", "particles", "thermal"];

/// A process that does not outlive its test.
pub struct Process(Option<Child>);

impl Process {
    fn start(command: &mut Command) -> Self {
        let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(Some(command.spawn().unwrap()))
    }

    fn id(&self) -> u32 {
        self.0.as_ref().unwrap().id()
    }

    pub fn end(mut self) -> Output {
        self.0.take().unwrap().wait_with_output().unwrap()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn configured(mut command: Command, config: Option<&Path>) -> Process {
    if let Some(config) = config {
        command.arg("--config").arg(config);
    }
    Process::start(&mut command)
}

pub fn coordinator(place: &Workplace, run: &str, arguments: &[&str], config: Option<&Path>) -> Process {
    let mut command = stagger();
    command.arg("coordinator").arg(&place.scene).args(["--json", "--run", run]).args(arguments);
    configured(command, config)
}

pub fn node(place: &Workplace, kind: &str, run: &str, connect: &str, config: Option<&Path>) -> Process {
    let mut command = stagger();
    command.args(["node", kind, "--child", "--run", run, "--connect", connect, "--scene"]).arg(&place.scene);
    configured(command, config)
}

pub fn router(listen: &str, config: Option<&Path>) -> Process {
    let mut command = stagger();
    command.args(["router", "--child", "--listen", listen]);
    configured(command, config)
}

pub fn hash_alone(place: &Workplace) -> serde_json::Value {
    json(&place.run(&["--json", "--no-record"]))["hash"].clone()
}

/// The summary of a run that must have ended well for everybody.
pub fn ended_well(coordinator: &Output, nodes: impl IntoIterator<Item = Process>) -> serde_json::Value {
    let outputs: Vec<_> = nodes.into_iter().map(Process::end).collect();
    let all = || outputs.iter().map(said).chain([said(coordinator)]).collect::<String>();
    assert!(coordinator.status.success() && outputs.iter().all(|output| output.status.success()), "{}", all());
    json(coordinator)
}

pub fn envelope(run: &str, sender: &str) -> Envelope {
    Envelope {
        run: run.into(),
        schema: SCHEMA_VERSION,
        epoch: 1,
        sender: sender.into(),
        version: Some(Version::first(1)),
        ..Envelope::default()
    }
}

pub fn stop(envelope: Envelope) -> Vec<u8> {
    let task = directive::Task::Stop(Stop { completed: false, reason: "forged".into() });
    Directive { envelope: Some(envelope), task: Some(task), ..Directive::default() }.encode_to_vec()
}

pub fn failure(envelope: Envelope) -> Vec<u8> {
    let body = report::Body::Failure(Failure { message: "forged".into(), retry: false });
    Report { envelope: Some(envelope), body: Some(body) }.encode_to_vec()
}

#[test]
fn a_run_through_a_router_has_the_same_hash() {
    let place = Workplace::with("quick.toml");
    let endpoint = format!("tcp/{}", free_address());
    let router = router(&endpoint, None);
    // Some before the coordinator, one after it.
    let mut nodes: Vec<_> = KINDS[..2].iter().map(|kind| node(&place, kind, "routed", &endpoint, None)).collect();
    let coordinator = coordinator(&place, "routed", &["--connect", &endpoint, "--no-record"], None);
    nodes.push(node(&place, KINDS[2], "routed", &endpoint, None));
    let summary = ended_well(&coordinator.end(), nodes);
    assert_eq!(summary["hash"], hash_alone(&place));
    assert_eq!(summary["refused"], 0);
    // Its standard input closes.
    let output = router.end();
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn behind_a_router_a_node_may_be_killed_and_started_again_and_a_name_is_given_once() {
    let place = Workplace::of(&format!("{}\n[recovery]\ncheckpoint = 10\n", laser_for("2 ms")));
    let alone = json(&place.run(&["--no-record", "--json"]));
    let endpoint = format!("tcp/{}", free_address());
    let _router = router(&endpoint, None);
    let recording = place.path("run.mcap");
    let arguments = ["--connect", &endpoint, "--record", recording.to_str().unwrap()];
    let first = coordinator(&place, "routed", &arguments, None);
    let nodes = KINDS.map(|kind| node(&place, kind, "routed", &endpoint, None));
    place.wait_for_file("run.mcap", 2_000_000);
    let second = coordinator(&place, "routed", &["--connect", &endpoint, "--no-record"], None).end();
    assert_eq!(second.status.code(), Some(1), "{}", said(&second));
    assert!(said(&second).contains("run `routed` has a coordinator already"), "{}", said(&second));
    signal("KILL", nodes[2].id());
    let _again = node(&place, "thermal", "routed", &endpoint, None);
    let output = first.end();
    let summary = json(&output);
    assert!(said(&output).contains("node `thermal` is gone"), "{}", said(&output));
    assert_eq!(summary["restarts"][0]["node"], "thermal");
    assert_eq!(summary["hash"], alone["hash"]);
}

#[test]
fn nodes_of_a_coordinator_behind_a_router_end_with_it() {
    let place = Workplace::with("deposition-laser.toml");
    let endpoint = format!("tcp/{}", free_address());
    let _router = router(&endpoint, None);
    let recording = place.path("run.mcap");
    let coordinator =
        coordinator(&place, "routed", &["--connect", &endpoint, "--record", recording.to_str().unwrap()], None);
    let nodes = KINDS.map(|kind| node(&place, kind, "routed", &endpoint, None));
    place.wait_for_file("run.mcap", 2_000_000);
    signal("KILL", coordinator.id());
    let begun = Instant::now();
    for node in nodes {
        let output = node.end();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains("the coordinator is gone"), "{}", said(&output));
    }
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
}

/// The ways in which a message can be not of this run: from an epoch that is over, of a run or schemas not ours.
fn wrong(run: &str, sender: &str) -> [Envelope; 3] {
    let right = envelope(run, sender);
    [
        Envelope { epoch: 0, ..right.clone() },
        Envelope { run: "elsewhere".into(), ..right.clone() },
        Envelope { schema: SCHEMA_VERSION + 1, ..right },
    ]
}

#[test]
fn on_an_open_run_old_foreign_and_malformed_messages_change_nothing_and_are_counted() {
    const ROUNDS: u64 = 10;
    let place = Workplace::with("quick.toml");
    let endpoint = format!("tcp/{}", free_address());
    let recording = place.path("run.mcap");
    let arguments = ["--listen", &endpoint, "--record", recording.to_str().unwrap()];
    let coordinator = coordinator(&place, "open", &arguments, None);
    let link = Link::open(&Role::Node { connect: endpoint.clone() }, None).unwrap();
    let (begin, begun) = std::sync::mpsc::channel();
    let _directives = link.subscribe(&keys::directive("open"), move |Sample { payload, .. }| {
        let directive: Directive = codec::decode("directive", &payload).unwrap_or_default();
        if let Some(directive::Task::Iterate(Iterate { .. })) = directive.task {
            let _ = begin.send(());
        }
    });
    let nodes: Vec<_> = KINDS.map(|kind| node(&place, kind, "open", &endpoint, None)).into();
    begun.recv_timeout(Duration::from_secs(20)).unwrap();

    let noise = vec![0xff; 40];
    let port = Arc::new(Port::f64("radii", "m", "particles", 1, Measure::None));
    let radii = Field::new(&port, 0, vec![0.0; 100]).unwrap();
    let values = radii.values().bytes();
    let directives: Vec<_> =
        wrong("open", "coordinator").map(stop).into_iter().chain([noise.clone(), vec![]]).collect();
    let reports: Vec<_> = wrong("open", "thermal")
        .into_iter()
        .chain([envelope("open", "stranger")])
        .map(failure)
        .chain([noise.clone(), vec![]])
        .collect();
    let headers: Vec<_> = wrong("open", "particles").map(|wrong| codec::field_attachment(&wrong, &radii, None)).into();
    let right = codec::field_attachment(&envelope("open", "particles"), &radii, None);
    let mut fields: Vec<_> =
        headers.into_iter().chain([noise, vec![]]).map(|header| (header, values.clone())).collect();
    // A field that is cut short.
    fields.push((right, values.slice(..80)));
    let publisher = |key| link.publisher(key).unwrap();
    let directive = publisher(keys::directive("open"));
    let report = publisher(keys::report("open", "thermal"));
    let field = publisher(keys::field("open", "particles", "radii"));
    let manifest = publisher(keys::manifest("open", "thermal"));
    for _ in 0..ROUNDS {
        // Nobody listens here but the recording.
        manifest.put(None, vec![0xff; 40].into()).unwrap();
        for message in &directives {
            directive.put(None, message.clone().into()).unwrap();
        }
        for message in &reports {
            report.put(None, message.clone().into()).unwrap();
        }
        for (header, values) in &fields {
            field.put(Some(header.clone()), values.clone()).unwrap();
        }
    }

    let summary = ended_well(&coordinator.end(), nodes);
    assert_eq!(summary["hash"], hash_alone(&place));
    let [directives, reports, fields] = [directives.len(), reports.len(), fields.len()].map(|n| ROUNDS * n as u64);
    let refused = |node: &str| summary["nodes"][node]["refused"].as_u64().unwrap();
    assert_eq!(refused("particles"), directives, "it does not read radii");
    assert_eq!(refused("thermal"), directives + fields);
    assert_eq!(refused("optics"), directives + fields);
    assert_eq!(summary["refused"], 3 * directives + 2 * fields + reports);
    let verified = stagger().arg("verify").arg(&recording).output().unwrap();
    // Nothing of all this is in the recording, and none of it counts as lost.
    assert!(verified.status.success(), "{}{}", String::from_utf8_lossy(&verified.stdout), said(&verified));
}
