//! Keys as data: a text in TOML is read by sections and keys that say what they hold, in which unit and range, and what
//! stands in for them; every mistake is told at once, with its place and what to do.
//!
//! Use it to give a table of a scene to a physics of your own. The reference of all keys, the JSON schema and `check` come from
//! the same descriptions.
//!
//! ```
//! use stagger_config::{
//!     Key, Kind, Problems, Range, Section, files,
//!     reader::{Log, Table},
//!     tree,
//!     units::{LENGTH, TIME},
//! };
//!
//! static RADIUS: Key = Key::new("radius", Kind::Number(&LENGTH, Range::POSITIVE), "Radius of the vessel.");
//! static HALF_LIFE: Key = Key::new("half-life", Kind::Number(&TIME, Range::POSITIVE), "Time to half.").or("\"1 ms\"");
//! static VESSEL: Section =
//!     Section { path: "vessel", doc: "A vessel.", example: "{ radius = 1 }", shorthand: None, keys: &[&RADIUS, &HALF_LIFE] };
//!
//! let read = |text: &str| {
//!     let entries = tree::parse(text).map_err(|mistakes| Problems::new("vessel.toml", &[], mistakes))?;
//!     let log = Log::new(&files::none);
//!     let table = Table::root(&log, &VESSEL, &entries);
//!     let values = [table.number(&RADIUS), table.number(&HALF_LIFE)];
//!     table.finish();
//!     let mistakes = log.mistakes.take();
//!     if mistakes.is_empty() { Ok(values) } else { Err(Problems::new("vessel.toml", &[], mistakes)) }
//! };
//! assert_eq!(read("radius = \"25 um\"")?, [25e-6, 1e-3]);
//! let told = read("raduis = \"25 um\"").err().ok_or("a mistake is told")?.to_string();
//! assert!(told.contains("did you mean `radius`?"), "{told}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
