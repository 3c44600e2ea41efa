//! Reads a recording: its messages, and the steps, states and replies they make up.

mod history;
pub(crate) mod recording;
mod replies;
mod states;
mod steps;

pub use history::History;
pub use recording::{Body, Message, Messages, Recording, messages_from};
pub use replies::{End, Replies, Reply};
pub use states::{State, States, Taken, Work};
pub use steps::{Step, Steps};
