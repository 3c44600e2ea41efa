//! The contact loop over one block, compiled for each pair of normal and tangential law.

use std::ops::AddAssign;

use super::{
    Particles, Vec3,
    blocks::Block,
    contact::{Law, Meeting, Normal, Response, Tangential, reduced},
    friction::{Frictionless, Regularised},
    pair_table::PairLaw,
    settings::Friction,
    springs::Springs,
    state::Dissipation,
    tangential_spring::TangentialSpring,
    wall_list::WallEntry,
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
    /// Step Δt in s for friction.
    pub step_s: f64,
}

impl Bed<'_> {
    /// Adds the loads by the contacts of `block` to `loads`, its own particles first, then its halo.
    pub fn contacts(
        self,
        block: &Block,
        walls: &[WallEntry],
        springs: &mut Springs,
        loads: &mut [Load],
    ) -> Dissipation {
        match self.particles.law {
            Law::Overlap(law) => self.of_law(law, block, walls, springs, loads),
            Law::Hertz(law) => self.of_law(law, block, walls, springs, loads),
            Law::Linear(law) => self.of_law(law, block, walls, springs, loads),
        }
    }

    fn of_law<N: Normal>(
        self,
        law: N,
        block: &Block,
        walls: &[WallEntry],
        springs: &mut Springs,
        loads: &mut [Load],
    ) -> Dissipation {
        match self.particles.settings.friction {
            None => self.of_laws(law, Frictionless, block, walls, springs, loads),
            Some(Friction::Regularised { .. }) => self.of_laws(law, Regularised, block, walls, springs, loads),
            Some(Friction::Spring { .. }) => self.of_laws(law, TangentialSpring, block, walls, springs, loads),
        }
    }

    fn of_laws<N: Normal, T: Tangential>(
        self,
        law: N,
        tangential: T,
        block: &Block,
        walls: &[WallEntry],
        springs: &mut Springs,
        loads: &mut [Load],
    ) -> Dissipation {
        let mut lost = self.pairs(law, tangential, block, springs, loads);
        lost += self.walls(law, tangential, block, walls, springs, loads);
        lost
    }

    fn pairs<N: Normal, T: Tangential>(
        self,
        law: N,
        tangential: T,
        block: &Block,
        springs: &mut Springs,
        loads: &mut [Load],
    ) -> Dissipation {
        let Self { particles, places, bodies, materials, step_s } = self;
        let surface = &particles.surface;
        let only = particles.table.only();
        let mut lost = Dissipation::default();
        for k in 0..block.len() {
            let i = block.first as usize + k;
            let (here, body) = (places[i], bodies[i]);
            let entries = block.entries(k);
            let partners = &block.partners[entries.clone()];
            let slots = &block.slots[entries.clone()];
            let mut own = Load::none();
            for (entry, (&j, &slot)) in entries.zip(partners.iter().zip(slots)) {
                let there = &places[j as usize];
                let between = there.position - here.position;
                let sum = here.radius + there.radius;
                let distance_squared = between.norm_squared();
                if distance_squared >= sum * sum {
                    if T::REMEMBERS {
                        springs.part(entry);
                    }
                    continue;
                }
                let partner = &bodies[j as usize];
                let pair: &PairLaw = match only {
                    Some(pair) => pair,
                    None => particles.table.get(materials[i], materials[j as usize]),
                };
                let distance = distance_squared.sqrt();
                let overlap = sum - distance;
                let meeting = Meeting {
                    normal: normal(&between, distance),
                    overlap,
                    strain: overlap / sum,
                    touch: law.pair(overlap, distance, here.radius, there.radius),
                    modulus: law.pair_modulus(body.modulus, partner.modulus),
                    reduced_mass: reduced(body.mass, partner.mass),
                    velocity: partner.velocity - body.velocity,
                    rolling: body.spin * here.radius + partner.spin * there.radius,
                    turning: partner.spin - body.spin,
                    reduced_inertia: reduced(
                        0.4 * body.mass * here.radius * here.radius,
                        0.4 * partner.mass * there.radius * there.radius,
                    ),
                };
                let mut unused = Vec3::zeros();
                let spring = if T::REMEMBERS { springs.meet(entry) } else { &mut unused };
                let response = surface.respond(tangential, pair, &meeting, step_s, spring);
                lost.add(&response);
                own.force += response.force;
                let other = &mut loads[slot as usize];
                other.force -= response.force;
                if surface.spin {
                    // Both particles are turned the same way: arm and force change sign together.
                    own.moment += response.couple * here.radius;
                    other.moment += response.couple * there.radius;
                    if surface.rolls {
                        own.moment += response.resistance;
                        other.moment -= response.resistance;
                    }
                }
            }
            loads[k] += own;
        }
        lost
    }

    fn walls<N: Normal, T: Tangential>(
        self,
        law: N,
        tangential: T,
        block: &Block,
        walls: &[WallEntry],
        springs: &mut Springs,
        loads: &mut [Load],
    ) -> Dissipation {
        let Self { particles, places, bodies, materials, step_s } = self;
        let surface = &particles.surface;
        let mut lost = Dissipation::default();
        for (entry, wall) in walls.iter().enumerate() {
            let k = wall.particle as usize;
            let i = block.first as usize + k;
            let (here, body) = (&places[i], &bodies[i]);
            let plane = &particles.planes[wall.plane as usize];
            let overlap = here.radius - plane.distance(&here.position);
            if overlap <= 0.0 {
                if T::REMEMBERS {
                    springs.part_wall(entry);
                }
                continue;
            }
            let meeting = Meeting {
                normal: -plane.normal,
                overlap,
                strain: overlap / here.radius,
                touch: law.wall(overlap, here.radius),
                modulus: body.modulus,
                reduced_mass: body.mass,
                velocity: -body.velocity,
                rolling: body.spin * here.radius,
                turning: -body.spin,
                reduced_inertia: 0.4 * body.mass * here.radius * here.radius,
            };
            let mut unused = Vec3::zeros();
            let spring = if T::REMEMBERS { springs.meet_wall(entry) } else { &mut unused };
            let pair = particles.table.get(materials[i], materials[i]);
            let response = surface.respond(tangential, pair, &meeting, step_s, spring);
            lost.add(&response);
            let load = &mut loads[k];
            load.force += response.force;
            if surface.spin {
                load.moment += response.couple * here.radius + response.resistance;
            }
        }
        lost
    }
}

impl Dissipation {
    #[inline(always)]
    fn add(&mut self, response: &Response) {
        self.contact_damping += response.damping_w;
        self.friction += response.friction_w;
        self.rolling += response.rolling_w;
    }
}

/// n_ij; particles at the same place have none, and are parted along z.
#[inline(always)]
fn normal(between: &Vec3, distance: f64) -> Vec3 {
    if distance > 0.0 { between / distance } else { Vec3::z() }
}
