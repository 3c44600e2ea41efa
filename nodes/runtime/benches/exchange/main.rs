//! One coupling iteration between two trivial nodes and the coordinator, each a process of its own, beside ping-pongs of
//! the same payloads in the same run.
//!
//! `cargo bench -p stagger-runtime --bench exchange` prints medians over the rounds, in µs, for N rows of three f64 each
//! way. `socket` is a plain Unix socket between two processes: what this machine can do. `direct` is Zenoh between two
//! processes with nothing between them; `hub` is Zenoh through a third, as the fields of two nodes go: four messages on
//! the way, as in an iteration in Gauss–Seidel order (directive, field in and out of the hub, reply). All Zenoh rows use
//! Unix sockets and shared memory for large payloads, and copy a payload out on arrival, as a solver does.
//!
//! A second table has the iteration with an acceleration, two nodes, and plain rings of three to five nodes.

// A bench that cannot measure has nothing better to do than to end.
#![allow(clippy::expect_used, clippy::panic)]

mod bare;
mod coupled;
mod socket;

use stagger_coupling::{Acceleration, Order};
use std::{
    path::PathBuf,
    process::{Child, Command, Stdio},
};

const SYSTEMS: [&str; 5] = ["socket", "direct", "hub", "gauss-seidel", "jacobi"];
const FURTHER: [&str; 6] = ["hub", "aitken", "iqn-ils", "ring-3", "ring-4", "ring-5"];
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
        Some("mirror") => return socket::mirror(&arguments[2], &arguments[3]),
        Some("node") => return coupled::node(&arguments[2..]),
        // One measurement a process: what a session maps of others' shared memory it keeps until its process ends.
        Some("measure") => {
            let rows = arguments[3].parse().expect("a number of rows");
            let time = match arguments[2].as_str() {
                "socket" => socket::ping_pong(rows, rounds(rows)),
                "direct" => bare::ping_pong(rows, rounds(rows), false),
                "hub" => bare::ping_pong(rows, rounds(rows), true),
                system => {
                    let order = if system == "jacobi" { Order::Jacobi } else { Order::GaussSeidel };
                    let nodes = system.strip_prefix("ring-").map_or(2, |nodes| nodes.parse().expect("a number"));
                    coupled::iterations(rows, rounds(rows), nodes, order, acceleration(system))
                }
            };
            return println!("{time}");
        }
        _ => {}
    }
    println!("median µs per round, {PASSES} passes (fastest and slowest pass in brackets)");
    let head = SYSTEMS.map(|system| format!("{system:>22}")).concat();
    println!("{:>8}{head} {:>10} {:>10}", "N x 3", "seidel/hub", "/direct");
    for rows in SIZES {
        let (shown, [_, direct, hub, seidel, _]) = row(SYSTEMS, rows);
        println!("{rows:>8}{shown} {:>10.2} {:>10.2}", seidel / hub, seidel / direct);
    }
    println!("\nrings over as many halves of a hub's round as they have nodes");
    let head = FURTHER.map(|system| format!("{system:>22}")).concat();
    println!("{:>8}{head} {:>7} {:>7} {:>7}", "N x 3", "3/hub", "4/hub", "5/hub");
    for rows in SIZES {
        let (shown, [hub, _, _, three, four, five]) = row(FURTHER, rows);
        let [three, four, five] =
            [(three, 3.0), (four, 4.0), (five, 5.0)].map(|(time, nodes)| 2.0 * time / nodes / hub);
        println!("{rows:>8}{shown} {three:>7.2} {four:>7.2} {five:>7.2}");
    }
}

fn acceleration(system: &str) -> Acceleration {
    match system {
        "aitken" => Acceleration::Aitken { relaxation: 0.5 },
        "iqn-ils" => Acceleration::IqnIls { relaxation: 0.5, reused_steps: 8, columns: 20, filter: 1e-6 },
        _ => Acceleration::None,
    }
}

/// Medians of the systems for one size, as shown and as numbers.
fn row<const N: usize>(systems: [&str; N], rows: usize) -> (String, [f64; N]) {
    let mut times = systems.map(|_| Vec::new());
    for _ in 0..PASSES {
        for (system, times) in systems.into_iter().zip(&mut times) {
            times.push(measure(system, rows));
        }
    }
    let medians = times.map(|mut passes| {
        passes.sort_by(f64::total_cmp);
        (passes[passes.len() / 2], passes[0], passes[passes.len() - 1])
    });
    let shown = medians.map(|(median, low, high)| format!("{:>22}", format!("{median:.0} [{low:.0}, {high:.0}]")));
    (shown.concat(), medians.map(|(median, ..)| median))
}

fn measure(system: &str, rows: usize) -> f64 {
    let mut child = program(&["measure", system, &rows.to_string()]);
    // A coordinator passes messages on, and a hub that has one thread for both directions locks itself out.
    if ["socket", "direct", "hub"].contains(&system) {
        child.env(RUNTIME, ONE_THREAD);
    }
    let mut child = child.stdout(Stdio::piped()).spawn().expect("this program can be started again");
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

const RUNTIME: &str = "ZENOH_RUNTIME";
const ONE_THREAD: &str =
    "(app: (worker_threads: 1), rx: (handover: app), tx: (handover: app), acc: (handover: app), net: (handover: app))";

/// This program again, in another role.
fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("a running program has a path"));
    command.args(arguments).env_remove(RUNTIME).stdin(Stdio::piped());
    command
}

/// A process at the end of one link, with the same one-thread runtime as a node.
fn spawn(arguments: &[&str]) -> Child {
    let mut command = program(arguments);
    command.env(RUNTIME, ONE_THREAD).stdout(Stdio::null()).spawn().expect("this program can be started again")
}

/// A process that passes messages on.
fn spawn_hub(endpoint: &str) -> Child {
    program(&["hub", endpoint]).stdout(Stdio::null()).spawn().expect("this program can be started again")
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
