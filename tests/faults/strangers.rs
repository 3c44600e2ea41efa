//! Who speaks in a run without being of it, and who hears it without taking it up: neither changes a bit, nor the recording.

use std::{
    path::Path,
    process::{Child, Command, Output, Stdio},
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use bytes::Bytes;
use prost::Message as _;
use serde_json::Value;
use stagger_messages::{
    Checkpoint, Directive, Envelope, Field, Report, SCHEMA_VERSION, Version, codec, directive, keys, report,
};
use stagger_recordings::{Body, Exchange, Recorder, RecorderOptions, Recording};
use stagger_runtime::link::{Declaration, Link, Publisher, Role};

use super::place::{Workplace, json, said, signal, stagger};

const KINDS: [&str; 3] = ["optics", "particles", "thermal"];
const RUN: &str = "open";
/// A version no run comes to.
const ABSURD: Version = Version { step: 1_000_000_000, attempt: 1, iteration: 1 };

/// A run whose socket everybody may use, on its way.
struct Open {
    place: Workplace,
    coordinator: Child,
    nodes: Vec<Child>,
}

fn endpoint(place: &Workplace) -> String {
    format!("unixsock-stream/{}", place.path("hub.sock").display())
}

impl Open {
    /// The coordinator is there; its nodes come with [`Open::begin`].
    fn listening(place: Workplace) -> Self {
        let mut coordinator = stagger();
        coordinator.arg("coordinator").arg(&place.scene).args(["--json", "--run", RUN, "--listen", &endpoint(&place)]);
        coordinator.arg("--record").arg(place.path("run.mcap"));
        let coordinator = coordinator.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        Self { place, coordinator, nodes: Vec::new() }
    }

    fn begin(&mut self) {
        for kind in KINDS {
            let mut node = stagger();
            node.args(["node", kind, "--run", RUN, "--connect", &endpoint(&self.place), "--scene"])
                .arg(&self.place.scene);
            self.nodes.push(node.stdin(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
        }
    }

    fn end(mut self) -> (Workplace, Output) {
        let output = self.coordinator.wait_with_output().unwrap();
        for node in &mut self.nodes {
            node.wait().unwrap();
        }
        (self.place, output)
    }
}

/// A session beside those of the run.
fn session(endpoint: &str) -> Link {
    let begun = Instant::now();
    loop {
        match Link::open(&Role::Node { connect: endpoint.into() }, None) {
            Ok(link) => return link,
            Err(error) => assert!(begun.elapsed() < Duration::from_secs(30), "{error}"),
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// What happened to a run that a stranger speaks in, beside the same run alone: nothing.
fn is_unharmed(place: &Workplace, output: &Output, expected: &Value) -> Value {
    let summary = json(output);
    assert_eq!(summary["hash"], expected["hash"]);
    assert_eq!(summary["recording"]["lost"], 0, "{}", said(output));
    let verified = stagger().arg("verify").arg(place.path("run.mcap")).output().unwrap();
    assert!(verified.status.success(), "{}{}", String::from_utf8_lossy(&verified.stdout), said(&verified));
    let info = stagger().args(["info", "--json"]).arg(place.path("run.mcap")).output().unwrap();
    assert_eq!(json(&info)["steps_accepted"], summary["steps"]["accepted"]);
    summary
}

/// The scene alone, recorded, and the first fields of each writer.
fn alone() -> (Workplace, Value, Vec<(String, Field)>) {
    let place = Workplace::with("quick.toml");
    let summary = json(&place.run(&["--json", "--record", "alone.mcap"]));
    let mut fields = Vec::new();
    for message in Recording::open(place.path("alone.mcap")).unwrap().messages().unwrap() {
        if let Body::Field(received) = message.unwrap().body
            && received.envelope.version == Some(Version::INITIAL)
        {
            fields.push((received.envelope.sender, received.field.unwrap()));
        }
    }
    assert!(fields.len() > 5);
    (place, summary, fields)
}

fn envelope(sender: &str, epoch: u32, version: Version) -> Envelope {
    Envelope {
        run: RUN.into(),
        schema: SCHEMA_VERSION,
        epoch,
        sender: sender.into(),
        version: Some(version),
        ..Envelope::default()
    }
}

/// The fields with other values, each with the publisher of its key.
fn forged(link: &Link, fields: &[(String, Field)]) -> Vec<(Publisher, String, Field)> {
    let publisher = |(sender, field): &(String, Field)| {
        let publisher = link.publisher(keys::field(RUN, sender, field.name())).unwrap();
        let values: Vec<u8> = field.values().bytes().iter().map(|byte| byte ^ 1).collect();
        let values = stagger_messages::Values::from_bytes(field.values().kind(), values.into());
        (
            publisher,
            sender.clone(),
            Field::with_support(Arc::clone(&field.port), field.support.clone(), values).unwrap(),
        )
    };
    fields.iter().map(publisher).collect()
}

fn put(forged: &[(Publisher, String, Field)], epoch: u32, version: Version) {
    for (publisher, sender, field) in forged {
        let header = codec::field_attachment(&envelope(sender, epoch, version), field, None);
        // A hub that has closed takes no more.
        let _ = publisher.put(Some(header), field.values().bytes().clone());
    }
}

/// Has `hear` called with each question of the run.
fn questions(link: &Link, hear: impl Fn(&Directive, Version) + Send + Sync + 'static) -> Declaration {
    let heard = link.subscribe(&keys::directive(RUN), move |arrival| {
        let directive: Directive = codec::decode("directive", &arrival.payload).unwrap_or_default();
        if let (Some(directive::Task::Iterate(_)), Some(envelope)) = (&directive.task, &directive.envelope) {
            hear(&directive, envelope.version.unwrap_or_default());
        }
    });
    heard.unwrap()
}

#[test]
fn fields_of_an_epoch_or_of_a_version_to_come_are_neither_used_nor_recorded() {
    let (place, expected, fields) = alone();
    let mut run = Open::listening(place);
    let link = session(&endpoint(&run.place));
    let forged = forged(&link, &fields);
    let asked = Arc::new(Mutex::new(None));
    let heard = Arc::clone(&asked);
    let _questions = questions(&link, move |_, version| *heard.lock().unwrap() = Some(version));
    let over = AtomicBool::new(false);
    let (place, output) = std::thread::scope(|scope| {
        // Before the nodes have begun, in their start, and all the way.
        let (over_now, asked) = (&over, &asked);
        scope.spawn(move || {
            while !over_now.load(Ordering::Relaxed) {
                put(&forged, 1, ABSURD);
                put(&forged, 99, ABSURD);
                if let Some(version) = *asked.lock().unwrap() {
                    put(&forged, 99, version);
                    put(&forged, 99, Version::first(version.step + 1));
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        run.begin();
        let ended = run.end();
        over.store(true, Ordering::Relaxed);
        ended
    });
    let summary = is_unharmed(&place, &output, &expected);
    assert!(summary["refused"].as_u64().unwrap() > 0, "they came, and were refused");
}

#[test]
fn what_the_coordinator_said_before_may_be_repeated() {
    let (place, expected, _) = alone();
    let mut run = Open::listening(place);
    let link = session(&endpoint(&run.place));
    let (repeat, repeated) = std::sync::mpsc::channel::<Bytes>();
    let said = Mutex::new(Vec::<Bytes>::new());
    let _directives = link
        .subscribe(&keys::directive(RUN), move |arrival| {
            let mut said = said.lock().unwrap();
            if said.contains(&arrival.payload) {
                return;
            }
            // The one before, the one before that, and the plan.
            let again = said.iter().rev().take(2).chain(said.first()).cloned();
            again.for_each(|message| drop(repeat.send(message)));
            said.push(arrival.payload);
        })
        .unwrap();
    let publisher = link.publisher(keys::directive(RUN)).unwrap();
    std::thread::spawn(move || repeated.into_iter().for_each(|message| drop(publisher.put(None, message))));
    run.begin();
    let (place, output) = run.end();
    let summary = is_unharmed(&place, &output, &expected);
    assert!(summary["refused"].as_u64().unwrap() > 0, "they came, and were refused");
}

#[test]
fn a_forged_number_is_no_gap() {
    let (place, expected, _) = alone();
    let mut run = Open::listening(place);
    let link = session(&endpoint(&run.place));
    let (tell, told) = std::sync::mpsc::channel();
    let _questions = questions(&link, move |directive, version| drop(tell.send((directive.clone(), version))));
    let publishers = KINDS.map(|kind| link.publisher(keys::report(RUN, kind)).unwrap());
    std::thread::spawn(move || {
        for (number, (_, version)) in told.into_iter().enumerate() {
            for (kind, publisher) in KINDS.into_iter().zip(&publishers) {
                let sequence = [u64::MAX, 1_000_000_000, u64::MAX - 1][number % 3];
                // A trial that is over: the coordinator has no use for it.
                let about = Version::first(version.step.saturating_sub(1));
                let envelope = Envelope { sequence, ..envelope(kind, 1, about) };
                let body = Some(report::Body::Ready(stagger_messages::Ready::default()));
                let _ = publisher.put(None, Report { envelope: Some(envelope), body }.encode_to_vec().into());
            }
        }
    });
    run.begin();
    let (place, output) = run.end();
    is_unharmed(&place, &output, &expected);
}

/// Tells this program that it is to hear a run, and where.
const READER: &str = "STAGGER_TEST_READER";

/// Not a test but a reader, where one was started.
#[test]
fn as_a_reader() {
    let Ok(endpoint) = std::env::var(READER) else { return };
    let link = session(&endpoint);
    let _heard = link.subscribe(&keys::all(RUN), |_| {}).unwrap();
    std::fs::write(Path::new(endpoint.trim_start_matches("unixsock-stream")).with_file_name("hears"), "").unwrap();
    std::thread::sleep(Duration::from_secs(120));
}

#[test]
fn a_reader_that_is_stopped_does_not_harm_the_run() {
    let (place, expected, _) = alone();
    let mut run = Open::listening(place);
    let mut reader = Command::new(std::env::current_exe().unwrap());
    reader.args(["--exact", "strangers::as_a_reader", "--nocapture"]).env(READER, endpoint(&run.place));
    let mut reader = reader.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while !run.place.path("hears").exists() {
        assert!(begun.elapsed() < Duration::from_secs(30));
        std::thread::sleep(Duration::from_millis(5));
    }
    signal("STOP", reader.id());
    let begun = Instant::now();
    run.begin();
    let (place, output) = run.end();
    let took = begun.elapsed();
    reader.kill().unwrap();
    reader.wait().unwrap();
    is_unharmed(&place, &output, &expected);
    // The lease is 5 s, after which nobody waits for it; a session that does not close gives up after 10 s.
    assert!(took < Duration::from_secs(30), "{took:?}");
}

/// A recording as it was, but for its checkpoints.
fn with_other_checkpoints(place: &Workplace, name: &str, change: impl Fn(&mut Checkpoint)) -> String {
    let recording = Recording::open(place.path("run.mcap")).unwrap();
    let file = std::fs::File::create(place.path(name)).unwrap();
    let options = RecorderOptions { joined: true, ..RecorderOptions::default() };
    let recorder = Recorder::create(file, &recording.info, options).unwrap();
    for message in recording.messages().unwrap() {
        let mut message = message.unwrap();
        if let Body::Checkpoint(checkpoint) = &mut message.body {
            change(checkpoint);
        }
        let (attachment, payload) = message.parts();
        recorder.sender().push(Exchange::from_parts(&message.topic, attachment, payload).unwrap()).unwrap();
    }
    recorder.finish().unwrap();
    name.into()
}

#[test]
fn a_checkpoint_that_contradicts_itself_is_refused_in_words() {
    let place = Workplace::with("quick.toml");
    let sets = ["--set", "recovery.checkpoint=20", "--json"];
    let expected = json(&place.run(&[&sets[..], &["--record", "run.mcap"]].concat()));
    let resume = |file: &str| place.run(&[&sets[..], &["--no-record", "--resume", file]].concat());
    let same = with_other_checkpoints(&place, "same.mcap", |_| {});
    assert_eq!(json(&resume(&same))["hash"], expected["hash"], "the copy is as good as the recording");
    let step = with_other_checkpoints(&place, "step.mcap", |checkpoint| {
        let version = checkpoint.envelope.as_mut().unwrap().version.as_mut().unwrap();
        version.step = 1_000_000;
    });
    let attempt = with_other_checkpoints(&place, "attempt.mcap", |checkpoint| {
        checkpoint.nodes[1].committed.as_mut().unwrap().attempt = u32::MAX;
    });
    let all = with_other_checkpoints(&place, "all.mcap", |checkpoint| {
        // All agree, but for the step control.
        let more = |version: &mut Option<Version>| version.as_mut().unwrap().step += 7;
        more(&mut checkpoint.envelope.as_mut().unwrap().version);
        checkpoint.nodes.iter_mut().for_each(|node| more(&mut node.envelope.as_mut().unwrap().version));
    });
    for (file, word) in [(step, "contradicts itself"), (attempt, "had committed"), (all, "the step control in it")] {
        let begun = Instant::now();
        let output = resume(&file);
        assert!(!output.status.success() && said(&output).contains(word), "{file}: {}", said(&output));
        assert!(begun.elapsed() < Duration::from_secs(20), "{file}: {:?}", begun.elapsed());
    }
}
