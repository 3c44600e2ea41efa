//! How contact points slide past each other, and the tangential springs that this stretches.

use rayon::prelude::*;

use super::{
    PARALLEL_PARTICLES, Particles, Vec3,
    blocks::Block,
    bodies::Bodies,
    contact::SAME_PLACE_M,
    springs::Springs,
    state::{Motion, State},
    wall_list::WallList,
};
use crate::physics::walls::Pose;

/// The part normal to n of a velocity of the partner, less the rolling R_i ω_i + R_j ω_j times n.
fn tangential(normal: &Vec3, velocity: Vec3, rolling: Vec3) -> Vec3 {
    velocity - normal * velocity.dot(normal) - rolling.cross(normal)
}

/// Velocity in m/s of the contact point of particle j past that of i, as the contact kernel has it.
pub(super) fn of_pair(bodies: &Bodies, motion: &Motion, [i, j]: [usize; 2]) -> Vec3 {
    let Motion { positions, velocities, spins } = motion;
    let between = positions[j] - positions[i];
    let normal = between.try_normalize(SAME_PLACE_M).unwrap_or_else(Vec3::z);
    tangential(&normal, velocities[j] - velocities[i], spins[i] * bodies.radii[i] + spins[j] * bodies.radii[j])
}

/// Velocity in m/s of a wall past the contact point of particle i, at the signed `distance` of its centre along the wall's
/// outer `normal`.
pub(super) fn of_wall(bodies: &Bodies, motion: &Motion, i: usize, pose: &Pose, normal: &Vec3, distance: f64) -> Vec3 {
    let velocity = pose.velocity_at(&(motion.positions[i] - normal * distance)) - motion.velocities[i];
    tangential(&-normal, velocity, motion.spins[i] * bodies.radii[i])
}

impl Particles {
    /// Moves the springs of the contacts of `state`, at `t_s`, on by what their points slide in `by_s`.
    pub(super) fn stretch(&self, state: &State, springs: &mut [Springs], t_s: f64, by_s: f64) {
        let State { bodies, motion, lists, .. } = state;
        let poses = self.poses(&state.walls, t_s);
        let work = |((block, walls), springs): ((&Block, &WallList), &mut Springs)| {
            springs
                .stretch_pairs(|entry| of_pair(bodies, motion, block.pair(entry).map(|place| place as usize)) * by_s);
            let mut touches = Vec::new();
            for encounter in &walls.encounters {
                let i = (block.first + encounter.particle) as usize;
                let (wall, features) = (encounter.wall as usize, &walls.features[encounter.range()]);
                let pose = &poses[wall];
                touches.clear();
                self.surfaces[wall].touch(&pose.to_wall(&motion.positions[i]), bodies.radii[i], features, &mut touches);
                for touch in &touches {
                    let normal = pose.to_world_direction(&touch.normal);
                    let entry = encounter.features.start as usize + touch.entry as usize;
                    springs.stretch_wall(entry, of_wall(bodies, motion, i, pose, &normal, touch.distance) * by_s);
                }
            }
        };
        let blocks = &lists.pairs.blocks;
        if motion.positions.len() > PARALLEL_PARTICLES {
            blocks.par_iter().zip(&lists.walls).zip(springs).for_each(work);
        } else {
            blocks.iter().zip(&lists.walls).zip(springs).for_each(work);
        }
    }
}
