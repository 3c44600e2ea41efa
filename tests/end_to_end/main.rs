//! The program as a user meets it: run, kill, interrupt, verify, replay, nodes started by hand, scenes that cannot run.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[cfg(feature = "quic")]
mod authority;
mod bad_runs;
mod by_hand;
#[cfg(feature = "quic")]
mod certificates;
mod commands;
mod current;
mod damage;
mod disk;
mod earlier;
mod exports;
mod faults;
mod files;
#[cfg(feature = "quic")]
mod guarded;
mod live;
mod pouring;
mod program;
#[path = "../../recordings/tests/raw/mod.rs"]
mod raw;
mod recovery;
mod replayed;
mod report;
mod same_bits;
mod several_hosts;
#[cfg(target_os = "linux")]
mod shared_memory;
mod supports;
mod tradeoff;
mod vapour;
