//! What recording costs beside the bare mcap crate, and how fast a large recording is read.
//!
//! `cargo bench -p stagger-recordings --bench recording [-- FOLDER]` writes into FOLDER (the temporary one by default) and
//! removes what it wrote. The exchanges are made up: three iterations a step, each of positions, velocities, temperature
//! and absorbed power. `bare` is the mcap crate alone, given each record ready-made, in chunks as large and written the
//! same way; every level is handed the same exchanges. MB are of exchanges made, not of what a level keeps of them.

// A bench that cannot measure has nothing better to do than to end.
#![allow(clippy::expect_used, clippy::panic)]

mod bare;
mod reading;
mod run;

use std::{
    fs::File,
    path::{Path, PathBuf},
    time::Instant,
};

use stagger_recordings::{Level, Recorder, RecorderOptions};

/// Bytes of values per measurement.
const AMOUNT: usize = 400 << 20;
/// Passes over all levels in turn, so that the machine's drift hits all alike.
const PASSES: usize = 5;

fn levels(period_s: f64) -> Vec<(&'static str, RecorderOptions)> {
    let all = RecorderOptions { checkpoints: true, ..RecorderOptions::default() };
    let accepted = |every| RecorderOptions { level: Level::Accepted, every, ..all.clone() };
    let some = Some(["positions".to_owned(), "temperature".to_owned()].into());
    vec![
        ("all", all.clone()),
        ("all, with 100 frames", RecorderOptions { frame_period_s: Some(period_s), ..all.clone() }),
        ("accepted", accepted(1)),
        ("every 10th", accepted(10)),
        ("two fields of four", RecorderOptions { fields: some, ..all }),
    ]
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn main() {
    let given = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let folder = given.map_or_else(std::env::temp_dir, PathBuf::from);
    let path = folder.join(format!("stagger-bench-{}.mcap", std::process::id()));
    println!("| particles | level | MB/s made | of the bare crate | file MB | recorder's thread, s per GB made |");
    println!("|---|---|---|---|---|---|");
    for particles in [2_000, 10_000, 100_000] {
        let made = run::Run::of(particles, AMOUNT);
        let ready: Vec<_> = made.records().collect();
        let levels = levels(made.duration_s() / 100.0);
        let mut times = vec![Vec::new(); levels.len() + 1];
        let mut sizes = vec![(0, 0.0); levels.len() + 1];
        for _ in 0..PASSES {
            times[0].push(timed(&path, |file| bare::write(file, &ready)));
            sizes[0].0 = size(&path);
            for (number, (_, options)) in levels.iter().enumerate() {
                let mut busy_s = 0.0;
                times[number + 1].push(timed(&path, |file| busy_s = write(file, &made, options.clone())));
                sizes[number + 1] = (size(&path), busy_s);
            }
        }
        let made_mb = 1e-6 * made.bytes() as f64;
        let medians: Vec<f64> = times.iter_mut().map(|times| median(times)).collect();
        let names = std::iter::once("bare").chain(levels.iter().map(|(name, _)| *name));
        for ((name, time), (file, busy_s)) in names.zip(&medians).zip(&sizes) {
            println!(
                "| {particles} | {name} | {:.0} | {:.2} | {:.0} | {:.2} |",
                made_mb / time,
                medians[0] / time,
                1e-6 * *file as f64,
                1e3 * busy_s / made_mb
            );
        }
    }
    println!();
    reading::table(&path);
    std::fs::remove_file(&path).expect("the file just read");
}

/// Writes through a [`Recorder`], whose maker waits as a run does; returns the processor time of its thread, in s.
fn write(file: File, made: &run::Run, options: RecorderOptions) -> f64 {
    let recorder = Recorder::create(file, &run::info(), options).expect("a recorder");
    let sender = recorder.sender();
    for round in made.rounds() {
        round.into_iter().for_each(|exchange| sender.hand_over(exchange).expect("a recorder that takes it"));
        sender.catch_up().expect("a disk that takes it");
    }
    let busy_s = thread_s("recorder");
    recorder.finish().expect("a file that is closed");
    busy_s
}

/// Processor time of this process's thread of that name so far, in s; 0 where the system does not tell.
fn thread_s(name: &str) -> f64 {
    const TICKS_PER_S: f64 = 100.0;
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let mut total = 0.0;
    for task in tasks.filter_map(Result::ok) {
        let stat = std::fs::read_to_string(task.path().join("stat")).unwrap_or_default();
        if let Some((head, rest)) = stat.split_once(") ")
            && head.ends_with(&format!("({name}"))
        {
            let numbers: Vec<f64> = rest.split(' ').filter_map(|number| number.parse().ok()).collect();
            // After the state's letter: utime and stime are the eleventh and twelfth of the numbers that follow.
            total += numbers.iter().skip(10).take(2).sum::<f64>() / TICKS_PER_S;
        }
    }
    total
}

fn timed(path: &Path, work: impl FnOnce(File)) -> f64 {
    let file = File::create(path).expect("a file to write to");
    let begun = Instant::now();
    work(file);
    begun.elapsed().as_secs_f64()
}

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |metadata| metadata.len())
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
