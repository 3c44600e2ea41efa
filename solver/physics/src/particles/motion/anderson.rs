//! Anderson's mixing of the iterates of a fixed point in the motion (Anderson 1965; Walker & Ni 2011).

use stagger_coupling::{Acceleration, Accelerator, Iterates};

use crate::{
    common::Vec3,
    particles::model::{bodies::Bodies, state::Motion},
};

/// A difference of iterates that is this nearly a combination of newer ones is left out; contacts that open and close
/// bend the map, so that less is noise.
const FILTER: f64 = 1e-2;

/// The next iterate of the velocities and spins at a window's end from the newest ones: x̃ + W c, c = argmin ‖V c + x̃ − x‖
/// over the last differences (Walker & Ni 2011, eq. 4.1 with β = 1).
///
/// That is the interface quasi-Newton method without reuse of earlier steps (Fang & Saad 2009), whose QR factorisation it
/// uses. The unknowns are √m v and √I ω, whose squares are energies: one norm for translation and spin, for large particles
/// and small ones, in which the map of linear springs is symmetric.
pub struct Anderson {
    accelerator: Accelerator,
    /// √m in √kg by particle.
    masses: Vec<f64>,
    /// √I in √kg m by particle; empty where particles do not spin.
    inertias: Vec<f64>,
}

impl Anderson {
    /// Mixing of at most `depth` differences, or `None` where that is 0.
    pub fn new(bodies: &Bodies, spin: bool, depth: u32) -> Option<Self> {
        let roots = |values: &[f64]| values.iter().map(|value| value.sqrt()).collect::<Vec<_>>();
        let method = Acceleration::IqnIls { relaxation: 1.0, reused_steps: 0, columns: depth, filter: FILTER };
        (depth > 0).then(|| Self {
            accelerator: Accelerator::new(method),
            masses: roots(&bodies.masses),
            inertias: if spin { roots(&bodies.inertias) } else { Vec::new() },
        })
    }

    /// Replaces the velocities and spins that the map gave for `asked` by the next ones to ask for; finite where they are.
    pub fn mix(&mut self, asked: &Motion, answered: &mut Motion) {
        let (frozen, values) = (self.join(asked), self.join(answered));
        let next = self.accelerator.next(&[Iterates { frozen: &frozen, answered: &values }]);
        let mut next = next.iter().flat_map(|field| field.as_chunks::<3>().0);
        let motion = answered.velocities.iter_mut().zip(&self.masses);
        for ((vector, root), values) in motion.chain(answered.spins.iter_mut().zip(&self.inertias)).zip(&mut next) {
            *vector = Vec3::from(*values) / *root;
        }
    }

    /// √m v, then √I ω, of all particles.
    fn join(&self, motion: &Motion) -> Vec<f64> {
        let vectors = motion.velocities.iter().zip(&self.masses).chain(motion.spins.iter().zip(&self.inertias));
        vectors.flat_map(|(vector, root)| (vector * *root).data.0[0]).collect()
    }
}
