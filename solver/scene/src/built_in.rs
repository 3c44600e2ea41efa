//! The list of all physics. Each is a folder of stagger-physics; its line here is all that a scene, a recording, the
//! view, a report, an export and the command line need to know it.

pub use stagger_physics::common::Pictured;
use stagger_physics::{PhysicsKind, acoustics, current, optics, particles, solid, substrate, thermal};

/// Every physics that a scene can run, in the order of its tables.
pub static BUILT_IN: &[&PhysicsKind] = &[
    &particles::keys::KIND,
    &solid::keys::KIND,
    &thermal::keys::KIND,
    &optics::keys::KIND,
    &current::keys::KIND,
    &substrate::keys::KIND,
    &acoustics::keys::KIND,
];

/// The physics of that name.
#[must_use]
pub fn kind(name: &str) -> Option<&'static PhysicsKind> {
    BUILT_IN.iter().copied().find(|kind| kind.name == name)
}

/// The names of all of them, as a message lists them.
#[must_use]
pub fn names() -> String {
    let names: Vec<_> = BUILT_IN.iter().map(|kind| kind.name).collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => names.concat(),
    }
}
