//! Hertz's law of the normal force between elastic spheres (Hertz 1882; Zohdi 2018, eqs. 6.58–6.59).

use std::f64::consts::PI;

use super::normal::{Normal, NormalStiffness, reduced};
use crate::common::simd::Real;

/// Hertz's law of elastic spheres, 4/3 √R* E* δ^{3/2} with a² = R* δ (Hertz 1882; Zohdi 2018, eqs. 6.58–6.59).
///
/// Its modulus of a particle is E/(1−ν²), that of a pair 1/E* = (1−ν_i²)/E_i + (1−ν_j²)/E_j.
#[derive(Clone, Copy, Debug)]
pub struct Hertz;

impl Normal for Hertz {
    #[inline(always)]
    fn power(self) -> f64 {
        2.5
    }

    /// E* of two particles, in Pa; zero where both have softened to nothing.
    #[inline(always)]
    fn pair_modulus<R: Real>(self, modulus_i: R, modulus_j: R) -> R {
        let sum = modulus_i + modulus_j;
        modulus_i * modulus_j / sum.most(sum.all(f64::MIN_POSITIVE))
    }

    #[inline(always)]
    fn pair<R: Real>(self, overlap: R, _: R, radius_i: R, radius_j: R) -> NormalStiffness<R> {
        Self::stiffness(overlap, reduced(radius_i, radius_j), radius_i.least(radius_j))
    }

    /// R_j = ∞, and the wall is rigid.
    #[inline(always)]
    fn wall<R: Real>(self, overlap: R, radius: R) -> NormalStiffness<R> {
        Self::stiffness(overlap, radius, radius)
    }
}

impl Hertz {
    /// E/(1−ν²), in Pa.
    pub fn modulus(young_pa: f64, poisson: f64) -> f64 {
        young_pa / (1.0 - poisson * poisson)
    }

    #[inline(always)]
    fn stiffness<R: Real>(overlap: R, reduced_radius: R, smaller_radius: R) -> NormalStiffness<R> {
        let contact_radius_squared = reduced_radius * overlap;
        NormalStiffness {
            secant: overlap.all(4.0 / 3.0) * contact_radius_squared.sqrt(),
            area_m2: overlap.all(PI) * contact_radius_squared.least(smaller_radius * smaller_radius),
        }
    }

    /// Energy 8/15 √R* E* δ^{5/2} of two spheres over their modulus, in m³.
    pub fn pair_energy(overlap: f64, radius_i: f64, radius_j: f64) -> f64 {
        0.4 * overlap * overlap * Hertz.pair(overlap, 0.0, radius_i, radius_j).secant
    }

    /// Energy of a sphere at a plane over its modulus, in m³.
    pub fn wall_energy(overlap: f64, radius: f64) -> f64 {
        0.4 * overlap * overlap * Hertz.wall(overlap, radius).secant
    }
}
