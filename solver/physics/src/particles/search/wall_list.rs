//! Walls that particles may touch before they have moved half their skin.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::blocks::Block;
use crate::common::{
    Vec3,
    walls::{Pose, Surface},
};

/// The walls near the particles of one block, by particle.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct WallList {
    pub encounters: Vec<Encounter>,
    /// Features of the encounters' walls, one after the other: what springs are kept by.
    pub features: Vec<u32>,
}

/// A particle near a wall.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Encounter {
    /// Place of the particle in its block.
    pub particle: u32,
    /// Index of the wall in the scene.
    pub wall: u32,
    /// The features of the wall that it may touch.
    pub features: Range<u32>,
}

impl Encounter {
    /// Indices of its features.
    #[inline]
    pub fn range(&self) -> Range<usize> {
        self.features.start as usize..self.features.end as usize
    }
}

impl WallList {
    /// The walls near the particles of `block`.
    pub fn near(
        block: &Block,
        surfaces: &[Surface],
        poses: &[Pose],
        positions: &[Vec3],
        radii: &[f64],
        skin: f64,
    ) -> Self {
        let mut list = Self::default();
        for (particle, i) in (0u32..).zip(block.range()) {
            let reach = radii[i] * (1.0 + 0.5 * skin);
            for (wall, (surface, pose)) in (0u32..).zip(surfaces.iter().zip(poses)) {
                let from = list.features.len() as u32;
                surface.near(&pose.to_wall(&positions[i]), reach, &mut list.features);
                let until = list.features.len() as u32;
                if until > from {
                    list.encounters.push(Encounter { particle, wall, features: from..until });
                }
            }
        }
        list
    }

    /// Each feature with the place of its particle in the block, and what the contact is known by when lists change.
    pub fn entries(&self) -> impl Iterator<Item = (u32, [u32; 2])> + '_ {
        let of = |encounter: &Encounter| {
            let (particle, wall) = (encounter.particle, encounter.wall);
            self.features[encounter.range()].iter().map(move |&feature| (particle, [wall, feature]))
        };
        self.encounters.iter().flat_map(of)
    }
}
