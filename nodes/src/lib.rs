//! The processes of stagger: the Zenoh link, the host of a node, the coordinator, the launcher and the command line.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod advise;
mod bounded;
mod certificates;
pub mod check;
pub mod check_json;
pub mod cli;
pub mod conformance;
pub mod coordinator;
pub mod diagnostics;
pub mod endpoint;
pub mod environment;
pub mod export;
mod foreign_text;
pub mod graph;
pub mod host;
pub mod in_process;
mod interrupt;
pub mod last_words;
pub mod launcher;
pub mod link;
mod link_words;
pub mod monitor;
pub mod new_node;
pub mod node;
pub mod outputs;
pub mod pace;
pub mod plug_in;
pub mod records;
pub mod recovery;
pub mod replay;
pub mod replayed;
pub mod report;
pub mod resume;
pub mod roster;
pub mod router;
pub mod run;
pub mod scene_files;
mod settings;
mod shared_memory;
pub mod summary;
pub mod tradeoff;
mod turned_away;
pub mod verify;
pub mod view;
pub mod watchdog;
mod words;
