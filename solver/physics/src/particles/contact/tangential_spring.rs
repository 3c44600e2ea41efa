//! Friction by a spring that remembers the contact's displacement (Cundall & Strack 1979).

use super::{
    pair_table::PairLaw,
    tangential::{Slip, Tangential},
};
use crate::common::simd::{Real, Triple};

/// A spring between the contact points that remembers their displacement (Cundall & Strack 1979), with the stiffness k_t of
/// [`PairLaw::tangential`]; with Mindlin's ratio and Hertz's law it is 8 G* a (Mindlin 1949, no slip).
///
/// The spring is turned into the plane of contact by projection and stretched by half of v_τ Δt before the force is taken
/// and by half after it: what is remembered is half a step ahead, which makes its growth the trapezoidal rule's, second order.
/// Spring and damper together give at most μ_s ‖Ψ^n‖, and slide at μ_d ‖Ψ^n‖, the spring following as far as it does not
/// point against them: as the contact closes and k_t grows, it would soon push that way.
#[derive(Clone, Copy, Debug)]
pub struct TangentialSpring;

impl Tangential for TangentialSpring {
    const ACTS: bool = true;
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn force<R: Real>(self, law: &PairLaw<R>, slip: &Slip<R>, spring: Triple<R>) -> (Triple<R>, Triple<R>) {
        let (zero, least) = (slip.elastic_n.all(0.0), slip.elastic_n.all(f64::MIN_POSITIVE));
        let stiffness_n_m = law.tangential * slip.secant_n_m;
        let damping = slip.velocity * (law.tangential_damping * slip.impedance_kg_s);
        let half = slip.velocity * (slip.elastic_n.all(0.5) * slip.step_s);
        let stretched = spring - slip.normal * spring.dot(slip.normal) + half;
        let trial = stretched * stiffness_n_m + damping;
        let squared = trial.dot(trial);
        let limit_n = law.static_friction * slip.pressing_n;
        let slides = (limit_n * limit_n).below(squared);
        // Where it slides, the square is above zero.
        let share = law.dynamic_friction * slip.pressing_n / squared.most(least).sqrt();
        let force = trial * R::choose(slides, share, zero.all(1.0));
        let compliance = R::choose(zero.below(stiffness_n_m), zero.all(1.0) / stiffness_n_m.most(least), zero);
        let elastic = force - damping;
        let slid = elastic * R::choose(elastic.dot(force).below(zero), zero, compliance);
        let left = Triple {
            x: R::choose(slides, slid.x, stretched.x),
            y: R::choose(slides, slid.y, stretched.y),
            z: R::choose(slides, slid.z, stretched.z),
        };
        (force, left + half)
    }
}
