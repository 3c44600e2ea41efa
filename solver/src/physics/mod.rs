//! The physics of a scene, each a pure [`Physics`](crate::coupling::Physics).

mod checks;
pub mod optics;
pub mod particles;
mod rows;
pub mod thermal;

use serde::Serialize;

/// A wall as the other physics see it: its rows in wall-contact fields carry its index in the scene's order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wall {
    /// Name in the scene.
    pub name: String,
    /// Its surfaces; particles stay on the side the normals point to.
    pub planes: Vec<Plane>,
    /// Temperature in K; `None` is an insulated wall.
    pub temperature_k: Option<f64>,
}

/// An infinite plane; particles stay on the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Plane {
    /// A point on it, in m.
    pub through: [f64; 3],
    /// Unit normal.
    pub normal: [f64; 3],
}
