//! `stagger replay`: publishes a recording as the live run did.

use stagger_runtime::link::{Link, LinkError, Publisher};
use std::{
    collections::{BTreeMap, btree_map::Entry},
    io::BufRead as _,
    time::{Duration, Instant},
};

use stagger_messages::Shown;
use stagger_messages::keys;
use stagger_recordings::{Body, Message, Recording, RecordingError};

/// Share of a time by which a sum of steps may miss the one that is asked for.
const ROUNDING: f64 = 1e-9;

/// How fast, and which part.
#[derive(Clone, Debug, PartialEq)]
pub struct Pace {
    /// Wall time of the recording over wall time now; infinity waits for nothing.
    pub speed: f64,
    /// Waits for a line on standard input before each time step.
    pub step: bool,
    /// Starts without waiting for a first subscriber.
    pub at_once: bool,
    /// Leaves out what lies before this simulated time, in s; the initial fields are always sent.
    pub from_s: f64,
    /// Ends after this simulated time, in s.
    pub to_s: f64,
}

/// Why a replay ended early.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// Publishes the messages of `recording` on the keys of its run; returns how many.
///
/// # Errors
/// The recording cannot be read, or the link fails. `going` ends it early when false.
pub fn replay(recording: &Recording, link: &Link, pace: &Pace, going: &dyn Fn() -> bool) -> Result<u64, ReplayError> {
    let mut publishers: BTreeMap<String, Publisher> = BTreeMap::new();
    let mut first: Option<(u64, Instant)> = None;
    let mut step = 0;
    let mut sent = 0;
    // The newest values of each field left out: later messages may refer to them.
    let mut left_out: BTreeMap<String, Message> = BTreeMap::new();
    let first_reader = link.publisher(keys::directive(&recording.info.run))?;
    while !pace.at_once && going() && !first_reader.has_reader()? {
        std::thread::sleep(Duration::from_millis(20));
    }
    for message in recording.messages_from(pace.from_s * (1.0 - ROUNDING))? {
        let message = message?;
        if !going() {
            break;
        }
        let (t_s, at_step) = place(&message);
        if let Some(t_s) = t_s {
            if t_s * (1.0 + ROUNDING) < pace.from_s {
                if matches!(&message.body, Body::Field(received) if received.field.is_some()) {
                    left_out.insert(message.topic.clone(), message);
                }
                continue;
            }
            if t_s > pace.to_s * (1.0 + ROUNDING) {
                break;
            }
            for (_, message) in std::mem::take(&mut left_out) {
                sent += put(recording, link, &mut publishers, &message)?;
            }
        }
        if pace.step && at_step > step {
            stagger_runtime::diagnostics::note(&format!(
                "step {at_step}, t = {:e} s: press Enter",
                Shown(t_s.unwrap_or_default())
            ));
            // A closed standard input can press no more keys: the rest follows without waiting.
            let _ = std::io::stdin().lock().read_line(&mut String::new());
            step = at_step;
        } else if pace.speed.is_finite() && at_step > 0 {
            let (start, begun) = *first.get_or_insert((message.publish_time_ns, Instant::now()));
            let recorded = Duration::from_nanos(message.publish_time_ns.saturating_sub(start)).as_secs_f64();
            let due = Duration::try_from_secs_f64(recorded / pace.speed).unwrap_or(Duration::MAX);
            while going() && begun.elapsed() < due {
                std::thread::sleep(due.saturating_sub(begun.elapsed()).min(Duration::from_millis(50)));
            }
        }
        sent += put(recording, link, &mut publishers, &message)?;
    }
    Ok(sent)
}

fn put(
    recording: &Recording,
    link: &Link,
    publishers: &mut BTreeMap<String, Publisher>,
    message: &Message,
) -> Result<u64, LinkError> {
    let (attachment, payload) = message.parts();
    let attachment = (!attachment.is_empty()).then(|| attachment.into());
    let publisher = match publishers.entry(format!("stagger/{}/{}", recording.info.run, message.topic)) {
        Entry::Occupied(publisher) => publisher.into_mut(),
        Entry::Vacant(place) => {
            let publisher = link.publisher_that_waits(place.key().clone())?;
            place.insert(publisher)
        }
    };
    publisher.put(attachment, payload)?;
    Ok(1)
}

/// Simulated time at the window's start, where the message belongs to a window, and the step.
fn place(message: &Message) -> (Option<f64>, u64) {
    let envelope = match &message.body {
        Body::Field(field) => Some(&field.envelope),
        Body::Directive(directive) => directive.envelope.as_ref(),
        Body::Report(report) => report.envelope.as_ref(),
        Body::Manifest(_) => None,
        Body::Checkpoint(checkpoint) => checkpoint.envelope.as_ref(),
    };
    let Some(envelope) = envelope else { return (None, 0) };
    let t_s = (envelope.dt_s > 0.0).then_some(envelope.t_s);
    (t_s, envelope.version.map_or(0, |version| version.step))
}
