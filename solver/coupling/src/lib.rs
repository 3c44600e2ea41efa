//! The staggered iteration between physics, and its adaptive step (Zohdi 2018, ch. 5.9, 6.4).
//!
//! A [`Physics`] is a pure function of frozen fields. A [`Participant`] holds one with its committed state and its
//! current trial; [`FrozenFields`] keeps the fields that it reads. [`plan`](fn@plan) says who reads from whom. A
//! [`CouplingController`] decides: its [`StepControl`] about each iteration, its [`Subcycling`] about who solves when, its
//! [`Accelerator`]s about the next iterate. [`run_loop`](fn@run_loop) runs it over an [`Ensemble`]: participants in this
//! process or nodes of their own.

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
