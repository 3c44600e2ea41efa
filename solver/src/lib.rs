//! Every number of stagger: the staggered [`coupling`], the [`physics`], the [`scene`] they are built from, and
//! [`advice`] on a scene.
//!
//! No I/O, no async, no clock, no global randomness: the same inputs give the same bytes.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod advice;
pub mod coupling;
mod error;
pub mod math;
pub mod physics;
pub mod scene;
mod shown;
pub mod width;

pub use error::SolveError;
pub use shown::Shown;
