//! What a process is told by its environment, checked before anything rests on it.

use std::{num::NonZero, thread::available_parallelism};

use serde::Deserialize;

use crate::diagnostics;

/// Zenoh's own variable for the threads of its runtime. It panics where the value is none.
pub const ZENOH_RUNTIME: &str = "ZENOH_RUNTIME";
/// The variable that says how many threads solve.
pub const THREADS: &str = "RAYON_NUM_THREADS";
/// More threads than this for one task of Zenoh's are a mistake.
const MANY: usize = 1024;

/// Why the environment is not one to run in.
#[derive(Debug, thiserror::Error)]
#[error(
    "the environment variable {ZENOH_RUNTIME} is `{value}`: {problem}\nhint: unset it; docs/several-hosts.md shows what it may hold"
)]
pub struct EnvironmentError {
    value: String,
    problem: String,
}

/// `ZENOH_RUNTIME` as Zenoh reads it (zenoh-runtime 1.10).
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
#[derive(Default)]
struct Runtimes {
    app: Runtime,
    acc: Runtime,
    tx: Runtime,
    rx: Runtime,
    net: Runtime,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Runtime {
    worker_threads: usize,
    max_blocking_threads: usize,
    handover: Option<Name>,
}

impl Default for Runtime {
    fn default() -> Self {
        Self { worker_threads: 1, max_blocking_threads: 1, handover: None }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Name {
    App,
    Acc,
    Tx,
    Rx,
    Net,
}

/// Checks what Zenoh reads from the environment.
///
/// # Errors
/// A value that it cannot read.
pub fn check() -> Result<(), EnvironmentError> {
    let Some(value) = std::env::var_os(ZENOH_RUNTIME) else { return Ok(()) };
    let value = value.to_string_lossy();
    check_runtime(&value).map_err(|problem| EnvironmentError { value: value.chars().take(200).collect(), problem })
}

fn check_runtime(value: &str) -> Result<(), String> {
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let runtimes: Runtimes = options.from_str(value).map_err(|error| error.to_string())?;
    let Runtimes { app, acc, tx, rx, net } = runtimes;
    let counts = [app, acc, tx, rx, net].map(|runtime| [runtime.worker_threads, runtime.max_blocking_threads]);
    match counts.into_iter().flatten().find(|count| !(1..=MANY).contains(count)) {
        Some(count) => Err(format!("expected 1 to {MANY} threads, found {count}")),
        None => Ok(()),
    }
}

/// How many threads solve in this process, and in those it starts: as many as are `asked` for, or else as `RAYON_NUM_THREADS`
/// says, but no more than there are processors. `None` is one for each. The results do not depend on it.
pub fn set_threads(asked: Option<usize>) -> Option<usize> {
    let threads = match asked {
        Some(asked) => Some(at_most_processors("--threads", asked)),
        None => from_environment(),
    }?;
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global() {
        diagnostics::warn(&format!("cannot set the number of threads: {error}"));
    }
    Some(threads)
}

fn from_environment() -> Option<usize> {
    let value = std::env::var_os(THREADS)?;
    match value.to_str().and_then(|value| value.trim().parse().ok()) {
        // Rayon's own word for one for each processor.
        Some(0) => None,
        Some(asked) => Some(at_most_processors(THREADS, asked)),
        None => {
            let value = value.to_string_lossy();
            diagnostics::warn(&format!("{THREADS} is `{value}`, where a number is expected: it is ignored"));
            None
        }
    }
}

fn at_most_processors(source: &str, asked: usize) -> usize {
    let processors = available_parallelism().map_or(1, NonZero::get);
    if asked > processors {
        diagnostics::warn(&format!(
            "{source} asks for {asked} threads: {processors} are used, as this machine has {processors} processors for it"
        ));
    }
    asked.min(processors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_zenoh_would_panic_at_is_told() {
        for good in ["()", "(rx: (handover: app), app: (worker_threads: 2))", crate::launch::ONE_THREAD] {
            check_runtime(good).unwrap();
        }
        for bad in
            ["", "nonsense", "(app: 3)", "(app: (worker_threads: 0))", "(app: (worker_threads: 99999999))", "(web: ())"]
        {
            check_runtime(bad).unwrap_err();
        }
        assert!(check_runtime("(rx: (handover: web))").is_err());
    }
}
