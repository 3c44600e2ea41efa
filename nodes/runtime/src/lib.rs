//! The processes of a run: the Zenoh link, the host of a node, the launcher, the coordinator, and a run as a whole.
//!
//! Use it to make a program a node of a run: a [`Physics`](stagger_coupling::Physics) of your own is all it needs, and
//! [`node::plug_in`] does the rest. `stagger new-node` writes such a program with its manifest, from `examples/probe.rs`.
//!
//! ```no_run
//! use std::{process::ExitCode, sync::Arc};
//! use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
//! use stagger_messages::{Field, Fields, Measure, Port, Ports};
//! use stagger_runtime::node::plug_in;
//!
//! /// How high the powder lies on average.
//! struct Height {
//!     positions: Port,
//!     mean_height: Arc<Port>,
//! }
//!
//! impl Height {
//!     fn reply(&self, mean_m: f64) -> Result<Reply, SolveError> {
//!         let field = Field::new(&self.mean_height, 0, vec![mean_m])?;
//!         Ok(Reply { fields: Fields::from([("mean_height".to_owned(), field)]), ..Reply::default() })
//!     }
//! }
//!
//! impl Physics for Height {
//!     type State = ();
//!
//!     fn ports(&self) -> Ports {
//!         Ports::new(vec![self.positions.clone()], vec![(*self.mean_height).clone()])
//!     }
//!
//!     fn initial(&self) -> Result<((), Reply), SolveError> {
//!         Ok(((), self.reply(0.0)?))
//!     }
//!
//!     fn solve(&self, _: &(), frozen: &Frozen, _: Window) -> Result<((), Reply), SolveError> {
//!         let (positions_m, _) = frozen.at_end("positions")?.f64()?.as_chunks::<3>();
//!         let sum: f64 = positions_m.iter().map(|position| position[2]).sum();
//!         Ok(((), self.reply(sum / positions_m.len().max(1) as f64)?))
//!     }
//! }
//!
//! /// `stagger run SCENE --node height=./this-program` starts it.
//! fn main() -> ExitCode {
//!     plug_in::main(|_| {
//!         Ok(Height {
//!             positions: Port::f64("positions", "m", "particles", 3, Measure::None),
//!             mean_height: Arc::new(Port::f64("mean_height", "m", "height", 1, Measure::None)),
//!         })
//!     })
//! }
//! ```

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
