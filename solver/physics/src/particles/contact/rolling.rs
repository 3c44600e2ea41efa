//! Resistance to rolling (Zohdi 2018, eq. 6.18) and to torsion.

use super::{kinematics::ContactKinematics, pair_table::PairLaw};
use crate::common::simd::{Real, Triple};

/// Share of the moment that would stop a relative motion within one step that one contact may take.
const STOPPING_SHARE: f64 = 0.125;

/// The same of all contacts of a particle together: they do not turn it about, from step to step and for ever. A dozen equal
/// ones reach it, as two equal spheres stop each other half each.
const STOPPING_TOGETHER: f64 = 0.75;

/// Share of the moment that would stop a relative motion within one step that a contact may take where the contacts of the
/// most crowded particle have reduced moments of inertia that add up to so many of its own.
pub fn stopping_share(crowd: f64) -> f64 {
    if crowd * STOPPING_SHARE > STOPPING_TOGETHER { STOPPING_TOGETHER / crowd } else { STOPPING_SHARE }
}

/// Moment in N m on particle i against rolling and torsion: μ a ‖Ψ^n‖ against the relative rolling (Zohdi 2018, eq. 6.18),
/// and the same with its own coefficient against the relative spin about n; a is the contact radius.
///
/// Either ends in a moment in proportion to the motion where that would come to rest within some steps. So rest is reached,
/// but a moment that acts on is only held at a slow turning, in proportion to the step.
#[inline(always)]
pub fn resist<R: Real>(law: &PairLaw<R>, kinematics: &ContactKinematics<R>, elastic_n: R) -> Triple<R> {
    let zero = elastic_n.all(0.0);
    let least = zero.all(f64::MIN_POSITIVE);
    let lever_n_m = (kinematics.patch_m2 * zero.all(std::f64::consts::FRAC_1_PI)).sqrt() * elastic_n;
    let twisting = kinematics.normal * kinematics.turning.dot(kinematics.normal);
    let stopping = kinematics.stopping_share * kinematics.reduced_inertia;
    // A step of zero stops nothing.
    let stopping_kg_m2_s = R::choose(zero.below(kinematics.step_s), stopping / kinematics.step_s.most(least), zero);
    let against = |turning: Triple<R>, coefficient: R| {
        let speed = turning.dot(turning).sqrt();
        let moment_n_m = (coefficient * lever_n_m).least(stopping_kg_m2_s * speed);
        turning * (moment_n_m / speed.most(least))
    };
    against(kinematics.turning - twisting, law.rolling) + against(twisting, law.torsion)
}
