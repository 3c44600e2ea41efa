//! What the contact loops read and write, and the choice of the loop that is compiled for a scene's laws.

use std::ops::AddAssign;

use super::sinking::Sinking;
use crate::{
    common::{
        Vec3,
        walls::{Pose, Touch},
    },
    particles::{
        model::{Model, state::WallLoad},
        search::{blocks::Block, contact_history::ContactHistory, wall_list::WallList},
    },
};

/// Where a particle is: what the search for contacts reads, in half a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Place {
    /// r in m.
    pub position: Vec3,
    /// R in m.
    pub radius: f64,
}

/// How a particle moves and resists: what a contact reads besides, in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Body {
    /// v in m/s.
    pub velocity: Vec3,
    /// m in kg.
    pub mass: f64,
    /// ω in rad/s.
    pub spin: Vec3,
    /// Its modulus at its temperature.
    pub modulus: f64,
}

/// Force in N and moment in N m on a particle.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    pub force: Vec3,
    pub moment: Vec3,
}

impl Load {
    /// Nothing.
    pub fn none() -> Self {
        Self { force: Vec3::zeros(), moment: Vec3::zeros() }
    }
}

impl AddAssign for Load {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.moment += other.moment;
    }
}

/// What a block's kernel reads.
#[derive(Clone, Copy)]
pub struct KernelInput<'a> {
    pub model: &'a Model,
    pub places: &'a [Place],
    pub bodies: &'a [Body],
    /// Index of the material of each particle.
    pub materials: &'a [u16],
    /// Where the walls are.
    pub poses: &'a [Pose],
    /// How far the surface of one of them has given way.
    pub sinking: Option<Sinking<'a>>,
    /// Time in s.
    pub t_s: f64,
    /// Whether all particles have one radius, mass and modulus.
    pub alike: bool,
    /// Step Δt in s for friction.
    pub step_s: f64,
    /// As [`crate::particles::contact::rolling::stopping_share`].
    pub stopping_share: f64,
    /// The same for a rule between whose evaluations contacts begin and end, as
    /// [`ContactKinematics::touch_s`](crate::particles::contact::kinematics::ContactKinematics::touch_s).
    pub touch_s: f64,
}

/// A block with what its kernel writes.
pub struct Task<'a> {
    pub block: &'a Block,
    pub walls: &'a WallList,
    pub contact_history: &'a mut ContactHistory,
    /// Loads on the block's own particles, then on its halo; contacts are added.
    pub loads: &'a mut [Load],
    /// Forces on the walls, in N.
    pub on_walls: &'a mut [Vec3],
    /// Loads of the contacts with walls, their particles by place in memory; filled where a substrate reads them.
    pub on_contacts: &'a mut Vec<WallLoad>,
    /// Largest elastic force over overlap and reduced mass, in 1/s²: raised to that of the block's contacts.
    pub rate_1_s2: &'a mut f64,
    /// Scratch: entries of the pairs that touch.
    pub touching: &'a mut Vec<u32>,
    /// Scratch: contacts of a particle with a wall.
    pub touches: &'a mut Vec<Touch>,
}
