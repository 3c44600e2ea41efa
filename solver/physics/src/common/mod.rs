//! What several physics use: beams, rays, walls, contacts and their conductance, linear algebra.

pub mod advice;
pub mod beam;
mod bodies;
pub mod checks;
pub mod conductance;
pub mod contacts;
pub mod keys;
pub mod linear;
mod on_substrate;
mod over_temperature;
pub mod quadrature;
pub(crate) mod random;
pub mod rays;
pub mod rows;
pub(crate) mod simd;
mod tables;
pub mod tradeoff;
pub mod walls;
pub mod width;

pub use bodies::{Bodies, Given, Heat, property};
pub use conductance::{Conductance, Partner, conductance};
pub use on_substrate::OnSubstrate;
pub use over_temperature::Table;
pub use tables::Tables;
pub use walls::{Shape, Wall};

/// The support with a row for each particle, on which fields of several physics stand.
pub const PARTICLES: &str = "particles";

/// A vector in space.
pub(crate) type Vec3 = nalgebra::Vector3<f64>;
