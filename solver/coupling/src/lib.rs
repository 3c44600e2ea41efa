//! The staggered iteration between physics, and its adaptive step (Zohdi 2018, ch. 5.9, 6.4).
//!
//! A [`Physics`] is a pure function of frozen fields. A [`Participant`] holds one with its committed state and its
//! current trial, an [`Inbox`] the fields it reads. [`plan`](fn@plan) says who reads from whom; a [`Course`] decides: its
//! [`StepControl`] about each iteration, its [`Rates`] about who solves when, its [`Accelerator`]s about the next
//! iterate. [`drive`](fn@drive) runs them over an [`Ensemble`]: participants in this process or nodes of their own.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod acceleration;
mod change;
mod course;
mod drive;
mod error;
mod in_process;
mod inbox;
mod ledger;
pub mod math;
mod on_the_way;
mod participant;
mod physics;
mod plan;
mod precedent;
mod rates;
mod reach;
mod settings;
mod step_control;
mod vetting;

pub use acceleration::{Accelerator, Iterates};
pub use change::{change, order, relative};
pub use course::{Course, ledger_at};
pub use drive::{End, Ensemble, Observer, Task, drive, window_of};
pub use error::SolveError;
pub use in_process::{InProcess, InProcessError, restore, snapshot};
pub use inbox::{COORDINATOR, Inbox, resting};
pub use ledger::{Account, Ledger};
pub use participant::{Answer, Local, Participant, same};
pub use physics::{Frozen, NotConverged, Physics, Reply, Window};
pub use plan::{Measured, PlanError, System, measured, plan, systems};
pub use precedent::Precedent;
pub use rates::{Clocks, Rates, Turn, readers};
pub use reach::out_of_reach;
pub use settings::{Acceleration, FieldSettings, Order, Settings, StepSize};
pub use step_control::{ControlError, OtherRows, Outcome, Progress, StepControl};
