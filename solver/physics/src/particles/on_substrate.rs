//! What an elastic substrate under a wall reads of its contacts, and how its surface gives way under the particles.

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};
use stagger_coupling::SolveError;
use stagger_messages::{Field, Measure, Port};

use super::{Particles, State, Vec3, settings::OnSubstrate};
use crate::common::walls::{Pose, Shape};

/// The load of a contact on its wall.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct WallLoad {
    /// The particle, and the wall in the scene.
    pub pair: [u32; 2],
    /// Force of the particle on the wall, in N.
    pub force: Vec3,
    /// Where the wall is touched, in m.
    pub position: Vec3,
}

/// Ports of what a substrate reads.
#[derive(Debug)]
pub(super) struct WallLoadPorts {
    force: Arc<Port>,
    position: Arc<Port>,
    /// What it answers where it gives way.
    pub deflection: Arc<Port>,
}

impl WallLoadPorts {
    pub fn new() -> Self {
        let port = |name: &str, unit| Arc::new(Port::f64(name, unit, "wall-contacts", 3, Measure::None));
        Self {
            force: port("wall_contact_force", "N"),
            position: port("wall_contact_position", "m"),
            deflection: Arc::new(Port::f64("wall_deflection", "m", "particles", 1, Measure::None)),
        }
    }

    pub fn written(&self) -> [&Arc<Port>; 2] {
        [&self.force, &self.position]
    }
}

/// How far the surface of a wall has given way under each particle, in m, in memory order.
#[derive(Clone, Copy)]
pub(super) struct Sinking<'a> {
    pub wall: usize,
    /// At the window's start.
    pub start_m: &'a [f64],
    /// At its end, and the window's length in s; it sinks evenly in between. `None` where it stays.
    pub end_m: Option<(&'a [f64], f64)>,
    /// Share of the window that has passed.
    pub fraction: f64,
}

impl Sinking<'_> {
    /// Depth in m and its rate in m/s under a particle.
    #[inline]
    pub fn under(&self, particle: usize, wall: usize) -> (f64, f64) {
        if wall != self.wall {
            return (0.0, 0.0);
        }
        let start = self.start_m[particle];
        self.end_m.map_or((start, 0.0), |(end_m, window_s)| {
            let change = end_m[particle] - start;
            (start + self.fraction * change, change / window_s)
        })
    }
}

impl Particles {
    /// The wall that gives way, where one does.
    pub(super) fn sinking_wall(&self) -> Option<usize> {
        self.settings.substrate.and_then(|OnSubstrate { wall, deflects }| deflects.then_some(wall))
    }

    /// A position as a wall sees it whose surface has sunk by `sunk_m` under it: that much farther away.
    #[inline]
    pub(super) fn seen_from(&self, wall: usize, pose: &Pose, position: &Vec3, sunk_m: f64) -> Vec3 {
        let seen = pose.to_wall(position);
        match &self.settings.walls[wall].shape {
            Shape::Plane(plane) if sunk_m != 0.0 => seen + Vec3::from(plane.normal) * sunk_m,
            _ => seen,
        }
    }

    /// The loads of the wall contacts of `state`, as fields on its list of them.
    ///
    /// A contact that the implicit rule's last iterate opened, within its tolerance, has no load yet: it stands at its
    /// particle's centre with a force of zero.
    pub(super) fn wall_load_fields(&self, state: &State) -> Result<[Field; 2], SolveError> {
        let contacts = &state.wall_contacts.pairs;
        let pairs = contacts.u32()?.as_chunks::<2>().0;
        let loads = &state.forces.on_contacts;
        let same = loads.len() == pairs.len() && loads.iter().zip(pairs).all(|(load, pair)| load.pair == *pair);
        let mut rows = Vec::with_capacity(pairs.len());
        if same {
            rows.extend(loads.iter().map(|load| (load.force, load.position)));
        } else {
            let mut by_pair: BTreeMap<[u32; 2], Vec<&WallLoad>> = BTreeMap::new();
            for load in loads.iter().rev() {
                by_pair.entry(load.pair).or_default().push(load);
            }
            let centres = state.bodies.in_rows(&state.motion.positions);
            for pair in pairs {
                let load = by_pair.get_mut(pair).and_then(Vec::pop);
                let none = || (Vec3::zeros(), centres[pair[0] as usize]);
                rows.push(load.map_or_else(none, |load| (load.force, load.position)));
            }
        }
        let column = |port, of: fn(&(Vec3, Vec3)) -> Vec3| {
            let values: Vec<f64> = rows.iter().flat_map(|row| <[f64; 3]>::from(of(row))).collect();
            Field::new(port, contacts.support.revision, values)
        };
        Ok([column(&self.wall_load_ports.force, |row| row.0)?, column(&self.wall_load_ports.position, |row| row.1)?])
    }
}
