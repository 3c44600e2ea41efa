//! Every number of stagger: the staggered [`coupling`], the [`physics`], and the [`scene`] they are built from.
//!
//! No I/O, no async, no clock, no global randomness: the same inputs give the same bytes.

pub mod coupling;
mod error;
pub mod physics;
pub mod scene;

pub use error::SolveError;
