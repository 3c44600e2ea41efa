//! The particles of a scene as plain data: what does not change during a run ([`Model`]) and what does
//! ([`State`](state::State)).

pub mod bodies;
pub mod contact_list;
pub mod id_map;
pub mod ports;
pub mod state;
pub mod time_scales;

use stagger_coupling::SolveError;

use self::{bodies::Bodies, ports::ParticlePorts, state::Motion, time_scales::StartScales};
use crate::{
    common::{
        Vec3,
        walls::{self, Pose, Shape, WallState},
    },
    particles::{
        bonds::BondModel,
        contact::{force::Surface, law::Law, pair_table::PairTable, softening::Softening},
        fields::Fields,
        search::{contact_history::ContactHistory, lists::Lists},
        settings::{Friction, OnSubstrate, Settings},
    },
};

/// What does not change during a run: the settings of a scene, and what is derived from them.
#[derive(Debug)]
pub struct Model {
    pub settings: Settings,
    pub contact: ContactLaws,
    pub walls: WallGeometry,
    /// g in m/s².
    pub gravity: Vec3,
    pub fields: Fields,
    pub bonds: Option<BondModel>,
    /// The particles at t = 0, in the order of the fields.
    pub start: (Bodies, Motion),
    pub scales: StartScales,
    pub ports: ParticlePorts,
}

/// Laws of the contacts.
#[derive(Debug)]
pub struct ContactLaws {
    pub law: Law,
    pub table: PairTable,
    pub surface: Surface,
    /// Moduli of the materials, by temperature.
    pub softening: Vec<Softening>,
}

/// What the walls' settings do not say at once.
#[derive(Debug)]
pub struct WallGeometry {
    /// The walls, prepared for contact search.
    pub surfaces: Vec<walls::Surface>,
    /// How far each wall reaches from the axis it turns about, in m.
    pub reaches_m: Vec<f64>,
    /// Index of each wall's material in the table.
    pub materials: Vec<u16>,
}

impl Model {
    /// Whether contacts remember a tangential spring.
    pub fn remembers(&self) -> bool {
        matches!(self.settings.friction, Some(Friction::Spring { .. }))
    }

    /// Whether particles may come or go.
    pub fn come_and_go(&self) -> bool {
        self.settings.come_and_go()
    }

    /// Modulus of a material at a temperature in K.
    #[inline]
    pub fn modulus(&self, material: u16, temperature_k: f64) -> f64 {
        self.contact.softening[material as usize].stiffness(temperature_k)
    }

    /// Whether a wall is pressed by a set force.
    pub fn is_force_controlled(&self, wall: usize) -> bool {
        matches!(self.settings.walls[wall].motion, walls::Motion::Pressed(_))
    }

    /// Where the walls are at a time in s.
    pub fn poses(&self, walls: &[WallState], t_s: f64) -> Vec<Pose> {
        self.settings.walls.iter().zip(walls).map(|(wall, moved)| wall.motion.pose(t_s, moved)).collect()
    }

    /// The wall that gives way, where one does.
    pub fn sinking_wall(&self) -> Option<usize> {
        self.settings.substrate.and_then(|OnSubstrate { wall, deflects }| deflects.then_some(wall))
    }

    /// A position as a wall sees it whose surface has sunk by `sunk_m` under it: that much farther away.
    #[inline]
    pub fn seen_from(&self, wall: usize, pose: &Pose, position: &Vec3, sunk_m: f64) -> Vec3 {
        let seen = pose.to_wall(position);
        match &self.settings.walls[wall].shape {
            Shape::Plane(plane) if sunk_m != 0.0 => seen + Vec3::from(plane.normal) * sunk_m,
            _ => seen,
        }
    }

    /// Lists of what particles may touch, with the walls at `poses`.
    ///
    /// # Errors
    /// [`Lists::build`]'s.
    pub fn lists(&self, positions: &[Vec3], radii: &[f64], poses: &[Pose]) -> Result<Lists, SolveError> {
        Lists::build(&self.settings, &self.walls.surfaces, positions, radii, poses)
    }

    /// The springs of `from` as those of `to`, none where contacts remember none; `place` says where a particle of the old
    /// lists is in the new ones, `None` that it is gone.
    pub fn handed_over(
        &self,
        from: &Lists,
        contact_history: &[ContactHistory],
        to: &Lists,
        place: impl Fn(u32) -> Option<u32>,
    ) -> Vec<ContactHistory> {
        if self.remembers() { from.hand_over(contact_history, to, place) } else { to.no_history() }
    }
}
