//! The processes of stagger: the Zenoh link, the host of a node, the coordinator, the launcher and the command line.

pub mod check;
pub mod cli;
pub mod coordinator;
pub mod diagnostics;
pub mod host;
pub mod in_process;
pub mod launcher;
pub mod link;
mod mailbox;
pub mod monitor;
pub mod node;
pub mod replay;
pub mod roster;
pub mod router;
pub mod run;
mod settings;
pub mod summary;
pub mod verify;
pub mod view;
