//! The contacts of one instant as the current sees them.

use stagger_coupling::SolveError;
use stagger_messages::Fields;

use super::{Electrode, NODE};
use crate::common::contacts::{Contact, PAIRS, WALLS, contacts, in_range};

/// The contacts that conduct, each with a weight.
pub(super) struct Network {
    /// Two particles and the weight.
    pub(super) pairs: Vec<(u32, u32, f64)>,
    /// Contacts with electrified walls.
    pub(super) touches: Vec<Touch>,
}

/// Where a particle touches an electrified wall.
pub(super) struct Touch {
    pub(super) particle: u32,
    /// Index among the electrified walls.
    pub(super) electrode: usize,
    pub(super) weight: f64,
    pub(super) area_m2: f64,
}

impl Network {
    /// Reads the contacts of `count` particles in `fields`; `weight` is that of a contact of a particle with another, or
    /// with a wall (`None`). Contacts without weight and those with insulated walls are left out. `electrodes` say which
    /// electrified wall each wall is.
    pub(super) fn new(
        fields: &Fields,
        count: usize,
        electrodes: &[Option<usize>],
        weight: impl Fn(&Contact, usize, Option<usize>) -> Result<f64, SolveError>,
    ) -> Result<Self, SolveError> {
        let mut network = Self { pairs: Vec::new(), touches: Vec::new() };
        for contact in contacts(NODE, fields, PAIRS)? {
            let [i, j] = contact.indices;
            in_range(NODE, PAIRS, contact.row, "particle", i.max(j), count)?;
            let weight = weight(&contact, i, Some(j))?;
            if weight > 0.0 {
                network.pairs.push((i as u32, j as u32, weight));
            }
        }
        for contact in contacts(NODE, fields, WALLS)? {
            let [i, wall] = contact.indices;
            in_range(NODE, WALLS, contact.row, "particle", i, count)?;
            in_range(NODE, WALLS, contact.row, "wall", wall, electrodes.len())?;
            let Some(electrode) = electrodes[wall] else { continue };
            let weight = weight(&contact, i, None)?;
            if weight > 0.0 {
                let area_m2 = contact.area_m2;
                network.touches.push(Touch { particle: i as u32, electrode, weight, area_m2 });
            }
        }
        Ok(network)
    }

    /// What each of `electrodes` passes on, before any current is known.
    pub(super) fn terminals(&self, electrodes: &[Electrode]) -> Vec<Terminal> {
        let mut terminals = vec![Terminal::default(); electrodes.len()];
        for touch in &self.touches {
            terminals[touch.electrode].area_m2 += touch.area_m2;
        }
        terminals
    }
}

/// What happens at an electrified wall.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Terminal {
    /// Current into the particles, in A.
    pub(super) current_a: f64,
    /// Area of its contacts, in m².
    pub(super) area_m2: f64,
    /// Its potential, in V; 0 where the model knows none.
    pub(super) potential_v: f64,
}

impl Terminal {
    /// J̄: its current over the area of its contacts, in A/m²; 0 where it touches nothing.
    pub(super) fn current_density_a_m2(&self) -> f64 {
        if self.area_m2 > 0.0 { self.current_a / self.area_m2 } else { 0.0 }
    }
}
