//! What a physics is: a pure function from a state, frozen fields and a window to the next state and a reply.

use std::collections::BTreeMap;

use serde::{Serialize, de::DeserializeOwned};
use stagger_messages::{Energy, Field, Fields, MessageError, Ports};

use crate::SolveError;

/// A window of simulated time `[t_s, t_s + dt_s]`, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Start, in s.
    pub t_s: f64,
    /// Length, in s; positive.
    pub dt_s: f64,
}

/// The other physics' fields, frozen for one trial: at the window's start and, at their newest iterate, at its end.
///
/// Where the scene holds frozen fields instead of interpolating them, both are the end-of-window iterate.
#[derive(Clone, Debug, Default)]
pub struct Frozen {
    /// Fields at the window's start.
    pub start: Fields,
    /// Fields at the window's end, newest iterate.
    pub end: Fields,
}

impl Frozen {
    /// A field at the window's start.
    ///
    /// # Errors
    /// No port reads a field of that name.
    pub fn at_start(&self, name: &str) -> Result<&Field, MessageError> {
        self.start.get(name).ok_or_else(|| MessageError::Absent(name.into()))
    }

    /// A field at the window's end, newest iterate.
    ///
    /// # Errors
    /// No port reads a field of that name.
    pub fn at_end(&self, name: &str) -> Result<&Field, MessageError> {
        self.end.get(name).ok_or_else(|| MessageError::Absent(name.into()))
    }
}

/// What a physics answers: its fields at the window's end and what happened on the way.
#[derive(Clone, Debug, Default)]
pub struct Reply {
    /// The written fields at the window's end.
    pub fields: Fields,
    /// Where rows came or went since the last commit: written fields at the window's *start*, on the rows they have in
    /// this reply. Their change is measured from these instead of from what was committed, which has other rows; of a
    /// field that is not here the values themselves then count as the change.
    pub start: Fields,
    /// False where the physics' own solver did not converge: the coordinator tries a smaller step.
    pub not_converged: Option<NotConverged>,
    /// Energy held at the window's end, gained and lost during the window, in J.
    pub ledger: Vec<Energy>,
    /// Other quantities a user should see, by name with unit: `"substep [s]"`.
    pub figures: BTreeMap<String, f64>,
}

/// A physics' own solver did not reach its tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotConverged {
    /// Why, in words that follow on a colon: what asks for a smaller step.
    pub reason: &'static str,
    /// Factor on the step size that would have converged, as the solver estimates it; in (0, 1).
    pub step_factor: f64,
}

/// A physics: a pure function from the frozen fields of a window to its own fields at the window's end.
///
/// `solve` is a trial. The same inputs give the same bytes, for any thread count, and nothing is kept until the
/// coordinator commits: that rule gives rollback, replay, restart and determinism.
pub trait Physics: Send {
    /// Everything the next window depends on. Cheap to drop: a rejected trial drops it. It is encoded for checkpoints:
    /// the values that come back must be the same bits.
    type State: Clone + Send + Serialize + DeserializeOwned;

    /// Fields read and written.
    fn ports(&self) -> Ports;

    /// The state and the written fields at t = 0, with the energy held then.
    ///
    /// # Errors
    /// The start asked for cannot be made.
    fn initial(&self) -> Result<(Self::State, Reply), SolveError>;

    /// Advances `state` over `window` with the other physics' fields frozen.
    ///
    /// # Errors
    /// The frozen fields do not fit, or a value is not finite.
    fn solve(&self, state: &Self::State, frozen: &Frozen, window: Window) -> Result<(Self::State, Reply), SolveError>;
}
