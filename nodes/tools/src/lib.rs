//! What is done with scenes, recordings and nodes beside running them: check, verify, conformance, trade-offs, reports, exports.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod check;
pub mod conformance;
pub mod export;
pub mod new_node;
pub mod replay;
pub mod report;
pub mod tradeoff;
pub mod verify;
