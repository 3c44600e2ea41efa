//! Recordings of a run: one MCAP file that holds every exchange, written while the run goes on and read afterwards.
//!
//! [`Recorder`] writes, [`Recording`] reads, [`Summary`] says what happened. A recording is plain MCAP with protobuf
//! messages and embedded descriptors, so that other programs read it as it is. Nothing here is asynchronous.

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
