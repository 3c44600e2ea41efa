//! What other programs are shown of a recording: read from the bytes of the file, with Foxglove's published message
//! definitions written down here once more.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail as the tests themselves do")]

use std::collections::{BTreeMap, BTreeSet};

use prost::Message as _;
use stagger_recordings::{Exchange, Level, Message, Recorder, RecorderOptions, Step, Steps, messages_from};
use synthetic::{Script, exchanges, info};

mod raw;
mod synthetic;

const SCRIPT: Script = Script { particles: 60, steps: 55, dt_s: 1e-4 };
const DURATION_S: f64 = 5.5e-3;

/// foxglove.PointCloud of foxglove-schemas-protobuf 0.4.0.
#[derive(Clone, PartialEq, prost::Message)]
struct PointCloud {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<prost_types::Timestamp>,
    #[prost(string, tag = "2")]
    frame_id: String,
    #[prost(message, optional, tag = "3")]
    pose: Option<Pose>,
    #[prost(fixed32, tag = "4")]
    point_stride: u32,
    #[prost(message, repeated, tag = "5")]
    fields: Vec<PackedElementField>,
    #[prost(bytes = "vec", tag = "6")]
    data: Vec<u8>,
}

/// foxglove.PackedElementField; types 1 to 8 are UINT8 … FLOAT64, 7 is FLOAT32.
#[derive(Clone, PartialEq, prost::Message)]
struct PackedElementField {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(fixed32, tag = "2")]
    offset: u32,
    #[prost(int32, tag = "3")]
    kind: i32,
}

/// foxglove.Pose.
#[derive(Clone, PartialEq, prost::Message)]
struct Pose {
    #[prost(message, optional, tag = "1")]
    position: Option<Vector3>,
    #[prost(message, optional, tag = "2")]
    orientation: Option<Quaternion>,
}

/// foxglove.Vector3.
#[derive(Clone, Copy, PartialEq, prost::Message)]
struct Vector3 {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
}

/// foxglove.Quaternion.
#[derive(Clone, Copy, PartialEq, prost::Message)]
struct Quaternion {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

/// foxglove.Log; levels 1 to 5 are DEBUG … FATAL.
#[derive(Clone, PartialEq, prost::Message)]
struct Log {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<prost_types::Timestamp>,
    #[prost(int32, tag = "2")]
    level: i32,
    #[prost(string, tag = "3")]
    message: String,
    #[prost(string, tag = "4")]
    name: String,
    #[prost(string, tag = "5")]
    file: String,
    #[prost(fixed32, tag = "6")]
    line: u32,
}

/// stagger.display.v1.Scalar.
#[derive(Clone, PartialEq, prost::Message)]
struct Scalar {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<prost_types::Timestamp>,
    #[prost(double, tag = "2")]
    value: f64,
    #[prost(string, tag = "3")]
    unit: String,
}

fn record(sent: &[Exchange], options: RecorderOptions) -> Vec<u8> {
    let file = tempfile::NamedTempFile::new().unwrap();
    let recorder = Recorder::create(file.reopen().unwrap(), &info(), options).unwrap();
    sent.iter().for_each(|exchange| recorder.sender().push(exchange.clone()).unwrap());
    recorder.finish().unwrap();
    std::fs::read(file.path()).unwrap()
}

fn with_frames(frames: u32) -> RecorderOptions {
    RecorderOptions { frame_period_s: Some(DURATION_S / f64::from(frames)), ..RecorderOptions::default() }
}

/// Of a file: the schemas by name, and the messages by topic with their log times, in ns.
struct Contents {
    schemas: BTreeMap<String, Vec<u8>>,
    messages: BTreeMap<String, Vec<(u64, Vec<u8>)>>,
    log_times: Vec<u64>,
}

fn contents(bytes: &[u8]) -> Contents {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let text = |at: usize| String::from_utf8(bytes[at + 4..at + 4 + number(at)].to_vec()).unwrap();
    let mut found = Contents { schemas: BTreeMap::new(), messages: BTreeMap::new(), log_times: Vec::new() };
    let mut topics = BTreeMap::new();
    for chunk in raw::records(bytes, 8..bytes.len() - 8).iter().filter(|record| record.opcode == 6) {
        // Two times, size and checksum, compression, length of the records.
        assert_eq!(text(chunk.body.start + 28), "", "chunks are not compressed");
        for record in raw::records(bytes, chunk.body.start + 40..chunk.body.end) {
            let at = record.body.start;
            let id = u16::from_le_bytes([bytes[at], bytes[at + 1]]);
            match record.opcode {
                3 => {
                    let (name, encoding) = (text(at + 2), text(at + 6 + number(at + 2)));
                    assert_eq!(encoding, "protobuf");
                    let data = at + 2 + 4 + name.len() + 4 + encoding.len() + 4;
                    found.schemas.insert(name, bytes[data..record.body.end].to_vec());
                }
                4 => {
                    topics.insert(id, text(at + 4));
                }
                5 => {
                    let log_ns = u64::from_le_bytes(bytes[at + 6..at + 14].try_into().unwrap());
                    let messages = found.messages.entry(topics[&id].clone()).or_default();
                    messages.push((log_ns, bytes[at + 22..record.body.end].to_vec()));
                    found.log_times.push(log_ns);
                }
                other => panic!("a record {other} in a chunk"),
            }
        }
    }
    found
}

fn nanoseconds(time: Option<prost_types::Timestamp>) -> u64 {
    let time = time.unwrap();
    time.seconds as u64 * 1_000_000_000 + time.nanos as u64
}

fn exchanges_in(bytes: &[u8]) -> Vec<Message> {
    messages_from(bytes).unwrap().map(Result::unwrap).collect()
}

#[test]
fn the_exchanges_are_the_same_with_and_without_what_is_shown() {
    let sent = exchanges(SCRIPT);
    for level in [Level::All, Level::Accepted] {
        let of =
            |frame_period_s| record(&sent, RecorderOptions { level, frame_period_s, ..RecorderOptions::default() });
        let (with, without) = (of(Some(1e-3)), of(None));
        assert!(with.len() > without.len() && !contents(&without).messages.keys().any(|it| it.starts_with("display")));
        let exchanged = |bytes: &[u8]| -> Vec<_> {
            let messages = exchanges_in(bytes).into_iter();
            messages.map(|it| (it.topic.clone(), it.log_time_ns, it.parts())).collect()
        };
        assert_eq!(exchanged(&with), exchanged(&without));
    }
}

#[test]
fn particles_move_over_simulated_time_at_most_so_often_as_asked_for() {
    let sent = exchanges(SCRIPT);
    let mut steps = Steps::default();
    let whole = exchanges_in(&record(&sent, RecorderOptions::default()));
    let states: Vec<Step> = whole.into_iter().filter_map(|message| steps.take(message).step).collect();
    for frames in [1, 5, 11, 100_000] {
        let bytes = record(&sent, with_frames(frames));
        let contents = contents(&bytes);
        let clouds: Vec<(u64, PointCloud)> = contents.messages["display/particles"]
            .iter()
            .map(|(log_ns, data)| (*log_ns, PointCloud::decode(data.as_slice()).unwrap()))
            .collect();
        // The start, one for each of the periods, and no more than there are steps.
        assert!(clouds.len() <= (frames as usize + 2).min(states.len()), "{} of {frames}", clouds.len());
        assert!(clouds.len() >= (frames as usize).min(states.len()), "{} of {frames}", clouds.len());
        assert!(contents.log_times.is_sorted(), "log_time goes backwards");
        let (first, last) = (&clouds[0], &clouds[clouds.len() - 1]);
        assert_eq!((first.0, last.0), (0, 5_500_000), "from the start to the end");
        assert!(clouds.is_sorted_by(|a, b| nanoseconds(a.1.timestamp) < nanoseconds(b.1.timestamp)));
        for (log_ns, cloud) in &clouds {
            assert_eq!(nanoseconds(cloud.timestamp), *log_ns);
            let state = states.iter().find(|state| (state.t_s * 1e9).round() as u64 == *log_ns).unwrap();
            let offset = |name: &str| cloud.fields.iter().find(|field| field.name == name).unwrap().offset as usize;
            let stride = cloud.point_stride as usize;
            assert_eq!(cloud.data.len(), stride * SCRIPT.particles);
            let read = |row: usize, name: &str| {
                let at = row * stride + offset(name);
                f32::from_le_bytes(cloud.data[at..at + 4].try_into().unwrap())
            };
            let positions = state.fields["positions"].f64().unwrap();
            let kelvin = state.fields["temperature"].f64().unwrap();
            for row in 0..SCRIPT.particles {
                for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                    assert_eq!(read(row, name), (1e3 * positions[3 * row + axis]) as f32);
                }
                assert_eq!(read(row, "temperature [K]"), kelvin[row] as f32);
                assert_eq!(read(row, "radius [mm]"), (1e3 * synthetic::RADIUS_M) as f32);
            }
            let kinds: BTreeSet<i32> = cloud.fields.iter().map(|field| field.kind).collect();
            assert_eq!(kinds, BTreeSet::from([1, 7]), "FLOAT32 numbers and UINT8 colours");
        }
    }
}

#[test]
fn scalars_have_a_topic_each_and_log_lines_tell_what_went_wrong() {
    let contents = contents(&record(&exchanges(SCRIPT), with_frames(11)));
    let scalar = |name: &str| -> Vec<Scalar> {
        let messages = &contents.messages[&format!("display/scalars/{name}")];
        messages.iter().map(|(_, data)| Scalar::decode(data.as_slice()).unwrap()).collect()
    };
    // Of the start there is no window size.
    assert_eq!(scalar("dt").len() + 1, scalar("particles").len());
    assert!(scalar("dt").iter().all(|it| (it.value - SCRIPT.dt_s).abs() < 1e-12 && it.unit == "s"));
    assert!(scalar("iterations").iter().all(|it| it.value == f64::from(synthetic::ITERATIONS)));
    let (mean, max) = (scalar("temperature/mean"), scalar("temperature/max"));
    assert!(mean.iter().zip(&max).all(|(mean, max)| mean.value < max.value && max.unit == "K"));
    assert!(scalar("energy/particles/potential").is_sorted_by(|a, b| a.value >= b.value), "they fall");
    let lines: Vec<Log> =
        contents.messages["display/log"].iter().map(|(_, data)| Log::decode(data.as_slice()).unwrap()).collect();
    let levels: Vec<i32> = lines.iter().map(|line| line.level).collect();
    assert_eq!(levels, [2, 3, 3, 2], "the start, two rejections, the end: {lines:?}");
    assert!(lines[0].message.contains("run synthetic: synthetic.toml, seed 7"));
    assert!(lines[1].message.starts_with("step 25, attempt 1"), "{}", lines[1].message);
    assert!(lines[3].message.contains("duration reached"));
}

#[test]
fn every_schema_is_in_the_file_with_all_it_imports() {
    let schemas = contents(&record(&exchanges(SCRIPT), with_frames(3))).schemas;
    for (name, data) in &schemas {
        let set = prost_types::FileDescriptorSet::decode(data.as_slice()).unwrap();
        let files: BTreeSet<&str> = set.file.iter().map(|file| file.name()).collect();
        for file in &set.file {
            assert!(file.dependency.iter().all(|it| files.contains(it.as_str())), "{name}: {}", file.name());
        }
        let declares = |file: &prost_types::FileDescriptorProto| {
            file.message_type.iter().any(|message| format!("{}.{}", file.package(), message.name()) == *name)
        };
        assert!(set.file.iter().any(declares), "{name} is not in its own descriptors");
    }
    for name in ["foxglove.PointCloud", "foxglove.Log", "stagger.display.v1.Scalar", "stagger.v1.FieldMessage"] {
        assert!(schemas.contains_key(name), "{name} is missing");
    }
}
