//! What happened in a run, counted and summed over its messages.

pub(crate) mod accounts;
mod summary;
mod summary_text;
mod window_history;

pub use accounts::{Accounts, Outcome};
pub use summary::{FieldErrors, NodeSummary, Summary, TopicSummary, WindowSizes};
