//! The staggered iteration between physics, and its adaptive step (Zohdi 2018, ch. 5.9, 6.4).
//!
//! Use it to couple physics of your own in one process, or to find out what the coordinator of a run decides and why.
//!
//! A [`Physics`] is a pure function of frozen fields. A [`Participant`] holds one with its committed state and its
//! current trial; [`FrozenFields`] keeps the fields that it reads. [`plan`](fn@plan) says who reads from whom. A
//! [`CouplingController`] decides: its [`StepControl`] about each iteration, its [`Subcycling`] about who solves when, its
//! [`Accelerator`]s about the next iterate. [`run_loop`](fn@run_loop) runs it over an [`Ensemble`]: participants in this
//! process or nodes of their own.
//!
//! ```
//! use std::sync::Arc;
//! use stagger_coupling::{Frozen, Local, Participant, Physics, Reply, SolveError, Window};
//! use stagger_messages::{Field, Fields, Measure, Port, Ports, Version};
//!
//! /// dc/dt = −c/s, by the implicit Euler method.
//! struct Decay(Arc<Port>);
//!
//! impl Decay {
//!     fn reply(&self, c: f64) -> Result<Reply, SolveError> {
//!         let fields = Fields::from([("concentration".to_owned(), Field::new(&self.0, 0, vec![c])?)]);
//!         Ok(Reply { fields, ..Reply::default() })
//!     }
//! }
//!
//! impl Physics for Decay {
//!     type State = f64;
//!
//!     fn ports(&self) -> Ports {
//!         Ports::new(Vec::new(), vec![(*self.0).clone()])
//!     }
//!
//!     fn initial(&self) -> Result<(f64, Reply), SolveError> {
//!         Ok((1.0, self.reply(1.0)?))
//!     }
//!
//!     fn solve(&self, c: &f64, _: &Frozen, window: Window) -> Result<(f64, Reply), SolveError> {
//!         let c = c / (1.0 + window.dt_s);
//!         Ok((c, self.reply(c)?))
//!     }
//! }
//!
//! let port = Port::f64("concentration", "1", "vessel", 1, Measure::Magnitude);
//! let mut node = Local::new("decay", Decay(Arc::new(port)));
//! node.initial()?;
//! // A trial may be solved again with another window; what is committed is the start of the next.
//! let version = Version::first(1);
//! node.solve(version, Window { t_s: 0.0, dt_s: 1.0 }, &Frozen::default())?;
//! let answer = node.solve(version.next_attempt(), Window { t_s: 0.0, dt_s: 0.25 }, &Frozen::default())?;
//! node.commit(version.next_attempt())?;
//! assert_eq!(answer.fields["concentration"].f64()?, [0.8]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod acceleration;
mod controller;
mod convergence;
mod error;
mod frozen_fields;
mod in_process;
mod ledger;
pub mod math;
mod on_the_way;
mod participant;
mod physics;
mod plan;
mod reach;
mod recorded_schedule;
mod run_loop;
mod settings;
mod step_control;
mod subcycling;
mod validation;

pub use acceleration::{Accelerator, Iterates};
pub use controller::{CouplingController, ledger_at};
pub use convergence::{change, order, relative};
pub use error::SolveError;
pub use frozen_fields::{COORDINATOR, FrozenFields, resting};
pub use in_process::{InProcess, InProcessError, restore, snapshot};
pub use ledger::{Account, Ledger};
pub use participant::{Answer, Local, Participant, same};
pub use physics::{Frozen, NotConverged, Physics, Reply, Window};
pub use plan::{Measured, PlanError, System, measured, plan, systems};
pub use reach::out_of_reach;
pub use recorded_schedule::RecordedSchedule;
pub use run_loop::{End, Ensemble, Listener, Task, run_loop, window_of};
pub use settings::{Acceleration, FieldSettings, Order, Settings, StepSize};
pub use step_control::{ControlError, OtherRows, Outcome, Progress, StepControl};
pub use subcycling::{Clocks, Group, Subcycling, observers};
