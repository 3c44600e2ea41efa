//! Reflectivity of a surface by Fresnel's equations, without polarisation.

use nalgebra::Complex;
use serde::Serialize;
use stagger_coupling::math;

/// Refractive index n̂ = n + i k of a surface over that of the medium around it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RefractiveIndex {
    /// Real part n; positive.
    pub real: f64,
    /// Extinction k; 0 is a dielectric, and a metal's is several.
    pub extinction: f64,
}

/// Share R of unpolarised light that a surface reflects at the angle of incidence with this cosine.
///
/// Zohdi 2018, eqs. 10.14 and 10.25, with s = √(n̂² − sin²θ) and the ratio μ̂ of the magnetic permeabilities:
/// r_∥ = (n̂² cosθ/μ̂ − s)/(n̂² cosθ/μ̂ + s), r_⊥ = (cosθ − s/μ̂)/(cosθ + s/μ̂), R = ½ (|r_∥|² + |r_⊥|²).
///
/// The same formulas hold for a complex index (Born & Wolf, Principles of Optics, ch. 14). With n > 0 and k ≥ 0 the root has
/// Re s ≥ 0, and Re(n̂² s*) = Re s (|s|² + sin²θ) ≥ 0: numerators are never longer than denominators, and R is from 0 to 1. A
/// real n̂ at or below sinθ reflects all light; so does grazing light.
#[must_use]
pub fn reflectance(index: RefractiveIndex, permeability: f64, cosine: f64) -> f64 {
    if cosine <= 0.0 {
        return 1.0;
    }
    let RefractiveIndex { real, extinction } = index;
    // n̂² − 1 + cos²θ: no digits are lost at n̂ = 1.
    let (above_one, square) =
        ((real - 1.0) * (real + 1.0) - extinction * extinction + cosine * cosine, 2.0 * real * extinction);
    if square <= 0.0 && above_one <= 0.0 {
        return 1.0;
    }
    let root = math::complex_sqrt(Complex::new(above_one, square));
    let index = Complex::new(real, extinction);
    let inner = index * index * (cosine / permeability);
    let parallel = ((inner - root) / (inner + root)).norm_sqr();
    let outer = root / permeability;
    let perpendicular = ((Complex::from(cosine) - outer) / (Complex::from(cosine) + outer)).norm_sqr();
    (0.5 * (parallel + perpendicular)).min(1.0)
}
