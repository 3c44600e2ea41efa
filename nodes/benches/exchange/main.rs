//! One coupling iteration between two trivial nodes and the coordinator, each a process of its own, beside a bare Zenoh
//! ping-pong of the same payloads in the same run.
//!
//! `cargo bench -p stagger-nodes --bench exchange` prints medians over the rounds, in µs, for N rows of three f64 each
//! way. `direct` is a ping-pong of two processes with nothing between them; `hub` passes through a third, as the
//! fields of two nodes do. All use Unix sockets, shared memory for large payloads, and copy a payload out on arrival.

mod bare;
mod coupled;

use std::{
    path::PathBuf,
    process::{Child, Stdio},
};

const SIZES: [usize; 4] = [1, 1_000, 10_000, 100_000];
/// Passes over all sizes and systems in turn, so that the machine's drift hits all alike.
const PASSES: usize = 5;

/// Rounds timed per pass.
fn rounds(rows: usize) -> usize {
    if rows >= 100_000 { 60 } else { 400 }
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    match arguments.get(1).map(String::as_str) {
        Some("echo") => return bare::echo(&arguments[2]),
        Some("hub") => return bare::hub(&arguments[2]),
        Some("node") => return coupled::node(&arguments[2..]),
        // One measurement a process: what a session maps of others' shared memory it keeps until its process ends.
        Some("measure") => {
            let rows = arguments[3].parse().expect("a number of rows");
            let time = match arguments[2].as_str() {
                "direct" => bare::ping_pong(rows, rounds(rows), false),
                "hub" => bare::ping_pong(rows, rounds(rows), true),
                _ => coupled::iterations(rows, rounds(rows)),
            };
            return println!("{time}");
        }
        _ => {}
    }
    println!("median µs per round of {PASSES} passes (fastest and slowest pass in brackets)");
    println!(
        "{:>8} {:>24} {:>24} {:>24} {:>8} {:>8}",
        "N x 3", "bare, direct", "bare, by a hub", "stagger iteration", "/direct", "/hub"
    );
    for rows in SIZES {
        let mut times: [Vec<f64>; 3] = Default::default();
        for _ in 0..PASSES {
            for (system, times) in ["direct", "hub", "stagger"].into_iter().zip(&mut times) {
                times.push(measure(system, rows));
            }
        }
        let [direct, hub, ours] = times.map(|mut passes| {
            passes.sort_by(f64::total_cmp);
            (passes[passes.len() / 2], passes[0], passes[passes.len() - 1])
        });
        let shown = |(median, low, high): (f64, f64, f64)| format!("{median:.0} [{low:.0}, {high:.0}]");
        println!(
            "{rows:>8} {:>24} {:>24} {:>24} {:>8.2} {:>8.2}",
            shown(direct),
            shown(hub),
            shown(ours),
            ours.0 / direct.0,
            ours.0 / hub.0
        );
    }
}

fn measure(system: &str, rows: usize) -> f64 {
    let mut child = spawn(&["measure", system, &rows.to_string()], Stdio::piped());
    let mut result = String::new();
    let output = child.stdout.as_mut().expect("it is piped");
    std::io::Read::read_to_string(output, &mut result).expect("a child prints text");
    assert!(child.wait().expect("a child ends").success(), "{system} with {rows} rows failed");
    result.trim().parse().expect("a child prints its median")
}

/// A fresh socket.
fn endpoint(name: &str) -> (String, PathBuf) {
    let folder = std::env::temp_dir().join(format!("stagger-bench-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the temporary directory is writable");
    (format!("unixsock-stream/{}/hub.sock", folder.display()), folder)
}

/// This program again, in another role, with the same one-thread runtime as a node.
fn spawn(arguments: &[&str], stdout: Stdio) -> Child {
    let one = "(app: (worker_threads: 1), rx: (handover: app), tx: (handover: app), acc: (handover: app), net: (handover: app))";
    std::process::Command::new(std::env::current_exe().expect("a running program has a path"))
        .args(arguments)
        .env("ZENOH_RUNTIME", one)
        .stdin(Stdio::piped())
        .stdout(stdout)
        .spawn()
        .expect("this program can be started again")
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
