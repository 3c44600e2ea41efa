//! The processes of stagger: the Zenoh link, the host of a node, the coordinator, the launcher and the command line.

pub mod check;
pub mod check_json;
pub mod cli;
pub mod conformance;
pub mod coordinator;
pub mod diagnostics;
pub mod graph;
pub mod host;
pub mod in_process;
pub mod last_words;
pub mod launcher;
pub mod link;
pub mod monitor;
pub mod new_node;
pub mod node;
pub mod plug_in;
pub mod recovery;
pub mod replay;
pub mod resume;
pub mod roster;
pub mod router;
pub mod run;
pub mod scene_files;
mod settings;
pub mod summary;
pub mod verify;
pub mod view;
