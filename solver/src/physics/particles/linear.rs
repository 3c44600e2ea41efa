use super::{
    contact::{Normal, Touch},
    overlap::Overlap,
};

/// Linear spring k_n δ (Cundall & Strack 1979). Its modulus is k_n in N/m, that of a pair the mean of both; the contact
/// area is that of the lens plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear;

impl Normal for Linear {
    #[inline(always)]
    fn power(self) -> f64 {
        2.0
    }

    #[inline(always)]
    fn pair_modulus(self, modulus_i: f64, modulus_j: f64) -> f64 {
        0.5 * (modulus_i + modulus_j)
    }

    #[inline(always)]
    fn pair(self, overlap: f64, distance: f64, radius_i: f64, radius_j: f64) -> Touch {
        Touch { secant: 1.0, area_m2: Overlap::Square.pair(overlap, distance, radius_i, radius_j).area_m2 }
    }

    #[inline(always)]
    fn wall(self, overlap: f64, radius: f64) -> Touch {
        Touch { secant: 1.0, area_m2: Overlap::Square.wall(overlap, radius).area_m2 }
    }
}
