//! Recordings of a run: one MCAP file that holds every exchange, written while the run goes on and read afterwards.
//!
//! [`Recorder`] writes, [`Recording`] reads, [`Summary`] says what happened. A recording is plain MCAP with protobuf
//! messages and embedded descriptors, so that other programs read it as it is. Nothing here is asynchronous.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod accounts;
pub mod colour;
mod container;
mod display;
mod error;
mod history;
mod journal;
mod membership;
mod queue;
mod recorder;
mod recording;
mod replies;
mod run_info;
mod states;
mod steps;
mod summary;
mod summary_text;
mod thinning;
pub mod vtp;
mod window_history;

pub use accounts::{Accounts, Outcome};
pub use error::RecordingError;
pub use history::History;
pub use recorder::{ControlKind, Exchange, Level, Recorded, Recorder, RecorderOptions, RecorderSender};
pub use recording::{Body, Message, Messages, Recording, messages_from};
pub use replies::{End, Replies, Reply};
pub use run_info::RunInfo;
pub use states::{State, States, Taken, Work};
pub use steps::{Step, Steps};
pub use summary::{FieldErrors, NodeSummary, Summary, TopicSummary, WindowSizes};
