//! A linear spring as the law of the normal force (Cundall & Strack 1979).

use super::{
    normal::{Normal, NormalStiffness},
    overlap::Overlap,
};
use crate::common::simd::Real;

/// Linear spring k_n δ (Cundall & Strack 1979). Its modulus is k_n in N/m, that of a pair the mean of both; the contact
/// area is that of the lens plane.
#[derive(Clone, Copy, Debug)]
pub struct Linear;

impl Normal for Linear {
    #[inline(always)]
    fn power(self) -> f64 {
        2.0
    }

    #[inline(always)]
    fn pair_modulus<R: Real>(self, modulus_i: R, modulus_j: R) -> R {
        (modulus_i + modulus_j) * modulus_i.all(0.5)
    }

    #[inline(always)]
    fn pair<R: Real>(self, overlap: R, distance: R, radius_i: R, radius_j: R) -> NormalStiffness<R> {
        NormalStiffness { secant: overlap.all(1.0), ..Overlap::Square.pair(overlap, distance, radius_i, radius_j) }
    }

    #[inline(always)]
    fn wall<R: Real>(self, overlap: R, radius: R) -> NormalStiffness<R> {
        NormalStiffness { secant: overlap.all(1.0), ..Overlap::Square.wall(overlap, radius) }
    }
}
