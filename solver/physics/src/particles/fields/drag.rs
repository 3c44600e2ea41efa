//! Stokes' drag of a gas that rests or streams (Stokes 1851; Zohdi 2018, eq. 6.22).

use std::f64::consts::PI;

use crate::{common::Vec3, particles::settings::Drag};

impl Drag {
    /// Stokes' coefficient 6π c_e R, in N s/m (Stokes 1851; Zohdi 2018, eq. 6.22).
    #[inline]
    pub fn coefficient(&self, radius_m: f64) -> f64 {
        6.0 * PI * self.viscosity_pa_s * radius_m
    }

    /// Force 6π c_e R (v_e − v) in N.
    #[inline]
    pub fn force(&self, radius_m: f64, velocity: &Vec3) -> Vec3 {
        self.coefficient(radius_m) * (Vec3::from(self.velocity_m_s) - velocity)
    }
}
