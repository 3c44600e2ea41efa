//! Walls that particles may touch before they have moved half their skin.

use serde::{Deserialize, Serialize};

use super::{Plane, Vec3, blocks::Block};

/// A particle near a plane of a wall.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct WallEntry {
    /// Place of the particle in its block.
    pub particle: u32,
    /// Index into the scene's planes.
    pub plane: u32,
}

impl WallEntry {
    /// What the contact is known by when lists change.
    pub fn key(&self) -> [u32; 2] {
        [self.plane, 0]
    }
}

/// The planes near the particles of a block, by particle.
pub(super) fn near(block: &Block, planes: &[Plane], positions: &[Vec3], radii: &[f64], skin: f64) -> Vec<WallEntry> {
    let mut found = Vec::new();
    for (k, i) in block.range().enumerate() {
        for (plane, at) in (0u32..).zip(planes) {
            if at.distance(&positions[i]) < radii[i] * (1.0 + 0.5 * skin) {
                found.push(WallEntry { particle: k as u32, plane });
            }
        }
    }
    found
}
