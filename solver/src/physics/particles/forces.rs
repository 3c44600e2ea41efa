//! All forces on all particles.

use std::sync::Arc;

use rayon::prelude::*;

use super::{
    PARALLEL_PARTICLES, Particles, Vec3,
    blocks::BLOCK,
    bodies::one,
    kernel::{Bed, Body, Load, Place, Task},
    lists::Lists,
    springs::Springs,
    state::{Advanced, Dissipation, Forces, Motion, State},
};
use crate::SolveError;

/// Frozen temperatures of the particles at the window's start and end, in K, in memory order.
pub(super) struct Heat {
    pub start_k: Vec<f64>,
    pub end_k: Vec<f64>,
}

/// Evaluates forces; owns the scratch memory of one solve.
pub(super) struct Evaluator<'a> {
    particles: &'a Particles,
    heat: Option<&'a Heat>,
    radii: &'a [f64],
    materials: &'a [u16],
    /// Whether the particles have one radius, mass and modulus at the window's start.
    alike: bool,
    /// Moduli at the last evaluation.
    moduli: Vec<f64>,
    /// The lists at the last evaluation.
    lists: Arc<Lists>,
    /// Springs of the contacts, block by block: each evaluation advances them by its step.
    pub springs: Vec<Springs>,
    evaluations: u32,
    builds: u32,
    places: Vec<Place>,
    bodies: Vec<Body>,
    scratch: Vec<Scratch>,
}

/// What a block computes before it is added to the others.
#[derive(Default)]
struct Scratch {
    loads: Vec<Load>,
    touching: Vec<u32>,
    dissipation: Dissipation,
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
    /// Starts from what `state` holds; without `heat` its moduli stay.
    pub fn new(particles: &'a Particles, state: &'a State, heat: Option<&'a Heat>) -> Self {
        let bodies = (state.bodies.masses.iter().zip(&state.moduli))
            .map(|(&mass, &modulus)| Body { velocity: Vec3::zeros(), mass, spin: Vec3::zeros(), modulus })
            .collect();
        let places = (state.motion.positions.iter().zip(&state.bodies.radii))
            .map(|(&position, &radius)| Place { position, radius })
            .collect();
        Self {
            particles,
            heat,
            radii: &state.bodies.radii,
            materials: &state.bodies.materials,
            alike: state.bodies.alike() && one(&state.moduli),
            moduli: state.moduli.clone(),
            lists: Arc::clone(&state.lists),
            springs: state.springs.clone(),
            evaluations: 0,
            builds: 0,
            places,
            bodies,
            scratch: Vec::new(),
        }
    }

    /// Builds the lists anew where a particle has moved half its skin.
    ///
    /// # Errors
    /// [`Lists::build`]'s.
    pub fn refresh(&mut self, positions: &[Vec3]) -> Result<(), SolveError> {
        if self.lists.hold(positions, self.radii, self.particles.settings.skin) {
            return Ok(());
        }
        let lists = Lists::build(self.particles, positions, self.radii)?;
        if self.particles.remembers() {
            self.springs = self.lists.hand_over(&self.springs, &lists, Some);
        } else {
            self.springs = lists.no_springs();
        }
        self.lists = Arc::new(lists);
        self.builds += 1;
        Ok(())
    }

    /// Forces, moments and dissipation at one instant.
    ///
    /// # Errors
    /// [`Lists::build`]'s.
    pub fn evaluate(&mut self, at: At<'_>, forces: &mut Forces) -> Result<(), SolveError> {
        self.evaluations += 1;
        self.refresh(at.positions)?;
        if let Some(heat) = self.heat {
            self.particles.soften(heat, self.materials, at.fraction, &mut self.moduli);
        }
        self.pack(at);
        self.blocks(at.step_s);
        self.gather(forces);
        forces.step_s = at.step_s;
        Ok(())
    }

    /// What has come of the window.
    pub fn end(
        self,
        motion: Motion,
        forces: Forces,
        dissipated: Dissipation,
        substeps: u32,
        substep_s: f64,
    ) -> Advanced {
        let Self { moduli, lists, builds, springs, evaluations, .. } = self;
        Advanced { motion, forces, moduli, lists, builds, springs, dissipated, substeps, substep_s, evaluations }
    }

    /// Puts together what a contact reads together.
    fn pack(&mut self, at: At<'_>) {
        let moduli = &self.moduli;
        let pack = |(chunk, (places, bodies)): (usize, (&mut [Place], &mut [Body]))| {
            let first = chunk * BLOCK;
            for (k, (place, body)) in places.iter_mut().zip(bodies).enumerate() {
                let i = first + k;
                place.position = at.positions[i];
                (body.velocity, body.spin, body.modulus) = (at.velocities[i], at.spins[i], moduli[i]);
            }
        };
        if self.places.len() > PARALLEL_PARTICLES {
            self.places.par_chunks_mut(BLOCK).zip(self.bodies.par_chunks_mut(BLOCK)).enumerate().for_each(pack);
        } else {
            self.places.chunks_mut(BLOCK).zip(self.bodies.chunks_mut(BLOCK)).enumerate().for_each(pack);
        }
    }

    /// Loads of every block on its own particles and its halo.
    fn blocks(&mut self, step_s: f64) {
        let bed = Bed {
            particles: self.particles,
            places: &self.places,
            bodies: &self.bodies,
            materials: self.materials,
            alike: self.alike && self.heat.is_none(),
            step_s,
        };
        let lists = &self.lists;
        self.scratch.resize_with(lists.pairs.blocks.len(), Scratch::default);
        let work = |(index, (scratch, springs)): (usize, (&mut Scratch, &mut Springs))| {
            let block = &lists.pairs.blocks[index];
            scratch.loads.clear();
            scratch.loads.resize(block.len() + block.halo.len(), Load::none());
            scratch.dissipation = bed.fields(block.range(), &mut scratch.loads);
            let Scratch { loads, touching, dissipation } = scratch;
            let walls = &lists.walls[index];
            *dissipation += bed.contacts(Task { block, walls, springs, loads, touching });
        };
        if self.places.len() > PARALLEL_PARTICLES {
            self.scratch.par_iter_mut().zip(&mut self.springs).enumerate().for_each(work);
        } else {
            self.scratch.iter_mut().zip(&mut self.springs).enumerate().for_each(work);
        }
    }

    /// Adds the blocks' loads, the halos in the order of their blocks.
    fn gather(&mut self, forces: &mut Forces) {
        let (scratch, blocks) = (&self.scratch, &self.lists.pairs.blocks);
        let add = |(index, (force, moment)): (usize, (&mut [Vec3], &mut [Vec3]))| {
            let own = &scratch[index].loads[..force.len()];
            for ((force, moment), load) in force.iter_mut().zip(moment.iter_mut()).zip(own) {
                (*force, *moment) = (load.force, load.moment);
            }
            for (source, range) in &blocks[index].incoming {
                let source = *source as usize;
                let loads = &scratch[source].loads[blocks[source].len()..];
                for entry in range.start as usize..range.end as usize {
                    let k = blocks[source].halo[entry] as usize - index * BLOCK;
                    force[k] += loads[entry].force;
                    moment[k] += loads[entry].moment;
                }
            }
        };
        let Forces { force, moment, .. } = forces;
        if force.len() > PARALLEL_PARTICLES {
            force.par_chunks_mut(BLOCK).zip(moment.par_chunks_mut(BLOCK)).enumerate().for_each(add);
        } else {
            force.chunks_mut(BLOCK).zip(moment.chunks_mut(BLOCK)).enumerate().for_each(add);
        }
        forces.dissipation = Dissipation::default();
        for scratch in &self.scratch {
            forces.dissipation += scratch.dissipation;
        }
    }
}

impl Bed<'_> {
    /// Gravity and drag on the particles of a block.
    fn fields(self, range: std::ops::Range<usize>, loads: &mut [Load]) -> Dissipation {
        let Particles { settings, gravity, .. } = self.particles;
        let mut lost = Dissipation::default();
        for (i, load) in range.zip(loads) {
            let (place, body) = (&self.places[i], &self.bodies[i]);
            load.force = gravity * body.mass;
            if let Some(drag) = &settings.drag {
                let drag = drag.force(place.radius, &body.velocity);
                load.force += drag;
                lost.drag -= drag.dot(&body.velocity);
            }
        }
        lost
    }
}
