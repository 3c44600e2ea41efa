//! `stagger replay`: publishes a recording as the live run did.

use std::{
    collections::BTreeMap,
    io::BufRead as _,
    time::{Duration, Instant},
};

use bytes::Bytes;
use prost::Message as _;
use stagger_messages::{codec, keys};
use stagger_recordings::{Body, Message, Recording, RecordingError};

use crate::link::{Link, LinkError, Outlet};

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
    let mut outlets: BTreeMap<String, Outlet> = BTreeMap::new();
    let mut first: Option<(u64, Instant)> = None;
    let mut step = 0;
    let mut sent = 0;
    let first_reader = link.publisher(keys::directive(&recording.info.run))?;
    while !pace.at_once && going() && !first_reader.has_reader()? {
        std::thread::sleep(Duration::from_millis(20));
    }
    for message in recording.messages()? {
        let message = message?;
        if !going() {
            break;
        }
        let (t_s, at_step) = place(&message);
        if at_step > 0 && t_s < pace.from_s {
            continue;
        }
        if t_s > pace.to_s {
            break;
        }
        if pace.step && at_step > step {
            crate::diagnostics::note(&format!("step {at_step}, t = {t_s:e} s: press Enter"));
            // A closed standard input can press no more keys: the rest follows without waiting.
            let _ = std::io::stdin().lock().read_line(&mut String::new());
            step = at_step;
        } else if pace.speed.is_finite() && at_step > 0 {
            let (start, begun) = *first.get_or_insert((message.publish_time_ns, Instant::now()));
            let due = Duration::from_nanos(message.publish_time_ns.saturating_sub(start)).div_f64(pace.speed);
            std::thread::sleep(due.saturating_sub(begun.elapsed()));
        }
        let key = format!("stagger/{}/{}", recording.info.run, message.topic);
        let (attachment, payload) = parts(&message);
        let outlet = match outlets.entry(key) {
            std::collections::btree_map::Entry::Occupied(outlet) => outlet.into_mut(),
            std::collections::btree_map::Entry::Vacant(place) => {
                let outlet = link.publisher(place.key().clone())?;
                place.insert(outlet)
            }
        };
        outlet.put(attachment, payload)?;
        sent += 1;
    }
    Ok(sent)
}

/// Simulated time at the window's start, and the step.
fn place(message: &Message) -> (f64, u64) {
    let envelope = match &message.body {
        Body::Field(field) => Some(&field.envelope),
        Body::Directive(directive) => directive.envelope.as_ref(),
        Body::Report(report) => report.envelope.as_ref(),
        Body::Manifest(_) => None,
    };
    envelope.map_or((0.0, 0), |envelope| (envelope.t_s, envelope.version.map_or(0, |version| version.step)))
}

fn parts(message: &Message) -> (Option<Vec<u8>>, Bytes) {
    match &message.body {
        Body::Field(received) => {
            let payload = received.field.as_ref().map(|field| field.values().bytes().clone()).unwrap_or_default();
            (Some(codec::received_attachment(received)), payload)
        }
        Body::Directive(directive) => (None, directive.encode_to_vec().into()),
        Body::Report(report) => (None, report.encode_to_vec().into()),
        Body::Manifest(manifest) => (None, manifest.encode_to_vec().into()),
    }
}
