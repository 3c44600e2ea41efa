//! A wall with a solid under it.

use serde::Serialize;

/// A wall with a solid under it: who moves particles writes the forces on the walls for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct OnSubstrate {
    /// Index of the wall in the scene; a plane at rest.
    pub wall: usize,
    /// True where the substrate writes `wall_deflection`, by which the wall then gives way under each particle.
    pub deflects: bool,
}
