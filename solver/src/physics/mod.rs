//! The physics of a scene, each a pure [`Physics`](crate::coupling::Physics).

mod checks;
pub mod optics;
pub mod particles;
mod rows;
pub mod substrate;
pub mod thermal;
pub mod walls;

pub use walls::{Shape, Wall};
