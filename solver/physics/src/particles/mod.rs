//! Particle dynamics: contact, damping, friction, drag and gravity of spheres (Zohdi 2018, ch. 6), integrated inside
//! each coupling window.

mod anderson;
mod blocks;
mod bodies;
pub mod bonds;
mod coming_and_going;
mod contact;
mod contact_list;
#[cfg(test)]
mod critical_step_tests;
mod domain;
mod drag;
mod expectation;
pub mod fields;
mod forces;
mod friction;
mod gyration;
mod held;
mod hertz;
mod kernel;
pub(crate) mod lanes;
mod ledger;
mod linear;
mod lists;
mod monograph_bond;
mod neighbours;
mod on_substrate;
mod outside;
mod overlap;
mod pair_kernel;
mod pair_table;
mod pistons;
mod pour;
mod register;
mod rolling;
mod settings;
mod settings_bonds;
mod settings_fields;
mod sliding;
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

use std::sync::Arc;

use stagger_messages::{Energy, Field, Fields, Geometry, Measure, Port, Ports};

pub use domain::{Body, Domain, Moved};
pub use expectation::Expectation;
pub use pour::{Pour, PourRegion, Poured};
pub use settings::*;
pub use settings_bonds::*;
pub use settings_fields::*;
pub use state::State;

use self::{
    bodies::{Bodies, along_z_curve, cell, sphere_inertia, sphere_mass},
    bonds::{BondModel, Bonds, Spheres},
    coming_and_going::Booked,
    contact::{Law, Normal as _, Surface},
    contact_list::{ContactPorts, Snapshot},
    forces::{At, Evaluator},
    lists::Lists,
    monograph_bond::MonographBond,
    neighbours::NeighbourList,
    on_substrate::WallLoadPorts,
    outside::{Heat, Outside},
    pair_table::PairTable,
    register::Register,
    softening::Softening,
    start::Placed,
    state::{Advanced, Forces, Motion, Rows, Trial},
    substep::{Hardest, TimeScales},
    trapezoidal::Trapezoidal,
};
use crate::common::quadrature;
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};

use crate::common::walls::{Motion as WallMotion, Pose, Surface as WallSurface, Wall, WallState};

type Vec3 = nalgebra::Vector3<f64>;

/// Particles above which threads share the work; below, waking them costs more than it saves.
const PARALLEL_PARTICLES: usize = 4096;

/// Lists built from one sorting of the memory to the next.
const BUILDS_PER_SORTING: u32 = 8;

/// The particles of a scene.
///
/// Writes `positions`, `velocities`, `radii` and the contacts between particles and with walls, all at the window's
/// end; reads `temperature` where it softens the contacts, and `acoustic_force` where sound pushes the particles.
#[derive(Debug)]
pub struct Particles {
    settings: Settings,
    law: Law,
    table: PairTable,
    surface: Surface,
    /// Moduli of the materials, by temperature.
    softening: Vec<Softening>,
    gravity: Vec3,
    /// The walls, prepared for contact search.
    surfaces: Vec<WallSurface>,
    /// How far each wall reaches from the axis it turns about, in m.
    wall_reaches_m: Vec<f64>,
    /// Index of each wall's material in the table.
    wall_materials: Vec<u16>,
    fields: fields::Fields,
    bonds: Option<BondModel>,
    /// The particles at t = 0, in the order of the fields.
    start: (Bodies, Motion),
    /// The hardest impacts of the start and of what is poured.
    hardest: Option<Hardest>,
    /// Shortest expected contact, in s.
    contact_s: f64,
    /// Longest substep of the Verlet integrator, in s: the scene's own, or that of the speeds which the start lets expect.
    substep_s: f64,
    temperature: Arc<Port>,
    positions: Arc<Port>,
    velocities: Arc<Port>,
    radii: Arc<Port>,
    /// Written where particles come and go.
    ids: Arc<Port>,
    material: Arc<Port>,
    contact_ports: ContactPorts,
    wall_contact_ports: ContactPorts,
    wall_load_ports: WallLoadPorts,
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
        let vectors = |name, unit, measure| Arc::new(Port::f64(name, unit, "particles", 3, measure));
        let law = Law::from(settings.contact.law);
        let (table, wall_materials) = PairTable::new(&settings, law)?;
        let mut particles = Self {
            law,
            surface: Surface {
                spin: settings.spin,
                arms_by_radius: settings.lever_arm == LeverArm::Radius,
                rolls: settings.spin && table.laws().iter().any(|pair| pair.rolling > 0.0 || pair.torsion > 0.0),
                bond: settings.bond.map(|settings| MonographBond { settings }),
                power: law.power(),
            },
            table,
            softening: settings.materials.iter().map(|material| Softening::of(&settings, material)).collect(),
            gravity: Vec3::from(settings.gravity_m_s2),
            surfaces: settings.walls.iter().map(|wall| WallSurface::new(&wall.shape, law.power())).collect(),
            wall_reaches_m: settings.walls.iter().map(Wall::reach_m).collect(),
            wall_materials,
            fields: fields::Fields::new(
                &settings.fields,
                settings.drag,
                matches!(settings.integrator, Integrator::Verlet { .. }),
            )?,
            bonds: settings.bonds.map(BondModel::new).transpose()?,
            start,
            hardest: None,
            contact_s: f64::INFINITY,
            substep_s: f64::INFINITY,
            temperature: Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude).as_read()),
            positions: vectors("positions", "m", Measure::Increment),
            velocities: vectors("velocities", "m/s", Measure::None),
            radii: Arc::new(Port::f64("radii", "m", "particles", 1, Measure::None)),
            ids: Arc::new(Port::u32("ids", "particles", 1)),
            material: Arc::new(Port::u32("material", "particles", 1)),
            contact_ports: ContactPorts::new("contact", "contacts", settings.writes_contact_forces),
            wall_contact_ports: ContactPorts::new("wall_contact", "wall-contacts", settings.writes_contact_forces),
            wall_load_ports: WallLoadPorts::new(),
            settings,
        };
        let state = particles.state_at_start()?;
        particles.hardest = particles.hardest(&state);
        let TimeScales { contact_s, substep_s } = particles.time_scales(particles.reference_speed(&state));
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

    /// Whether a wall is pressed by a set force.
    fn is_piston(&self, wall: usize) -> bool {
        matches!(self.settings.walls[wall].motion, WallMotion::Pressed(_))
    }

    /// Where the walls are at a time in s.
    fn poses(&self, walls: &[WallState], t_s: f64) -> Vec<Pose> {
        self.settings.walls.iter().zip(walls).map(|(wall, moved)| wall.motion.pose(t_s, moved)).collect()
    }

    /// The state at t = 0. Friction is zero in its forces: it depends on a step that is not known yet.
    fn state_at_start(&self) -> Result<State, SolveError> {
        let (bodies, motion) = &self.start;
        let order = along_z_curve(&motion.positions, cell(bodies));
        let (bodies, motion) = (bodies.reordered(&order), motion.reordered(&order));
        let walls = vec![WallState::default(); self.settings.walls.len()];
        let register = Register::new(bodies.len() as u32, self.settings.pours.len());
        let moduli: Vec<f64> =
            bodies.materials.iter().map(|&material| self.modulus(material, self.settings.temperature_k)).collect();
        let lists = Lists::build(self, &motion.positions, &bodies.radii, &self.poses(&walls, 0.0))?;
        let springs = lists.no_springs();
        let mut bonds = Bonds::default();
        if let Some(model) = &self.bonds {
            // Bonds bridge gaps that the contact lists need not reach.
            let gap = self.settings.bonds.and_then(|bonds| bonds.gap_share).unwrap_or(0.0);
            let near = NeighbourList::build(&motion.positions, &bodies.radii, 2.0 * gap)?;
            let places = bodies.places_by_id();
            bonds = model.form(&self.spheres(&bodies, &motion, &places), near.pairs());
        }
        let sunk_m = if self.sinking_wall().is_some() { vec![0.0; bodies.len()] } else { Vec::new() };
        let rows = Rows { bodies, motion, moduli, lists, springs, bonds, sunk_m };
        self.state(rows, walls, register, 0.0, None)
    }

    /// The state of these particles, with their contacts and the forces on them at a time in s. What depends on the step
    /// is without it: it is not known yet.
    fn state(
        &self,
        rows: Rows,
        walls: Vec<WallState>,
        register: Register,
        t_s: f64,
        before: Option<&State>,
    ) -> Result<State, SolveError> {
        let Rows { bodies, motion, moduli, lists, springs, bonds, sunk_m } = rows;
        let poses = self.poses(&walls, t_s);
        let at = Snapshot {
            bodies: &bodies,
            motion: &motion,
            moduli: &moduli,
            lists: &lists,
            springs: &springs,
            poses: &poses,
            sunk_m: &sunk_m,
        };
        let contacts = self.contacts(at, before, self.bond_rate_1_s(&bodies, &motion, &bonds))?;
        let mut state = State {
            contacts: contacts.pairs,
            wall_contacts: contacts.walls,
            critical_s: contacts.critical_s,
            stable_s: contacts.stable_s,
            forces: Forces::none(bodies.len()),
            near: None,
            bodies: Arc::new(bodies),
            motion,
            moduli,
            lists: Arc::new(lists),
            builds: 0,
            springs,
            lead_s: before.map_or(0.0, |state| state.lead_s),
            bonds,
            walls,
            sunk_m,
            register,
        };
        let mut forces = state.forces.clone();
        let outside = Outside::default();
        let mut evaluator = Evaluator::new(self, &state, &outside);
        self.forces_at_start(&state, &mut evaluator, t_s, 0.0, &mut forces)?;
        // Without a step to be ahead by, the springs are those of this instant.
        let springs = evaluator.springs().to_vec();
        (state.forces, state.springs, state.lead_s) = (forces, springs, 0.0);
        Ok(state)
    }

    /// The particles as bonds see them.
    fn spheres<'a>(&self, bodies: &'a Bodies, motion: &'a Motion, places: &'a [u32]) -> Spheres<'a> {
        Spheres {
            ids: &bodies.ids,
            places,
            positions: &motion.positions,
            velocities: &motion.velocities,
            spins: &motion.spins,
            turning: &motion.spins,
            radii: &bodies.radii,
            masses: &bodies.masses,
        }
    }

    /// Largest angular frequency of the bonds, in rad/s.
    fn bond_rate_1_s(&self, bodies: &Bodies, motion: &Motion, bonds: &Bonds) -> f64 {
        let rate = |model: &BondModel| model.rate_1_s(bonds, &self.spheres(bodies, motion, &bodies.places_by_id()));
        self.bonds.as_ref().map_or(0.0, rate)
    }

    /// Forces at the window's start `t_s` with friction's step. The evaluation stretches the springs by half of it, so that
    /// it takes them half of it behind.
    fn forces_at_start(
        &self,
        state: &State,
        evaluator: &mut Evaluator<'_>,
        t_s: f64,
        step_s: f64,
        forces: &mut Forces,
    ) -> Result<(), SolveError> {
        let Motion { positions, velocities, spins } = &state.motion;
        let at = At { positions, velocities, spins, turning: spins, walls: &state.walls, t_s, fraction: 0.0, step_s };
        evaluator.lead(t_s, -step_s)?;
        evaluator.evaluate(at, forces)
    }

    /// Forces at the window's start: those of the state, or new ones where friction depends on a step that has changed. What
    /// contacts remember is put ahead by half of the new step.
    fn start_forces(
        &self,
        state: &State,
        evaluator: &mut Evaluator<'_>,
        t_s: f64,
        step_s: f64,
    ) -> Result<Forces, SolveError> {
        let mut forces = state.forces.clone();
        let depends = matches!(self.settings.friction, Some(Friction::Regularised { .. }))
            || self.settings.bond.is_some()
            || self.surface.rolls;
        // The push of sound is another one in every window.
        let pushed = self.settings.fields.reads_acoustic_force;
        if pushed || depends && forces.step_s.to_bits() != step_s.to_bits() {
            self.forces_at_start(state, evaluator, t_s, step_s, &mut forces)?;
        }
        evaluator.lead(t_s, step_s)?;
        Ok(forces)
    }

    /// Moduli at the share `fraction` of the window, the temperature running linearly.
    fn soften(&self, heat: &Heat, materials: &[u16], fraction: f64, moduli: &mut [f64]) {
        let temperatures = heat.start_k.iter().zip(&heat.end_k);
        for ((modulus, &material), (start, end)) in moduli.iter_mut().zip(materials).zip(temperatures) {
            *modulus = self.modulus(material, start + fraction * (end - start));
        }
    }

    /// The state at the end of a window, at `t_s`, and what is said about it.
    fn finish(
        &self,
        from: &State,
        advanced: Advanced,
        outside: &Outside,
        t_s: f64,
    ) -> Result<(State, Reply), SolveError> {
        let Advanced { motion, walls, forces, moduli, lists, near, springs, mut bonds, dissipated, .. } = advanced;
        let bodies = Arc::clone(&from.bodies);
        let poses = self.poses(&walls, t_s);
        let sunk_m = outside.sunk_m.as_ref().map_or(&from.sunk_m, |(end_m, _)| end_m).clone();
        let at = Snapshot {
            bodies: &bodies,
            motion: &motion,
            moduli: &moduli,
            lists: &lists,
            springs: &springs,
            poses: &poses,
            sunk_m: &sunk_m,
        };
        if let Some(model) = &self.bonds {
            model.sinter(&mut bonds, &self.spheres(&bodies, &motion, &[]), lists.pairs.pairs());
        }
        let contacts = self.contacts(at, Some(from), self.bond_rate_1_s(&bodies, &motion, &bonds))?;
        let state = State {
            contacts: contacts.pairs,
            wall_contacts: contacts.walls,
            critical_s: contacts.critical_s,
            stable_s: contacts.stable_s,
            bodies,
            motion,
            forces,
            moduli,
            lists,
            near,
            builds: from.builds + advanced.builds,
            springs,
            lead_s: advanced.substep_s,
            bonds,
            walls,
            sunk_m,
            register: from.register.clone(),
        };
        let softening = match &outside.heat {
            Some(heat) => {
                let mut start = from.moduli.clone();
                self.soften(heat, &from.bodies.materials, 0.0, &mut start);
                self.softening(from, &start, &state)?
            }
            None => 0.0,
        };
        let mut reply = self.reply(&state)?;
        reply.ledger.extend(self.exchanged(from, &state, &dissipated, softening));
        reply.figures.insert("force evaluations".into(), f64::from(advanced.evaluations));
        if advanced.substeps > 0 {
            reply.figures.insert("substeps".into(), f64::from(advanced.substeps));
            reply.figures.insert("substep [s]".into(), advanced.substep_s);
            // Without contacts nothing is critical, and this is zero.
            reply.figures.insert("substep over critical".into(), advanced.substep_s / state.critical_s);
            let fastest_m_s = state.motion.velocities.iter().map(Vec3::norm).fold(0.0, f64::max);
            let share = self.contact_s.min(self.time_scales(fastest_m_s).contact_s) / advanced.substep_s;
            if share.is_finite() {
                reply.figures.insert("shortest contact time over substep".into(), share);
            }
        }
        let state = if state.builds >= BUILDS_PER_SORTING { self.sorted(state, t_s)? } else { state };
        Ok((state, reply))
    }

    /// The same state, with particles that have become neighbours near each other in memory again.
    fn sorted(&self, state: State, t_s: f64) -> Result<State, SolveError> {
        let order = along_z_curve(&state.motion.positions, cell(&state.bodies));
        let mut places = vec![0u32; order.len()];
        for (place, &from) in (0u32..).zip(&order) {
            places[from as usize] = place;
        }
        let (bodies, motion) = (state.bodies.reordered(&order), state.motion.reordered(&order));
        let lists = Lists::build(self, &motion.positions, &bodies.radii, &self.poses(&state.walls, t_s))?;
        let springs =
            self.handed_over(&state.lists, &state.springs, &lists, |particle| Some(places[particle as usize]));
        Ok(State {
            forces: state.forces.reordered(&order),
            moduli: bodies::reordered(&state.moduli, &order),
            sunk_m: if state.sunk_m.is_empty() { Vec::new() } else { bodies::reordered(&state.sunk_m, &order) },
            bodies: Arc::new(bodies),
            motion,
            lists: Arc::new(lists),
            near: None,
            builds: 0,
            springs,
            ..state
        })
    }

    /// Vectors in memory order as a field on the rows of `state`.
    fn vectors(&self, port: &Arc<Port>, state: &State, vectors: &[Vec3]) -> Result<Field, SolveError> {
        let rows = state.bodies.in_rows(vectors);
        let values: Vec<f64> = rows.iter().flat_map(|vector| [vector.x, vector.y, vector.z]).collect();
        Ok(Field::new(port, state.register.revision, values)?)
    }

    /// The fields and the stored energy of `state`.
    fn reply(&self, state: &State) -> Result<Reply, SolveError> {
        let bodies = &state.bodies;
        let mut fields = Fields::new();
        let revision = state.register.revision;
        let motion = [
            self.vectors(&self.positions, state, &state.motion.positions)?,
            self.vectors(&self.velocities, state, &state.motion.velocities)?,
            Field::new(&self.radii, revision, bodies.in_rows(&bodies.radii))?,
        ];
        let lists = state.contacts.fields().chain(state.wall_contacts.fields());
        for field in motion.into_iter().chain(self.identities(state)?).chain(lists.cloned()) {
            fields.insert(field.name().into(), field);
        }
        if self.settings.substrate.is_some() {
            for field in self.wall_load_fields(state)? {
                fields.insert(field.name().into(), field);
            }
        }
        let figures = self.pressed(state);
        let mut reply = Reply { fields, figures, ledger: self.stored(state)?, ..Reply::default() };
        let deepest = state.contacts.deepest.max(state.wall_contacts.deepest);
        reply.figures.insert("largest overlap over radius".into(), deepest);
        Ok(reply)
    }
}

impl Physics for Particles {
    type State = State;

    fn ports(&self) -> Ports {
        let written = [&self.positions, &self.velocities, &self.radii].into_iter();
        let lists = self.contact_ports.all().chain(self.wall_contact_ports.all());
        let ids = self.come_and_go().then_some(&self.ids);
        let loads = self.settings.substrate.map(|_| self.wall_load_ports.written()).into_iter().flatten();
        let material = self.settings.writes_material.then_some(&self.material);
        let vapourised = self.settings.reads_vapourised.then(|| Port::u8("vapourised", "particles", 1));
        let written = written.chain(lists).chain(loads).chain(ids).chain(material);
        let writes = written.map(|port| (**port).clone()).collect();
        let particles = &self.positions.support;
        Ports::new(self.reads().into_iter().chain(vapourised).collect(), writes)
            .with(Geometry::spheres(particles, &self.positions.field, &self.radii.field))
            .with(self.contact_ports.geometry(particles, particles))
            .with(self.wall_contact_ports.geometry(particles, "walls"))
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
        let (renewed, booked) = self.renewed(state, frozen, window)?.unzip();
        let before = state;
        let state = renewed.as_ref().unwrap_or(state);
        let outside = self.outside((frozen, window), state)?;
        let solved = match self.settings.integrator {
            Integrator::Verlet { .. } => verlet::solve(self, state, &outside, window)?,
            Integrator::Held => {
                let advanced = held::advance(self, state, &outside, window)?;
                Ok(self.finish(state, advanced, &outside, window.t_s + window.dt_s)?)
            }
            Integrator::Trapezoidal { phi, tolerance, iterations, anderson_depth } => {
                let rule = Trapezoidal { phi, tolerance, iterations, anderson_depth };
                match rule.advance(self, state, &outside, window)? {
                    Trial::Converged(advanced) => {
                        Ok(self.finish(state, *advanced, &outside, window.t_s + window.dt_s)?)
                    }
                    Trial::NotConverged(reason) => Err(reason),
                }
            }
        };
        match solved {
            Ok((state, mut reply)) => {
                if let Some(renewed) = &renewed {
                    // What the iteration measures its changes from stands on the new rows.
                    let positions = self.vectors(&self.positions, renewed, &renewed.motion.positions)?;
                    reply.start.insert(positions.name().into(), positions);
                }
                if self.come_and_go() {
                    let Booked { poured_j, removed_j } = booked.unwrap_or_default();
                    reply.ledger.push(Energy::gained("poured", poured_j));
                    reply.ledger.push(Energy::lost("removed", removed_j));
                    reply.figures.insert("particles".into(), state.bodies.len() as f64);
                }
                Ok((state, reply))
            }
            // The fields of the window's start, so that the reply is whole; nobody may accept them.
            Err(reason) => Ok((before.clone(), Reply { not_converged: Some(reason), ..self.reply(before)? })),
        }
    }
}

/// The particles at t = 0, in the order of the fields.
fn at_start(settings: &Settings) -> Result<(Bodies, Motion), SolveError> {
    let Placed { positions, mut velocities, radii, materials, mut spins } = start::place(settings)?;
    if settings.integrator == Integrator::Held {
        // What is left of settling, or was read from a file.
        velocities.fill([0.0; 3]);
    }
    if settings.integrator == Integrator::Held || !settings.spin {
        spins.fill([0.0; 3]);
    }
    let density = |material: &u16| settings.materials[usize::from(*material)].density_kg_m3;
    let masses: Vec<f64> =
        (radii.iter().zip(&materials)).map(|(&radius, material)| sphere_mass(radius, density(material))).collect();
    let bodies = Bodies {
        ids: (0u32..).take(radii.len()).collect(),
        rows: (0u32..).take(radii.len()).collect(),
        inertias: masses.iter().zip(&radii).map(|(&mass, &radius)| sphere_inertia(mass, radius)).collect(),
        materials,
        masses,
        radii,
    };
    let vectors = |values: Vec<[f64; 3]>| values.into_iter().map(Vec3::from).collect::<Vec<_>>();
    let [positions, velocities, spins] = [positions, velocities, spins].map(vectors);
    Ok((bodies, Motion { positions, velocities, spins }))
}
