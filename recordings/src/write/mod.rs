//! Writes a recording while the run goes on.

mod admission_filter;
mod queue;
mod record_writer;
mod recorder;
mod thinning;

pub use recorder::{ControlKind, Exchange, Level, Recorded, Recorder, RecorderOptions, RecorderSender};
