//! A list of contacts at one instant, with its energies.

use serde::{Deserialize, Serialize};
use stagger_messages::{Field, MessageError};

/// A list of contacts at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ContactList {
    pub pairs: Field,
    pub area: Field,
    pub distance: Field,
    /// Elastic normal forces, where they are written.
    pub force: Option<Field>,
    /// Elastic energy over the contact's modulus, in m³ (m² for the linear law).
    pub energy_per_modulus: Vec<f64>,
    /// Potential of the bonds, in J.
    pub bonds_j: f64,
    /// Energy of the tangential springs, in J.
    pub springs_j: f64,
    /// Largest overlap over the smaller radius.
    pub deepest: f64,
}

impl ContactList {
    pub fn fields(&self) -> impl Iterator<Item = &Field> {
        [&self.pairs, &self.area, &self.distance].into_iter().chain(&self.force)
    }

    /// Σ energy, each contact's energy per modulus times `modulus(pair)`, in J; without bonds and springs.
    pub fn energy(&self, modulus: impl Fn([u32; 2]) -> f64) -> Result<f64, MessageError> {
        let pairs = self.pairs.u32()?.as_chunks::<2>().0;
        Ok(pairs.iter().zip(&self.energy_per_modulus).map(|(&pair, energy)| energy * modulus(pair)).sum())
    }
}
