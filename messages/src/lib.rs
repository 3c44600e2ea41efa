//! What crosses a process boundary in stagger: the protobuf schemas, the [`Field`], the key expressions and the codec.
//!
//! Use it to read or write fields in a program that is not a node: nothing here does I/O. The `.proto` files under
//! `messages/proto` are the documentation of the wire for authors in any language; [`codec`] says how a field is split into
//! an attachment and a payload.
//!
//! ```
//! use std::sync::Arc;
//! use stagger_messages::{Envelope, Field, Measure, Port, Version, codec};
//!
//! // The temperatures of two particles, as one process sends and another receives them.
//! let port = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude));
//! let sent = Field::new(&port, 0, vec![300.0, 310.0])?;
//! let envelope = Envelope { version: Some(Version::first(1)), ..Envelope::default() };
//! let attachment = codec::field_attachment(&envelope, &sent, None);
//! let payload = sent.values().bytes().clone();
//!
//! let received = codec::decode_field(&attachment, payload)?.field.ok_or("no values were sent")?;
//! assert_eq!(received.f64()?, [300.0, 310.0]);
//! assert_eq!((received.name(), received.port.unit.as_str()), ("temperature", "K"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

use std::borrow::Cow;

pub mod codec;
mod error;
mod field;
pub mod keys;
mod shown;
mod support;

pub use error::MessageError;
pub use field::{Field, Fields, Values};
pub use schema::*;
pub use shown::Shown;
pub use support::{Supports, Told, kind};

/// The types generated from `messages/proto`.
mod schema {
    // Generated: the comments of the .proto files are its documentation, and its lints are prost's concern.
    #![allow(missing_docs, clippy::all, unused_qualifications)]
    include!(concat!(env!("OUT_DIR"), "/stagger.v1.rs"));
}

/// Version of the schemas; a message with another one is refused.
pub const SCHEMA_VERSION: u32 = 2;

/// The compiled `FileDescriptorSet` of all schemas, for embedding in recordings.
pub const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));

impl Version {
    /// The initial state, before the first step.
    pub const INITIAL: Self = Self { step: 0, attempt: 0, iteration: 0 };

    /// The first iteration of the first attempt at a step.
    #[must_use]
    pub const fn first(step: u64) -> Self {
        Self { step, attempt: 1, iteration: 1 }
    }

    /// The next iteration of the same attempt.
    #[must_use]
    pub const fn next_iteration(self) -> Self {
        Self { iteration: self.iteration + 1, ..self }
    }

    /// The first iteration of the next attempt at the same step.
    #[must_use]
    pub const fn next_attempt(self) -> Self {
        Self { attempt: self.attempt + 1, iteration: 1, ..self }
    }
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "step {}, attempt {}, iteration {}", self.step, self.attempt, self.iteration)
    }
}

impl Checkpoint {
    /// The version all nodes hold.
    #[must_use]
    pub fn version(&self) -> Version {
        self.envelope.as_ref().and_then(|envelope| envelope.version).unwrap_or_default()
    }
}

impl ValueKind {
    /// Bytes of one value.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::F64 => 8,
            Self::U32 => 4,
            Self::U8 => 1,
            Self::Unspecified => 0,
        }
    }
}

impl Port {
    /// A field of binary64 values: `components` per row of `support`, in `unit`, converging by `measure`.
    #[must_use]
    pub fn f64(field: &str, unit: &str, support: &str, components: u32, measure: Measure) -> Self {
        Self {
            field: field.into(),
            unit: unit.into(),
            support: support.into(),
            components,
            kind: ValueKind::F64.into(),
            measure: measure.into(),
            adds_up: false,
            optional: false,
        }
    }

    /// A field of indices: `components` per row of `support`.
    #[must_use]
    pub fn u32(field: &str, support: &str, components: u32) -> Self {
        Self::whole(field, support, components, ValueKind::U32)
    }

    /// A field of flags and other small whole numbers: `components` per row of `support`.
    #[must_use]
    pub fn u8(field: &str, support: &str, components: u32) -> Self {
        Self::whole(field, support, components, ValueKind::U8)
    }

    fn whole(field: &str, support: &str, components: u32, kind: ValueKind) -> Self {
        Self {
            field: field.into(),
            unit: "1".into(),
            support: support.into(),
            components,
            kind: kind.into(),
            measure: Measure::None.into(),
            adds_up: false,
            optional: false,
        }
    }

    /// The same field as a reader announces it: how it converges is its writer's matter.
    #[must_use]
    pub fn as_read(&self) -> Self {
        Self { measure: Measure::None.into(), ..self.clone() }
    }

    /// The same field as a reader announces it that takes the sum of what several nodes write.
    #[must_use]
    pub fn as_sum(&self) -> Self {
        Self { adds_up: true, ..self.as_read() }
    }

    /// The same field as a reader announces it that does without where no node writes it.
    #[must_use]
    pub fn as_optional(&self) -> Self {
        Self { optional: true, ..self.as_read() }
    }
}

impl Rows {
    /// The supports of some fields, each once, with the first field in the order of names that stands on it.
    #[must_use]
    pub fn of(fields: &Fields) -> Vec<Self> {
        let mut rows: Vec<Self> = Vec::new();
        for field in fields.values() {
            if !rows.iter().any(|known| known.support.as_ref() == Some(&field.support)) {
                rows.push(Self { field: field.name().into(), support: Some(field.support.clone()) });
            }
        }
        rows
    }
}

/// A name that a node chose, as people are shown it: without characters that control a terminal, and of a bounded length.
#[must_use]
pub fn shown_name(name: &str) -> Cow<'_, str> {
    if name.len() <= LONGEST_NAME && !name.chars().any(char::is_control) {
        return Cow::Borrowed(name);
    }
    let mut shown: String =
        name.chars().take(LONGEST_NAME).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if shown.len() < name.len() && name.chars().nth(LONGEST_NAME).is_some() {
        shown.push('…');
    }
    Cow::Owned(shown)
}

/// Characters of a name that are shown.
const LONGEST_NAME: usize = 120;

impl Energy {
    /// Energy held at the end of the window, in J.
    #[must_use]
    pub fn stored(name: &str, joule: f64) -> Self {
        Self { name: name.into(), kind: energy::Kind::Stored.into(), joule, from_nothing: false }
    }

    /// Energy held at the end of the window that is counted from nothing, in J: of motion. Contacts, orbits and fields turn
    /// all of it over within a window, which its change from one window to the next does not show.
    #[must_use]
    pub fn of_motion(name: &str, joule: f64) -> Self {
        Self { from_nothing: true, ..Self::stored(name, joule) }
    }

    /// Energy that entered during the window, in J.
    #[must_use]
    pub fn gained(name: &str, joule: f64) -> Self {
        Self { name: name.into(), kind: energy::Kind::Gained.into(), joule, from_nothing: false }
    }

    /// Energy that left during the window, in J.
    #[must_use]
    pub fn lost(name: &str, joule: f64) -> Self {
        Self { name: name.into(), kind: energy::Kind::Lost.into(), joule, from_nothing: false }
    }
}

#[cfg(test)]
mod tests {
    use std::{env, fs, path::Path};

    /// The Python kit makes its message classes from a copy of the descriptors, so that it needs no protoc.
    #[test]
    fn the_descriptors_of_the_python_kit_are_these() {
        let copy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../nodes/python/stagger/descriptors.bin");
        if env::var_os("STAGGER_BLESS").is_some() {
            fs::write(&copy, super::DESCRIPTORS).unwrap();
        }
        assert!(
            fs::read(&copy).unwrap() == super::DESCRIPTORS,
            "{} is stale: run this test again with STAGGER_BLESS=1",
            copy.display()
        );
    }

    #[test]
    fn the_python_kit_speaks_this_schema() {
        let kit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../nodes/python/stagger/messages.py");
        let line = format!("SCHEMA_VERSION = {}", super::SCHEMA_VERSION);
        assert!(fs::read_to_string(&kit).unwrap().lines().any(|other| other == line), "{} lacks {line}", kit.display());
    }
}
