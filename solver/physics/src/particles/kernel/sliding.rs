//! How contact points slide past each other, and the tangential springs that this stretches.

use rayon::prelude::*;

use crate::{
    common::{Vec3, walls::Pose},
    particles::{
        contact::kinematics::{SAME_PLACE_M, pair_arms, wall_arm},
        model::{
            Model,
            bodies::Bodies,
            state::{Motion, State},
        },
        search::{
            blocks::{Block, PARALLEL_PARTICLES},
            contact_history::ContactHistory,
            wall_list::WallList,
        },
    },
};

/// The part normal to n of a velocity of the partner, less the rolling L_i ω_i + L_j ω_j times n.
fn tangential(normal: &Vec3, velocity: Vec3, rolling: Vec3) -> Vec3 {
    velocity - normal * velocity.dot(normal) - rolling.cross(normal)
}

/// Velocity in m/s of the contact point of particle j past that of i, as the contact kernel has it; `by_radius` as in
/// [`pair_arms`].
pub fn of_pair(by_radius: bool, bodies: &Bodies, motion: &Motion, [i, j]: [usize; 2]) -> Vec3 {
    let Motion { positions, velocities, spins } = motion;
    let between = positions[j] - positions[i];
    let normal = between.try_normalize(SAME_PLACE_M).unwrap_or_else(Vec3::z);
    let [arm_i, arm_j] = pair_arms(by_radius, between.norm(), bodies.radii[i], bodies.radii[j]);
    tangential(&normal, velocities[j] - velocities[i], spins[i] * arm_i + spins[j] * arm_j)
}

/// Velocity in m/s of a wall past the contact point of particle i, at the signed `distance` of its centre along the wall's
/// outer `normal`.
pub fn of_wall(
    by_radius: bool,
    bodies: &Bodies,
    motion: &Motion,
    i: usize,
    pose: &Pose,
    (normal, distance): (&Vec3, f64),
) -> Vec3 {
    let velocity = pose.velocity_at(&(motion.positions[i] - normal * distance)) - motion.velocities[i];
    tangential(&-normal, velocity, motion.spins[i] * wall_arm(by_radius, distance, bodies.radii[i]))
}

/// Moves the springs of the contacts of `state`, at `t_s`, on by what their points slide in `by_s`.
pub fn stretch(model: &Model, state: &State, contact_history: &mut [ContactHistory], t_s: f64, by_s: f64) {
    let State { bodies, motion, lists, .. } = state;
    let poses = model.poses(&state.walls, t_s);
    let by_radius = model.contact.surface.arms_by_radius;
    let work = |((block, walls), contact_history): ((&Block, &WallList), &mut ContactHistory)| {
        contact_history.stretch_pairs(|entry| {
            of_pair(by_radius, bodies, motion, block.pair(entry).map(|place| place as usize)) * by_s
        });
        let mut touches = Vec::new();
        for encounter in &walls.encounters {
            let i = (block.first + encounter.particle) as usize;
            let (wall, features) = (encounter.wall as usize, &walls.features[encounter.range()]);
            let pose = &poses[wall];
            touches.clear();
            model.walls.surfaces[wall].touch(
                &pose.to_wall(&motion.positions[i]),
                bodies.radii[i],
                features,
                &mut touches,
            );
            for touch in &touches {
                let normal = pose.to_world_direction(&touch.normal);
                let entry = encounter.features.start as usize + touch.entry as usize;
                let slid = of_wall(by_radius, bodies, motion, i, pose, (&normal, touch.distance));
                contact_history.stretch_wall(entry, slid * by_s);
            }
        }
    };
    let blocks = &lists.pairs.blocks;
    if motion.positions.len() > PARALLEL_PARTICLES {
        blocks.par_iter().zip(&lists.walls).zip(contact_history).for_each(work);
    } else {
        blocks.iter().zip(&lists.walls).zip(contact_history).for_each(work);
    }
}
