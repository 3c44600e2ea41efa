use std::collections::BTreeMap;

/// How the physics of a scene are coupled (Zohdi 2018, section 6.4). SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Whether a physics sees what others computed in the same iteration.
    pub order: Order,
    /// Names of the nodes in the order in which they solve; nodes not named follow in the default order.
    pub sequence: Vec<String>,
    /// What is done to the iterates.
    pub acceleration: Acceleration,
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
}

impl Settings {
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

/// Acceleration of the staggered iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acceleration {
    /// The plain iteration.
    None,
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
