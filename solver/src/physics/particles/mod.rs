//! Particle dynamics: contact, damping, friction, drag and gravity of spheres (Zohdi 2018, ch. 6), integrated inside
//! each coupling window.

mod blocks;
mod bodies;
pub mod bonds;
mod contact;
mod contact_list;
mod domain;
mod drag;
pub mod fields;
mod forces;
mod friction;
mod hertz;
mod kernel;
mod lanes;
mod ledger;
mod linear;
mod lists;
mod monograph_bond;
mod neighbours;
mod overlap;
mod pair_kernel;
mod pair_table;
mod pour;
mod quadrature;
mod rolling;
mod settings;
mod settings_bonds;
mod settings_fields;
mod softening;
mod springs;
pub mod start;
mod state;
mod substep;
mod tangential_spring;
mod trapezoidal;
mod validate;
mod verlet;
mod wall_kernel;
mod wall_list;

use std::{f64::consts::PI, sync::Arc};

use stagger_messages::{Field, Fields, Measure, Port, Ports};

pub use domain::{Body, Domain, Moved};
pub use pour::{Pour, PourRegion, Poured};
pub use settings::*;
pub use settings_bonds::*;
pub use settings_fields::*;
pub use state::State;

use self::{
    bodies::{Bodies, along_z_curve},
    contact::{Law, Surface},
    contact_list::{ContactPorts, Snapshot},
    forces::{At, Evaluator, Heat},
    hertz::Hertz,
    lists::Lists,
    monograph_bond::MonographBond,
    pair_table::PairTable,
    softening::Softening,
    start::Placed,
    state::{Advanced, Forces, Motion, Trial},
    substep::TimeScales,
    trapezoidal::Trapezoidal,
};
use crate::{
    SolveError,
    coupling::{Frozen, Physics, Reply, Window},
};

type Vec3 = nalgebra::Vector3<f64>;

/// Particles above which threads share the work; below, waking them costs more than it saves.
const PARALLEL_PARTICLES: usize = 4096;

/// Lists built from one sorting of the memory to the next.
const BUILDS_PER_SORTING: u32 = 8;

/// The particles of a scene.
///
/// Writes `positions`, `velocities`, `radii` and the contacts between particles and with walls, all at the window's
/// end; reads `temperature` where it softens the contacts.
#[derive(Debug)]
pub struct Particles {
    settings: Settings,
    law: Law,
    table: PairTable,
    surface: Surface,
    /// Moduli of the materials, by temperature.
    softening: Vec<Softening>,
    gravity: Vec3,
    planes: Vec<Plane>,
    /// The particles at t = 0, in the order of the fields.
    start: (Bodies, Motion),
    /// Shortest expected contact, in s.
    contact_s: f64,
    /// Longest substep of the Verlet integrator, in s.
    substep_s: f64,
    temperature: Arc<Port>,
    positions: Arc<Port>,
    velocities: Arc<Port>,
    radii: Arc<Port>,
    contact_ports: ContactPorts,
    wall_contact_ports: ContactPorts,
}

/// A plane of a wall.
#[derive(Clone, Copy, Debug)]
struct Plane {
    wall: u32,
    through: Vec3,
    normal: Vec3,
}

impl Plane {
    /// Signed distance in m; negative behind the plane.
    #[inline]
    fn distance(&self, position: &Vec3) -> f64 {
        (position - self.through).dot(&self.normal)
    }
}

impl Particles {
    /// Places the particles of `settings` and derives what does not change during a run.
    ///
    /// # Errors
    /// [`SolveError::Start`] where the start cannot be made, [`SolveError::Mismatch`] where a setting is out of its
    /// range; the message names the setting.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        validate::settings(&settings)?;
        let start = at_start(&settings)?;
        let planes = (0u32..).zip(&settings.walls).flat_map(|(wall, shape)| {
            shape.shape.planes().into_iter().map(move |plane| Plane {
                wall,
                through: Vec3::from(plane.through),
                normal: Vec3::from(plane.normal).normalize(),
            })
        });
        let vectors = |name, unit, measure| Arc::new(Port::f64(name, unit, "particles", 3, measure));
        let law = Law::from(settings.contact.law);
        let table = PairTable::new(&settings, law);
        let mut particles = Self {
            law,
            surface: Surface {
                spin: settings.spin,
                rolls: settings.spin && table.laws().iter().any(|pair| pair.rolling > 0.0 || pair.torsion > 0.0),
                bond: settings.bond.map(|settings| MonographBond { settings }),
            },
            table,
            softening: vec![softening(&settings)],
            gravity: Vec3::from(settings.gravity_m_s2),
            planes: planes.collect(),
            start,
            contact_s: f64::INFINITY,
            substep_s: f64::INFINITY,
            temperature: Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude).as_read()),
            positions: vectors("positions", "m", Measure::Increment),
            velocities: vectors("velocities", "m/s", Measure::None),
            radii: Arc::new(Port::f64("radii", "m", "particles", 1, Measure::None)),
            contact_ports: ContactPorts::new("contact", "contacts"),
            wall_contact_ports: ContactPorts::new("wall_contact", "wall-contacts"),
            settings,
        };
        let state = particles.state_at_start()?;
        let stored_per_modulus = (state.contacts.energy_per_modulus.iter())
            .chain(&state.wall_contacts.energy_per_modulus)
            .fold(0.0f64, |largest, &energy| largest.max(energy));
        let TimeScales { contact_s, substep_s } = particles.time_scales(&state, stored_per_modulus);
        particles.contact_s = contact_s;
        particles.substep_s = match particles.settings.integrator {
            Integrator::Verlet { substep_s: Some(bound_s) } => bound_s,
            _ => substep_s,
        };
        Ok(particles)
    }

    /// Whether contacts remember a tangential spring.
    fn remembers(&self) -> bool {
        matches!(self.settings.friction, Some(Friction::Spring { .. }))
    }

    /// Modulus of a material at a temperature in K.
    #[inline]
    fn modulus(&self, material: u16, temperature_k: f64) -> f64 {
        self.softening[material as usize].stiffness(temperature_k)
    }

    /// The state at t = 0. Friction is zero in its forces: it depends on a step that is not known yet.
    fn state_at_start(&self) -> Result<State, SolveError> {
        let (bodies, motion) = &self.start;
        let order = along_z_curve(&motion.positions, cell(bodies));
        let (bodies, motion) = (bodies.reordered(&order), motion.reordered(&order));
        let lists = Lists::build(self, &motion.positions, &bodies.radii)?;
        let moduli: Vec<f64> =
            bodies.materials.iter().map(|&material| self.modulus(material, self.settings.temperature_k)).collect();
        let springs = lists.no_springs();
        let at = Snapshot {
            bodies: &bodies,
            positions: &motion.positions,
            moduli: &moduli,
            lists: &lists,
            springs: &springs,
        };
        let (found, found_walls) = (self.find_contacts(at), self.find_wall_contacts(at));
        let mut state = State {
            contacts: self.contact_ports.list(&found, None)?,
            wall_contacts: self.wall_contact_ports.list(&found_walls, None)?,
            critical_s: self.critical_step(&bodies, &found, &found_walls),
            forces: Forces::none(bodies.len()),
            bodies: Arc::new(bodies),
            motion,
            moduli,
            lists: Arc::new(lists),
            builds: 0,
            springs,
        };
        let mut forces = state.forces.clone();
        self.forces_at_start(&state, &mut Evaluator::new(self, &state, None), 0.0, &mut forces)?;
        state.forces = forces;
        Ok(state)
    }

    /// Forces at the window's start with friction's step; the springs stay as they are.
    fn forces_at_start(
        &self,
        state: &State,
        evaluator: &mut Evaluator<'_>,
        step_s: f64,
        forces: &mut Forces,
    ) -> Result<(), SolveError> {
        let Motion { positions, velocities, spins } = &state.motion;
        evaluator.evaluate(At { positions, velocities, spins, fraction: 0.0, step_s }, forces)?;
        evaluator.springs.clone_from(&state.springs);
        Ok(())
    }

    /// Forces at the window's start: those of the state, or new ones where friction depends on a step that has changed.
    fn start_forces(&self, state: &State, evaluator: &mut Evaluator<'_>, step_s: f64) -> Result<Forces, SolveError> {
        let mut forces = state.forces.clone();
        let depends = matches!(self.settings.friction, Some(Friction::Regularised { .. }))
            || self.settings.bond.is_some()
            || self.surface.rolls;
        if depends && forces.step_s.to_bits() != step_s.to_bits() {
            self.forces_at_start(state, evaluator, step_s, &mut forces)?;
        }
        Ok(forces)
    }

    /// The frozen temperatures; `None` where they change nothing.
    fn heat(&self, frozen: &Frozen, bodies: &Bodies) -> Result<Option<Heat>, SolveError> {
        if !self.settings.reads_temperature || self.softening.iter().all(|softening| softening.rate <= 0.0) {
            return Ok(None);
        }
        let read = |field: &Field| {
            let values = field.f64()?;
            if values.len() != bodies.len() {
                return Err(SolveError::Mismatch(format!(
                    "particles: field `temperature` has {} values, but there are {} particles",
                    values.len(),
                    bodies.len()
                )));
            }
            match field.first_not_finite() {
                None => Ok(bodies.in_memory(values)),
                Some(row) => Err(SolveError::NotFinite {
                    node: "particles".into(),
                    field: "temperature".into(),
                    row,
                    value: values[row],
                }),
            }
        };
        Ok(Some(Heat { start_k: read(frozen.at_start("temperature")?)?, end_k: read(frozen.at_end("temperature")?)? }))
    }

    /// Moduli at the share `fraction` of the window, the temperature running linearly.
    fn soften(&self, heat: &Heat, materials: &[u16], fraction: f64, moduli: &mut [f64]) {
        let temperatures = heat.start_k.iter().zip(&heat.end_k);
        for ((modulus, &material), (start, end)) in moduli.iter_mut().zip(materials).zip(temperatures) {
            *modulus = self.modulus(material, start + fraction * (end - start));
        }
    }

    /// The state at the end of a window and what is said about it.
    fn finish(&self, from: &State, advanced: Advanced, heat: Option<&Heat>) -> Result<(State, Reply), SolveError> {
        let Advanced { motion, forces, moduli, lists, springs, dissipated, .. } = advanced;
        let bodies = Arc::clone(&from.bodies);
        let at = Snapshot {
            bodies: &bodies,
            positions: &motion.positions,
            moduli: &moduli,
            lists: &lists,
            springs: &springs,
        };
        let (found, found_walls) = (self.find_contacts(at), self.find_wall_contacts(at));
        let state = State {
            contacts: self.contact_ports.list(&found, Some(&from.contacts))?,
            wall_contacts: self.wall_contact_ports.list(&found_walls, Some(&from.wall_contacts))?,
            critical_s: self.critical_step(&bodies, &found, &found_walls),
            bodies,
            motion,
            forces,
            moduli,
            lists,
            builds: from.builds + advanced.builds,
            springs,
        };
        let softening = match heat {
            Some(heat) => {
                let mut start = from.moduli.clone();
                self.soften(heat, &from.bodies.materials, 0.0, &mut start);
                self.softening(from, &start, &state)?
            }
            None => 0.0,
        };
        let mut reply = self.reply(&state)?;
        reply.ledger.extend(self.exchanged(from, &state, &dissipated, softening));
        reply.figures.insert("substeps".into(), f64::from(advanced.substeps));
        reply.figures.insert("substep [s]".into(), advanced.substep_s);
        reply.figures.insert("force evaluations".into(), f64::from(advanced.evaluations));
        if state.critical_s.is_finite() {
            reply.figures.insert("substep over critical".into(), advanced.substep_s / state.critical_s);
        }
        if self.contact_s.is_finite() {
            reply.figures.insert("shortest contact time over substep".into(), self.contact_s / advanced.substep_s);
        }
        let state = if state.builds >= BUILDS_PER_SORTING { self.sorted(state)? } else { state };
        Ok((state, reply))
    }

    /// The same state, with particles that have become neighbours near each other in memory again.
    fn sorted(&self, state: State) -> Result<State, SolveError> {
        let order = along_z_curve(&state.motion.positions, cell(&state.bodies));
        let mut places = vec![0u32; order.len()];
        for (place, &from) in (0u32..).zip(&order) {
            places[from as usize] = place;
        }
        let (bodies, motion) = (state.bodies.reordered(&order), state.motion.reordered(&order));
        let lists = Lists::build(self, &motion.positions, &bodies.radii)?;
        let springs = if self.remembers() {
            state.lists.hand_over(&state.springs, &lists, |particle| Some(places[particle as usize]))
        } else {
            lists.no_springs()
        };
        Ok(State {
            forces: state.forces.reordered(&order),
            moduli: bodies::reordered(&state.moduli, &order),
            bodies: Arc::new(bodies),
            motion,
            lists: Arc::new(lists),
            builds: 0,
            springs,
            ..state
        })
    }

    /// The fields and the stored energy of `state`.
    fn reply(&self, state: &State) -> Result<Reply, SolveError> {
        let bodies = &state.bodies;
        let flat = |vectors: &[Vec3]| -> Vec<f64> {
            bodies.in_rows(vectors).iter().flat_map(|vector| [vector.x, vector.y, vector.z]).collect()
        };
        let mut fields = Fields::new();
        let motion = [
            Field::new(&self.positions, 0, flat(&state.motion.positions))?,
            Field::new(&self.velocities, 0, flat(&state.motion.velocities))?,
            Field::new(&self.radii, 0, bodies.in_rows(&bodies.radii))?,
        ];
        let lists = state.contacts.fields().into_iter().chain(state.wall_contacts.fields());
        for field in motion.into_iter().chain(lists.cloned()) {
            fields.insert(field.name().into(), field);
        }
        let mut reply = Reply { fields, ledger: self.stored(state)?, ..Reply::default() };
        let deepest = state.contacts.deepest.max(state.wall_contacts.deepest);
        reply.figures.insert("largest overlap over radius".into(), deepest);
        Ok(reply)
    }
}

/// Cell in m that the memory is sorted by: the mean diameter.
fn cell(bodies: &Bodies) -> f64 {
    if bodies.len() == 0 { 1.0 } else { 2.0 * bodies.radii.iter().sum::<f64>() / bodies.len() as f64 }
}

/// Softening of the modulus of the particles' material.
fn softening(settings: &Settings) -> Softening {
    let contact = &settings.contact;
    let (stiffness, factor) = match contact.law {
        ContactLaw::Overlap { stiffness_pa, .. } => (stiffness_pa, 1.0),
        ContactLaw::Hertz { young_pa, poisson } => (young_pa, Hertz::modulus(1.0, poisson)),
        ContactLaw::Linear { stiffness_n_m } => (stiffness_n_m, 1.0),
    };
    Softening {
        reference_modulus: stiffness * factor,
        rate: contact.softening_rate,
        reference_k: contact.softening_reference_k,
        floor_modulus: contact.softening_floor_pa * factor,
    }
}

impl Physics for Particles {
    type State = State;

    fn ports(&self) -> Ports {
        let written = [&self.positions, &self.velocities, &self.radii].into_iter();
        let lists = self.contact_ports.all().into_iter().chain(self.wall_contact_ports.all());
        Ports {
            reads: self.settings.reads_temperature.then(|| (*self.temperature).clone()).into_iter().collect(),
            writes: written.chain(lists).map(|port| (**port).clone()).collect(),
        }
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let state = self.state_at_start()?;
        let reply = self.reply(&state)?;
        Ok((state, reply))
    }

    fn solve(&self, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        if !(window.dt_s > 0.0 && window.dt_s.is_finite()) {
            return Err(SolveError::Mismatch(format!("particles: a window of {} s cannot be solved", window.dt_s)));
        }
        let heat = self.heat(frozen, &state.bodies)?;
        let heat = heat.as_ref();
        let trial = match self.settings.integrator {
            Integrator::Verlet { .. } => verlet::advance(self, state, heat, window)?,
            Integrator::Trapezoidal { phi, tolerance, iterations } => {
                Trapezoidal { phi, tolerance, iterations }.advance(self, state, heat, window)?
            }
        };
        match trial {
            Trial::Converged(advanced) => self.finish(state, *advanced, heat),
            // The fields of the window's start, so that the reply is whole; nobody may accept them.
            Trial::NotConverged(reason) => {
                Ok((state.clone(), Reply { not_converged: Some(reason), ..self.reply(state)? }))
            }
        }
    }
}

/// The particles at t = 0, in the order of the fields.
fn at_start(settings: &Settings) -> Result<(Bodies, Motion), SolveError> {
    let Placed { positions, velocities, radii, materials } = start::place(settings)?;
    let density = |material: &u16| settings.materials[usize::from(*material)].density_kg_m3;
    let masses: Vec<f64> = (radii.iter().zip(&materials))
        .map(|(radius, material)| 4.0 / 3.0 * PI * radius.powi(3) * density(material))
        .collect();
    let bodies = Bodies {
        rows: (0u32..).take(radii.len()).collect(),
        inertias: masses.iter().zip(&radii).map(|(mass, radius)| 0.4 * mass * radius * radius).collect(),
        // The laws of contact are those of one material.
        materials: vec![0; radii.len()],
        masses,
        radii,
    };
    let vectors = |values: Vec<[f64; 3]>| values.into_iter().map(Vec3::from).collect::<Vec<_>>();
    let spins = vec![Vec3::zeros(); bodies.radii.len()];
    Ok((bodies, Motion { positions: vectors(positions), velocities: vectors(velocities), spins }))
}
