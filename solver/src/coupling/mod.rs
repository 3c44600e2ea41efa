//! The staggered iteration between physics, and its adaptive step (Zohdi 2018, ch. 5.9, 6.4).
//!
//! A [`Physics`] is a pure function of frozen fields. A [`Participant`] holds one with its committed state and its
//! current trial. [`plan`](fn@plan) says who reads from whom, [`StepControl`] decides about each iteration, and
//! [`drive`](fn@drive) runs them over an [`Ensemble`]: participants in this process or nodes of their own.

mod acceleration;
mod change;
mod drive;
mod in_process;
mod ledger;
mod participant;
mod physics;
mod plan;
mod settings;
mod step_control;

pub use acceleration::{Accelerator, Iterates};
pub use change::{change, order, relative};
pub use drive::{End, Ensemble, Observer, Task, drive};
pub use in_process::{InProcess, InProcessError, freeze};
pub use ledger::{Account, Ledger};
pub use participant::{Answer, Local, Participant, same};
pub use physics::{Frozen, NotConverged, Physics, Reply, Window};
pub use plan::{PlanError, measured, plan};
pub use settings::{Acceleration, FieldSettings, Order, Settings, StepSize};
pub use step_control::{ControlError, Outcome, StepControl};
