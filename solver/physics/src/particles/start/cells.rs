//! A grid of cells that finds whether a sphere overlaps those placed before it.

use stagger_coupling::math;

use crate::common::Vec3;

/// Cells at least as large as the largest diameter; a particle is chained in the cell of its centre.
pub(super) struct Cells {
    lower: Vec3,
    inverse_cell: Vec3,
    sides: [usize; 3],
    /// Last particle inserted into each cell.
    heads: Vec<Option<u32>>,
    /// The particle inserted before, by particle.
    previous: Vec<Option<u32>>,
}

impl Cells {
    /// Cells over a box; at most as many as particles, however large the box.
    pub fn new(lower: Vec3, extent: Vec3, diameter: f64, count: usize) -> Self {
        let per_side = math::cbrt(count as f64).ceil().max(1.0);
        let volume_side = extent.map(|side| (side / diameter).floor());
        let wanted = volume_side.product();
        let share = if wanted > math::powi(per_side, 3) { math::cbrt(math::powi(per_side, 3) / wanted) } else { 1.0 };
        let sides = [0, 1, 2].map(|axis| ((volume_side[axis] * share) as usize).clamp(1, count.max(1)));
        let inverse_cell = Vec3::from_fn(|axis, _| sides[axis] as f64 / extent[axis]);
        Self { lower, inverse_cell, sides, heads: vec![None; sides.iter().product()], previous: Vec::new() }
    }

    fn cell(&self, position: &Vec3) -> [usize; 3] {
        [0, 1, 2].map(|axis| {
            let cell = (position[axis] - self.lower[axis]) * self.inverse_cell[axis];
            (cell as usize).min(self.sides[axis] - 1)
        })
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.sides[1] + y) * self.sides[2] + z
    }

    pub fn insert(&mut self, position: &Vec3, particle: usize) {
        let index = self.index(self.cell(position));
        self.previous.push(self.heads[index].replace(particle as u32));
    }

    /// Whether a sphere overlaps none of those inserted.
    pub fn free(&self, candidate: &Vec3, radius: f64, positions: &[Vec3], radii: &[f64]) -> bool {
        let cell = self.cell(candidate);
        let range = |axis: usize| cell[axis].saturating_sub(1)..=(cell[axis] + 1).min(self.sides[axis] - 1);
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    let mut next = self.heads[self.index([x, y, z])];
                    while let Some(other) = next {
                        let other = other as usize;
                        let reach = radius + radii[other];
                        if (positions[other] - candidate).norm_squared() < reach * reach {
                            return false;
                        }
                        next = self.previous[other];
                    }
                }
            }
        }
        true
    }
}
