//! What a law of the tangential force is, and what it sees of a contact.

use super::pair_table::PairLaw;
use crate::common::simd::{Real, Triple};

/// A tangential law: the force on a particle whose partner slides past it.
///
/// Kernels are compiled for each law.
pub trait Tangential: Copy + Send + Sync {
    /// Whether it has a force at all.
    const ACTS: bool;
    /// Whether a contact remembers a spring.
    const REMEMBERS: bool;

    /// Tangential force on i in N, where its partner's contact point slides past its own, and the spring that is left.
    ///
    /// `spring` is the contact's tangential displacement in m, which the law turns into the plane of contact and advances.
    fn force<R: Real>(self, law: &PairLaw<R>, slip: &Slip<R>, spring: Triple<R>) -> (Triple<R>, Triple<R>);
}

/// What a tangential law sees.
#[derive(Clone, Copy, Debug)]
pub struct Slip<R> {
    /// Velocity of the partner's contact point past that of i, normal to n, in m/s.
    pub velocity: Triple<R>,
    /// n.
    pub normal: Triple<R>,
    /// A in m².
    pub area_m2: R,
    /// Elastic normal force, in N.
    pub elastic_n: R,
    /// Elastic and damping force together, in N; not negative.
    pub pressing_n: R,
    /// Elastic force over overlap, in N/m.
    pub secant_n_m: R,
    /// √(m* secant), in kg/s.
    pub impedance_kg_s: R,
    /// Δt in s.
    pub step_s: R,
}
