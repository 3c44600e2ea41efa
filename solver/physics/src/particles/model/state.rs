//! What goes from window to window: the state of the particles, their motion, and the forces on them.

use std::{ops::AddAssign, sync::Arc};

use serde::{Deserialize, Serialize};
use stagger_coupling::{NotConverged, SolveError};

use super::{
    bodies::{Bodies, reordered},
    contact_list::ContactList,
    id_map::IdMap,
};
use crate::{
    common::{Vec3, walls::WallState},
    particles::{
        bonds::{Bonds, Spheres},
        fields::NearList,
        search::{contact_history::ContactHistory, lists::Lists},
    },
};

/// Everything the particles' next window depends on; in memory order but for the contact lists.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State {
    pub(crate) bodies: Arc<Bodies>,
    pub(crate) motion: Motion,
    /// Forces at the same instant.
    pub(crate) forces: Forces,
    /// Moduli of the particles at the same instant.
    pub(crate) moduli: Vec<f64>,
    pub(crate) lists: Arc<Lists>,
    /// Pairs of the near field: kept for speed only, the forces are the same bits without it.
    #[serde(skip)]
    pub(crate) near: Option<Arc<NearList>>,
    /// Lists built since the particles were last sorted.
    pub(crate) builds: u32,
    /// Springs of the contacts, block by block, ahead by half of `lead_s`.
    pub(crate) contact_history: Vec<ContactHistory>,
    /// The step in s by half of which the springs are ahead: the last one.
    pub(crate) lead_s: f64,
    pub(crate) bonds: Bonds,
    /// How far pressed walls have moved, by wall.
    pub(crate) walls: Vec<WallState>,
    /// How far the surface of the wall that gives way has sunk under each particle, in m; empty where none does.
    pub(crate) sunk_m: Vec<f64>,
    /// Who has come and gone.
    pub(crate) id_map: IdMap,
    /// Contacts between particles.
    pub(crate) contacts: ContactList,
    /// Contacts with walls.
    pub(crate) wall_contacts: ContactList,
    /// Largest stable step of the contacts' springs, in s; infinite without contacts.
    pub(crate) critical_s: f64,
    /// The same with the contacts' damping and regularised friction; at most `critical_s`.
    pub(crate) stable_s: f64,
}

impl State {
    /// Reduced moments of inertia of a particle's contacts over its own, added up, of the most crowded particle.
    pub(crate) fn crowd(&self) -> f64 {
        let inertias = self.bodies.in_rows(&self.bodies.inertias);
        let mut sums = vec![0.0; inertias.len()];
        // Lists of contacts that are not of their type are refused where they are made.
        let pairs = |list: &ContactList| list.pairs.u32().map_or_else(|_| Vec::new(), <[u32]>::to_vec);
        for &[i, j] in pairs(&self.contacts).as_chunks::<2>().0 {
            let (i, j) = (i as usize, j as usize);
            let sum = inertias[i] + inertias[j];
            sums[i] += inertias[j] / sum;
            sums[j] += inertias[i] / sum;
        }
        for &[i, _] in pairs(&self.wall_contacts).as_chunks::<2>().0 {
            sums[i as usize] += 1.0;
        }
        sums.into_iter().fold(0.0, f64::max)
    }
}

/// Where the particles are and how they move.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Motion {
    /// r in m.
    pub positions: Vec<Vec3>,
    /// v in m/s.
    pub velocities: Vec<Vec3>,
    /// ω in rad/s; zero where particles do not spin.
    pub spins: Vec<Vec3>,
}

impl Motion {
    /// The particles in another order: place k takes what was at `order[k]`.
    pub fn reordered(&self, order: &[u32]) -> Self {
        Self {
            positions: reordered(&self.positions, order),
            velocities: reordered(&self.velocities, order),
            spins: reordered(&self.spins, order),
        }
    }

    /// The particles as bonds see them.
    pub fn spheres<'a>(&'a self, bodies: &'a Bodies, places: &'a [u32]) -> Spheres<'a> {
        Spheres {
            ids: &bodies.ids,
            places,
            positions: &self.positions,
            velocities: &self.velocities,
            spins: &self.spins,
            turning: &self.spins,
            radii: &bodies.radii,
            masses: &bodies.masses,
        }
    }

    /// The first value that is not finite, as the error that names it.
    pub fn check_finite(&self) -> Result<(), SolveError> {
        let fields = [("positions", &self.positions), ("velocities", &self.velocities), ("spins", &self.spins)];
        for (field, vectors) in fields {
            for (row, vector) in vectors.iter().enumerate() {
                if let Some(&value) = vector.iter().find(|value| !value.is_finite()) {
                    return Err(SolveError::NotFinite { node: "particles".into(), field: field.into(), row, value });
                }
            }
        }
        Ok(())
    }

    /// How many times [`LARGEST_WAY`] the first particle has moved since `before` that has moved more than that.
    pub fn jump(&self, before: &[Vec3], radii: &[f64]) -> Option<f64> {
        let steps = self.positions.iter().zip(before).map(|(now, then)| now - then);
        let far = steps.zip(radii).find(|(step, radius)| !within(step, LARGEST_WAY * **radius));
        far.map(|(step, radius)| step.norm() / (LARGEST_WAY * radius))
    }
}

/// Largest share of its radius that a particle, or a wall as the smallest of them sees it, moves in a step: a longer way could
/// jump a contact.
pub const LARGEST_WAY: f64 = 0.25;

/// Whether a step is at most so long, in m. False for what is not a number.
#[inline]
pub fn within(step: &Vec3, longest_m: f64) -> bool {
    step.norm_squared() <= longest_m * longest_m
}

/// Forces on all particles at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Forces {
    /// Ψ in N.
    pub force: Vec<Vec3>,
    /// M in N m.
    pub moment: Vec<Vec3>,
    /// Forces of the particles on the walls, in N.
    pub on_walls: Vec<Vec3>,
    /// Loads of the contacts with walls, where a substrate reads them; their particles by row.
    pub on_contacts: Vec<WallLoad>,
    /// Power lost, in W.
    pub dissipation: Dissipation,
    /// Step Δt in s that friction was evaluated with.
    pub step_s: f64,
}

impl Forces {
    /// The particles in another order.
    pub fn reordered(&self, order: &[u32]) -> Self {
        Self {
            force: reordered(&self.force, order),
            moment: reordered(&self.moment, order),
            on_walls: self.on_walls.clone(),
            on_contacts: self.on_contacts.clone(),
            ..*self
        }
    }

    /// No forces on `count` particles.
    pub fn none(count: usize) -> Self {
        Self {
            force: vec![Vec3::zeros(); count],
            moment: vec![Vec3::zeros(); count],
            on_walls: Vec::new(),
            on_contacts: Vec::new(),
            dissipation: Dissipation::default(),
            step_s: 0.0,
        }
    }
}

/// The load of a contact on its wall.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct WallLoad {
    /// The particle, and the wall in the scene.
    pub pair: [u32; 2],
    /// Force of the particle on the wall, in N.
    pub force: Vec3,
    /// Where the wall is touched, in m.
    pub position: Vec3,
}

/// Power in W, or energy in J, lost to each kind of friction.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Dissipation {
    pub contact_damping: f64,
    pub friction: f64,
    pub drag: f64,
    pub rolling: f64,
    /// By the work of fields; negative where they drive the particles.
    pub fields: f64,
    /// By the work of the near field; negative where it drives the particles.
    pub near_field: f64,
    /// By the work of sound; negative where it drives the particles.
    pub sound: f64,
    /// By the work of moving walls; negative where they drive the particles. Without pistons, whose own energy is booked.
    pub walls: f64,
    /// By the damping of bonds.
    pub bonds: f64,
    /// Energy of bonds that broke; an energy, never a power.
    pub broken: f64,
    /// Of pistons: in their dampers and at their stops, less the work of what drives them; an energy too.
    pub force_controlled_walls: f64,
}

impl Dissipation {
    /// Energy lost over a step of `step_s` between two powers by the trapezoidal rule, second order.
    pub fn over(before: &Self, after: &Self, step_s: f64) -> Self {
        Self {
            contact_damping: 0.5 * step_s * (before.contact_damping + after.contact_damping),
            friction: 0.5 * step_s * (before.friction + after.friction),
            drag: 0.5 * step_s * (before.drag + after.drag),
            rolling: 0.5 * step_s * (before.rolling + after.rolling),
            fields: 0.5 * step_s * (before.fields + after.fields),
            near_field: 0.5 * step_s * (before.near_field + after.near_field),
            sound: 0.5 * step_s * (before.sound + after.sound),
            walls: 0.5 * step_s * (before.walls + after.walls),
            bonds: 0.5 * step_s * (before.bonds + after.bonds),
            ..Self::default()
        }
    }
}

impl AddAssign for Dissipation {
    fn add_assign(&mut self, other: Self) {
        self.contact_damping += other.contact_damping;
        self.friction += other.friction;
        self.drag += other.drag;
        self.rolling += other.rolling;
        self.fields += other.fields;
        self.near_field += other.near_field;
        self.sound += other.sound;
        self.walls += other.walls;
        self.bonds += other.bonds;
        self.broken += other.broken;
        self.force_controlled_walls += other.force_controlled_walls;
    }
}

/// What an integrator makes of a window.
pub enum Trial {
    Converged(Box<Advanced>),
    NotConverged(NotConverged),
}

/// A window integrated to its end.
pub struct Advanced {
    pub motion: Motion,
    pub walls: Vec<WallState>,
    pub forces: Forces,
    pub moduli: Vec<f64>,
    pub lists: Arc<Lists>,
    pub near: Option<Arc<NearList>>,
    /// Lists built during the window.
    pub builds: u32,
    pub contact_history: Vec<ContactHistory>,
    pub bonds: Bonds,
    /// Energy lost during the window, in J.
    pub dissipated: Dissipation,
    pub substeps: u32,
    pub substep_s: f64,
    /// Evaluations of all forces.
    pub evaluations: u32,
}

/// Particles with what belongs to them, in memory order.
pub struct Rows {
    pub bodies: Bodies,
    pub motion: Motion,
    pub moduli: Vec<f64>,
    pub lists: Lists,
    pub contact_history: Vec<ContactHistory>,
    pub bonds: Bonds,
    /// As in [`State`].
    pub sunk_m: Vec<f64>,
}
