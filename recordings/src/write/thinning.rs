//! Which fields are kept where not all are.

use std::collections::BTreeMap;

use bytes::Bytes;
use stagger_messages::{Directive, FieldMessage, Verdict, Version, directive};

use crate::{History, statistics::decision_log::asks};

/// A field message on its way into the file.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) topic: String,
    pub(crate) version: Version,
    pub(crate) header: FieldMessage,
    pub(crate) payload: Bytes,
    pub(crate) publish_ns: u64,
}

/// Holds fields back until their iteration is accepted, and lets through every n-th accepted step.
///
/// What is let through can be read without what was left out: a reference to values that are not in the file is
/// replaced by the values.
#[derive(Debug, Default)]
pub(crate) struct Thinning {
    every: u64,
    topics: BTreeMap<String, Topic>,
    /// Whether trials have begun; fields sent before are the values the run starts from.
    begun: bool,
    accepted: Option<Version>,
    accepted_kept: bool,
    /// Fields of the newest accepted step, where it is not an n-th one: the last step is always kept.
    last: Vec<(Piece, Option<Version>)>,
}

#[derive(Debug, Default)]
struct Topic {
    history: History<Bytes>,
    held: Option<(Piece, Option<Version>)>,
    /// Origin of the values in the file last, and the version they have there.
    in_file: Option<(Version, Version)>,
}

impl Thinning {
    pub(crate) fn new(every: u64) -> Self {
        Self { every: every.max(1), ..Self::default() }
    }

    /// Takes a field; returns it where it is to be written now.
    pub(crate) fn field(&mut self, mut piece: Piece) -> Option<Piece> {
        let version = piece.version;
        let stale = self.accepted.is_some_and(|accepted| version < accepted) && self.begun;
        if stale {
            return None;
        }
        let topic = self.topics.entry(piece.topic.clone()).or_default();
        let origin = match piece.header.same_as {
            None => {
                // A copy, so that a buffer shared with the sender is not held back along with the message.
                piece.payload = Bytes::copy_from_slice(&piece.payload);
                topic.history.insert(version, piece.payload.clone());
                Some(version)
            }
            Some(same_as) => topic.history.refer(version, same_as).map(|(origin, payload)| {
                piece.payload = payload;
                origin
            }),
        };
        let initial = version.step == 0 || !self.begun;
        let late = self.accepted == Some(version);
        if initial || (late && self.accepted_kept) {
            return Some(self.write(piece, origin));
        }
        if late {
            self.last.push((piece, origin));
        } else {
            topic.held = Some((piece, origin));
        }
        None
    }

    /// Takes a directive; returns the fields to be written before it.
    pub(crate) fn directive(&mut self, message: &Directive) -> Vec<Piece> {
        let decision = message.decision.as_ref();
        let mut written = match decision.and_then(|decision| Some((decision.verdict(), decision.version?))) {
            Some((Verdict::Accept, version)) if self.accepted != Some(version) => self.accept(version),
            Some((Verdict::Reject, version)) => {
                self.topics.values_mut().for_each(|topic| topic.history.reject(version));
                Vec::new()
            }
            _ => Vec::new(),
        };
        if asks(message) {
            self.begun = true;
        }
        if matches!(message.task, Some(directive::Task::Stop(_))) {
            written.extend(self.finish());
        }
        written
    }

    /// The fields of the last accepted step, where they are not written yet.
    pub(crate) fn finish(&mut self) -> Vec<Piece> {
        let last = std::mem::take(&mut self.last);
        self.accepted_kept = true;
        last.into_iter().map(|(piece, origin)| self.write(piece, origin)).collect()
    }

    fn accept(&mut self, version: Version) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for topic in self.topics.values_mut() {
            topic.history.accept(version);
            pieces.extend(topic.held.take().filter(|(piece, _)| piece.version == version));
        }
        self.accepted = Some(version);
        self.accepted_kept = version.step.is_multiple_of(self.every);
        if self.accepted_kept {
            self.last.clear();
            pieces.into_iter().map(|(piece, origin)| self.write(piece, origin)).collect()
        } else {
            self.last = pieces;
            Vec::new()
        }
    }

    /// Gives a piece the form it has in the file: a reference where its values are there already, else the values.
    fn write(&mut self, mut piece: Piece, origin: Option<Version>) -> Piece {
        let topic = self.topics.entry(piece.topic.clone()).or_default();
        // Without an origin the values were never seen here; the reference is all there is.
        let Some(origin) = origin else { return piece };
        match topic.in_file {
            Some((in_file, written_as)) if in_file == origin && written_as != piece.version => {
                piece.header.same_as = Some(written_as);
                piece.payload = Bytes::new();
            }
            _ => {
                piece.header.same_as = None;
                topic.in_file = Some((origin, piece.version));
            }
        }
        piece
    }
}
