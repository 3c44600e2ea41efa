//! The order and the form in which messages are recorded: each once, in simulated time.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{BufWriter, Write},
};

use bytes::Bytes;
use stagger_messages::{
    Checkpoint, Directive, Envelope, FieldMessage, Manifest, MessageError, Report, Version, codec, directive, report,
};

use crate::{
    Body, ControlKind, Exchange, Level, Recorded, RecorderOptions, RecordingError, RunInfo,
    container::ContainerWriter,
    display::Display,
    read::recording::{END, FILE, RUN, SCENE},
    write::{
        membership::{Membership, Numbering},
        thinning::{Piece, Thinning},
    },
};

/// Small records between chunks are gathered up to this before they go to the system.
const BUFFER_BYTES: usize = 1 << 18;

/// Puts messages in the order and form in which they are recorded: each once, in simulated time, thinned as asked for.
pub(crate) struct Journal<W: Write> {
    container: ContainerWriter<BufWriter<W>>,
    membership: Membership,
    thinning: Option<Thinning>,
    /// The fields to keep, where not all are.
    fields: Option<BTreeSet<String>>,
    display: Option<Display>,
    /// The senders of the epoch under way.
    senders: BTreeMap<String, Numbering>,
    /// Messages of this epoch that were missing when the last checkpoint was taken.
    missing_then: u64,
    /// Messages of earlier epochs that are missing and were not sent again in a later one.
    missing_before: u64,
    /// Whether numbers may begin anywhere.
    joined: bool,
    /// What is in the file of each version, and the epoch it came in.
    seen: BTreeMap<Version, BTreeMap<String, u32>>,
    /// Whether what was seen is kept until the next checkpoint.
    checkpoints: bool,
    log_ns: u64,
    recorded: Recorded,
}

impl<W: Write> Journal<W> {
    pub(crate) fn create(output: W, info: &RunInfo, options: &RecorderOptions) -> Result<Self, RecordingError> {
        let mut container = ContainerWriter::new(BufWriter::with_capacity(BUFFER_BYTES, output))?;
        container.metadata(RUN, info.to_metadata())?;
        container.attachment(SCENE, "application/toml", info.scene_text.as_bytes(), info.started_unix_ns)?;
        for (path, contents) in &info.files {
            let name = format!("{FILE}{path}");
            container.attachment(&name, "application/octet-stream", contents, info.started_unix_ns)?;
        }
        container.flush()?;
        let thin = options.level == Level::Accepted || options.every > 1;
        Ok(Self {
            container,
            membership: Membership::new(&info.run, !options.joined),
            thinning: thin.then(|| Thinning::new(options.every)),
            fields: options.fields.clone(),
            display: options.frame_period_s.map(|period_s| Display::new(info, period_s)),
            senders: BTreeMap::new(),
            missing_then: 0,
            missing_before: 0,
            joined: options.joined,
            seen: BTreeMap::new(),
            checkpoints: options.checkpoints,
            log_ns: 0,
            recorded: Recorded::default(),
        })
    }

    pub(crate) fn take(&mut self, exchange: Exchange, publish_ns: u64) -> Result<(), RecordingError> {
        match exchange {
            Exchange::Field { topic, attachment, payload } => self.field(topic, &attachment, payload, publish_ns),
            Exchange::Control { topic, message, kind } => self.control(topic, &message, kind, publish_ns),
        }
    }

    fn field(
        &mut self,
        topic: String,
        attachment: &[u8],
        payload: Bytes,
        publish_ns: u64,
    ) -> Result<(), RecordingError> {
        let Some(header) = self.decoded(codec::decode::<FieldMessage>("field", attachment)) else { return Ok(()) };
        let received = codec::decode_field(attachment, payload.clone()).ok();
        let own = header.envelope.clone().filter(|envelope| {
            received.is_some() && self.membership.admits(&topic, envelope) && self.is_next(envelope)
        });
        let Some((envelope, version)) = own.and_then(|envelope| Some((envelope.clone(), envelope.version?))) else {
            self.recorded.refused += 1;
            return Ok(());
        };
        self.count(&envelope);
        if !self.first(&envelope, version, &topic) {
            return Ok(());
        }
        if let Some(received) = received {
            self.show(&topic, Body::Field(received), publish_ns)?;
        }
        let name = header.port.as_ref().map_or("", |port| port.field.as_str());
        if self.fields.as_ref().is_some_and(|kept| !kept.contains(name)) {
            return Ok(());
        }
        let Some(thinning) = &mut self.thinning else {
            let kind = header.port.as_ref().map(|port| port.kind()).unwrap_or_default();
            self.recorded.field_bytes += payload.len() as u64;
            let record = codec::field_record(attachment, kind, &payload);
            return self.write(&topic, "FieldMessage", envelope.t_s, publish_ns, &record);
        };
        let piece = Piece { topic, version, header, payload, publish_ns };
        match thinning.field(piece) {
            Some(piece) => self.piece(&piece),
            None => Ok(()),
        }
    }

    fn control(
        &mut self,
        topic: String,
        message: &[u8],
        kind: ControlKind,
        publish_ns: u64,
    ) -> Result<(), RecordingError> {
        let (schema, t_s, body) = match kind {
            ControlKind::Manifest => {
                let decoded = self.decoded(codec::decode::<Manifest>("manifest", message));
                let Some(manifest) = decoded else { return Ok(()) };
                if !self.admitted(self.membership.admits_manifest(&topic, &manifest)) {
                    return Ok(());
                }
                ("Manifest", 0.0, None)
            }
            ControlKind::Checkpoint => {
                let Some(checkpoint) = self.decoded(codec::decode::<Checkpoint>("checkpoint", message)) else {
                    return Ok(());
                };
                let own = checkpoint.envelope.as_ref().is_some_and(|it| self.membership.admits_checkpoint(it));
                if !self.admitted(own) {
                    return Ok(());
                }
                self.seen = self.seen.split_off(&checkpoint.version());
                // Every node had sent its state, and so all that led to it, when this was put together.
                self.missing_then = self.missing_now();
                ("Checkpoint", checkpoint.envelope.map_or(0.0, |envelope| envelope.t_s), None)
            }
            ControlKind::Report => {
                let Some(report) = self.decoded(codec::decode::<Report>("report", message)) else { return Ok(()) };
                // A failure is news even where a reply to the same trial came before.
                let repeatable = !matches!(report.body, Some(report::Body::Failure(_)));
                let envelope = report.envelope.clone().unwrap_or_default();
                if !self.admitted(self.membership.admits(&topic, &envelope) && self.is_next(&envelope)) {
                    return Ok(());
                }
                self.count(&envelope);
                let version = envelope.version.unwrap_or_default();
                let ready = matches!(report.body, Some(report::Body::Ready(_)));
                let subject = if ready { format!("{topic} ready") } else { topic.clone() };
                if repeatable && !self.first(&envelope, version, &subject) {
                    return Ok(());
                }
                ("Report", envelope.t_s, Some(Body::Report(report)))
            }
            ControlKind::Directive => {
                let decoded = self.decoded(codec::decode::<Directive>("directive", message));
                let Some(directive) = decoded else { return Ok(()) };
                let envelope = directive.envelope.clone().unwrap_or_default();
                let next = self.is_next(&envelope);
                let begins = if next { self.membership.admits_directive(&topic, &directive) } else { None };
                if !self.admitted(begins.is_some()) {
                    return Ok(());
                }
                if begins == Some(true) {
                    self.begin_epoch();
                }
                if let Some(envelope) = &directive.envelope {
                    self.count(envelope);
                    if self.asked_before(envelope, &directive, &topic) {
                        return Ok(());
                    }
                }
                let released = self.thinning.as_mut().map(|thinning| thinning.directive(&directive));
                for piece in released.unwrap_or_default() {
                    self.piece(&piece)?;
                }
                let asked_s = directive.envelope.as_ref().map_or(0.0, |envelope| envelope.t_s);
                // The end asks for no window; its time is the one reached.
                let reached_s = directive.decision.as_ref().map_or(0.0, |decision| decision.t_s);
                ("Directive", asked_s.max(reached_s), Some(Body::Directive(directive)))
            }
        };
        self.write(&topic, schema, t_s, publish_ns, message)?;
        body.map_or(Ok(()), |body| self.show(&topic, body, publish_ns))
    }

    /// Writes what other programs are shown because of a message.
    fn show(&mut self, topic: &str, body: Body, publish_ns: u64) -> Result<(), RecordingError> {
        let Some(display) = &mut self.display else { return Ok(()) };
        for shown in display.take(topic, body) {
            self.recorded.display_bytes += shown.data.len() as u64;
            self.container.message(&shown.topic, shown.schema, self.log_ns, publish_ns, &shown.data)?;
        }
        Ok(())
    }

    fn piece(&mut self, piece: &Piece) -> Result<(), RecordingError> {
        let kind = piece.header.port.as_ref().map(|port| port.kind()).unwrap_or_default();
        let t_s = piece.header.envelope.as_ref().map_or(0.0, |envelope| envelope.t_s);
        let record = codec::field_record(&prost::Message::encode_to_vec(&piece.header), kind, &piece.payload);
        self.recorded.field_bytes += piece.payload.len() as u64;
        self.write(&piece.topic, "FieldMessage", t_s, piece.publish_ns, &record)
    }

    fn write(
        &mut self,
        topic: &str,
        schema: &str,
        t_s: f64,
        publish_ns: u64,
        data: &[u8],
    ) -> Result<(), RecordingError> {
        // Time never runs backwards in the file; what is no time does not move it.
        if t_s.is_finite() {
            self.log_ns = self.log_ns.max((t_s * 1e9).round() as u64);
        }
        self.recorded.messages += 1;
        self.container.message(topic, &format!("stagger.v1.{schema}"), self.log_ns, publish_ns, data)
    }

    fn decoded<M>(&mut self, result: Result<M, MessageError>) -> Option<M> {
        self.recorded.refused += u64::from(result.is_err());
        result.ok()
    }

    fn admitted(&mut self, own: bool) -> bool {
        self.recorded.refused += u64::from(!own);
        own
    }

    /// Whether a message may have its number; each epoch has its own.
    fn is_next(&self, envelope: &Envelope) -> bool {
        let known = self.senders.get(&envelope.sender).filter(|_| !self.membership.is_later(envelope));
        self.joined || known.copied().unwrap_or_default().admits(envelope.sequence)
    }

    fn count(&mut self, envelope: &Envelope) {
        self.senders.entry(envelope.sender.clone()).or_default().count(envelope.sequence);
    }

    fn missing_now(&self) -> u64 {
        self.senders.values().map(Numbering::missing).fold(0, u64::saturating_add)
    }

    /// All is solved, and sent, again from the last checkpoint on: what was missing of that is here, or is missing anew.
    fn begin_epoch(&mut self) {
        self.missing_before = self.missing_before.saturating_add(std::mem::take(&mut self.missing_then));
        self.senders.clear();
    }

    /// Whether this is the first message about its subject at that version: a reply that is sent again, or solved again
    /// after a restart, is recorded once.
    fn first(&mut self, envelope: &Envelope, version: Version, subject: &str) -> bool {
        self.seen_in(version, envelope.epoch, subject).is_none()
    }

    /// Whether a directive asks for a trial that was asked for before a restart: what follows from it is here already.
    fn asked_before(&mut self, envelope: &Envelope, directive: &Directive, topic: &str) -> bool {
        let (Some(directive::Task::Iterate(iterate)), Some(version)) = (&directive.task, envelope.version) else {
            return false;
        };
        let resting = iterate.parts.iter().filter(|part| part.rests).map(|part| part.node.as_str());
        let subject = format!("{topic} {}", resting.collect::<Vec<_>>().join(" "));
        self.seen_in(version, envelope.epoch, &subject).is_some_and(|epoch| epoch < envelope.epoch)
    }

    /// The epoch in which a subject was recorded at a version; where it was not, that is now this one.
    fn seen_in(&mut self, version: Version, epoch: u32, subject: &str) -> Option<u32> {
        // A repetition comes within its step, or after the last checkpoint: what is older is forgotten.
        let oldest = Version { step: version.step.saturating_sub(1), attempt: 0, iteration: 0 };
        if !self.checkpoints && self.seen.first_key_value().is_some_and(|(seen, _)| *seen < oldest) {
            self.seen = self.seen.split_off(&oldest);
        }
        let subjects = self.seen.entry(version).or_default();
        let before = subjects.get(subject).copied();
        if before.is_none() {
            subjects.insert(subject.into(), epoch);
        }
        before
    }

    pub(crate) fn flush(&mut self) -> Result<(), RecordingError> {
        self.container.flush()
    }

    pub(crate) fn finish(mut self) -> Result<Recorded, RecordingError> {
        for piece in self.thinning.take().map(|mut thinning| thinning.finish()).unwrap_or_default() {
            self.piece(&piece)?;
        }
        self.recorded.lost = self.missing_before.saturating_add(self.missing_now());
        let end = [("messages", self.recorded.messages), ("lost", self.recorded.lost)];
        let end = end.map(|(key, value)| (key.to_owned(), value.to_string()));
        self.container.metadata(END, end.into())?;
        self.container.finish()?;
        Ok(self.recorded)
    }
}
