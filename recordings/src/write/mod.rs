//! Writes a recording while the run goes on.

mod journal;
mod membership;
mod queue;
mod recorder;
mod thinning;

pub use recorder::{ControlKind, Exchange, Level, Recorded, Recorder, RecorderOptions, RecorderSender};
