//! States for the tests of several files.

use std::sync::Arc;

use stagger_messages::{Field, Measure, Port, Supports, Values, Version};
use stagger_recordings::Step;

/// A field of numbers.
pub fn field(name: &str, unit: &str, support: &str, components: u32, values: impl Into<Values>) -> (String, Field) {
    let port = Arc::new(Port::f64(name, unit, support, components, Measure::None));
    (name.into(), Field::new(&port, 0, values).unwrap())
}

/// A state whose supports are those of earlier recordings.
pub fn step(fields: impl IntoIterator<Item = (String, Field)>) -> Step {
    Step {
        version: Version::first(1),
        t_s: 1e-3,
        dt_s: 1e-4,
        fields: fields.into_iter().collect(),
        supports: Supports::default(),
        recorded: true,
    }
}
