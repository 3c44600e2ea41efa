//! Recordings that are cut off or damaged: nothing panics, what can be read is read, the exit code tells, and a run goes on
//! from the last whole checkpoint.

use std::{collections::BTreeSet, process::Output};

use super::{
    program::{Workplace, json, said, stagger},
    raw::{self, Record},
};

/// Opcodes of MCAP's records.
const CHUNK: u8 = 6;
const ATTACHMENT: u8 = 9;
const METADATA: u8 = 12;
const FOOTER: u8 = 2;

/// A recording with several checkpoints.
struct Recorded {
    place: Workplace,
    bytes: Vec<u8>,
    hash: serde_json::Value,
    records: Vec<Record>,
}

/// Checkpoints so near to each other that a damaged file has some left.
const OFTEN: [&str; 2] = ["--set", "recovery.checkpoint=5"];

fn recorded(scene: &str) -> Recorded {
    let place = Workplace::with(scene);
    let summary = json(&place.run(&[&["--record", "run.mcap", "--json"][..], &OFTEN[..]].concat()));
    let bytes = std::fs::read(place.path("run.mcap")).unwrap();
    let records = raw::records(&bytes, 8..bytes.len() - 8);
    assert_eq!(records.last().map(|record| record.body.end), Some(bytes.len() - 8), "records fill the file");
    Recorded { place, bytes, hash: summary["hash"].clone(), records }
}

impl Recorded {
    /// Where the description of the run ends and its messages begin.
    fn head(&self) -> usize {
        self.records.iter().find(|record| record.opcode == CHUNK).unwrap().body.start - 9
    }

    /// Puts a damaged file in place and asks about it.
    fn ask(&self, bytes: &[u8], command: &[&str]) -> Output {
        std::fs::write(self.place.path("hurt.mcap"), bytes).unwrap();
        let output = stagger().args(command).arg(self.place.path("hurt.mcap")).output().unwrap();
        // 101 is what a panic ends with.
        assert!(output.status.code().is_some_and(|code| code < 4), "{command:?}: {}", said(&output));
        output
    }

    /// What `info` could read of it.
    fn info(&self, bytes: &[u8]) -> (Option<i32>, serde_json::Value) {
        let output = self.ask(bytes, &["info", "--json"]);
        (output.status.code(), serde_json::from_slice(&output.stdout).unwrap_or_default())
    }

    /// Goes on from the damaged file, and ends with the bits of the run that was never stopped.
    fn goes_on(&self) {
        let output = self.place.run(&[&["--resume", "hurt.mcap", "--no-record", "--json"][..], &OFTEN[..]].concat());
        assert_eq!(json(&output)["hash"], self.hash);
    }
}

#[test]
fn a_recording_cut_at_every_hundredth_of_its_length_tells_what_it_holds_and_can_be_gone_on_from() {
    let recorded = recorded("quick.toml");
    let (length, head) = (recorded.bytes.len(), recorded.head());
    let (mut steps, mut resumed) = (0, BTreeSet::new());
    for percent in 0..=100 {
        let cut = length * percent / 100;
        let bytes = &recorded.bytes[..cut];
        let (code, info) = recorded.info(bytes);
        let expected = if cut == length {
            0
        } else if cut < head {
            1
        } else {
            3
        };
        assert_eq!(code, Some(expected), "cut at {percent} %");
        if cut < head {
            continue;
        }
        assert_eq!(info["complete"], cut == length, "cut at {percent} %");
        let accepted = info["steps_accepted"].as_u64().unwrap();
        assert!(accepted >= steps, "{percent} % hold {accepted} steps, fewer than {steps}");
        steps = accepted;
        if percent % 10 == 0 {
            let verified = recorded.ask(bytes, &["verify"]);
            assert_eq!(verified.status.code(), Some(expected), "cut at {percent} %: {}", said(&verified));
        }
        // Once for each checkpoint that comes within reach.
        let last = info["checkpoints"].as_array().unwrap().last().cloned();
        if let Some(last) = last.and_then(|step| step.as_u64()).filter(|_| cut < length)
            && resumed.insert(last)
        {
            recorded.goes_on();
        }
    }
    assert!(resumed.len() > 2, "{resumed:?}: the file has more checkpoints than that");
}

#[test]
fn a_flipped_byte_anywhere_is_noticed_and_never_a_panic() {
    let recorded = recorded("quick.toml");
    let whole = recorded.info(&recorded.bytes).1;
    let chunks: Vec<usize> =
        (0..recorded.records.len()).filter(|&number| recorded.records[number].opcode == CHUNK).collect();
    let last_chunk = chunks[chunks.len() - 1];
    // One record of every sort, and of the chunks a first, a middle and a last one.
    let mut sorts = BTreeSet::new();
    let some = (0..recorded.records.len()).filter(|number| {
        let first = sorts.insert(recorded.records[*number].opcode);
        first || [chunks[chunks.len() / 2], last_chunk].contains(number)
    });
    let magic = [0, recorded.bytes.len() - 1].map(|at| (0, at));
    let bytes_of = |record: &Record| {
        let body = &record.body;
        // Opcode, length, and the body's ends and middle.
        let places = [body.start - 9, body.start - 8, body.start, body.start + body.len() / 2, body.end - 1];
        places.map(|at| (record.opcode, at))
    };
    let places: Vec<(u8, usize)> = some.flat_map(|number| bytes_of(&recorded.records[number])).chain(magic).collect();
    assert!(places.len() > 60, "{} places are too few to be all regions", places.len());
    for (opcode, at) in places {
        for mask in [0x01, 0xff] {
            let mut bytes = recorded.bytes.clone();
            bytes[at] ^= mask;
            let what = format!("byte {at} of a record {opcode} ^ {mask:#x}");
            let (code, info) = recorded.info(&bytes);
            let describes = [METADATA, ATTACHMENT].contains(&opcode) || at < recorded.head();
            let told = code == Some(3) || (describes && code == Some(1));
            assert!(told, "{what}: info ends with {code:?}");
            if code == Some(3) && at > recorded.records[last_chunk].body.end {
                assert_eq!(info["steps_accepted"], whole["steps_accepted"], "{what}: the messages are all there");
            }
            let verified = recorded.ask(&bytes, &["verify"]);
            assert_ne!(verified.status.code(), Some(0), "{what}: {}", said(&verified));
            if opcode == FOOTER {
                break;
            }
        }
    }
}

#[test]
fn a_run_goes_on_from_before_the_damage() {
    // Long enough for several chunks.
    let recorded = recorded("falling-powder.toml");
    let chunks: Vec<&Record> = recorded.records.iter().filter(|record| record.opcode == CHUNK).collect();
    assert!(chunks.len() > 1);
    let last = &chunks[chunks.len() - 1].body;
    // In the last chunk, and in the index behind all of them.
    for at in [last.start + last.len() / 2, recorded.bytes.len() - 60] {
        let mut bytes = recorded.bytes.clone();
        bytes[at] ^= 0x10;
        std::fs::write(recorded.place.path("hurt.mcap"), bytes).unwrap();
        recorded.goes_on();
    }
}
