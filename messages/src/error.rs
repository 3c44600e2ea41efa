//! What can be wrong with a message or a field.

use crate::ValueKind;

/// What can be wrong with a message or a field.
#[derive(Debug, thiserror::Error)]
pub enum MessageError {
    /// The bytes are no protobuf message of the expected type.
    #[error("malformed {what}: {source}")]
    Malformed {
        /// The type of message expected.
        what: &'static str,
        /// What the decoder said.
        source: prost::DecodeError,
    },
    /// A part that every message of this type carries is absent.
    #[error("{what} lacks its {part}")]
    Missing {
        /// The type of message.
        what: &'static str,
        /// The part absent.
        part: &'static str,
    },
    /// The values do not fill the announced shape.
    #[error("field `{field}`: {rows} rows of {components} {kind:?} values take {expected} bytes, but {found} came")]
    Length {
        /// Name of the field.
        field: String,
        /// Rows announced.
        rows: u64,
        /// Values per row announced.
        components: u32,
        /// Type of value announced.
        kind: ValueKind,
        /// Bytes these take.
        expected: usize,
        /// Bytes received.
        found: usize,
    },
    /// A field is read as another type than it has.
    #[error("field `{field}` holds {found:?} values, not {expected:?}")]
    Kind {
        /// Name of the field.
        field: String,
        /// Type asked for.
        expected: ValueKind,
        /// Type held.
        found: ValueKind,
    },
    /// A field is asked for that is not there.
    #[error("field `{0}` is not among the frozen fields")]
    Absent(String),
    /// A field that a support's description names is not there.
    #[error("there is no field `{0}`, which holds the places of its support's points")]
    NoField(String),
    /// A field that should hold points has another number of values per row than 3 or a multiple of it.
    #[error("field `{field}` holds {components} values per row, where points in space have 3 each")]
    NoPoints {
        /// Name of the field.
        field: String,
        /// Values per row found.
        components: usize,
    },
    /// A name that cannot be part of a key expression.
    #[error("`{0}` cannot be part of a key: use letters, digits, `-` and `_`")]
    Name(String),
}
