//! Normal damping: the damper that gives a coefficient of restitution, and its share where a contact begins or ends.

use stagger_coupling::math;

use super::kinematics::ContactKinematics;
use crate::common::simd::Real;

/// Damping ratio ζ of a restitution coefficient e in (0, 1]: −ln e/√(π² + ln² e) (linear spring, exact).
pub fn damping_ratio(restitution: f64) -> f64 {
    let logarithm = math::ln(restitution);
    -logarithm / math::hypot(std::f64::consts::PI, logarithm)
}

/// What share of the damping acts at an evaluation next to where a contact begins or ends; 1 at all others.
///
/// Damping that gives a restitution begins and ends with a jump (linear law) or nearly so. An evaluation at an overlap of x
/// speeds times Δt stands for a whole step, where the contact has lasted x steps before the first one, or lasts so long
/// after the last: that made an error of first order, with a sign that hung on the phase of first touch. The weights a x up to
/// x = 1, and from there down to 1 at x = 2, a = ½ + 2/q, give the first two evaluations together the impulse of a force that
/// grows as the damping does, δ^{(q−2)/2}; and where touch begins they are continuous. Δt c/(2 m*) takes what the velocity
/// predicted there does not know: that the damping c has begun to act since the evaluation before.
#[inline(always)]
pub fn touch_share<R: Real>(power: f64, kinematics: &ContactKinematics<R>, damping_kg_s: R, opening: R) -> R {
    let (zero, one) = (opening.all(0.0), opening.all(1.0));
    let way = opening.most(-opening) * kinematics.touch_s;
    // Nothing moves, or the rule is another: the overlap is any number of ways.
    let ways = kinematics.overlap / way.most(zero.all(f64::MIN_POSITIVE));
    let most = 0.5 + 2.0 / power;
    let share = (ways * one.all(most)).least((one.all(1.0 - most) * (ways - one) + one.all(most)).most(one));
    let unknown = (one.all(2.0) - ways).least(one).most(zero);
    let lag = damping_kg_s * share * kinematics.touch_s / (kinematics.reduced_mass + kinematics.reduced_mass);
    share / (one + lag * unknown)
}

#[cfg(test)]
mod tests {
    use super::damping_ratio;

    #[test]
    fn half_of_the_speed_is_left_at_a_damping_ratio_of_0_215454() {
        assert!((damping_ratio(0.5) - 0.215_454).abs() < 5e-7);
        assert!(damping_ratio(1.0).abs() < f64::EPSILON);
    }
}
