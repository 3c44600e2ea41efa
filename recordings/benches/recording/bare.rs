//! The mcap crate without this program.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Read as _, Seek as _, SeekFrom},
    path::Path,
};

use mcap::{
    WriteOptions,
    records::MessageHeader,
    sans_io::{
        indexed_reader::{IndexedReadEvent, IndexedReader, IndexedReaderOptions},
        summary_reader::{SummaryReadEvent, SummaryReader},
    },
    write::NoSeek,
};

use crate::run::Ready;

pub fn write(file: File, records: &[Ready]) {
    let options = WriteOptions::new().compression(None).chunk_size(Some(4 << 20)).disable_seeking(true);
    let output = NoSeek::new(BufWriter::with_capacity(1 << 18, file));
    let mut writer = options.create(output).expect("a writer");
    let mut channels = BTreeMap::new();
    for (sequence, Ready { topic, schema, log_time, record }) in records.iter().enumerate() {
        let channel_id = *channels.entry(topic).or_insert_with(|| {
            let schema = writer.add_schema(schema, "protobuf", stagger_messages::DESCRIPTORS).expect("a schema");
            writer.add_channel(schema, topic, "protobuf", &BTreeMap::new()).expect("a channel")
        });
        let header =
            MessageHeader { channel_id, sequence: sequence as u32, log_time: *log_time, publish_time: *log_time };
        writer.write_to_known_channel(&header, record).expect("a disk that takes it");
    }
    writer.finish().expect("a file that is closed");
}

/// Finds the first message at or after `log_time`, in ns, by the file's index.
pub fn seek(path: &Path, log_time: u64) {
    let mut file = File::open(path).expect("the file just written");
    let mut summary = SummaryReader::new();
    while let Some(event) = summary.next_event() {
        match event.expect("an index") {
            SummaryReadEvent::ReadRequest(need) => {
                let read = file.read(summary.insert(need)).expect("a readable file");
                summary.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => summary.notify_seeked(file.seek(to).expect("a seekable file")),
        }
    }
    let summary = summary.finish().expect("a summary");
    let options = IndexedReaderOptions::new().starting_at(log_time);
    let mut reader = IndexedReader::new_with_options(&summary, options).expect("an index");
    while let Some(event) = reader.next_event() {
        match event.expect("sound chunks") {
            IndexedReadEvent::ReadChunkRequest { offset, length } => {
                let mut chunk = vec![0; length];
                file.seek(SeekFrom::Start(offset)).expect("a seekable file");
                file.read_exact(&mut chunk).expect("a whole chunk");
                reader.insert_chunk_record_data(offset, &chunk).expect("a sound chunk");
            }
            IndexedReadEvent::Message { header, .. } => {
                assert!(header.log_time >= log_time);
                return;
            }
        }
    }
    panic!("no message at {log_time} ns");
}
