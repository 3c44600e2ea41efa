//! Particle dynamics: contact, damping, friction, drag and gravity of spheres (Zohdi 2018, ch. 6), integrated inside
//! each coupling window.

mod contact;
mod contact_list;
mod drag;
mod forces;
mod friction;
mod hertz;
mod ledger;
mod neighbours;
mod overlap;
mod quadrature;
mod sequential_addition;
mod settings;
mod softening;
mod state;
mod substep;
mod trapezoidal;
mod validate;
mod verlet;

use std::{f64::consts::PI, sync::Arc};

use stagger_messages::{Field, Fields, Measure, Port, Ports};

pub use settings::*;
pub use state::State;

use self::{
    contact::{Law, Surface},
    contact_list::ContactPorts,
    forces::{At, Evaluator, Heat},
    neighbours::NeighbourList,
    sequential_addition::SequentialAddition,
    softening::Softening,
    state::{Advanced, Forces, Motion, Trial},
    substep::TimeScales,
    trapezoidal::Trapezoidal,
};
use crate::{
    SolveError,
    coupling::{Frozen, Physics, Reply, Window},
};

type Vec3 = nalgebra::Vector3<f64>;

/// Listed pairs, or particles, above which threads share the work; below, waking them costs more than it saves.
const PARALLEL_ITEMS: usize = 16_384;

/// The particles of a scene.
///
/// Writes `positions`, `velocities`, `radii` and the contacts between particles and with walls, all at the window's
/// end; reads `temperature` where it softens the contacts.
#[derive(Debug)]
pub struct Particles {
    settings: Settings,
    law: Law,
    surface: Surface,
    softening: Softening,
    gravity: Vec3,
    planes: Vec<Plane>,
    radii: Vec<f64>,
    masses: Vec<f64>,
    /// 2/5 m R², in kg m².
    inertias: Vec<f64>,
    start: Motion,
    /// Shortest expected contact, in s.
    contact_s: f64,
    /// Longest substep of the Verlet integrator, in s.
    substep_s: f64,
    temperature: Arc<Port>,
    positions: Arc<Port>,
    velocities: Arc<Port>,
    radii_field: Field,
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
        let (start, radii) = place(&settings)?;
        let masses: Vec<f64> =
            radii.iter().map(|radius| 4.0 / 3.0 * PI * radius.powi(3) * settings.density_kg_m3).collect();
        let inertias = masses.iter().zip(&radii).map(|(mass, radius)| 0.4 * mass * radius * radius).collect();
        let (ContactLaw::Overlap { stiffness_pa, .. } | ContactLaw::Hertz { young_pa: stiffness_pa, .. }) =
            settings.contact.law;
        let planes = (0u32..).zip(&settings.walls).flat_map(|(wall, shape)| {
            shape.planes.iter().map(move |plane| Plane {
                wall,
                through: Vec3::from(plane.through),
                normal: Vec3::from(plane.normal).normalize(),
            })
        });
        let vectors = |name, unit, measure| Arc::new(Port::f64(name, unit, "particles", 3, measure));
        let radii_port = Arc::new(Port::f64("radii", "m", "particles", 1, Measure::None));
        let mut particles = Self {
            law: Law::from(settings.contact.law),
            surface: Surface {
                damping_n_s_m3: settings.contact.damping_n_s_m3,
                friction: settings.friction,
                spin: settings.spin,
            },
            softening: Softening {
                reference_pa: stiffness_pa,
                rate: settings.contact.softening_rate,
                reference_k: settings.contact.softening_reference_k,
                floor_pa: settings.contact.softening_floor_pa,
            },
            gravity: Vec3::from(settings.gravity_m_s2),
            planes: planes.collect(),
            radii_field: Field::new(&radii_port, 0, radii.clone())?,
            radii,
            masses,
            inertias,
            start,
            contact_s: f64::INFINITY,
            substep_s: f64::INFINITY,
            temperature: Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude).as_read()),
            positions: vectors("positions", "m", Measure::Increment),
            velocities: vectors("velocities", "m/s", Measure::None),
            contact_ports: ContactPorts::new("contact", "contacts"),
            wall_contact_ports: ContactPorts::new("wall_contact", "wall-contacts"),
            settings,
        };
        let state = particles.state_at_start()?;
        let modulus = particles.law.modulus(particles.softening.stiffness(particles.settings.temperature_k));
        let stored_per_pa = (state.contacts.energy_per_pa.iter())
            .chain(&state.wall_contacts.energy_per_pa)
            .fold(0.0f64, |largest, &energy| largest.max(energy));
        let TimeScales { contact_s, substep_s } =
            particles.time_scales(&state.motion.positions, &state.motion.velocities, stored_per_pa * modulus);
        particles.contact_s = contact_s;
        particles.substep_s = match particles.settings.integrator {
            Integrator::Verlet { substep_s: Some(bound_s) } => bound_s,
            _ => substep_s,
        };
        Ok(particles)
    }

    /// The state at t = 0. Friction is zero in its forces: it depends on a step that is not known yet.
    fn state_at_start(&self) -> Result<State, SolveError> {
        let motion = self.start.clone();
        let neighbours = Arc::new(NeighbourList::build(&motion.positions, &self.radii, self.settings.skin));
        let modulus = self.law.modulus(self.softening.stiffness(self.settings.temperature_k));
        let moduli = vec![modulus; self.radii.len()];
        let mut forces = Forces::none(self.radii.len());
        let Motion { positions, velocities, spins } = &motion;
        Evaluator::new(self, None, moduli.clone(), Arc::clone(&neighbours))
            .evaluate(At { positions, velocities, spins, fraction: 0.0, step_s: 0.0 }, &mut forces);
        let contacts = self.contact_ports.list(&self.find_contacts(&neighbours, positions), None)?;
        let wall_contacts = self.wall_contact_ports.list(&self.find_wall_contacts(positions), None)?;
        Ok(State { motion, forces, moduli, neighbours, contacts, wall_contacts })
    }

    /// Forces at the window's start: those of the state, or new ones where friction's step has changed.
    fn start_forces(&self, state: &State, evaluator: &mut Evaluator<'_>, step_s: f64) -> Forces {
        let mut forces = state.forces.clone();
        if self.settings.friction.is_some() && forces.step_s.to_bits() != step_s.to_bits() {
            let Motion { positions, velocities, spins } = &state.motion;
            evaluator.evaluate(At { positions, velocities, spins, fraction: 0.0, step_s }, &mut forces);
        }
        forces
    }

    /// The frozen temperatures; `None` where they change nothing.
    fn heat<'a>(&self, frozen: &'a Frozen) -> Result<Option<Heat<'a>>, SolveError> {
        if !self.settings.reads_temperature || self.softening.rate <= 0.0 {
            return Ok(None);
        }
        let read = |field: &'a Field| {
            let values = field.f64()?;
            if values.len() != self.radii.len() {
                return Err(SolveError::Mismatch(format!(
                    "particles: field `temperature` has {} values, but there are {} particles",
                    values.len(),
                    self.radii.len()
                )));
            }
            match field.first_not_finite() {
                None => Ok(values),
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
    fn soften(&self, heat: Heat<'_>, fraction: f64, moduli: &mut [f64]) {
        for (modulus, (start, end)) in moduli.iter_mut().zip(heat.start_k.iter().zip(heat.end_k)) {
            *modulus = self.law.modulus(self.softening.stiffness(start + fraction * (end - start)));
        }
    }

    /// The state at the end of a window and what is said about it.
    fn finish(&self, from: &State, advanced: Advanced, heat: Option<Heat<'_>>) -> Result<(State, Reply), SolveError> {
        let Advanced { motion, forces, moduli, neighbours, dissipated, .. } = advanced;
        let contacts =
            self.contact_ports.list(&self.find_contacts(&neighbours, &motion.positions), Some(&from.contacts))?;
        let wall_contacts =
            self.wall_contact_ports.list(&self.find_wall_contacts(&motion.positions), Some(&from.wall_contacts))?;
        let state = State { motion, forces, moduli, neighbours, contacts, wall_contacts };
        let softening = match heat {
            Some(heat) => {
                let mut start = from.moduli.clone();
                self.soften(heat, 0.0, &mut start);
                self.softening(from, &start, &state)?
            }
            None => 0.0,
        };
        let mut reply = self.reply(&state)?;
        reply.ledger.extend(Self::exchanged(&dissipated, softening));
        reply.figures.insert("substeps".into(), f64::from(advanced.substeps));
        reply.figures.insert("substep [s]".into(), advanced.substep_s);
        reply.figures.insert("force evaluations".into(), f64::from(advanced.evaluations));
        if self.contact_s.is_finite() {
            reply.figures.insert("shortest contact time over substep".into(), self.contact_s / advanced.substep_s);
        }
        Ok((state, reply))
    }

    /// The fields and the stored energy of `state`.
    fn reply(&self, state: &State) -> Result<Reply, SolveError> {
        let flat = |vectors: &[Vec3]| -> Vec<f64> {
            vectors.iter().flat_map(|vector| [vector.x, vector.y, vector.z]).collect()
        };
        let mut fields = Fields::new();
        let motion = [
            Field::new(&self.positions, 0, flat(&state.motion.positions))?,
            Field::new(&self.velocities, 0, flat(&state.motion.velocities))?,
            self.radii_field.clone(),
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

impl Physics for Particles {
    type State = State;

    fn ports(&self) -> Ports {
        let written = [&self.positions, &self.velocities, &self.radii_field.port].into_iter();
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
        let heat = self.heat(frozen)?;
        let trial = match self.settings.integrator {
            Integrator::Verlet { .. } => verlet::advance(self, state, heat, window, self.substep_s)?,
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

/// Positions, velocities and radii at t = 0.
fn place(settings: &Settings) -> Result<(Motion, Vec<f64>), SolveError> {
    let (positions, velocities, radii) = match &settings.start {
        Start::SequentialAddition { lower_m, upper_m, velocity_m_s } => {
            let addition = SequentialAddition {
                count: settings.count,
                radius_m: settings.radius_m,
                radius_spread_m: settings.radius_spread_m,
                lower_m: *lower_m,
                upper_m: *upper_m,
                seed: settings.seed,
            };
            let (positions, radii) = addition.place()?;
            let velocities = vec![Vec3::from(*velocity_m_s); positions.len()];
            (positions, velocities, radii)
        }
        Start::Given { positions_m, velocities_m_s, radii_m } => {
            let vectors = |given: &[[f64; 3]]| given.iter().copied().map(Vec3::from).collect::<Vec<_>>();
            (vectors(positions_m), vectors(velocities_m_s), radii_m.clone())
        }
    };
    let spins = vec![Vec3::zeros(); positions.len()];
    Ok((Motion { positions, velocities, spins }, radii))
}
