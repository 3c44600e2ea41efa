//! The physics of a scene, each a pure [`Physics`](crate::coupling::Physics).

pub mod acoustics;
pub mod beam;
mod checks;
mod conductance;
mod contacts;
pub mod current;
mod linear;
pub mod optics;
pub mod particles;
mod quadrature;
pub mod rays;
mod rows;
pub mod substrate;
pub mod thermal;
pub mod walls;

pub use conductance::Conductance;
pub(crate) use conductance::{Partner, conductance};
pub use walls::{Shape, Wall};
