//! Contacts without friction, and the monograph's regularised friction (Zohdi 2018, eqs. 6.11–6.15).

use super::{
    pair_table::PairLaw,
    tangential::{Slip, Tangential},
};
use crate::common::simd::{Real, Triple};

/// No tangential force.
#[derive(Clone, Copy, Debug)]
pub struct Frictionless;

impl Tangential for Frictionless {
    const ACTS: bool = false;
    const REMEMBERS: bool = false;

    #[inline(always)]
    fn force<R: Real>(self, _: &PairLaw<R>, slip: &Slip<R>, spring: Triple<R>) -> (Triple<R>, Triple<R>) {
        (Triple::zero(slip.elastic_n), spring)
    }
}

/// The monograph's regularised friction (Zohdi 2018, eqs. 6.11–6.15).
///
/// Stick while K_f ‖v_τ‖ A Δt < μ_s ‖Ψ^n‖, else slip at μ_d ‖Ψ^n‖; Δt is the step of the integrator, Ψ^n the elastic normal
/// force. Rest gives zero.
#[derive(Clone, Copy, Debug)]
pub struct Regularised;

impl Tangential for Regularised {
    const ACTS: bool = true;
    const REMEMBERS: bool = false;

    #[inline(always)]
    fn force<R: Real>(self, law: &PairLaw<R>, slip: &Slip<R>, spring: Triple<R>) -> (Triple<R>, Triple<R>) {
        let speed = slip.velocity.dot(slip.velocity).sqrt();
        let stick_n = law.friction_stiffness_n_m3 * speed * slip.area_m2 * slip.step_s;
        let sticks = stick_n.below(law.static_friction * slip.elastic_n);
        let magnitude_n = R::choose(sticks, stick_n, law.dynamic_friction * slip.elastic_n);
        // At rest the velocity, and so the force, is zero.
        (slip.velocity * (magnitude_n / speed.most(speed.all(f64::MIN_POSITIVE))), spring)
    }
}
