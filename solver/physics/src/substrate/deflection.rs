//! How far the surface gives way under the particles.

use rayon::prelude::*;
use stagger_coupling::math;

use super::Load;

/// Deflection into the solid at a distance ρ from the load's centre, in m (Johnson 1985, eqs. 3.22, 3.29):
/// F(1−ν²)/(π E ρ) outside the contact, at its centre 2F(1−ν²)/(π E a), that of an even pressure over it; between half the
/// contact radius and the centre it is constant. The tangential force is not looked at.
#[must_use]
pub fn deflection_m(poisson: f64, young_pa: f64, load: &Load, rho_m: f64) -> f64 {
    let compliance = (1.0 - poisson * poisson) / (std::f64::consts::PI * young_pa);
    load.normal_n * compliance / rho_m.max(0.5 * load.radius_m)
}

/// Deflection in m under each particle by all loads but its own: `at` are the particles' places on the surface, `None`
/// those too high for it to matter, and `by` the particle of each load.
///
/// What a contact's own force presses in is its contact law's matter: Hertz's law, with the reduced modulus of both
/// bodies, holds it already.
pub(super) fn under_particles(
    poisson: f64,
    young_pa: f64,
    loads: &[Load],
    by: &[u32],
    at: &[Option<[f64; 2]>],
) -> Vec<f64> {
    let under = |(row, place): (u32, &Option<[f64; 2]>)| {
        let Some([x, y]) = *place else { return 0.0 };
        let others = loads.iter().zip(by).filter(|(_, particle)| **particle != row);
        others.map(|(load, _)| deflection_m(poisson, young_pa, load, math::hypot(x - load.x_m, y - load.y_m))).sum()
    };
    let rows: Vec<(u32, &Option<[f64; 2]>)> = (0u32..).zip(at).collect();
    rows.into_par_iter().map(under).collect()
}
