//! The contacts at the end of a window, as other physics read them.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use stagger_messages::{Field, Measure, MessageError, Port};

use super::{PARALLEL_ITEMS, Particles, Vec3, neighbours::NeighbourList};

/// Ports of one list of contacts: indices, area, distance.
#[derive(Debug)]
pub(super) struct ContactPorts {
    pairs: Arc<Port>,
    area: Arc<Port>,
    distance: Arc<Port>,
}

impl ContactPorts {
    /// Ports on `support`, their names beginning with `prefix`.
    pub fn new(prefix: &str, support: &str) -> Self {
        let port = |name: &str, unit| Port::f64(&format!("{prefix}_{name}"), unit, support, 1, Measure::None);
        Self {
            pairs: Arc::new(Port::u32(&format!("{prefix}_pairs"), support, 2)),
            area: Arc::new(port("area", "m^2")),
            distance: Arc::new(port("distance", "m")),
        }
    }

    pub fn all(&self) -> [&Arc<Port>; 3] {
        [&self.pairs, &self.area, &self.distance]
    }

    /// The list as fields. Where its pairs are those of `before` it keeps their revision, else it takes the next one.
    pub fn list(&self, found: &[Found], before: Option<&ContactList>) -> Result<ContactList, MessageError> {
        let indices: Vec<u32> = found.iter().flat_map(|contact| contact.pair).collect();
        let pairs = match before {
            Some(before) if before.pairs.u32()? == indices => before.pairs.clone(),
            Some(before) => Field::new(&self.pairs, before.pairs.support.revision + 1, indices)?,
            None => Field::new(&self.pairs, 0, indices)?,
        };
        let revision = pairs.support.revision;
        let areas: Vec<f64> = found.iter().map(|contact| contact.area_m2).collect();
        let distances: Vec<f64> = found.iter().map(|contact| contact.distance_m).collect();
        Ok(ContactList {
            area: Field::new(&self.area, revision, areas)?,
            distance: Field::new(&self.distance, revision, distances)?,
            pairs,
            energy_per_pa: found.iter().map(|contact| contact.energy_per_pa).collect(),
            deepest: found.iter().fold(0.0, |deepest, contact| contact.relative_overlap.max(deepest)),
        })
    }
}

/// One contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pair: [u32; 2],
    area_m2: f64,
    distance_m: f64,
    energy_per_pa: f64,
    relative_overlap: f64,
}

/// A list of contacts at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ContactList {
    pub pairs: Field,
    pub area: Field,
    pub distance: Field,
    /// Elastic energy over the contact's modulus, in m³.
    pub energy_per_pa: Vec<f64>,
    /// Largest overlap over the smaller radius.
    pub deepest: f64,
}

impl ContactList {
    pub fn fields(&self) -> [&Field; 3] {
        [&self.pairs, &self.area, &self.distance]
    }

    /// Σ energy, each contact's energy per modulus times `modulus(row)`, in J.
    pub fn energy(&self, modulus: impl Fn([u32; 2]) -> f64) -> Result<f64, MessageError> {
        let pairs = self.pairs.u32()?.as_chunks::<2>().0;
        Ok(pairs.iter().zip(&self.energy_per_pa).map(|(&pair, energy)| energy * modulus(pair)).sum())
    }
}

impl Particles {
    /// Contacts between particles, in the order of the neighbour list, which must hold at `positions`.
    pub(super) fn find_contacts(&self, neighbours: &NeighbourList, positions: &[Vec3]) -> Vec<Found> {
        let find = |&pair: &[u32; 2]| {
            let [i, j] = pair.map(|index| index as usize);
            let (radius_i, radius_j) = (self.radii[i], self.radii[j]);
            let sum = radius_i + radius_j;
            let distance_squared = (positions[j] - positions[i]).norm_squared();
            (distance_squared < sum * sum).then(|| {
                let distance_m = distance_squared.sqrt();
                let overlap = sum - distance_m;
                Found {
                    pair,
                    area_m2: self.law.pair(overlap, distance_m, radius_i, radius_j).area_m2,
                    distance_m,
                    energy_per_pa: self.law.pair_energy(overlap, radius_i, radius_j),
                    relative_overlap: overlap / radius_i.min(radius_j),
                }
            })
        };
        if neighbours.pairs.len() > PARALLEL_ITEMS {
            neighbours.pairs.par_iter().filter_map(find).collect()
        } else {
            neighbours.pairs.iter().filter_map(find).collect()
        }
    }

    /// Contacts with walls, by particle, then wall; a particle in a corner of one wall has a row for each plane.
    pub(super) fn find_wall_contacts(&self, positions: &[Vec3]) -> Vec<Found> {
        let mut found = Vec::new();
        for (i, position) in positions.iter().enumerate() {
            let radius = self.radii[i];
            for plane in &self.planes {
                let distance = plane.distance(position);
                let overlap = radius - distance;
                if overlap > 0.0 {
                    found.push(Found {
                        pair: [i as u32, plane.wall],
                        area_m2: self.law.wall(overlap, radius).area_m2,
                        distance_m: distance.abs(),
                        energy_per_pa: self.law.wall_energy(overlap, radius),
                        relative_overlap: overlap / radius,
                    });
                }
            }
        }
        found
    }
}
