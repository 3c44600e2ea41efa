//! What is written can be read: whole, cut off anywhere, thinned; and a disk that fails says so.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail as the tests themselves do")]

mod synthetic;

use std::{
    collections::BTreeMap,
    io::{self, Write},
    sync::{Arc, Mutex},
    thread,
    time::{Duration, Instant},
};

use bytes::Bytes;
use stagger_messages::{Verdict, Version, codec};
use stagger_recordings::{
    Body, End, Exchange, Level, Message, Recorded, Recorder, RecorderOptions, Recording, RecordingError, Replies,
    Reply, Step, Steps, Summary, messages_from,
};
use synthetic::{ITERATIONS, Script, exchanges, info};

const SMALL: Script = Script { particles: 12, steps: 55, dt_s: 1e-4 };
/// About 25 MB.
const LARGE: Script = Script { particles: 2000, steps: 60, dt_s: 1e-4 };

/// A file in memory that can be looked at while it is written.
#[derive(Clone, Default)]
struct Shared(Arc<Mutex<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn record(exchanges: &[Exchange], options: RecorderOptions) -> (Vec<u8>, Recorded) {
    let file = Shared::default();
    let recorder = Recorder::create(file.clone(), &info(), options).unwrap();
    let sender = recorder.sender();
    exchanges.iter().for_each(|exchange| sender.push(exchange.clone()).unwrap());
    let recorded = recorder.finish().unwrap();
    let bytes = file.0.lock().unwrap().clone();
    (bytes, recorded)
}

fn thinned(every: u64) -> RecorderOptions {
    RecorderOptions { level: Level::Accepted, every, ..RecorderOptions::default() }
}

fn read(bytes: &[u8]) -> Vec<Message> {
    messages_from(bytes).unwrap().map(Result::unwrap).collect()
}

/// Topic and content of a message, for comparing.
fn print(message: &Message) -> String {
    format!("{} {} {:?}", message.topic, message.log_time_ns, message.body)
}

fn steps(messages: Vec<Message>) -> Vec<Step> {
    let mut steps = Steps::default();
    let mut reached: Vec<Step> = messages.into_iter().filter_map(|message| steps.take(message).step).collect();
    reached.extend(steps.end());
    reached
}

#[test]
fn every_exchange_comes_back_bit_for_bit_and_in_order() {
    let sent = exchanges(SMALL);
    let (bytes, recorded) = record(&sent, RecorderOptions::default());
    let messages = read(&bytes);
    assert_eq!(messages.len(), sent.len());
    assert_eq!(recorded.messages, sent.len() as u64);
    assert_eq!((recorded.lost, recorded.refused, recorded.file_bytes), (0, 0, bytes.len() as u64));
    for (exchange, message) in sent.iter().zip(&messages) {
        match (exchange, &message.body) {
            (Exchange::Field { topic, attachment, payload }, Body::Field(received)) => {
                let expected = codec::decode_field(attachment, payload.clone()).unwrap();
                assert_eq!((topic, &expected.envelope), (&message.topic, &received.envelope));
                assert_eq!(expected.same_as, received.same_as);
                assert_eq!(expected.field, received.field);
            }
            (Exchange::Control { topic, .. }, Body::Directive(_) | Body::Report(_) | Body::Manifest(_)) => {
                assert_eq!(topic, &message.topic);
            }
            (exchange, body) => panic!("{exchange:?} came back as {body:?}"),
        }
    }
    assert!(messages.is_sorted_by_key(|message| message.log_time_ns), "log_time went backwards");
    // The last window starts at 54 steps of 100 us, and its decision names the end of it.
    assert_eq!(messages.last().unwrap().log_time_ns, 5_500_000);
    let mut stream = messages_from(bytes.as_slice()).unwrap();
    assert_eq!(stream.info, info());
    assert!(stream.by_ref().all(|message| message.is_ok()) && stream.complete());
}

#[test]
fn a_file_cut_anywhere_reads_as_a_beginning_of_the_whole() {
    let script = Script { particles: 40, steps: 30, dt_s: 1e-4 };
    let (bytes, _) = record(&exchanges(script), RecorderOptions::default());
    let whole: Vec<String> = read(&bytes).iter().map(print).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let mut most = 0;
    // Every length of the head and of the tail, and lengths without a common factor with anything in between.
    let lengths = (0..3000).chain((3000..bytes.len()).step_by(997)).chain(bytes.len() - 400..=bytes.len());
    for length in lengths {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let recording = match Recording::open(&path) {
            Ok(recording) => recording,
            // Before the run's description there is nothing to read, and the error says so.
            Err(RecordingError::NoRun(_)) if length < 3000 => continue,
            Err(error) => panic!("cut at {length}: {error}"),
        };
        assert_eq!(recording.complete, length == bytes.len(), "cut at {length}");
        let read: Vec<String> = recording.messages().unwrap().map(|message| print(&message.unwrap())).collect();
        assert!(read.len() <= whole.len() && read[..] == whole[..read.len()], "cut at {length}");
        most = most.max(read.len());
        assert!(Summary::of(&recording).is_ok(), "cut at {length}");
    }
    assert_eq!(most, whole.len());
}

#[test]
fn a_killed_run_leaves_what_was_pushed_a_second_ago() {
    let sent = exchanges(SMALL);
    let file = Shared::default();
    let recorder = Recorder::create(file.clone(), &info(), RecorderOptions::default()).unwrap();
    let sender = recorder.sender();
    sent.iter().for_each(|exchange| sender.push(exchange.clone()).unwrap());
    // Nothing more is pushed: the recorder must flush by itself. Twice the promised second, for a busy machine.
    let patience = Instant::now() + Duration::from_secs(2);
    while Instant::now() < patience {
        thread::sleep(Duration::from_millis(20));
        let so_far = file.0.lock().unwrap().clone();
        if read(&so_far).len() == sent.len() {
            return;
        }
    }
    panic!("{} of {} messages after two seconds", read(&file.0.lock().unwrap()).len(), sent.len());
}

#[test]
fn damage_inside_a_file_is_an_error_or_loses_nothing_but_never_a_panic() {
    let (bytes, _) = record(&exchanges(Script { particles: 3, steps: 4, dt_s: 1e-4 }), RecorderOptions::default());
    for at in (0..bytes.len()).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0xff;
        if let Ok(messages) = messages_from(damaged.as_slice()) {
            messages.for_each(drop);
        }
    }
    assert!(matches!(messages_from(&b"PK\x03\x04 no recording"[..]), Err(RecordingError::NotMcap)));
}

#[test]
fn accepted_only_holds_each_accepted_field_once_and_all_control() {
    let sent = exchanges(SMALL);
    let (all, _) = record(&sent, RecorderOptions::default());
    let (accepted, _) = record(&sent, thinned(1));
    let (all, accepted) = (read(&all), read(&accepted));
    let control = |messages: &[Message]| messages.iter().filter(|m| !matches!(m.body, Body::Field(_))).count();
    assert_eq!(control(&all), control(&accepted));
    let positions = accepted.iter().filter(|message| message.topic == "field/particles/positions");
    let versions: Vec<Version> = positions
        .map(|message| match &message.body {
            Body::Field(received) => received.envelope.version.unwrap(),
            body => panic!("{body:?}"),
        })
        .collect();
    assert_eq!(versions.len() as u64, SMALL.steps + 1);
    // Step 25 was rejected once: its second attempt is the one that counts.
    assert_eq!(versions[25], Version { step: 25, attempt: 2, iteration: ITERATIONS });
    assert!(accepted.is_sorted_by_key(|message| message.log_time_ns));
}

#[test]
fn a_thinned_recording_gives_the_same_states_as_the_whole_one() {
    let sent = exchanges(SMALL);
    let states = |options| steps(read(&record(&sent, options).0));
    let whole = states(RecorderOptions::default());
    assert_eq!(whole.len() as u64, SMALL.steps + 1);
    for every in [1, 2, 7, 1000] {
        let kept: BTreeMap<u64, Step> = states(thinned(every))
            .into_iter()
            .filter(|step| step.recorded)
            .map(|step| (step.version.step, step))
            .collect();
        let expected: Vec<u64> = (0..=SMALL.steps).filter(|step| step % every == 0 || *step == SMALL.steps).collect();
        assert_eq!(kept.keys().copied().collect::<Vec<_>>(), expected, "every {every}");
        for (number, step) in &kept {
            let full = &whole[*number as usize];
            // radii and contact_pairs are sent as references most of the time; they must be resolved all the same.
            assert_eq!(step.fields, full.fields, "step {number}, every {every}");
            assert_eq!(step.fields.len(), 8);
        }
    }
    let size = |options| record(&sent, options).1.field_bytes;
    assert!(size(thinned(7)) < size(thinned(1)) && size(thinned(1)) < size(RecorderOptions::default()));
}

#[test]
fn losses_are_counted_and_repetitions_recorded_once() {
    let mut sent = exchanges(SMALL);
    let (_, whole) = record(&sent, RecorderOptions::default());
    let fields: Vec<usize> = (0..sent.len())
        .filter(|&i| matches!(&sent[i], Exchange::Field { topic, .. } if topic.ends_with("velocities")))
        .collect();
    // A reply is sent again under new numbers; the next messages of that node follow on.
    let last = fields[fields.len() - 1];
    let Exchange::Field { topic, attachment, payload } = sent[last].clone() else { panic!("a field was picked") };
    let mut received = codec::decode_field(&attachment, payload.clone()).unwrap();
    let mut again = |sequence| {
        received.envelope.sequence = sequence;
        let attachment = codec::field_attachment(&received.envelope, received.field.as_ref().unwrap(), None);
        Exchange::Field { topic: topic.clone(), attachment: attachment.into(), payload: payload.clone() }
    };
    let highest = 9_000;
    sent.push(again(highest));
    let (_, repeated) = record(&sent, RecorderOptions::default());
    assert_eq!(repeated.messages, whole.messages);
    // The particles sent four fields and a report for the start and for each iteration, of which none is missing; all
    // numbers between the last of them and the repetition's are.
    let iterations = SMALL.steps * u64::from(ITERATIONS) + 2 * u64::from(ITERATIONS - 1);
    assert_eq!(repeated.lost, highest - 5 * (1 + iterations));
    sent.pop();
    // No node comes to such a number: somebody else does.
    sent.push(again(u64::MAX));
    let (_, forged) = record(&sent, RecorderOptions::default());
    assert_eq!((forged.lost, forged.refused, forged.messages), (0, 1, whole.messages));
    sent.pop();
    for (gone, index) in [fields[10], fields[30], fields[31]].into_iter().rev().zip(1..) {
        sent.remove(gone);
        assert_eq!(record(&sent, RecorderOptions::default()).1.lost, index);
    }
}

/// A disk that takes so many bytes and then fails.
struct Full(usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some(rest) = self.0.checked_sub(bytes.len()) else {
            return Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"));
        };
        self.0 = rest;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_ends_in_an_error_and_nobody_waits_for_it() {
    let options = RecorderOptions { queue_bytes: 10_000, ..RecorderOptions::default() };
    let recorder = Recorder::create(Full(100_000), &info(), options).unwrap();
    let sender = recorder.sender();
    // Far more than the disk and the queue hold: a recorder that hung would make this wait for ever.
    let payload = Bytes::from(vec![0u8; 8000]);
    let refused = exchanges(SMALL).iter().cycle().take(1_000_000).find_map(|exchange| {
        let exchange = match exchange.clone() {
            Exchange::Field { topic, attachment, .. } => {
                Exchange::Field { topic, attachment, payload: payload.clone() }
            }
            control => control,
        };
        sender.push(exchange).err()
    });
    let refused = refused.expect("the disk is full, so some push must fail");
    assert!(refused.to_string().contains("no space left on device"), "{refused}");
    let error = recorder.finish().unwrap_err();
    assert!(matches!(&error, RecordingError::Write(cause) if cause.contains("no space")), "{error}");
    assert!(Recorder::create(Full(10), &info(), RecorderOptions::default()).is_err());
}

/// A disk that waits until it is told to go on.
struct Slow(Arc<Mutex<()>>);

impl Write for Slow {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        drop(self.0.lock().unwrap());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A recorder with room for 50 kB on a disk that waits for `gate`.
fn slow_recorder(gate: &Arc<Mutex<()>>, patience: Duration) -> Recorder {
    let options = RecorderOptions { queue_bytes: 50_000, patience, ..RecorderOptions::default() };
    Recorder::create(Slow(Arc::clone(gate)), &info(), options).unwrap()
}

#[test]
fn a_slow_disk_makes_the_sender_wait_and_drops_nothing() {
    let gate = Arc::new(Mutex::new(()));
    let recorder = slow_recorder(&gate, RecorderOptions::default().patience);
    let sender = recorder.sender();
    let sent = exchanges(LARGE);
    let count = sent.len() as u64;
    let closed = gate.lock().unwrap();
    let pusher = thread::spawn(move || sent.into_iter().for_each(|exchange| sender.push(exchange).unwrap()));
    // The chunk under way takes 4 MiB, the queue 50 kB, and about 25 MB are to be written: the sender cannot finish.
    thread::sleep(Duration::from_millis(1500));
    assert!(!pusher.is_finished());
    drop(closed);
    pusher.join().unwrap();
    assert_eq!(recorder.finish().unwrap().messages, count);
}

#[test]
fn who_must_not_wait_hands_over_and_whoever_causes_it_waits_until_the_disk_has_caught_up() {
    let gate = Arc::new(Mutex::new(()));
    let recorder = slow_recorder(&gate, RecorderOptions::default().patience);
    let sender = recorder.sender();
    let sent = exchanges(LARGE);
    let count = sent.len() as u64;
    let closed = gate.lock().unwrap();
    // 25 MB, where the chunk under way takes 4 MiB and the queue 50 kB: none of it waits.
    sent.into_iter().for_each(|exchange| sender.hand_over(exchange).unwrap());
    let waiter = thread::spawn(move || sender.catch_up());
    thread::sleep(Duration::from_millis(300));
    assert!(!waiter.is_finished());
    drop(closed);
    assert!(waiter.join().unwrap().unwrap() >= Duration::from_millis(200));
    assert_eq!(recorder.finish().unwrap().messages, count);
}

#[test]
fn a_disk_that_takes_nothing_is_given_up_and_nobody_waits_for_it() {
    let gate = Arc::new(Mutex::new(()));
    let patience = Duration::from_millis(300);
    let recorder = slow_recorder(&gate, patience);
    let sender = recorder.sender();
    let closed = gate.lock().unwrap();
    for exchange in exchanges(LARGE) {
        sender.hand_over(exchange).unwrap();
    }
    let begun = Instant::now();
    let stalled = sender.catch_up().unwrap_err();
    assert!(stalled.to_string().contains("the disk has taken nothing for"), "{stalled}");
    assert!(sender.hand_over(exchanges(SMALL)[0].clone()).is_err(), "nothing more is taken");
    let error = recorder.finish().unwrap_err();
    assert!(error.to_string().contains("the disk has taken nothing for"), "{error}");
    // Twice the patience, and time for a busy machine; the disk would never have come back.
    assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
    drop(closed);
}

#[test]
fn fields_that_are_not_kept_are_left_out_and_all_else_stays() {
    let sent = exchanges(SMALL);
    let kept = Some(["positions".to_owned()].into());
    for level in [Level::All, Level::Accepted] {
        let options = RecorderOptions { level, ..RecorderOptions::default() };
        let whole = read(&record(&sent, options.clone()).0);
        let (bytes, recorded) = record(&sent, RecorderOptions { fields: Option::clone(&kept), ..options });
        let of = |message: &Message| !matches!(message.body, Body::Field(_)) || message.topic.ends_with("/positions");
        let expected: Vec<String> = whole.iter().filter(|message| of(message)).map(print).collect();
        assert_eq!(read(&bytes).iter().map(print).collect::<Vec<_>>(), expected);
        assert_eq!(recorded.lost, 0, "what is left out on purpose is not lost");
    }
}

#[test]
fn a_damaged_chunk_gives_no_message_and_the_ones_before_it_give_all() {
    let (bytes, _) = record(&exchanges(Script { particles: 2000, steps: 60, dt_s: 1e-4 }), RecorderOptions::default());
    let whole: Vec<_> = read(&bytes).iter().map(Message::parts).collect();
    // Some 25 MB in chunks of 4 MiB.
    for share in [0.1, 0.5, 0.9] {
        let at = (share * bytes.len() as f64) as usize;
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x04;
        let (mut sound, mut errors) = (Vec::new(), 0);
        for message in messages_from(damaged.as_slice()).unwrap() {
            match message {
                Ok(message) => sound.push(message.parts()),
                Err(error) => {
                    assert!(matches!(error, RecordingError::Damaged(_)), "{error}");
                    errors += 1;
                }
            }
        }
        assert_eq!(errors, 1, "told once");
        assert_eq!(sound[..], whole[..sound.len()], "and nothing damaged was given out");
        // All but the chunk that was hit, and what follows it.
        assert!(sound.len() as f64 > (share - 0.25) * whole.len() as f64, "{} of {}", sound.len(), whole.len());
    }
}

#[test]
fn a_summary_tells_what_happened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, record(&exchanges(SMALL), RecorderOptions::default()).0).unwrap();
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.info, info());
    let summary = Summary::of(&recording).unwrap();
    assert_eq!((summary.steps_accepted, summary.steps_rejected), (SMALL.steps, 2));
    assert_eq!(summary.iterations, SMALL.steps * u64::from(ITERATIONS) + 2 * u64::from(ITERATIONS - 1));
    assert!((summary.simulated_time_s - 5.5e-3).abs() < 1e-12);
    assert_eq!((summary.complete, summary.completed, summary.lost), (true, Some(true), Some(0)));
    assert_eq!(summary.nodes["thermal"].solves, summary.iterations);
    assert_eq!(summary.topics["field/particles/positions"].messages, summary.iterations + 1);
    // The made-up ledgers balance up to the rounding of some hundred sums.
    assert!(summary.imbalance.values().all(|share| share.abs() < 1e-12), "{:?}", summary.imbalance);
    assert_eq!(summary.dt_history_s, vec![SMALL.dt_s; SMALL.steps as usize]);
    assert_eq!(summary.rejected_by, BTreeMap::from([("temperature".to_owned(), 2)]));
    // In the last iteration, the third, each relative error is 1e-3 of what it was made with.
    let errors = summary.errors["temperature"];
    assert_eq!((errors.count, errors.tolerance), (SMALL.steps, 1e-6));
    assert!((errors.mean / (1e-3 * 1e-6 * 500.0) - 1.0).abs() < 1e-12 && errors.largest >= errors.mean, "{errors:?}");
    let text = summary.to_string();
    for expected in [
        "completed",
        "dt history  ▅▅▅",
        "5.500 ms simulated, 55 steps accepted, 2 rejected",
        "field/thermal/temperature",
        "to_walls",
    ] {
        assert!(text.contains(expected), "{expected} is missing from\n{text}");
    }
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    assert!(serde_json::to_string(&summary).unwrap().contains("\"steps_accepted\":55"));
}

#[test]
fn outcomes_come_with_the_reports_they_were_made_from() {
    let (bytes, _) = record(&exchanges(SMALL), RecorderOptions::default());
    let mut steps = Steps::default();
    let outcomes: Vec<_> = read(&bytes).into_iter().filter_map(|message| steps.take(message).outcome).collect();
    assert!(outcomes.iter().zip(1..).all(|(outcome, number)| outcome.iteration == number));
    assert!(outcomes.iter().all(|outcome| outcome.reports.len() == 3));
    let rejected: Vec<Version> =
        outcomes.iter().filter(|it| it.decision.verdict() == Verdict::Reject).map(|it| it.version).collect();
    assert_eq!(rejected.iter().map(|version| version.step).collect::<Vec<_>>(), [25, 50]);
}

#[test]
fn of_a_damaged_file_what_precedes_the_damage_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    // Chunks of 4 MiB: damage in the second one leaves the first, and nothing behind it is told.
    let (mut bytes, _) =
        record(&exchanges(Script { particles: 2000, steps: 40, dt_s: 1e-4 }), RecorderOptions::default());
    assert!(bytes.len() > 12 << 20, "{} bytes", bytes.len());
    bytes[5 << 20] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let summary = Summary::of(&Recording::open(&path).unwrap()).unwrap();
    assert!(summary.steps_accepted > 0 && summary.steps_accepted < 40, "{} steps", summary.steps_accepted);
    assert!(!summary.complete && summary.damage.as_ref().is_some_and(|why| why.contains("what precedes this point")));
    assert!(summary.to_string().contains("cannot be read further"));
}

#[test]
fn the_replies_of_a_node_come_in_their_order_with_their_windows_and_fields() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let replies = |options| {
        std::fs::write(&path, record(&exchanges(SMALL), options).0).unwrap();
        let mut replies = Replies::of(&Recording::open(&path).unwrap(), "thermal").unwrap();
        assert_eq!((replies.from, replies.initial.contains_key("temperature")), (Version::INITIAL, true));
        assert_eq!(replies.ready.ledger[0].name, "heat");
        let all: Vec<Reply> = replies.by_ref().collect();
        assert!(matches!(replies.end(), Some(End::Closed)));
        all
    };
    let whole = replies(RecorderOptions::default());
    assert_eq!(whole.len() as u64, SMALL.steps * u64::from(ITERATIONS) + 2 * u64::from(ITERATIONS - 1));
    assert!(whole.is_sorted_by(|a, b| a.version < b.version));
    for Reply { version, window, result, fields } in &whole {
        assert_eq!(fields["temperature"].rows(), SMALL.particles);
        assert_eq!(window.dt_s, SMALL.dt_s);
        assert!((window.t_s - (version.step - 1) as f64 * SMALL.dt_s).abs() < 1e-12, "{version}: {window:?}");
        assert!(result.as_ref().unwrap().ledger.iter().any(|line| line.name == "to_walls"));
    }
    // Thinned, the reports are all there, and the fields of the accepted iterations with them.
    let accepted = replies(thinned(1));
    assert_eq!(accepted.len(), whole.len());
    for (one, other) in accepted.iter().zip(&whole) {
        let is_accepted = one.version.iteration == ITERATIONS;
        assert_eq!(one.fields.get("temperature"), other.fields.get("temperature").filter(|_| is_accepted));
    }
}

/// Place and bytes of a message.
type Wire = (String, u64, (Bytes, Bytes));

fn wire(message: &Message) -> Wire {
    (message.topic.clone(), message.log_time_ns, message.parts())
}

/// The newest values of each field before a time, by topic.
fn newest_before(messages: &[Message], log_time_ns: u64) -> BTreeMap<String, Wire> {
    let before = messages.iter().filter(|message| message.log_time_ns < log_time_ns);
    let values = before.filter(|message| matches!(&message.body, Body::Field(it) if it.field.is_some()));
    values.map(|message| (message.topic.clone(), wire(message))).collect()
}

#[test]
fn a_closed_recording_is_read_from_a_time_on_without_what_lies_in_between() {
    // Some ten chunks.
    let script = Script { particles: 3000, steps: 60, dt_s: 1e-4 };
    let (bytes, _) = record(&exchanges(script), RecorderOptions::default());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let from = |bytes: &[u8], t_s: f64| -> Vec<Message> {
        std::fs::write(&path, bytes).unwrap();
        Recording::open(&path).unwrap().messages_from(t_s).unwrap().map(Result::unwrap).collect()
    };
    let all = read(&bytes);
    let initial: Vec<Wire> = all.iter().take_while(|message| message.log_time_ns == 0).map(wire).collect();
    for (t_s, skips) in [(0.0, false), (1.05e-3, false), (3e-3, true), (5.9e-3, true), (1.0, false)] {
        let log_time_ns = (t_s * 1e9) as u64;
        let some = from(&bytes, t_s);
        let later = |messages: &[Message]| -> Vec<Wire> {
            messages.iter().filter(|message| message.log_time_ns >= log_time_ns).map(wire).collect()
        };
        assert!(later(&some) == later(&all), "{t_s} s");
        assert!(newest_before(&some, log_time_ns) == newest_before(&all, log_time_ns), "{t_s} s");
        assert!(some.iter().map(wire).zip(&initial).all(|(found, expected)| found == *expected), "{t_s} s");
        assert!(!skips || some.len() < all.len() - 100, "{t_s} s: {} of {}", some.len(), all.len());
    }
    // Without an index everything is read.
    assert_eq!(from(&bytes[..bytes.len() - 40], 5.9e-3).len(), all.len());
}
