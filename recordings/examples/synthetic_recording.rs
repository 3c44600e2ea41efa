//! Writes a made-up run to a file, for trying readers and the view: `cargo run --example synthetic_recording -- OUT.mcap`.

#[path = "../tests/synthetic/mod.rs"]
mod synthetic;

use std::{error::Error, fs::File};

use stagger_recordings::{Level, Recorder, RecorderOptions};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: synthetic_recording OUT.mcap [EVERY-NTH-STEP]")?;
    let every = arguments.next().map(|text| text.parse()).transpose()?;
    let options = RecorderOptions {
        level: if every.is_some() { Level::Accepted } else { Level::All },
        every: every.unwrap_or(1),
        ..RecorderOptions::default()
    };
    let recorder = Recorder::create(File::create(path)?, &synthetic::info(), options)?;
    let sender = recorder.sender();
    for exchange in synthetic::exchanges(synthetic::Script { particles: 300, steps: 200, dt_s: 1e-4 }) {
        sender.push(exchange)?;
    }
    recorder.finish()?;
    Ok(())
}
