//! The particles' energy: stored at an instant, gained and lost during a window.

use stagger_messages::Energy;

use super::{Particles, State, contact_list::ContactList, state::Dissipation};
use crate::SolveError;

impl Particles {
    /// Kinetic, rotational, potential (−m g·r) and elastic energy of `state`, in J.
    pub(super) fn stored(&self, state: &State) -> Result<Vec<Energy>, SolveError> {
        let motion = &state.motion;
        let twice_kinetic: f64 = motion.velocities.iter().zip(&self.masses).map(|(v, m)| m * v.norm_squared()).sum();
        let positions = motion.positions.iter().zip(&self.masses);
        let potential: f64 = positions.map(|(position, mass)| -mass * self.gravity.dot(position)).sum();
        let elastic = self.elastic(&state.contacts, &state.wall_contacts, &state.moduli)?;
        let mut stored = vec![
            Energy::stored("kinetic", 0.5 * twice_kinetic),
            Energy::stored("potential", potential),
            Energy::stored("elastic", elastic),
        ];
        if self.settings.spin {
            let twice: f64 =
                motion.spins.iter().zip(&self.inertias).map(|(w, inertia)| inertia * w.norm_squared()).sum();
            stored.push(Energy::stored("rotational", 0.5 * twice));
        }
        Ok(stored)
    }

    /// What a window lost to damping, friction and drag, and gained by softening, in J.
    ///
    /// With a gas that streams, `drag` is what the particles lose to it, which may be negative.
    pub(super) fn exchanged(dissipated: &Dissipation, softening: f64) -> [Energy; 4] {
        [
            Energy::lost("contact_damping", dissipated.contact_damping),
            Energy::lost("friction", dissipated.friction),
            Energy::lost("drag", dissipated.drag),
            Energy::gained("softening", softening),
        ]
    }

    /// Change of the elastic energy by the change of the moduli at fixed geometry, in J.
    ///
    /// What the frozen temperature at the window's start differs from the last window's end counts at the start's
    /// geometry; the change over the window counts at the mean of both ends' geometry, second order in the window.
    pub(super) fn softening(&self, from: &State, start: &[f64], to: &State) -> Result<f64, SolveError> {
        let before = |moduli: &[f64]| self.elastic(&from.contacts, &from.wall_contacts, moduli);
        let after = |moduli: &[f64]| self.elastic(&to.contacts, &to.wall_contacts, moduli);
        let corrected = before(start)? - before(&from.moduli)?;
        let early = before(&to.moduli)? - before(start)?;
        let late = after(&to.moduli)? - after(start)?;
        Ok(corrected + 0.5 * (early + late))
    }

    /// Elastic energy of all contacts with the given moduli, in J.
    fn elastic(&self, contacts: &ContactList, walls: &ContactList, moduli: &[f64]) -> Result<f64, SolveError> {
        let pair = |[i, j]: [u32; 2]| self.law.pair_modulus(moduli[i as usize], moduli[j as usize]);
        Ok(contacts.energy(pair)? + walls.energy(|[i, _]| moduli[i as usize])?)
    }
}
