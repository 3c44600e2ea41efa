//! What the node under test puts, and what is said where it is not what was expected.

use stagger_runtime::link::{Declaration, Link, LinkError};
use std::sync::mpsc::Sender;

use stagger_messages::{
    Change, Envelope, Field, Fields, Report, SCHEMA_VERSION, Snapshot,
    codec::{self, Received},
    keys, report,
};

/// A rule not kept: what was expected of the node, and what was found instead.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}; found {found}")]
pub struct Fault {
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub found: String,
}

impl Fault {
    /// From both halves of the sentence.
    pub fn new(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self { expected: expected.into(), found: found.into() }
    }
}

impl From<LinkError> for Fault {
    fn from(error: LinkError) -> Self {
        Self::new("a working link to the node", error.to_string())
    }
}

/// What the node put, in the order it came.
#[derive(Clone, Debug)]
pub enum Heard {
    /// Values of a field, or a reference to earlier ones.
    Field(Received),
    /// A report.
    Report(Envelope, report::Body),
    /// Its state at a checkpoint.
    Snapshot(Snapshot),
    /// What does not keep the schema, in words.
    Unreadable(String),
}

impl Heard {
    /// The envelope it came in; none where it could not be read.
    pub fn envelope(&self) -> Option<&Envelope> {
        match self {
            Self::Field(received) => Some(&received.envelope),
            Self::Report(envelope, _) => Some(envelope),
            Self::Snapshot(snapshot) => snapshot.envelope.as_ref(),
            Self::Unreadable(_) => None,
        }
    }
}

/// Hears everything the node puts, in its order.
pub fn listen(link: &Link, run: &str, node: &str, sender: Sender<Heard>) -> Result<Declaration, LinkError> {
    let (fields, run_name, node_name) = (format!("field/{node}/"), run.to_owned(), node.to_owned());
    let topics = [keys::report(run, node), keys::snapshot(run, node)].map(|key| keys::topic(&key).to_owned());
    // One subscription, so that fields and reports keep their order.
    link.subscribe(&keys::all(run), move |arrival| {
        let topic = keys::topic(&arrival.key);
        let heard = if topic.starts_with(&fields) {
            codec::decode_field(&arrival.attachment, arrival.payload.clone()).map(Heard::Field)
        } else if topic == topics[0] {
            codec::decode::<Report>("report", &arrival.payload).map(|report| match (report.envelope, report.body) {
                (Some(envelope), Some(body)) => Heard::Report(envelope, body),
                _ => Heard::Unreadable("a report without envelope or body".into()),
            })
        } else if topic == topics[1] {
            codec::decode::<Snapshot>("snapshot", &arrival.payload).map(Heard::Snapshot)
        } else {
            return;
        };
        let heard = heard.unwrap_or_else(|error| Heard::Unreadable(format!("on `{topic}`: {error}")));
        let foreign = heard.envelope().and_then(|envelope| {
            let found = (envelope.run.as_str(), envelope.schema, envelope.sender.as_str());
            let expected = (run_name.as_str(), SCHEMA_VERSION, node_name.as_str());
            let whole = found == expected && envelope.version.is_some();
            (!whole).then(|| format!("on `{topic}` an envelope of run, schema, sender {found:?}, not {expected:?}"))
        });
        // A session that has ended hears no more.
        let _ = sender.send(foreign.map_or(heard, Heard::Unreadable));
    })
}

/// A report's name, and what it says where it failed.
pub fn name_of(body: &report::Body) -> String {
    match body {
        report::Body::Ready(_) => "Ready".into(),
        report::Body::Done(_) => "Done".into(),
        report::Body::Failure(failure) => format!("a Failure ({})", failure.message),
        report::Body::FinalReport(_) => "FinalReport".into(),
    }
}

/// Refuses fields that are not the same bytes.
pub fn same_values(expected: &Fields, found: &Fields) -> Result<(), Fault> {
    for (name, expected) in expected {
        let Some(found) = found.get(name) else { return Err(Fault::new(format!("`{name}`"), "nothing")) };
        if expected.support != found.support {
            let rows = |field: &Field| format!("{} rows at revision {}", field.rows(), field.support.revision);
            return Err(Fault::new(format!("`{name}` of {}", rows(expected)), rows(found)));
        }
        let bytes = expected.values().bytes().iter().zip(found.values().bytes());
        if let Some(at) = bytes.into_iter().position(|(a, b)| a != b) {
            let index = at / expected.values().kind().bytes().max(1);
            let value = |field: &Field| match field.f64() {
                Ok(values) => format!("{:e}", values[index]),
                Err(_) => format!("byte {}", field.values().bytes()[at]),
            };
            let row = index / expected.components().max(1);
            return Err(Fault::new(format!("`{name}` = {} in row {row}, bit for bit", value(expected)), value(found)));
        }
    }
    Ok(())
}

/// Refuses changes that are not the same.
pub fn same_changes(expected: &[Change], found: &[Change]) -> Result<(), Fault> {
    if expected == found {
        return Ok(());
    }
    Err(Fault::new(format!("the changes {expected:?}"), format!("{found:?}")))
}
