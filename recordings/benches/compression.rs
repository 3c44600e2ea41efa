//! What compression would save in real recordings, and how fast it would be, in pure Rust.
//!
//! `cargo bench -p stagger-recordings --bench compression -- FILE.mcap...` takes the values of all fields of each file, in
//! pieces as large as its chunks, as they are, with their bytes shuffled (first bytes of all numbers, then second ones,
//! …), and as the difference in bits to the message before on the same topic, shuffled too. Ratios are packed over plain.

// A bench that cannot measure has nothing better to do than to end.
#![allow(clippy::expect_used, clippy::panic)]

use std::{collections::BTreeMap, time::Instant};

use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use stagger_recordings::{Body, Recording};

/// Bytes compressed at once: as large as a chunk.
const PIECE: usize = 4 << 20;
/// Bytes of values taken of each file at most.
const ENOUGH: usize = 64 << 20;
const F64_BYTES: usize = 8;

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn main() {
    println!("| recording | values MB | form | lz4 ratio | lz4 MB/s | back MB/s | zstd ratio | zstd MB/s |");
    println!("|---|---|---|---|---|---|---|---|");
    for path in std::env::args().skip(1).filter(|argument| !argument.starts_with('-')) {
        let name = path.rsplit('/').next().unwrap_or_default().trim_end_matches(".mcap").to_owned();
        let [plain, shuffled, differences] = forms(&path);
        for (form, bytes) in [("as it is", plain), ("shuffled", shuffled), ("difference, shuffled", differences)] {
            let lz4 = packed(&bytes, lz4_flex::block::compress_prepend_size);
            let back = rate(&bytes, || {
                lz4.0
                    .iter()
                    .map(|piece| lz4_flex::block::decompress_size_prepended(piece).expect("own data").len())
                    .sum()
            });
            let zstd = packed(&bytes, |piece| compress_to_vec(piece, CompressionLevel::Fastest));
            let ratio = |pieces: &[Vec<u8>]| pieces.iter().map(Vec::len).sum::<usize>() as f64 / bytes.len() as f64;
            println!(
                "| {name} | {:.0} | {form} | {:.2} | {:.0} | {back:.0} | {:.2} | {:.0} |",
                1e-6 * bytes.len() as f64,
                ratio(&lz4.0),
                lz4.1,
                ratio(&zstd.0),
                zstd.1
            );
        }
    }
}

/// The pieces packed, and the rate, in MB of input per second.
fn packed(bytes: &[u8], pack: impl Fn(&[u8]) -> Vec<u8>) -> (Vec<Vec<u8>>, f64) {
    let mut pieces = Vec::new();
    let rate = rate(bytes, || {
        pieces = bytes.chunks(PIECE).map(&pack).collect();
        pieces.len()
    });
    (pieces, rate)
}

fn rate(bytes: &[u8], work: impl FnOnce() -> usize) -> f64 {
    let begun = Instant::now();
    std::hint::black_box(work());
    1e-6 * bytes.len() as f64 / begun.elapsed().as_secs_f64()
}

/// Values of a recording in the three forms.
fn forms(path: &str) -> [Vec<u8>; 3] {
    let recording = Recording::open(path).expect("a recording");
    let mut forms = [Vec::new(), Vec::new(), Vec::new()];
    let mut before: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    for message in recording.messages().expect("a recording").map_while(Result::ok) {
        let Body::Field(received) = message.body else { continue };
        let Some(field) = received.field else { continue };
        let bytes = field.values().bytes();
        forms[0].extend_from_slice(bytes);
        if field.f64().is_err() {
            forms[1].extend_from_slice(bytes);
            forms[2].extend_from_slice(bytes);
            continue;
        }
        forms[1].extend(shuffled(bytes));
        let last = before.entry(message.topic).or_default();
        // Where rows came or went there is nothing to compare with.
        let difference: Vec<u8> = match last.len() == bytes.len() {
            true => bytes.iter().zip(last.iter()).map(|(now, then)| now ^ then).collect(),
            false => bytes.to_vec(),
        };
        forms[2].extend(shuffled(&difference));
        *last = bytes.to_vec();
        if forms[0].len() > ENOUGH {
            break;
        }
    }
    forms
}

fn shuffled(bytes: &[u8]) -> impl Iterator<Item = u8> + '_ {
    (0..F64_BYTES).flat_map(move |place| bytes.iter().skip(place).step_by(F64_BYTES).copied())
}
