//! A recording file: its index, its run, and its messages one by one.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{File, TryLockError},
    io::{Read, Take},
    path::{Path, PathBuf},
    sync::Arc,
};

use bytes::Bytes;
use prost::Message as _;
use stagger_messages::{
    Checkpoint, Directive, Manifest, MessageError, Report,
    codec::{self, Received},
};

use crate::{
    RecordingError, RunInfo,
    container::{ContainerReader, Event, Index, ends_complete},
};

/// Name of the metadata that describes the run.
pub(crate) const RUN: &str = "stagger";
/// Name of the metadata written when a recording is closed.
pub(crate) const END: &str = "stagger-end";
/// Name of the attachment that holds the scene.
pub(crate) const SCENE: &str = "scene.toml";

/// Schema of the fields.
pub(crate) const FIELD: &str = "stagger.v1.FieldMessage";

/// What the names of attachments that hold the scene's files begin with; the path follows.
pub(crate) const FILE: &str = "file/";

/// Messages needed from before a time, and those from about that time on.
type Skipped = (Vec<Message>, Messages<Take<File>>);

/// A recorded run on disk.
#[derive(Clone, Debug)]
pub struct Recording {
    /// What the recording says about its run.
    pub info: RunInfo,
    /// False where the file was cut off: its run, or the machine, was stopped before the recording was closed.
    pub complete: bool,
    /// Whether its run still writes it: a recorder holds the file locked until it has closed it.
    pub being_written: bool,
    path: PathBuf,
}

/// One recorded message.
#[derive(Clone, Debug)]
pub struct Message {
    /// Its key behind the run's name: `field/particles/positions`.
    pub topic: String,
    /// Simulated time at the start of its window, in ns; never decreases within a recording.
    pub log_time_ns: u64,
    /// Wall clock when it was recorded, in ns since 1970.
    pub publish_time_ns: u64,
    /// Length of its record, in bytes.
    pub bytes: u64,
    /// What it says.
    pub body: Body,
}

/// Content of a recorded message.
#[derive(Clone, Debug)]
pub enum Body {
    /// A field.
    Field(Received),
    /// The coordinator to the nodes.
    Directive(Directive),
    /// A node to the coordinator.
    Report(Report),
    /// What a node said about itself.
    Manifest(Manifest),
    /// What a run can go on from.
    Checkpoint(Checkpoint),
}

impl Message {
    /// The message as it went over the wire: the header, empty for control messages, and the body.
    #[must_use]
    pub fn parts(&self) -> (Bytes, Bytes) {
        match &self.body {
            Body::Field(received) => {
                let payload = received.field.as_ref().map(|field| field.values().bytes().clone()).unwrap_or_default();
                (codec::received_attachment(received).into(), payload)
            }
            Body::Directive(directive) => (Bytes::new(), directive.encode_to_vec().into()),
            Body::Report(report) => (Bytes::new(), report.encode_to_vec().into()),
            Body::Manifest(manifest) => (Bytes::new(), manifest.encode_to_vec().into()),
            Body::Checkpoint(checkpoint) => (Bytes::new(), checkpoint.encode_to_vec().into()),
        }
    }
}

impl Recording {
    /// Opens a recording, closed or cut off.
    ///
    /// # Errors
    /// The file cannot be read, is no MCAP, or does not describe a run.
    pub fn open(path: impl Into<PathBuf>) -> Result<Self, RecordingError> {
        let path = path.into();
        let mut file = open(&path)?;
        // Before its end is looked at: it may be closed right then.
        let being_written = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
        let complete = ends_complete(&mut file).map_err(RecordingError::Read)?;
        let info = read_info(&mut ContainerReader::new(open(&path)?), true)?;
        Ok(Self { info, complete, being_written, path })
    }

    /// How its file falls short, where nothing in it is damaged and it has no end.
    #[must_use]
    pub fn shortfall(&self) -> &'static str {
        if self.being_written { "is still being written" } else { "is cut off" }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All messages in the order of recording, up to where the file was cut off. Messages of foreign schemas are left
    /// out. A message that does not decode is an error, and the next one follows; damage of the file ends it.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn messages(&self) -> Result<Messages<File>, RecordingError> {
        let events = ContainerReader::new(open(&self.path)?);
        Ok(Messages { info: self.info.clone(), events, fields: true })
    }

    /// As [`Self::messages`], without the fields, which are not decoded: what was said of them, and decided.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn control_messages(&self) -> Result<Messages<File>, RecordingError> {
        Ok(Messages { fields: false, ..self.messages()? })
    }

    /// The last whole checkpoint, or the last one at or before a step. In a damaged file, that before the damage.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn checkpoint(&self, step: Option<u64>) -> Result<Option<Checkpoint>, RecordingError> {
        let mut found = None;
        for message in self.control_messages()?.map_while(Result::ok) {
            if let Body::Checkpoint(checkpoint) = message.body
                && step.is_none_or(|step| checkpoint.version().step <= step)
            {
                found = Some(checkpoint);
            }
        }
        Ok(found)
    }

    /// As [`Self::messages`], but of those before a simulated time, in s, perhaps only what is needed to go on from it:
    /// those at the start, and each field's newest values. A closed recording is not read in between.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn messages_from(
        &self,
        t_s: f64,
    ) -> Result<Box<dyn Iterator<Item = Result<Message, RecordingError>> + '_>, RecordingError> {
        // Times in the index are rounded.
        let log_time_ns = (t_s * 1e9).floor() as u64;
        match self.skipping(log_time_ns.saturating_sub(1))? {
            Some((before, rest)) => Ok(Box::new(before.into_iter().map(Ok).chain(rest))),
            None => Ok(Box::new(self.messages()?)),
        }
    }

    /// What is needed of the messages before a time, and those from its chunk on; `None` where the index is of no use.
    fn skipping(&self, log_time_ns: u64) -> Result<Option<Skipped>, RecordingError> {
        let Some(mut index) = Index::of(open(&self.path)?) else { return Ok(None) };
        // Nothing is left out before the chunk behind the one with the last message of the start.
        let from = index.chunk_at(log_time_ns).filter(|from| index.chunk_at(1).is_some_and(|later| later < *from));
        let Some(from) = from else { return Ok(None) };
        // Without a checksum, a message that does not decode is read again by whoever reads everything.
        let has_values = |data: &[u8]| codec::decode_field_record(data).is_ok_and(|received| received.field.is_some());
        let channels: Vec<u16> = index.channels_of(FIELD).collect();
        let chunks: BTreeSet<usize> =
            channels.into_iter().filter_map(|channel| index.last_with(channel, from, has_values)).collect();
        let mut before = Vec::new();
        for message in self.messages()? {
            let message = message?;
            if message.log_time_ns > 0 {
                break;
            }
            before.push(message);
        }
        let mut newest: BTreeMap<String, Message> = BTreeMap::new();
        for chunk in chunks {
            let events = index.reader(chunk, true)?;
            for message in (Messages { info: self.info.clone(), events, fields: true }) {
                let message = message?;
                if matches!(&message.body, Body::Field(received) if received.field.is_some()) {
                    newest.insert(message.topic.clone(), message);
                }
            }
        }
        before.extend(newest.into_values());
        let events = index.reader(from, false)?;
        Ok(Some((before, Messages { info: self.info.clone(), events, fields: true })))
    }

    pub(crate) fn events(&self) -> Result<ContainerReader<File>, RecordingError> {
        Ok(ContainerReader::new(open(&self.path)?))
    }
}

/// The messages of a recording that comes as a stream, such as that of a run under way; waits until the stream has
/// described its run.
///
/// # Errors
/// The stream cannot be read, is no MCAP, or does not begin with the description of a run.
pub fn messages_from<R: Read>(input: R) -> Result<Messages<R>, RecordingError> {
    let mut events = ContainerReader::new(input);
    let info = read_info(&mut events, false)?;
    Ok(Messages { info, events, fields: true })
}

fn open(path: &Path) -> Result<File, RecordingError> {
    File::open(path).map_err(|source| RecordingError::Open { path: path.into(), source })
}

fn read_info<R: Read>(events: &mut ContainerReader<R>, anywhere: bool) -> Result<RunInfo, RecordingError> {
    let (mut metadata, mut scene) = (None, None);
    let mut files: BTreeMap<String, Arc<[u8]>> = BTreeMap::new();
    for event in events {
        match event? {
            Event::Metadata { name, map } if name == RUN => metadata = Some(map),
            Event::Attachment { name, data } if name == SCENE => scene = Some(data),
            Event::Attachment { name, data } => {
                if let Some(path) = name.strip_prefix(FILE) {
                    files.insert(path.into(), data.into());
                }
            }
            // Other tools may put the description behind the messages; a stream cannot be searched for it.
            Event::Message { .. } if !anywhere => break,
            _ => {}
        }
        if let (Some(map), Some(text)) = (&metadata, &scene)
            && RunInfo::files_in(map).all(|path| files.contains_key(path))
        {
            return RunInfo::from_metadata(map, String::from_utf8_lossy(text).into_owned(), files);
        }
    }
    Err(RecordingError::NoRun("it was cut off before its head was written, or another program wrote it"))
}

/// Iterates over the messages of a recording or a stream.
pub struct Messages<R> {
    /// What the recording says about its run.
    pub info: RunInfo,
    events: ContainerReader<R>,
    /// Whether fields are among them.
    fields: bool,
}

impl<R: Read> Messages<R> {
    /// Whether the end mark was reached; false before the end, and where the input was cut off.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.events.complete()
    }
}

impl<R: Read> Iterator for Messages<R> {
    type Item = Result<Message, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let event = match self.events.next()? {
                Ok(event) => event,
                Err(error) => return Some(Err(error)),
            };
            let Event::Message { topic, schema, log_time_ns, publish_time_ns, data } = event else { continue };
            if !self.fields && &*schema == FIELD {
                continue;
            }
            let (topic, bytes) = (topic.to_string(), data.len() as u64);
            match body(&schema, &data) {
                Ok(None) => {}
                Ok(Some(body)) => return Some(Ok(Message { topic, log_time_ns, publish_time_ns, bytes, body })),
                Err(source) => return Some(Err(RecordingError::Message { topic, source })),
            }
        }
    }
}

/// Decodes a message by the name of its schema; `None` for a foreign one.
pub(crate) fn body(schema: &str, data: &[u8]) -> Result<Option<Body>, MessageError> {
    Ok(Some(match schema {
        FIELD => Body::Field(codec::decode_field_record(data)?),
        "stagger.v1.Directive" => Body::Directive(codec::decode("directive", data)?),
        "stagger.v1.Report" => Body::Report(codec::decode("report", data)?),
        "stagger.v1.Checkpoint" => Body::Checkpoint(codec::decode("checkpoint", data)?),
        "stagger.v1.Manifest" => Body::Manifest(codec::decode("manifest", data)?),
        _ => return Ok(None),
    }))
}
