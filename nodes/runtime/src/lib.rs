//! The processes of a run: the Zenoh link, the host of a node, the launcher, the coordinator, and a run as a whole.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod bounded;
pub mod coordinator;
pub mod diagnostics;
mod foreign_text;
pub mod launch;
pub mod link;
pub mod node;
pub mod run;
