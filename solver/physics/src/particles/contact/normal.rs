//! What a law of the normal force is: elastic force over overlap, and area, of a contact.

use crate::common::simd::Real;

/// Stiffness over the modulus, and area of a contact.
#[derive(Clone, Copy, Debug)]
pub struct NormalStiffness<R> {
    /// Elastic force over overlap and modulus: in m where the modulus is a pressure, 1 where it is N/m.
    pub secant: R,
    /// Contact area A in m².
    pub area_m2: R,
}

impl NormalStiffness<f64> {
    /// The part of a contact that has this share of its patch.
    pub fn shared(self, share: f64) -> Self {
        Self { secant: self.secant * share, area_m2: self.area_m2 * share }
    }
}

/// A law of the normal force: elastic force = modulus · secant(δ) · δ.
///
/// Kernels are compiled for each law; [`Law`] is the same at run time.
pub trait Normal: Copy + Send + Sync {
    /// q of the force ∝ δ^{q−1} that the law tends to at small overlap.
    fn power(self) -> f64;

    /// Modulus of two particles in contact. That of a particle at a rigid wall is its own.
    fn pair_modulus<R: Real>(self, modulus_i: R, modulus_j: R) -> R;

    /// Two particles at centre distance d with overlap δ > 0.
    fn pair<R: Real>(self, overlap: R, distance: R, radius_i: R, radius_j: R) -> NormalStiffness<R>;

    /// A particle that overlaps a wall by δ > 0.
    fn wall<R: Real>(self, overlap: R, radius: R) -> NormalStiffness<R>;
}

/// a b/(a + b) of two positive numbers: reduced mass, reduced radius, and the like.
#[inline(always)]
pub fn reduced<R: Real>(a: R, b: R) -> R {
    a * b / (a + b)
}
