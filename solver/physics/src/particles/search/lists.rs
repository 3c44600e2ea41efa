//! What particles may touch before they have moved half their skin: each other, and walls.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use stagger_coupling::SolveError;

use super::{
    blocks::{Block, PARALLEL_PARTICLES},
    contact_history::{ContactHistory, Remembered},
    neighbours::NeighbourList,
    wall_list::WallList,
};
use crate::{
    common::{
        Vec3,
        walls::{Motion, Pose, Surface},
    },
    particles::settings::Settings,
};

/// Neighbours of the particles, and the walls near them.
#[derive(Debug, Serialize, Deserialize)]
pub struct Lists {
    pub pairs: NeighbourList,
    /// Walls near the particles of each block.
    pub walls: Vec<WallList>,
    /// Positions of the particles at which the lists were built, in the frame of each wall that moves.
    seen_from_walls: Vec<(u32, Vec<Vec3>)>,
}

impl Lists {
    /// Lists of the particles at `positions`, with the walls of `settings`, whose surfaces these are, at `poses`.
    ///
    /// # Errors
    /// [`NeighbourList::build`]'s.
    pub fn build(
        settings: &Settings,
        surfaces: &[Surface],
        positions: &[Vec3],
        radii: &[f64],
        poses: &[Pose],
    ) -> Result<Self, SolveError> {
        let skin = settings.skin;
        let pairs = NeighbourList::build(positions, radii, skin)?;
        let walls = |block: &Block| WallList::near(block, surfaces, poses, positions, radii, skin);
        let walls = if positions.len() > PARALLEL_PARTICLES {
            pairs.blocks.par_iter().map(walls).collect()
        } else {
            pairs.blocks.iter().map(walls).collect()
        };
        let moving = settings.walls.iter().zip(poses).zip(0u32..);
        let seen_from_walls = moving
            .filter(|((wall, _), _)| wall.motion != Motion::Fixed)
            .map(|((_, pose), wall)| (wall, positions.iter().map(|position| pose.to_wall(position)).collect()))
            .collect();
        Ok(Self { pairs, walls, seen_from_walls })
    }

    /// Whether no particle has moved more than half its skin since the lists were built, nor a wall as it sees it.
    pub fn hold(&self, positions: &[Vec3], radii: &[f64], skin: f64, poses: &[Pose]) -> bool {
        let near = |wall: u32, built_at: &[Vec3]| {
            let pose = &poses[wall as usize];
            positions.iter().zip(built_at).zip(radii).all(|((position, then), radius)| {
                let limit = 0.5 * skin * radius;
                (pose.to_wall(position) - then).norm_squared() <= limit * limit
            })
        };
        self.pairs.holds(positions, radii, skin) && self.seen_from_walls.iter().all(|(wall, then)| near(*wall, then))
    }

    /// Each block with the walls near it and its springs.
    pub fn blocks<'a>(
        &'a self,
        contact_history: &'a [ContactHistory],
    ) -> impl Iterator<Item = (&'a Block, &'a WallList, &'a ContactHistory)> {
        self.pairs
            .blocks
            .iter()
            .zip(&self.walls)
            .zip(contact_history)
            .map(|((block, walls), contact_history)| (block, walls, contact_history))
    }

    /// Springs of no contact.
    pub fn no_history(&self) -> Vec<ContactHistory> {
        let blocks = self.pairs.blocks.iter().zip(&self.walls);
        blocks.map(|(block, walls)| ContactHistory::none(block.partners.len(), walls.features.len())).collect()
    }

    /// The springs of these lists as those of `next`; `place` says where a particle of these lists is in the next, `None`
    /// that it is gone.
    pub fn hand_over(
        &self,
        contact_history: &[ContactHistory],
        next: &Self,
        place: impl Fn(u32) -> Option<u32>,
    ) -> Vec<ContactHistory> {
        let count = next.pairs.blocks.iter().map(Block::len).sum();
        let remembered = Remembered::collect(count, self.blocks(contact_history), place);
        let blocks = &next.pairs.blocks;
        if count > PARALLEL_PARTICLES {
            blocks.par_iter().zip(&next.walls).map(|(block, walls)| remembered.recall(block, walls)).collect()
        } else {
            blocks.iter().zip(&next.walls).map(|(block, walls)| remembered.recall(block, walls)).collect()
        }
    }
}
