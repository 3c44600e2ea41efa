//! What several physics use: beams, rays, walls, contacts and their conductance, grids, linear algebra.

pub mod advice;
pub mod beam;
mod bodies;
pub mod checks;
pub mod conductance;
pub mod contacts;
pub(crate) mod enthalpy_curve;
pub mod grid;
mod heat_material;
pub mod keys;
pub mod linear;
mod on_substrate;
mod over_temperature;
mod pictured;
pub mod quadrature;
pub(crate) mod radiation;
pub(crate) mod random;
pub mod rays;
pub mod rows;
pub(crate) mod simd;
mod solid_surface;
mod tables;
pub mod tradeoff;
pub mod walls;
pub mod width;

pub use bodies::{Bodies, Given, Heat, missing_property, property};
pub use conductance::{Conductance, Partner, conductance};
pub use enthalpy_curve::{PhaseChange, Phases};
pub use heat_material::{HeatMaterial, PhaseBands};
pub use on_substrate::OnSubstrate;
pub use over_temperature::Table;
pub use pictured::Pictured;
pub(crate) use solid_surface::power_port;
pub use solid_surface::{SURFACE, SolidSurface};
pub use tables::Tables;
pub use walls::{Shape, Wall};

/// The support with a row for each particle, on which fields of several physics stand.
pub const PARTICLES: &str = "particles";

/// A vector in space.
pub(crate) type Vec3 = nalgebra::Vector3<f64>;
