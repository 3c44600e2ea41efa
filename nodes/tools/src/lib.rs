//! What is done with scenes, recordings and nodes beside running them: check, verify, conformance, trade-offs, reports, exports.
//!
//! Use it to do in a program of your own what the commands of `stagger` do; each module is one command.
//!
//! ```
//! use stagger_scene::Scene;
//! use stagger_tools::check;
//!
//! let text = r#"
//!     duration = "1 ms"
//!     [particles]
//!     count  = 2
//!     radius = "25 um"
//!     start  = { box = ["0.3 mm", "0.3 mm", "0.3 mm"] }
//!     [coupling]
//!     dt     = "20 us"
//! "#;
//! let scene = Scene::parse(text, "two.toml", &[])?;
//! let (ports, _) = check::ports(&scene)?;
//! assert!(ports["particles"].writes.iter().any(|port| port.field == "positions"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
