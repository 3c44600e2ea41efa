//! A load spread over a disc as Hertz's pressure: its stress in the half-space in closed form.

use nalgebra::Complex;
use stagger_coupling::math;

use super::{Load, point_load::COMPONENTS};

/// Stress in Pa at a point `x`, `y` from the load's centre and `z` ≥ 0 below the surface, in m.
///
/// The normal force is spread as Hertz's pressure 3F/(2πa³) √(a²−ρ²), the tangential one likewise (sliding contact,
/// Hamilton 1983). Both parts derive from the potentials h₀ = 1/R, h₁ = ln(R+ζ), … of a point load, each the derivative of the
/// next with respect to depth ζ. Hertz's pressure is the superposition of point loads at complex depths ζ = z + i t,
/// −a < t < a, with weights ∝ a² − t²; integrating twice by parts,
///
/// T[h] = (3/a³) (Im I³h − a Re I²h) at ζ = z + i a,
///
/// with Iⁿh the n-th integral of h over ζ. So every derivative of a potential that the stress needs is one of a potential
/// two and three steps up the chain, taken at one complex depth. With A, B, C for the first to third (1/ρ) ∂/∂ρ of hₙ and
/// u = R + ζ these are polynomials in 1/u, 1/R and ln u: nothing is divided by ρ, and nothing is singular but 1/R on the
/// disc's edge, where a factor z makes it vanish.
pub(super) fn stress(poisson: f64, load: &Load, x: f64, y: f64, z: f64) -> [f64; COMPONENTS] {
    let a = load.radius_m;
    let r2 = x * x + y * y;
    let depth = Complex::new(z, a);
    // The root with a positive real part; above the disc on the surface, that of z → 0 from below.
    let root = {
        let root = math::complex_sqrt(depth * depth + r2);
        if root.re < 0.0 || (root.re == 0.0 && root.im < 0.0) { -root } else { root }
    };
    let u = root + depth;
    let v = u.inv();
    let log = math::complex_ln(u);
    // On the disc's edge at the surface, what has this factor is multiplied by z = 0.
    let w = if root.norm_sqr() > 0.0 { root.inv() } else { Complex::new(0.0, 0.0) };
    let (v2, v3, v4) = (v * v, v * v * v, v * v * v * v);

    // hₙ, and Aₙ = (1/ρ) ∂hₙ/∂ρ, Bₙ of Aₙ, Cₙ of Bₙ.
    let (h0, h1, h2) = (w, log, depth * log - root);
    let (a1, a2, a3) = (w * v, -v, (v2 * (0.5 * r2) - log) * 0.5);
    let a4 = (depth * log * 2.0 - u - v * (0.5 * r2) + v3 * (r2 * r2 / 6.0)) * -0.25;
    let (b2, b3, b4) = (w * v2, v2 * -0.5, (v + v3 * (r2 / 3.0)) * 0.25);
    let b5 = (log - v2 * (r2 * 2.0 / 3.0) - v4 * (r2 * r2 / 12.0)) * 0.125;
    let (c3, c4, c5) = (w * v3, v3 * (-1.0 / 3.0), v2 * (1.0 / 12.0) + v4 * (r2 / 24.0));

    let factor = 3.0 / (a * a * a);
    let spread = |third: Complex<f64>, second: Complex<f64>| factor * (third.im - a * second.re);
    let potentials = Potentials {
        hm: spread(h2, h1),
        hmm: spread(h1, h0),
        am: spread(a2, a1),
        a0: spread(a3, a2),
        b0: spread(b3, b2),
        a1: spread(a4, a3),
        b1: spread(b4, b3),
        c1: spread(c4, c3),
        b2: spread(b5, b4),
        c2: spread(c5, c4),
    };
    potentials.stress(poisson, load, [x, y, z])
}

/// Derivatives of a load's potentials over its force: h₋₁ and h₋₂, and A, B, C of h₋₁ (`am`), h₀, h₁ and h₂.
struct Potentials {
    hm: f64,
    hmm: f64,
    am: f64,
    a0: f64,
    b0: f64,
    a1: f64,
    b1: f64,
    c1: f64,
    b2: f64,
    c2: f64,
}

impl Potentials {
    /// Stress of a load with these potentials (Johnson 1985, eqs. 3.15 to 3.18 and their like for tangential traction).
    fn stress(&self, poisson: f64, load: &Load, [x, y, z]: [f64; 3]) -> [f64; COMPONENTS] {
        let Self { hm, hmm, am, a0, b0, a1, b1, c1, b2, c2 } = *self;
        let over = |force: f64| force / std::f64::consts::TAU;
        let (f, fx, fy) = (over(load.normal_n), over(load.tangential_n[0]), over(load.tangential_n[1]));
        let (incompressible, compressible) = (2.0 * poisson, 1.0 - 2.0 * poisson);
        let s = fx * x + fy * y;
        let plane = |q: f64| f * (incompressible * hm - z * (a0 + q * q * b0) - compressible * (a1 + q * q * b1));
        let shear = |q: f64| s * (incompressible * (a0 + b2 + q * q * c2) - z * (b1 + q * q * c1));
        let along = 2.0 * a0 - 2.0 * z * b1 + 2.0 * incompressible * b2;
        let across = a0 - z * b1 + incompressible * b2;
        let normal_xy = -f * x * y * (z * b0 + compressible * b1);
        [
            plane(x) + shear(x) + fx * x * along,
            plane(y) + shear(y) + fy * y * along,
            f * (hm - z * hmm) - z * am * s,
            normal_xy + s * x * y * (incompressible * c2 - z * c1) + (fx * y + fy * x) * across,
            -f * z * y * am + fy * (hm - z * (a0 + y * y * b0)) - fx * z * x * y * b0,
            -f * z * x * am + fx * (hm - z * (a0 + x * x * b0)) - fy * z * x * y * b0,
        ]
    }
}
