use super::{
    Vec3,
    contact::{Slip, Tangential},
    pair_table::PairLaw,
};

/// A spring between the contact points that remembers their displacement (Cundall & Strack 1979), with the stiffness k_t of
/// [`PairLaw::tangential`]; with Mindlin's ratio and Hertz's law it is 8 G* a (Mindlin 1949, no slip).
///
/// The spring is turned into the plane of contact by projection and stretched by half of v_τ Δt before the force is taken
/// and by half after it: what is remembered is half a step ahead, which makes its growth the trapezoidal rule's, second order.
/// Spring and damper together give at most μ_s ‖Ψ^n‖, and slide at μ_d ‖Ψ^n‖, the spring following.
#[derive(Clone, Copy, Debug)]
pub(super) struct TangentialSpring;

impl Tangential for TangentialSpring {
    const ACTS: bool = true;
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn force(self, law: &PairLaw, slip: &Slip, spring: &mut Vec3) -> Vec3 {
        let stiffness_n_m = law.tangential * slip.secant_n_m;
        let damping = slip.velocity * (law.tangential_damping * slip.impedance_kg_s);
        let half = slip.velocity * (0.5 * slip.step_s);
        let stretched = *spring - slip.normal * spring.dot(&slip.normal) + half;
        let force = stretched * stiffness_n_m + damping;
        let limit_n = law.static_friction * slip.pressing_n;
        let squared = force.norm_squared();
        if squared <= limit_n * limit_n {
            *spring = stretched + half;
            return force;
        }
        // `squared` is above zero here.
        let force = force * (law.dynamic_friction * slip.pressing_n / squared.sqrt());
        *spring = if stiffness_n_m > 0.0 { (force - damping) / stiffness_n_m + half } else { Vec3::zeros() };
        force
    }
}
