//! What the contact loops read and write, and the choice of the loop that is compiled for a scene's laws.

use std::ops::AddAssign;

use super::{
    Particles, Vec3,
    blocks::Block,
    contact::{Law, Normal, Tangential},
    friction::{Frictionless, Regularised},
    on_substrate::{Sinking, WallLoad},
    pair_kernel::PairKernel,
    settings::Friction,
    springs::Springs,
    state::Dissipation,
    tangential_spring::TangentialSpring,
    wall_list::WallList,
};
use crate::common::{
    walls::{Pose, Touch},
    width,
};

/// Where a particle is: what the search for contacts reads, in half a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Place {
    /// r in m.
    pub position: Vec3,
    /// R in m.
    pub radius: f64,
}

/// How a particle moves and resists: what a contact reads besides, in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Body {
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
pub(super) struct Load {
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
pub(super) struct Bed<'a> {
    pub particles: &'a Particles,
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
    /// As [`super::rolling::stopping_share`].
    pub stopping_share: f64,
    /// The same for a rule between whose evaluations contacts begin and end, as [`super::contact::Meeting::touch_s`].
    pub touch_s: f64,
}

/// A block with what its kernel writes.
pub(super) struct Task<'a> {
    pub block: &'a Block,
    pub walls: &'a WallList,
    pub springs: &'a mut Springs,
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

impl Bed<'_> {
    /// Adds the loads by the contacts of a block.
    pub fn contacts(self, task: Task<'_>) -> Dissipation {
        match self.particles.law {
            Law::Overlap(law) => self.of_law(law, task),
            Law::Hertz(law) => self.of_law(law, task),
            Law::Linear(law) => self.of_law(law, task),
        }
    }

    fn of_law<N: Normal>(self, law: N, task: Task<'_>) -> Dissipation {
        match self.particles.settings.friction {
            None => self.of_laws(law, Frictionless, task),
            Some(Friction::Regularised { .. }) => self.of_laws(law, Regularised, task),
            Some(Friction::Spring { .. }) => self.of_laws(law, TangentialSpring, task),
        }
    }

    fn of_laws<N: Normal, T: Tangential>(self, law: N, tangential: T, mut task: Task<'_>) -> Dissipation {
        let mut lost = width::chosen().dispatch(PairKernel { bed: self, law, tangential, task: &mut task });
        lost += self.walls(law, tangential, &mut task);
        lost
    }
}
