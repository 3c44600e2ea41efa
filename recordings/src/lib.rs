//! Recordings of a run: one MCAP file that holds every exchange, written while the run goes on and read afterwards.
//!
//! Use it to take the numbers of a run into a program of your own. [`Recorder`] writes, [`Recording`] reads, [`Summary`] says
//! what happened. A recording is plain MCAP with protobuf messages and embedded descriptors, so that other programs read it as it
//! is. Nothing here is asynchronous.
//!
//! ```
//! use stagger_recordings::{Recording, Steps};
//!
//! # let file = "../tests/end_to_end/fixtures/recorded.mcap";
//! let recording = Recording::open(file)?;
//! let (mut steps, mut hottest_k) = (Steps::default(), f64::NEG_INFINITY);
//! for message in recording.messages()? {
//!     // A step is whole when the message after its decision has come.
//!     if let Some(step) = steps.take(message?).step {
//!         let temperatures_k = step.fields["temperature"].f64()?;
//!         hottest_k = temperatures_k.iter().copied().fold(hottest_k, f64::max);
//!     }
//! }
//! assert!(hottest_k > 300.0, "{hottest_k} K");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod container;
pub mod display;
mod error;
pub mod export;
pub mod read;
mod run_info;
pub mod statistics;
pub mod write;

pub use error::RecordingError;
pub use read::{
    Body, End, History, Message, Messages, Recording, Replies, Reply, State, States, Step, Steps, Taken, Work,
    messages_from,
};
pub use run_info::RunInfo;
pub use statistics::{DecisionLog, FieldErrors, NodeSummary, Outcome, Summary, TopicSummary, WindowSizes};
pub use write::{ControlKind, Exchange, Level, Recorded, Recorder, RecorderOptions, RecorderSender};
