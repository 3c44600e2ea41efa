//! All forces on all particles.
//!
//! Work is cut into chunks of fixed size, each summed in order, and the chunks are added in order: the result does not
//! depend on how many threads share them.

use std::sync::Arc;

use rayon::prelude::*;

use super::{
    PARALLEL_ITEMS, Particles, Vec3,
    neighbours::NeighbourList,
    state::{Dissipation, Forces},
};

/// Particles or listed pairs a chunk.
const CHUNK: usize = 4096;

/// Frozen temperatures of the particles at the window's start and end, in K.
#[derive(Clone, Copy)]
pub(super) struct Heat<'a> {
    pub start_k: &'a [f64],
    pub end_k: &'a [f64],
}

/// Evaluates forces; owns the scratch memory of one solve.
pub(super) struct Evaluator<'a> {
    particles: &'a Particles,
    heat: Option<Heat<'a>>,
    /// Moduli at the last evaluation, in Pa.
    pub moduli: Vec<f64>,
    /// The list at the last evaluation.
    pub neighbours: Arc<NeighbourList>,
    pub evaluations: u32,
    chunks: Vec<Chunk>,
    bodies: Vec<Dissipation>,
}

#[derive(Default)]
struct Chunk {
    contacts: Vec<PairForce>,
    dissipation: Dissipation,
}

struct PairForce {
    i: u32,
    j: u32,
    force: Vec3,
    couple: Vec3,
}

/// Positions, velocities and spins that forces are evaluated at.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub positions: &'a [Vec3],
    pub velocities: &'a [Vec3],
    pub spins: &'a [Vec3],
    /// Share of the window that has passed, for the frozen temperature.
    pub fraction: f64,
    /// Step Δt in s for friction.
    pub step_s: f64,
}

impl<'a> Evaluator<'a> {
    /// `moduli` are those at the window's start; without `heat` they stay.
    pub fn new(
        particles: &'a Particles,
        heat: Option<Heat<'a>>,
        moduli: Vec<f64>,
        neighbours: Arc<NeighbourList>,
    ) -> Self {
        Self { particles, heat, moduli, neighbours, evaluations: 0, chunks: Vec::new(), bodies: Vec::new() }
    }

    /// Builds the neighbour list anew where a particle has moved half its skin.
    pub fn refresh(&mut self, positions: &[Vec3]) {
        let (radii, skin) = (&self.particles.radii, self.particles.settings.skin);
        if !self.neighbours.holds(positions, radii, skin) {
            self.neighbours = Arc::new(NeighbourList::build(positions, radii, skin));
        }
    }

    /// Forces, moments and dissipation at one instant.
    pub fn evaluate(&mut self, at: At<'_>, forces: &mut Forces) {
        self.evaluations += 1;
        self.refresh(at.positions);
        if let Some(heat) = self.heat {
            self.particles.soften(heat, at.fraction, &mut self.moduli);
        }
        forces.step_s = at.step_s;
        forces.dissipation = Dissipation::default();
        self.bodies(at, forces);
        self.pairs(at, forces);
    }

    /// Gravity, drag and walls: writes every particle's force.
    fn bodies(&mut self, at: At<'_>, forces: &mut Forces) {
        let mut dissipations = std::mem::take(&mut self.bodies);
        let Forces { force, moment, .. } = forces;
        if force.len() > PARALLEL_ITEMS {
            (force.par_chunks_mut(CHUNK).zip(moment.par_chunks_mut(CHUNK)).enumerate())
                .map(|(chunk, (force, moment))| self.body_chunk(at, chunk * CHUNK, force, moment))
                .collect_into_vec(&mut dissipations);
        } else {
            dissipations.clear();
            let chunks = force.chunks_mut(CHUNK).zip(moment.chunks_mut(CHUNK)).enumerate();
            dissipations
                .extend(chunks.map(|(chunk, (force, moment))| self.body_chunk(at, chunk * CHUNK, force, moment)));
        }
        for &dissipation in &dissipations {
            forces.dissipation += dissipation;
        }
        self.bodies = dissipations;
    }

    fn body_chunk(&self, at: At<'_>, first: usize, force: &mut [Vec3], moment: &mut [Vec3]) -> Dissipation {
        let Particles { settings, surface, law, planes, gravity, .. } = self.particles;
        let mut lost = Dissipation::default();
        for (k, (force, moment)) in force.iter_mut().zip(moment).enumerate() {
            let i = first + k;
            let (position, velocity) = (&at.positions[i], &at.velocities[i]);
            let radius = self.particles.radii[i];
            *force = gravity * self.particles.masses[i];
            *moment = Vec3::zeros();
            if let Some(drag) = &settings.drag {
                let drag = drag.force(radius, velocity);
                *force += drag;
                lost.drag -= drag.dot(velocity);
            }
            for plane in planes {
                let overlap = radius - plane.distance(position);
                if overlap <= 0.0 {
                    continue;
                }
                let touch = law.wall(overlap, radius);
                let response = surface.respond(
                    &-plane.normal,
                    &-velocity,
                    &(at.spins[i] * radius),
                    self.moduli[i] * touch.force_per_pa,
                    touch.area_m2,
                    at.step_s,
                );
                *force += response.force;
                *moment += response.couple * radius;
                lost.contact_damping += response.damping_w;
                lost.friction += response.friction_w;
            }
        }
        lost
    }

    /// Contacts between particles: found chunk by chunk, then added in the order of the list.
    fn pairs(&mut self, at: At<'_>, forces: &mut Forces) {
        let mut chunks = std::mem::take(&mut self.chunks);
        let pairs = &self.neighbours.pairs;
        chunks.resize_with(pairs.len().div_ceil(CHUNK), Chunk::default);
        if pairs.len() > PARALLEL_ITEMS {
            let work = chunks.par_iter_mut().zip(pairs.par_chunks(CHUNK));
            work.for_each(|(chunk, pairs)| self.pair_chunk(at, pairs, chunk));
        } else {
            let work = chunks.iter_mut().zip(pairs.chunks(CHUNK));
            work.for_each(|(chunk, pairs)| self.pair_chunk(at, pairs, chunk));
        }
        let spin = self.particles.settings.spin;
        for chunk in &chunks {
            forces.dissipation += chunk.dissipation;
            for contact in &chunk.contacts {
                let (i, j) = (contact.i as usize, contact.j as usize);
                forces.force[i] += contact.force;
                forces.force[j] -= contact.force;
                if spin {
                    // Both particles are turned the same way: arm and force change sign together.
                    forces.moment[i] += contact.couple * self.particles.radii[i];
                    forces.moment[j] += contact.couple * self.particles.radii[j];
                }
            }
        }
        self.chunks = chunks;
    }

    fn pair_chunk(&self, at: At<'_>, pairs: &[[u32; 2]], chunk: &mut Chunk) {
        let Particles { surface, law, radii, .. } = self.particles;
        chunk.contacts.clear();
        let mut lost = Dissipation::default();
        for &[index_i, index_j] in pairs {
            let (i, j) = (index_i as usize, index_j as usize);
            let between = at.positions[j] - at.positions[i];
            let (radius_i, radius_j) = (radii[i], radii[j]);
            let sum = radius_i + radius_j;
            let distance_squared = between.norm_squared();
            if distance_squared >= sum * sum {
                continue;
            }
            let distance = distance_squared.sqrt();
            let touch = law.pair(sum - distance, distance, radius_i, radius_j);
            let rolling = at.spins[i] * radius_i + at.spins[j] * radius_j;
            let response = surface.respond(
                &normal(&between, distance),
                &(at.velocities[j] - at.velocities[i]),
                &rolling,
                law.pair_modulus(self.moduli[i], self.moduli[j]) * touch.force_per_pa,
                touch.area_m2,
                at.step_s,
            );
            lost.contact_damping += response.damping_w;
            lost.friction += response.friction_w;
            chunk.contacts.push(PairForce { i: index_i, j: index_j, force: response.force, couple: response.couple });
        }
        chunk.dissipation = lost;
    }
}

/// n_ij; particles at the same place have none, and are parted along z.
#[inline]
fn normal(between: &Vec3, distance: f64) -> Vec3 {
    if distance > 0.0 { between / distance } else { Vec3::z() }
}
