//! The replies of one node of a recorded run, in the order in which they were given.

use std::{collections::BTreeMap, fs::File};

use stagger_coupling::{Window, resting, window_of};
use stagger_messages::{
    Directive, Done, Failure, Field, Fields, Ports, Ready, Report, Verdict, Version, codec::Received, directive, report,
};

use crate::{Body, History, Messages, Recording, RecordingError};

/// What one node of a recorded run started with, and its replies in the order in which they were given.
///
/// It reads its recording forwards, once, and holds the values of one attempt.
pub struct Replies {
    node: String,
    messages: Messages<File>,
    /// Ports by node, as far as the nodes have told them.
    pub ports: BTreeMap<String, Ports>,
    /// Where the run starts: [`Version::INITIAL`], or the checkpoint it goes on from.
    pub from: Version,
    /// The energy the node held at the start.
    pub ready: Ready,
    /// The fields the node had at the initial state.
    pub initial: Fields,
    values: BTreeMap<String, History<Field>>,
    /// The trial asked of the node last, and its window.
    asked: Option<(Version, Window)>,
    /// The node's report about a trial, whose fields may follow until something else is asked for.
    reported: Option<Reply>,
    reached: (Version, f64),
    end: Option<End>,
}

/// What a node answered to a trial.
#[derive(Clone, Debug)]
pub struct Reply {
    /// The trial.
    pub version: Version,
    /// The node's window in it.
    pub window: Window,
    /// Its report.
    pub result: Result<Done, Failure>,
    /// Its fields, as far as they were recorded.
    pub fields: Fields,
}

/// How a recording ends.
#[derive(Clone, Debug)]
pub enum End {
    /// It was closed.
    Closed,
    /// It was cut off.
    CutOff,
    /// It cannot be read further, for this reason.
    Damaged(String),
}

impl Replies {
    /// Those of `node`; reads up to the first trial.
    ///
    /// # Errors
    /// The recording cannot be opened again.
    pub fn of(recording: &Recording, node: &str) -> Result<Self, RecordingError> {
        let mut replies = Self {
            node: node.into(),
            messages: recording.messages()?,
            ports: BTreeMap::new(),
            from: Version::INITIAL,
            ready: Ready::default(),
            initial: Fields::new(),
            values: BTreeMap::new(),
            asked: None,
            reported: None,
            reached: (Version::INITIAL, 0.0),
            end: None,
        };
        while replies.end.is_none() && replies.reached.0 == Version::INITIAL {
            // Nothing was asked yet, so that nothing is answered.
            replies.advance();
        }
        replies.initial = replies.fields(Version::INITIAL);
        Ok(replies)
    }

    /// The newest trial that was asked for so far, and the simulated time at its start, in s.
    #[must_use]
    pub fn reached(&self) -> (Version, f64) {
        self.reached
    }

    /// How the recording ends, once it has been read to there.
    #[must_use]
    pub fn end(&self) -> Option<&End> {
        self.end.as_ref()
    }

    fn fields(&self, version: Version) -> Fields {
        let at = |(name, values): (&String, &History<Field>)| Some((name.clone(), values.get(version)?.clone()));
        self.values.iter().filter_map(at).collect()
    }

    /// Takes the next message; returns a reply where it is whole now.
    fn advance(&mut self) -> Option<Reply> {
        let message = match self.messages.next() {
            Some(Ok(message)) => message,
            Some(Err(error)) => return self.finish(End::Damaged(error.to_string())),
            None if self.messages.complete() => return self.finish(End::Closed),
            None => return self.finish(End::CutOff),
        };
        match message.body {
            Body::Field(received) if received.envelope.sender == self.node => self.field(received),
            Body::Report(report) => self.report(report),
            Body::Manifest(manifest) => {
                self.ports.insert(manifest.node, manifest.ports.unwrap_or_default());
            }
            Body::Directive(directive) => return self.directive(&directive),
            Body::Field(_) | Body::Checkpoint(_) => {}
        }
        None
    }

    fn finish(&mut self, end: End) -> Option<Reply> {
        self.end = Some(end);
        self.whole()
    }

    /// The reply whose report has come, with its fields.
    fn whole(&mut self) -> Option<Reply> {
        let reply = self.reported.take()?;
        Some(Reply { fields: self.fields(reply.version), ..reply })
    }

    fn field(&mut self, received: Received) {
        let version = received.envelope.version.unwrap_or_default();
        let values = self.values.entry(received.name).or_default();
        match (received.field, received.same_as) {
            (Some(field), _) => values.insert(version, field),
            (None, Some(same_as)) => {
                values.refer(version, same_as);
            }
            (None, None) => {}
        }
    }

    fn report(&mut self, report: Report) {
        let Some(envelope) = report.envelope.filter(|envelope| envelope.sender == self.node) else { return };
        let version = envelope.version.unwrap_or_default();
        let asked = self.asked.filter(|(asked, _)| *asked == version);
        let window = asked.map_or(Window { t_s: envelope.t_s, dt_s: envelope.dt_s }, |(_, window)| window);
        let result = match report.body {
            Some(report::Body::Done(done)) => Ok(done),
            Some(report::Body::Failure(failure)) => Err(failure),
            Some(report::Body::Ready(ready)) if version == Version::INITIAL => {
                self.ready = ready;
                return;
            }
            Some(report::Body::Ready(_) | report::Body::FinalReport(_)) | None => return,
        };
        self.reported = Some(Reply { version, window, result, fields: Fields::new() });
    }

    fn directive(&mut self, directive: &Directive) -> Option<Reply> {
        let about = directive.envelope.clone().unwrap_or_default();
        let version = about.version.unwrap_or_default();
        // The same trial may be asked for again, or of the nodes that only read.
        let stops = matches!(directive.task, Some(directive::Task::Stop(_)));
        let over = self.reported.as_ref().is_some_and(|reply| stops || reply.version != version);
        let reply = if over { self.whole() } else { None };
        if let Some(decision) = &directive.decision {
            let version = decision.version.unwrap_or_default();
            match decision.verdict() {
                Verdict::Accept => self.values.values_mut().for_each(|values| values.accept(version)),
                Verdict::Reject => self.values.values_mut().for_each(|values| values.reject(version)),
                Verdict::Iterate | Verdict::None => {}
            }
        }
        match &directive.task {
            Some(directive::Task::Iterate(iterate)) => {
                self.reached = (version, about.t_s);
                if resting(&self.node, iterate).is_none() {
                    let window = window_of(&self.node, Window { t_s: about.t_s, dt_s: about.dt_s }, iterate);
                    self.asked = Some((version, window));
                }
            }
            Some(directive::Task::Plan(plan)) if self.reached.0 == Version::INITIAL => {
                self.from = plan.from.unwrap_or(Version::INITIAL);
            }
            Some(directive::Task::Plan(_) | directive::Task::Stop(_)) | None => {}
        }
        reply
    }
}

impl Iterator for Replies {
    type Item = Reply;

    fn next(&mut self) -> Option<Reply> {
        while self.end.is_none() {
            if let Some(reply) = self.advance() {
                return Some(reply);
            }
        }
        None
    }
}
