//! Why a physics cannot be set up or a window not be solved.

use stagger_messages::MessageError;

/// Why a physics could not be set up or a window not be solved.
///
/// Not converging is no error: it is [`crate::Reply::not_converged`].
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// A frozen field is absent or of the wrong type.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// A value that is not finite: the step may succeed when it is smaller.
    #[error("{node}: field `{field}` is {value} in row {row}: the step is too large or an input is not physical")]
    NotFinite {
        /// The node whose reply it is.
        node: String,
        /// The field.
        field: String,
        /// The row.
        row: usize,
        /// The value.
        value: f64,
    },
    /// An energy that is not finite, where all fields are: the step may succeed when it is smaller.
    #[error("{node}: the energy `{name}` is {joule} J: an input is not physical or its unit is another")]
    Energy {
        /// The node whose reply it is.
        node: String,
        /// The entry of its ledger.
        name: String,
        /// The value, in J.
        joule: f64,
    },
    /// A figure that is not a number: the step may succeed when it is smaller.
    #[error("{node}: the figure `{name}` is {value}: an input is not physical, or it is divided by nothing")]
    Figure {
        /// The node whose reply it is.
        node: String,
        /// The figure.
        name: String,
        /// The value.
        value: f64,
    },
    /// Frozen fields do not fit together or do not fit the scene.
    #[error("{0}")]
    Mismatch(String),
    /// A state that cannot be encoded, or one that is none of this physics.
    #[error("node `{node}`: its state cannot be {what}: {source}")]
    Snapshot {
        /// The node.
        node: String,
        /// What was tried.
        what: &'static str,
        /// What the encoding said.
        source: postcard::Error,
    },
    /// A physics' own solver failed, and a shorter window would not help.
    #[error("{0}")]
    Unsolved(String),
    /// A recorded node has no answer, or failed when it was recorded.
    #[error("{message}")]
    Replayed {
        /// Why, in words.
        message: String,
        /// Whether it failed so that a smaller step helped.
        retry: bool,
    },
    /// The start configuration asked for cannot be made.
    #[error("{0}")]
    Start(String),
}

impl SolveError {
    /// Whether the same window may succeed when it is shorter.
    #[must_use]
    pub fn retry(&self) -> bool {
        matches!(
            self,
            Self::NotFinite { .. } | Self::Energy { .. } | Self::Figure { .. } | Self::Replayed { retry: true, .. }
        )
    }
}
