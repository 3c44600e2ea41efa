//! What happened in a run, counted and summed over its messages.

pub(crate) mod decision_log;
mod summary;
mod summary_text;
mod window_history;

pub use decision_log::{DecisionLog, Outcome};
pub use summary::{FieldErrors, NodeSummary, Summary, TopicSummary, WindowSizes};
