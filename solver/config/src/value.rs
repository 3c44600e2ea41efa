//! What a scene says, as it is shown.

use serde::Serialize;

/// A value in effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Value {
    /// Its key: `particles.radius.mean`.
    pub path: String,
    /// The value with its unit.
    pub value: String,
    /// The number in SI units, or the components of a vector; empty for a text, a choice, a flag.
    pub si: Vec<f64>,
    /// Whether it is a default.
    pub is_default: bool,
    /// What it does.
    pub doc: &'static str,
}
