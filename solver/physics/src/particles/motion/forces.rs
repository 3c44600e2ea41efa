//! All forces on all particles, and on the walls.

use std::sync::Arc;

use rayon::prelude::*;
use stagger_coupling::SolveError;

use crate::{
    common::{
        Vec3,
        walls::{Pose, Touch, WallState},
    },
    particles::{
        bonds::{Bonds, Spheres},
        contact::rolling,
        exchange::external_fields::{ExternalFields, soften},
        fields::NearList,
        kernel::{
            input::{Body, KernelInput, Load, Place, Task},
            sinking::Sinking,
            sliding::stretch,
        },
        model::{
            Model,
            bodies::one,
            state::{Advanced, Dissipation, Forces, Motion, State, WallLoad},
        },
        search::{
            blocks::{BLOCK, PARALLEL_PARTICLES},
            contact_history::ContactHistory,
            lists::Lists,
        },
        settings::Integrator,
    },
};

/// Evaluates forces; owns the scratch memory of one solve.
pub struct Evaluator<'a> {
    model: &'a Model,
    state: &'a State,
    external: &'a ExternalFields,
    /// Whether the particles have one radius, mass and modulus.
    alike: bool,
    /// Moduli at the last evaluation.
    moduli: Vec<f64>,
    /// The lists at the last evaluation.
    lists: Arc<Lists>,
    /// Pairs of the near field.
    near: Option<Arc<NearList>>,
    /// Strengths of the particles in the near field.
    sources: Vec<f64>,
    /// What contacts and bonds remember: each evaluation advances it by its step.
    memory: Memory,
    /// The springs of the window's start, in the lists of the state, where they are other than the state's.
    led: Option<Vec<ContactHistory>>,
    /// Place in memory of each particle's number, where there are bonds.
    places_by_id: Vec<u32>,
    evaluations: u32,
    builds: u32,
    /// As [`rolling::stopping_share`], of the window's start.
    stopping_share: f64,
    /// As [`Self::rate_1_s2`].
    rate_1_s2: f64,
    places: Vec<Place>,
    bodies: Vec<Body>,
    poses: Vec<Pose>,
    scratch: Vec<Scratch>,
    /// Scratch: the near field's forces.
    field_forces: Vec<Vec3>,
}

/// What contacts and bonds remember.
#[derive(Clone)]
struct Memory {
    /// Springs of the contacts, block by block.
    contact_history: Vec<ContactHistory>,
    bonds: Bonds,
    /// Energy of the bonds that broke since the window's start, in J.
    broken_j: f64,
}

/// What a block computes before it is added to the others.
#[derive(Default)]
struct Scratch {
    loads: Vec<Load>,
    on_walls: Vec<Vec3>,
    on_contacts: Vec<WallLoad>,
    touching: Vec<u32>,
    touches: Vec<Touch>,
    dissipation: Dissipation,
    rate_1_s2: f64,
}

/// The instant that forces are evaluated at.
#[derive(Clone, Copy)]
pub struct At<'a> {
    pub positions: &'a [Vec3],
    pub velocities: &'a [Vec3],
    pub spins: &'a [Vec3],
    /// Mean spins over the step that led here.
    pub turning: &'a [Vec3],
    /// How far pressed walls have moved.
    pub walls: &'a [WallState],
    /// Time in s.
    pub t_s: f64,
    /// Share of the window that has passed, for the frozen temperature.
    pub fraction: f64,
    /// Step Δt in s for what contacts and bonds remember.
    pub step_s: f64,
}

impl<'a> Evaluator<'a> {
    /// Starts from what `state` holds; without heat from outside its moduli stay.
    pub fn new(model: &'a Model, state: &'a State, external: &'a ExternalFields) -> Self {
        let State { bodies: of, motion, moduli, .. } = state;
        let bodies = (of.masses.iter().zip(moduli)).map(|(&mass, &modulus)| Body {
            velocity: Vec3::zeros(),
            mass,
            spin: Vec3::zeros(),
            modulus,
        });
        let places = motion.positions.iter().zip(&of.radii).map(|(&position, &radius)| Place { position, radius });
        let sources = model.fields.near_field.as_ref().map_or_else(Vec::new, |near| {
            let each = of.radii.iter().zip(&of.masses).zip(&of.ids);
            each.map(|((&radius, &mass), &id)| near.source(model.fields.body(radius, mass), id.into())).collect()
        });
        Self {
            model,
            state,
            external,
            alike: of.alike() && one(moduli) && external.heat.is_none(),
            moduli: moduli.clone(),
            lists: Arc::clone(&state.lists),
            near: state.near.clone(),
            sources,
            memory: Memory {
                contact_history: state.contact_history.clone(),
                bonds: state.bonds.clone(),
                broken_j: 0.0,
            },
            led: None,
            places_by_id: if model.bonds.is_some() { of.places_by_id() } else { Vec::new() },
            evaluations: 0,
            builds: 0,
            stopping_share: rolling::stopping_share(if model.contact.surface.rolls { state.crowd() } else { 0.0 }),
            rate_1_s2: 0.0,
            places: places.collect(),
            bodies: bodies.collect(),
            poses: Vec::new(),
            scratch: Vec::new(),
            field_forces: Vec::new(),
        }
    }

    /// Forgets what contacts and bonds have remembered since the window's start: the next evaluation starts there again.
    pub fn forget(&mut self) -> Result<(), SolveError> {
        self.memory.bonds.clone_from(&self.state.bonds);
        self.memory.broken_j = 0.0;
        if !self.model.remembers() {
            return Ok(());
        }
        let contact_history = self.led.as_ref().unwrap_or(&self.state.contact_history);
        if Arc::ptr_eq(&self.lists, &self.state.lists) {
            self.memory.contact_history.clone_from(contact_history);
        } else {
            self.memory.contact_history = self.state.lists.hand_over(contact_history, &self.lists, Some);
        }
        Ok(())
    }

    /// Starts again from the window's start, at `t_s`, with its springs ahead by half of `step_s`, where the state has them
    /// ahead by half of another.
    pub fn lead(&mut self, t_s: f64, step_s: f64) -> Result<(), SolveError> {
        let by_s = 0.5 * (step_s - self.state.lead_s);
        if self.evaluations == 0 && by_s == 0.0 {
            return Ok(());
        }
        self.led = (self.model.remembers() && by_s.abs() > 0.0).then(|| {
            let mut contact_history = self.state.contact_history.clone();
            stretch(self.model, self.state, &mut contact_history, t_s, by_s);
            contact_history
        });
        self.forget()
    }

    /// What the contacts of the last evaluation remember.
    pub fn contact_history(&self) -> &[ContactHistory] {
        &self.memory.contact_history
    }

    /// Largest elastic force over overlap and reduced mass of a contact at the last evaluation, in 1/s²; 0 without contacts.
    pub fn rate_1_s2(&self) -> f64 {
        self.rate_1_s2
    }

    /// Builds the lists anew where a particle, or a wall as it sees it, has moved half its skin.
    ///
    /// # Errors
    /// [`Lists::build`]'s.
    pub fn refresh(&mut self, positions: &[Vec3], walls: &[WallState], t_s: f64) -> Result<(), SolveError> {
        self.poses = self.model.poses(walls, t_s);
        let (radii, skin) = (&self.state.bodies.radii, self.model.settings.skin);
        if self.lists.hold(positions, radii, skin, &self.poses) {
            return Ok(());
        }
        let lists = self.model.lists(positions, radii, &self.poses)?;
        self.memory.contact_history = self.model.handed_over(&self.lists, &self.memory.contact_history, &lists, Some);
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
        self.refresh(at.positions, at.walls, at.t_s)?;
        if let Some(heat) = &self.external.heat {
            soften(self.model, heat, &self.state.bodies.materials, at.fraction, &mut self.moduli);
        }
        self.pack(at);
        self.blocks(at);
        self.gather(forces);
        self.near_field(at, forces);
        self.bonds(at, forces);
        self.push(at, forces);
        forces.step_s = at.step_s;
        Ok(())
    }

    /// What has come of the window.
    pub fn end(
        self,
        (motion, walls): (Motion, Vec<WallState>),
        forces: Forces,
        dissipated: Dissipation,
        (substeps, substep_s): (u32, f64),
    ) -> Advanced {
        let Self { moduli, lists, near, memory, evaluations, builds, .. } = self;
        Advanced {
            motion,
            walls,
            forces,
            moduli,
            lists,
            near,
            builds,
            contact_history: memory.contact_history,
            bonds: memory.bonds,
            dissipated: Dissipation { broken: memory.broken_j, ..dissipated },
            substeps,
            substep_s,
            evaluations,
        }
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
    fn blocks(&mut self, at: At<'_>) {
        let sinking = self.model.sinking_wall().map(|wall| Sinking {
            wall,
            start_m: &self.state.sunk_m,
            end_m: self.external.sunk_m.as_ref().map(|(end_m, window_s)| (&**end_m, *window_s)),
            fraction: at.fraction,
        });
        let input = KernelInput {
            model: self.model,
            sinking,
            places: &self.places,
            bodies: &self.bodies,
            materials: &self.state.bodies.materials,
            poses: &self.poses,
            t_s: at.t_s,
            alike: self.alike,
            step_s: at.step_s,
            stopping_share: self.stopping_share,
            touch_s: match self.model.settings.integrator {
                Integrator::Verlet { .. } => at.step_s,
                Integrator::Trapezoidal { .. } | Integrator::Held => 0.0,
            },
        };
        let lists = &self.lists;
        self.scratch.resize_with(lists.pairs.blocks.len(), Scratch::default);
        let work = |(index, (scratch, contact_history)): (usize, (&mut Scratch, &mut ContactHistory))| {
            let block = &lists.pairs.blocks[index];
            let Scratch { loads, on_walls, on_contacts, touching, touches, dissipation, rate_1_s2 } = scratch;
            *rate_1_s2 = 0.0;
            on_contacts.clear();
            loads.clear();
            loads.resize(block.len() + block.halo.len(), Load::none());
            on_walls.clear();
            on_walls.resize(input.poses.len(), Vec3::zeros());
            *dissipation = input.fields(block.range(), loads);
            let walls = &lists.walls[index];
            *dissipation += input.contacts(Task {
                block,
                walls,
                contact_history,
                loads,
                on_walls,
                on_contacts,
                rate_1_s2,
                touching,
                touches,
            });
        };
        if self.places.len() > PARALLEL_PARTICLES {
            self.scratch.par_iter_mut().zip(&mut self.memory.contact_history).enumerate().for_each(work);
        } else {
            self.scratch.iter_mut().zip(&mut self.memory.contact_history).enumerate().for_each(work);
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
        forces.on_walls.clear();
        forces.on_walls.resize(self.poses.len(), Vec3::zeros());
        forces.on_contacts.clear();
        let rows = &self.state.bodies.rows;
        self.rate_1_s2 = 0.0;
        for scratch in &self.scratch {
            self.rate_1_s2 = self.rate_1_s2.max(scratch.rate_1_s2);
            forces.dissipation += scratch.dissipation;
            let row = |load: &WallLoad| WallLoad { pair: [rows[load.pair[0] as usize], load.pair[1]], ..*load };
            forces.on_contacts.extend(scratch.on_contacts.iter().map(row));
            for (sum, force) in forces.on_walls.iter_mut().zip(&scratch.on_walls) {
                *sum += force;
            }
        }
    }

    /// Adds the near field between the particles.
    fn near_field(&mut self, at: At<'_>, forces: &mut Forces) {
        let Some(field) = &self.model.fields.near_field else { return };
        if !self.near.as_ref().is_some_and(|list| field.holds(list, at.positions)) {
            self.near = field.list(at.positions).map(Arc::new);
        }
        let radii = &self.state.bodies.radii;
        self.field_forces.clear();
        self.field_forces.resize(at.positions.len(), Vec3::zeros());
        field.add(at.t_s, self.near.as_deref(), at.positions, &self.sources, radii, &mut self.field_forces);
        for ((force, near), velocity) in forces.force.iter_mut().zip(&self.field_forces).zip(at.velocities) {
            *force += near;
            forces.dissipation.near_field -= near.dot(velocity);
        }
    }

    /// Whether there is a push of sound.
    pub fn is_pushed(&self) -> bool {
        self.external.push.is_some()
    }

    /// Adds the push of sound.
    fn push(&self, at: At<'_>, forces: &mut Forces) {
        let Some(push) = &self.external.push else { return };
        for ((force, push), velocity) in forces.force.iter_mut().zip(push).zip(at.velocities) {
            *force += push;
            forces.dissipation.sound -= push.dot(velocity);
        }
    }

    /// Moves the bonds on and adds what they pull.
    fn bonds(&mut self, at: At<'_>, forces: &mut Forces) {
        let Some(bond_model) = &self.model.bonds else { return };
        let bodies = &self.state.bodies;
        let spheres = Spheres {
            ids: &bodies.ids,
            places: &self.places_by_id,
            positions: at.positions,
            velocities: at.velocities,
            spins: at.spins,
            turning: at.turning,
            radii: &bodies.radii,
            masses: &bodies.masses,
        };
        let Memory { bonds, broken_j, .. } = &mut self.memory;
        let work = bond_model.advance(bonds, &spheres, at.t_s, at.step_s, &mut forces.force, &mut forces.moment);
        forces.dissipation.bonds += work.damping_w;
        *broken_j += work.broken_j;
    }
}
