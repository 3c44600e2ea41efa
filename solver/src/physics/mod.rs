//! The physics of a scene, each a pure [`Physics`](crate::coupling::Physics).

mod checks;
mod conductance;
mod contacts;
pub mod current;
mod linear;
pub mod optics;
pub mod particles;
mod rows;
pub mod substrate;
pub mod thermal;
pub mod walls;

pub use conductance::Conductance;
pub use walls::{Shape, Wall};
