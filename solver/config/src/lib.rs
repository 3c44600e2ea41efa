//! Keys as data: a text in TOML is read by sections and keys that say what they hold, in which unit and range, and what
//! stands in for them; every mistake is told at once, with its place and what to do.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod files;
pub mod key;
pub mod node_values;
pub mod over_temperature;
pub mod presets;
pub mod problems;
pub mod reader;
pub mod tree;
pub mod units;
mod value;

pub use files::{Files, ReadFile};
pub use key::{Fallback, Key, Kind, Range, Section};
pub use presets::STANDARD;
pub use problems::{Problem, Problems};
pub use value::Value;
