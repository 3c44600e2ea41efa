//! Every number of stagger: the staggered [`coupling`], the [`physics`], the [`scene`] they are built from, and
//! [`advice`] on a scene.
//!
//! No I/O, no async, no clock, no global randomness: the same inputs give the same bytes.

pub mod advice;
pub mod coupling;
mod error;
pub mod math;
pub mod physics;
pub mod scene;
mod shown;

pub use error::SolveError;
pub use shown::Shown;
