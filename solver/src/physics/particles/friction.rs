use super::{
    Vec3,
    contact::{Slip, Tangential},
    pair_table::PairLaw,
};

/// No tangential force.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frictionless;

impl Tangential for Frictionless {
    const ACTS: bool = false;
    const REMEMBERS: bool = false;

    #[inline(always)]
    fn force(self, _: &PairLaw, _: &Slip, _: &mut Vec3) -> Vec3 {
        Vec3::zeros()
    }
}

/// The monograph's regularised friction (Zohdi 2018, eqs. 6.11–6.15).
///
/// Stick while K_f ‖v_τ‖ A Δt < μ_s ‖Ψ^n‖, else slip at μ_d ‖Ψ^n‖; Δt is the step of the integrator, Ψ^n the elastic normal
/// force. Rest gives zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Regularised;

impl Tangential for Regularised {
    const ACTS: bool = true;
    const REMEMBERS: bool = false;

    #[inline(always)]
    fn force(self, law: &PairLaw, slip: &Slip, _: &mut Vec3) -> Vec3 {
        let speed = slip.velocity.norm();
        if speed <= 0.0 {
            return Vec3::zeros();
        }
        let stick_n = law.friction_stiffness_n_m3 * speed * slip.area_m2 * slip.step_s;
        let sticks = stick_n < law.static_friction * slip.elastic_n;
        let magnitude_n = if sticks { stick_n } else { law.dynamic_friction * slip.elastic_n };
        slip.velocity * (magnitude_n / speed)
    }
}
