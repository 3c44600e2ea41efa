//! Times and memory of reading a file of 1 GB.

use std::{fs::File, path::Path, time::Instant};

use stagger_recordings::{RecorderOptions, Recording, Summary};

use crate::{bare, run, size};

/// Writes a file of 1 GB to `path` and prints how long it takes to read it.
#[expect(clippy::print_stdout, reason = "a bench prints its table")]
pub fn table(path: &Path) {
    let made = run::Run::of(10_000, 1_000_000_000);
    let options = RecorderOptions { checkpoints: true, ..RecorderOptions::default() };
    crate::write(File::create(path).expect("a file to write to"), &made, options);
    let recording = Recording::open(path).expect("the file just written");
    println!("| of {:.2} GB | s | GB/s | peak memory of the process before, after, MB |", 1e-9 * size(path) as f64);
    println!("|---|---|---|---|");
    let row = |name: &str, work: &dyn Fn()| {
        let before = peak_mb();
        let begun = Instant::now();
        work();
        let s = begun.elapsed().as_secs_f64();
        println!("| {name} | {s:.3} | {:.2} | {before:.0}, {:.0} |", 1e-9 * size(path) as f64 / s, peak_mb());
    };
    row("plain read", &|| {
        let mut file = File::open(path).expect("the file just written");
        std::io::copy(&mut file, &mut std::io::sink()).expect("a readable file");
    });
    row("summary (what `info` does)", &|| drop(Summary::of(&recording).expect("a sound file")));
    row("every message decoded, checksums checked", &|| {
        let messages = recording.messages().expect("the file just written");
        messages.for_each(|message| drop(message.expect("a sound message")));
    });
    row("search for the last checkpoint", &|| drop(recording.checkpoint(None).expect("the file just written")));
    for share in [0.1, 0.5, 0.9] {
        let log_time = (share * made.duration_s() * 1e9) as u64;
        row(&format!("first message at {share} of the time, by our reader from the start"), &|| {
            let mut messages = recording.messages().expect("the file just written");
            let found = messages.find(|it| it.as_ref().is_ok_and(|it| it.log_time_ns >= log_time));
            assert!(found.is_some(), "a message there");
        });
        row("the same by the file's index, bare crate", &|| bare::seek(path, log_time));
    }
}

/// Largest resident memory of this process so far, in MB; 0 where the system does not tell.
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib: f64 = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).unwrap_or_default();
    1e-6 * 1024.0 * kib
}
