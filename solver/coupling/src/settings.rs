//! Settings of the coupling (Zohdi 2018, section 6.4).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// How the physics of a scene are coupled (Zohdi 2018, section 6.4). SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Whether a physics sees what others computed in the same iteration.
    pub order: Order,
    /// Names of the nodes in the order in which they solve; nodes not named follow in the default order.
    pub sequence: Vec<String>,
    /// What is done to the iterates that are fed back; `fields` may name another method for one of them.
    pub acceleration: Acceleration,
    /// Convergence and acceleration of single fields.
    pub fields: BTreeMap<String, FieldSettings>,
    /// Accepted steps from one solve of a node to the next, by node; nodes not named take part in every step.
    pub every: BTreeMap<String, u64>,
    /// Tolerance TOL of each measured field; others take `default_tolerance`.
    pub tolerance: BTreeMap<String, f64>,
    /// Tolerance of the measured fields that `tolerance` does not name.
    pub default_tolerance: f64,
    /// Iterations K_d within which a window must converge.
    pub iterations: u32,
    /// Size of the window.
    pub dt: StepSize,
    /// True: frozen fields run linearly from the window's start to their newest iterate at its end.
    /// False: they are held at the newest iterate.
    pub interpolate: bool,
    /// A node whose frozen fields changed by less than this share of their tolerance since it last solved in this
    /// attempt gives its last reply again; 0 asks for equal fields.
    pub reuse: f64,
    /// Attempts at one step that may be rejected, one after the other, before the run ends; at least 1.
    pub rejections: u32,
}

impl Settings {
    /// Steps of size `dt`, and for the rest what a scene that says nothing gets: Gauss–Seidel order, no acceleration,
    /// a tolerance of 1e-6 within 8 iterations, frozen fields interpolated, reuse below a tenth of the tolerance,
    /// an end after 50 rejections of one step.
    #[must_use]
    pub fn new(dt: StepSize) -> Self {
        Self {
            order: Order::GaussSeidel,
            sequence: Vec::new(),
            acceleration: Acceleration::None,
            fields: BTreeMap::new(),
            every: BTreeMap::new(),
            tolerance: BTreeMap::new(),
            default_tolerance: 1e-6,
            iterations: 8,
            dt,
            interpolate: true,
            reuse: 0.1,
            rejections: 50,
        }
    }

    /// Tolerance TOL of a field.
    #[must_use]
    pub fn tolerance_of(&self, field: &str) -> f64 {
        self.tolerance.get(field).copied().unwrap_or(self.default_tolerance)
    }
}

/// Order of the staggered iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Fields already solved in this iteration are new; the nodes solve one after the other.
    GaussSeidel,
    /// All fields are from the iteration before; the nodes solve at the same time.
    Jacobi,
}

/// Acceleration of the staggered iteration: how the next iterate follows from the one frozen, x, and the one
/// answered, x̃ = H(x).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Acceleration {
    /// The plain iteration: x̃ itself.
    #[default]
    None,
    /// x + ω (x̃ − x) with a constant ω.
    Constant {
        /// ω; in (0, 2).
        relaxation: f64,
    },
    /// The same with ω from the last two residuals (Küttler & Wall 2008, eq. 44).
    Aitken {
        /// ω of the first iteration of a run; in (0, 2).
        relaxation: f64,
    },
    /// Interface quasi-Newton with the inverse Jacobian from a least-squares model (Degroote, Bathe & Vierendeels 2009).
    IqnIls {
        /// ω of an iteration for which there is no model yet; in (0, 2).
        relaxation: f64,
        /// Accepted steps whose differences are used again; 0 uses those of the step alone.
        reused_steps: u32,
        /// Most differences kept.
        columns: u32,
        /// A difference is dropped that adds less than this share of its length to those before it; in (0, 1).
        filter: f64,
    },
}

/// Convergence and acceleration of one field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FieldSettings {
    /// Mean change of a row, in the field's unit, that suffices for convergence whatever the relative change.
    pub absolute: Option<f64>,
    /// Acceleration, where it is not that of the scene; the field is then accelerated by itself.
    pub acceleration: Option<Acceleration>,
}

/// Bounds of the window's size, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSize {
    /// First window.
    pub start_s: f64,
    /// Largest window Δt_lim.
    pub limit_s: f64,
    /// Smallest window Δt_min: below it the run stops.
    pub minimum_s: f64,
    /// Largest factor from one accepted window to the next; above 1.
    pub growth: f64,
}
