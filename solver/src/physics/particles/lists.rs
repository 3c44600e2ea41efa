//! What particles may touch before they have moved half their skin: each other, and walls.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    PARALLEL_PARTICLES, Particles, Vec3,
    blocks::Block,
    neighbours::NeighbourList,
    springs::{Remembered, Springs},
    wall_list::{WallEntry, near},
};
use crate::SolveError;

/// Neighbours of the particles, and the walls near them.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Lists {
    pub pairs: NeighbourList,
    /// Walls near the particles of each block.
    pub walls: Vec<Vec<WallEntry>>,
}

impl Lists {
    /// Lists of the particles at `positions`.
    ///
    /// # Errors
    /// [`NeighbourList::build`]'s.
    pub fn build(particles: &Particles, positions: &[Vec3], radii: &[f64]) -> Result<Self, SolveError> {
        let skin = particles.settings.skin;
        let pairs = NeighbourList::build(positions, radii, skin)?;
        let walls = |block: &Block| near(block, &particles.planes, positions, radii, skin);
        let walls = pairs.blocks.iter().map(walls).collect();
        Ok(Self { pairs, walls })
    }

    /// Whether no particle has moved more than half its skin since the lists were built.
    pub fn hold(&self, positions: &[Vec3], radii: &[f64], skin: f64) -> bool {
        self.pairs.holds(positions, radii, skin)
    }

    /// Each block with the walls near it and its springs.
    pub fn blocks<'a>(
        &'a self,
        springs: &'a [Springs],
    ) -> impl Iterator<Item = (&'a Block, &'a [WallEntry], &'a Springs)> {
        self.pairs
            .blocks
            .iter()
            .zip(&self.walls)
            .zip(springs)
            .map(|((block, walls), springs)| (block, &walls[..], springs))
    }

    /// Springs of no contact.
    pub fn no_springs(&self) -> Vec<Springs> {
        let blocks = self.pairs.blocks.iter().zip(&self.walls);
        blocks.map(|(block, walls)| Springs::none(block.partners.len(), walls.len())).collect()
    }

    /// The springs of these lists as those of `next`; `place` says where a particle of these lists is in the next, `None`
    /// that it is gone.
    pub fn hand_over(&self, springs: &[Springs], next: &Self, place: impl Fn(u32) -> Option<u32>) -> Vec<Springs> {
        let count = next.pairs.blocks.iter().map(Block::len).sum();
        let remembered = Remembered::collect(count, self.blocks(springs), place);
        let blocks = &next.pairs.blocks;
        if count > PARALLEL_PARTICLES {
            blocks.par_iter().zip(&next.walls).map(|(block, walls)| remembered.recall(block, walls)).collect()
        } else {
            blocks.iter().zip(&next.walls).map(|(block, walls)| remembered.recall(block, walls)).collect()
        }
    }
}
