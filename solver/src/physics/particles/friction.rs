use super::settings::Friction;

impl Friction {
    /// Magnitude in N of the tangential force at a contact that slides at `speed_m_s` (Zohdi 2018, eqs. 6.11–6.15).
    ///
    /// Stick while K_f ‖v_τ‖ A Δt < μ_s ‖Ψ^n‖, else slip at μ_d ‖Ψ^n‖; Δt is the step of the integrator, Ψ^n the
    /// elastic normal force. Rest gives zero.
    #[inline]
    pub(super) fn force(&self, speed_m_s: f64, area_m2: f64, normal_n: f64, step_s: f64) -> f64 {
        let stick = self.stiffness_n_m3 * speed_m_s * area_m2 * step_s;
        if stick < self.static_coefficient * normal_n { stick } else { self.dynamic_coefficient * normal_n }
    }
}
