//! What several physics use: beams, rays, walls, contacts and their conductance, linear algebra.

pub mod beam;
pub mod checks;
pub mod conductance;
pub mod contacts;
pub mod linear;
pub mod quadrature;
pub mod rays;
pub mod rows;
pub mod walls;
pub mod width;

pub use conductance::{Conductance, Partner, conductance};
pub use walls::{Shape, Wall};
