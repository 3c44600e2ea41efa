//! Recordings of a run: one MCAP file that holds every exchange, written while the run goes on and read afterwards.
//!
//! [`Recorder`] writes, [`Recording`] reads, [`Summary`] says what happened. A recording is plain MCAP with protobuf
//! messages and embedded descriptors, so that other programs read it as it is. Nothing here is asynchronous.

mod accounts;
mod container;
mod display;
mod error;
mod history;
mod journal;
mod membership;
mod queue;
mod recorder;
mod recording;
mod run_info;
mod steps;
mod summary;
mod summary_text;
mod thinning;
pub mod vtp;

pub use accounts::{Accounts, Outcome};
pub use error::RecordingError;
pub use history::History;
pub use recorder::{ControlKind, Exchange, Level, Recorded, Recorder, RecorderOptions, RecorderSender};
pub use recording::{Body, Message, Messages, Recording, messages_from};
pub use run_info::RunInfo;
pub use steps::{Step, Steps};
pub use summary::{NodeSummary, Summary, TopicSummary, WindowSizes};
