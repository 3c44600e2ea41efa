//! The MCAP container: the only file that knows the `mcap` crate.
//!
//! Written without seeking, in chunks that are put to the file whole: whatever is cut off behind a flush, the rest reads
//! back. Uncompressed, because full-precision positions hardly shrink and the disk is not slower for it.

use std::{
    collections::{BTreeMap, VecDeque},
    fs::File,
    io::{Read, Seek, SeekFrom, Take, Write},
    sync::Arc,
};

use mcap::{
    Attachment, MAGIC, McapError, WriteOptions, Writer,
    records::ChunkIndex,
    records::{MessageHeader, Metadata, Record, op},
    sans_io::{
        linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
        summary_reader::{SummaryReadEvent, SummaryReader},
    },
    write::NoSeek,
};

use crate::{RecordingError, display};

/// Size from which a chunk is closed: small messages cost least in chunks of a few MiB.
const CHUNK_BYTES: u64 = 4 << 20;
/// No record of ours comes near this; a longer one is damage, and is not allocated for.
const RECORD_LIMIT_BYTES: usize = i32::MAX as usize;
/// Bytes of messages that wait for their chunk's checksum, with what holding them costs; our chunks are far smaller, what is
/// beyond this of those of other programs is let through.
const UNPROVEN_BYTES: usize = 256 << 20;
/// What one event costs beside its data, in bytes: itself, its place in two queues that grow by doubling, and an allocation.
const EVENT_BYTES: usize = 4 * size_of::<Event>() + 32;
/// Bytes asked of the input at once, so that a damaged length cannot make the reader allocate more than there is.
const READ_BYTES: usize = 1 << 20;
/// The encoding of schemas and messages.
const PROTOBUF: &str = "protobuf";

/// Writes messages of protobuf schemas into an MCAP stream.
pub(crate) struct ContainerWriter<W: Write> {
    writer: Writer<NoSeek<W>>,
    channels: BTreeMap<String, (u16, u32)>,
}

impl<W: Write> ContainerWriter<W> {
    pub(crate) fn new(output: W) -> Result<Self, RecordingError> {
        let options = WriteOptions::new().compression(None).chunk_size(Some(CHUNK_BYTES)).disable_seeking(true);
        let writer = options.create(NoSeek::new(output)).map_err(write_error)?;
        Ok(Self { writer, channels: BTreeMap::new() })
    }

    pub(crate) fn metadata(&mut self, name: &str, map: BTreeMap<String, String>) -> Result<(), RecordingError> {
        self.writer.write_metadata(&Metadata { name: name.into(), metadata: map }).map_err(write_error)
    }

    pub(crate) fn attachment(
        &mut self,
        name: &str,
        media_type: &str,
        data: &[u8],
        created_ns: u64,
    ) -> Result<(), RecordingError> {
        let attachment = Attachment {
            log_time: 0,
            create_time: created_ns,
            name: name.into(),
            media_type: media_type.into(),
            data: data.into(),
        };
        self.writer.attach(&attachment).map_err(write_error)
    }

    /// Writes one message; `schema` is the full name of its protobuf type.
    pub(crate) fn message(
        &mut self,
        topic: &str,
        schema: &str,
        log_time: u64,
        publish_time: u64,
        data: &[u8],
    ) -> Result<(), RecordingError> {
        let (channel_id, sequence) = match self.channels.get_mut(topic) {
            Some((id, sequence)) => {
                *sequence = sequence.wrapping_add(1);
                (*id, *sequence)
            }
            None => {
                let own = schema.starts_with("stagger.v1.");
                let descriptors = if own { stagger_messages::DESCRIPTORS } else { display::DESCRIPTORS };
                let schema = self.writer.add_schema(schema, PROTOBUF, descriptors).map_err(write_error)?;
                let id = self.writer.add_channel(schema, topic, PROTOBUF, &BTreeMap::new()).map_err(write_error)?;
                self.channels.insert(topic.into(), (id, 0));
                (id, 0)
            }
        };
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        self.writer.write_to_known_channel(&header, data).map_err(write_error)
    }

    /// Closes the chunk and hands everything to the operating system.
    pub(crate) fn flush(&mut self) -> Result<(), RecordingError> {
        self.writer.flush().map_err(write_error)
    }

    /// Writes the index and the end mark.
    pub(crate) fn finish(mut self) -> Result<(), RecordingError> {
        self.writer.finish().map_err(write_error)?;
        self.writer.into_inner().flush().map_err(|error| RecordingError::Write(error.to_string()))
    }
}

fn write_error(error: McapError) -> RecordingError {
    match error {
        McapError::Io(source) => RecordingError::Write(source.to_string()),
        other => RecordingError::Write(other.to_string()),
    }
}

/// One thing read from a container.
pub(crate) enum Event {
    Metadata { name: String, map: BTreeMap<String, String> },
    Attachment { name: String, data: Vec<u8> },
    Message { topic: Arc<str>, schema: Arc<str>, log_time_ns: u64, publish_time_ns: u64, data: Vec<u8> },
}

/// Reads a container from its start, whole or cut off; memory is bounded by its largest chunk. The messages of a chunk are
/// given out once its checksum holds, so that none is damaged; those of a chunk that was cut off as far as they are there.
pub(crate) struct ContainerReader<R> {
    input: R,
    reader: LinearReader,
    unproven: Vec<Event>,
    unproven_bytes: usize,
    proven: VecDeque<Event>,
    schemas: BTreeMap<u16, Arc<str>>,
    channels: BTreeMap<u16, (Arc<str>, Arc<str>)>,
    /// Whether a record was read.
    begun: bool,
    ended: bool,
    complete: bool,
}

impl<R: Read> ContainerReader<R> {
    pub(crate) fn new(input: R) -> Self {
        // A chunk's checksum is known where it ends; those of the sections find damage outside of chunks, behind them.
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(RECORD_LIMIT_BYTES);
        Self::with_options(input, options)
    }

    fn with_options(input: R, options: LinearReaderOptions) -> Self {
        Self {
            input,
            reader: LinearReader::new_with_options(options),
            unproven: Vec::new(),
            unproven_bytes: 0,
            proven: VecDeque::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            begun: false,
            ended: false,
            complete: false,
        }
    }

    /// Whether the end mark was read.
    pub(crate) fn complete(&self) -> bool {
        self.complete
    }

    fn advance(&mut self) -> Result<(), RecordingError> {
        let Some(event) = self.reader.next_event() else {
            (self.ended, self.complete) = (true, true);
            return Ok(());
        };
        match event {
            Ok(LinearReadEvent::ReadRequest(need)) => {
                let wanted = need.clamp(1 << 16, READ_BYTES);
                let buffer = self.reader.insert(wanted);
                let read = loop {
                    match self.input.read(buffer) {
                        Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                        result => break result.map_err(RecordingError::Read)?,
                    }
                };
                self.reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { opcode, data }) => {
                // The summary repeats what the data section said; only the latter is read, and the index skipped.
                let wanted = [op::SCHEMA, op::CHANNEL, op::MESSAGE, op::METADATA, op::ATTACHMENT];
                self.begun = true;
                if wanted.contains(&opcode) {
                    if opcode == op::ATTACHMENT && !attachment_fits(data) {
                        return Err(RecordingError::Damaged("an attachment is shorter than it says".into()));
                    }
                    let record = mcap::parse_record(opcode, data).map_err(damaged)?;
                    let event = Self::event(&mut self.schemas, &mut self.channels, record);
                    if event.is_some() {
                        self.unproven_bytes += EVENT_BYTES + data.len();
                    }
                    self.unproven.extend(event);
                }
                // What does not stand in a chunk comes after the checksum of the chunk before.
                if ![op::SCHEMA, op::CHANNEL, op::MESSAGE].contains(&opcode) || self.unproven_bytes > UNPROVEN_BYTES {
                    self.prove();
                }
            }
            Err(McapError::UnexpectedEof) => self.ended = true,
            Err(McapError::BadMagic) if !self.begun => return Err(RecordingError::NotMcap),
            Err(error) => return Err(damaged(error)),
        }
        Ok(())
    }

    fn prove(&mut self) {
        self.unproven_bytes = 0;
        // As it is, not one by one: the memory of the other is given back.
        if self.proven.is_empty() {
            self.proven = std::mem::take(&mut self.unproven).into();
        } else {
            self.proven.extend(self.unproven.drain(..));
        }
    }

    fn event(
        schemas: &mut BTreeMap<u16, Arc<str>>,
        channels: &mut BTreeMap<u16, (Arc<str>, Arc<str>)>,
        record: Record<'_>,
    ) -> Option<Event> {
        match record {
            Record::Schema { header, .. } => {
                schemas.insert(header.id, header.name.into());
                None
            }
            Record::Channel(channel) => {
                let schema = schemas.get(&channel.schema_id).cloned().unwrap_or_else(|| "".into());
                channels.insert(channel.id, (channel.topic.into(), schema));
                None
            }
            Record::Metadata(metadata) => Some(Event::Metadata { name: metadata.name, map: metadata.metadata }),
            Record::Attachment { header, data, .. } => {
                Some(Event::Attachment { name: header.name, data: data.into_owned() })
            }
            Record::Message { header, data } => {
                let (topic, schema) = channels.get(&header.channel_id)?.clone();
                Some(Event::Message {
                    topic,
                    schema,
                    log_time_ns: header.log_time,
                    publish_time_ns: header.publish_time,
                    data: data.into_owned(),
                })
            }
            _ => None,
        }
    }
}

impl<R: Read> Iterator for ContainerReader<R> {
    type Item = Result<Event, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(event) = self.proven.pop_front() {
                return Some(Ok(event));
            }
            if self.ended {
                return None;
            }
            if let Err(error) = self.advance() {
                self.ended = true;
                self.unproven.clear();
                return Some(Err(error));
            }
            if self.ended {
                self.prove();
            }
        }
    }
}

/// The index at the end of a closed container: where its chunks are, and what is in them.
pub(crate) struct Index {
    file: File,
    /// In the order of the file, which is that of time.
    chunks: Vec<ChunkIndex>,
    schemas: BTreeMap<u16, Arc<str>>,
    channels: BTreeMap<u16, (Arc<str>, Arc<str>)>,
}

impl Index {
    /// `None` where there is none, or where it is not that of a container this program writes: plain and in order of time.
    pub(crate) fn of(mut file: File) -> Option<Self> {
        let mut reader = SummaryReader::new();
        while let Some(event) = reader.next_event() {
            match event.ok()? {
                SummaryReadEvent::ReadRequest(wanted) => {
                    let read = file.read(reader.insert(wanted)).ok()?;
                    reader.notify_read(read);
                }
                SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to).ok()?),
            }
        }
        let summary = reader.finish()?;
        let mut chunks = summary.chunk_indexes;
        chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
        let plain = chunks.iter().all(|chunk| chunk.compression.is_empty());
        let in_order = chunks.is_sorted_by_key(|chunk| chunk.message_end_time);
        let schemas = summary.schemas.iter().map(|(id, schema)| (*id, schema.name.as_str().into())).collect();
        let channel = |(id, channel): (&u16, &Arc<mcap::Channel<'_>>)| {
            let schema = channel.schema.as_ref().map_or("", |schema| schema.name.as_str());
            (*id, (channel.topic.as_str().into(), schema.into()))
        };
        let channels = summary.channels.iter().map(channel).collect();
        (plain && in_order && !chunks.is_empty()).then_some(Self { file, chunks, schemas, channels })
    }

    /// The first chunk with a message at or after a time; `None` where all are before.
    pub(crate) fn chunk_at(&self, log_time_ns: u64) -> Option<usize> {
        self.chunks.iter().position(|chunk| chunk.message_end_time >= log_time_ns)
    }

    /// Numbers of the channels whose messages have a schema.
    pub(crate) fn channels_of<'a>(&'a self, schema: &'a str) -> impl Iterator<Item = u16> + 'a {
        self.channels.iter().filter(move |(_, (_, name))| **name == *schema).map(|(id, _)| *id)
    }

    /// The last chunk before `below` with a message on a channel that `wanted` takes. The messages are read where the
    /// index says they are, without the checksum of their chunk: what is found is to be read again with it. `None` where
    /// there is no such message, or where the index does not lead to messages.
    pub(crate) fn last_with(&mut self, channel: u16, below: usize, wanted: impl Fn(&[u8]) -> bool) -> Option<usize> {
        for number in (0..below).rev() {
            let chunk = self.chunks.get(number)?;
            let Some(&at) = chunk.message_index_offsets.get(&channel) else { continue };
            let data = chunk.compressed_data_offset().ok()?;
            let Record::MessageIndex(index) = mcap::parse_record(op::MESSAGE_INDEX, &self.record(at)?).ok()? else {
                return None;
            };
            let mut offsets: Vec<u64> = index.records.iter().map(|entry| entry.offset).collect();
            offsets.sort_unstable();
            for offset in offsets.into_iter().rev() {
                let record = self.record(data.checked_add(offset)?)?;
                if let Record::Message { data, .. } = mcap::parse_record(op::MESSAGE, &record).ok()?
                    && wanted(&data)
                {
                    return Some(number);
                }
            }
        }
        None
    }

    /// The body of the record at a place in the file.
    fn record(&mut self, at: u64) -> Option<Vec<u8>> {
        let mut head = [0; 9];
        self.file.seek(SeekFrom::Start(at)).ok()?;
        self.file.read_exact(&mut head).ok()?;
        let length = head.get(1..)?.try_into().ok().map(u64::from_le_bytes)?;
        let mut body = Vec::new();
        // Read as far as there is: a damaged length must not allocate more.
        (&self.file).take(length.min(RECORD_LIMIT_BYTES as u64)).read_to_end(&mut body).ok()?;
        (body.len() as u64 == length).then_some(body)
    }

    /// Reads one chunk alone, or from one to the end of the container.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(crate) fn reader(&self, from: usize, alone: bool) -> Result<ContainerReader<Take<File>>, RecordingError> {
        let mut file = self.file.try_clone().map_err(RecordingError::Read)?;
        let (start, length) =
            self.chunks.get(from).map_or((0, 0), |chunk| (chunk.chunk_start_offset, chunk.chunk_length));
        file.seek(SeekFrom::Start(start)).map_err(RecordingError::Read)?;
        let length = if alone { length } else { u64::MAX };
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(alone)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_LIMIT_BYTES);
        let mut reader = ContainerReader::with_options(file.take(length), options);
        (reader.schemas, reader.channels, reader.begun) = (self.schemas.clone(), self.channels.clone(), true);
        Ok(reader)
    }
}

/// Whether the lengths inside an attachment record stay within it: the crate's parser trusts them.
fn attachment_fits(data: &[u8]) -> bool {
    let word = |at: usize| Some(u32::from_le_bytes(data.get(at..at.checked_add(4)?)?.try_into().ok()?) as usize);
    // Two times of 8 bytes, then name and media type with their lengths, then length (8), data, checksum (4).
    let end = word(16).and_then(|name| Some(20 + name + 4 + word(20 + name)? + 8 + 4));
    end.is_some_and(|end| end <= data.len())
}

fn damaged(error: McapError) -> RecordingError {
    match error {
        McapError::UnsupportedCompression(name) => RecordingError::Damaged(format!(
            "its chunks are compressed with {name}; unpack it with `mcap compress --compression none`"
        )),
        other => RecordingError::Damaged(other.to_string()),
    }
}

/// Whether a file ends as a finished container does: a footer and the signature.
pub(crate) fn ends_complete(file: &mut (impl Read + Seek)) -> std::io::Result<bool> {
    // Opcode, length, summary start, summary offset start, checksum, signature (MCAP specification, "Footer").
    const FOOTER_BYTES: usize = 20;
    let mut tail = [0u8; 1 + 8 + FOOTER_BYTES + 8];
    let length = file.seek(SeekFrom::End(0))?;
    if length < (tail.len() + MAGIC.len()) as u64 {
        return Ok(false);
    }
    file.seek(SeekFrom::End(-(tail.len() as i64)))?;
    file.read_exact(&mut tail)?;
    let footer = tail[0] == op::FOOTER && tail[1..9] == (FOOTER_BYTES as u64).to_le_bytes();
    Ok(footer && tail.ends_with(MAGIC))
}
