//! A point load on an elastic half-space: Boussinesq (1885) for its normal part, Cerruti (1882) for its tangential part.

use super::{Load, NEAR_RADII};
use crate::common::simd::{Real, Triple};

/// Components of a symmetric tensor, in the order xx, yy, zz, xy, yz, zx.
pub(super) const COMPONENTS: usize = 6;

/// A point load as the sum reads it, its forces over 2π.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    pub x_m: f64,
    pub y_m: f64,
    /// Normal force into the solid and tangential forces, over 2π, in N.
    pub normal: f64,
    pub along_x: f64,
    pub along_y: f64,
    /// Square of the distance within which this load is spread over its disc and not summed here, in m².
    pub near_m2: f64,
}

impl Source {
    /// The point load that stands for `load` away from its disc.
    pub fn of(load: &Load) -> Self {
        let reach_m = NEAR_RADII * load.radius_m;
        let [along_x, along_y] = load.tangential_n.map(|force| force / std::f64::consts::TAU);
        Self {
            x_m: load.x_m,
            y_m: load.y_m,
            normal: load.normal_n / std::f64::consts::TAU,
            along_x,
            along_y,
            near_m2: reach_m * reach_m,
        }
    }
}

/// Square of the distance from a point of the surface, in m²; in the order of operations that decides who is near.
#[inline(always)]
pub(super) fn distance_squared<R: Real>(x: R, y: R, z: R) -> R {
    x * x + y * y + z * z
}

/// Adds the stress of a point load, in Pa, at points of depth `at.z` ≥ 0; nothing within the load's near distance.
///
/// With r from the load, R = |r|, u = R + z, and the force f = (X, Y, F) over 2π (Johnson 1985, §3.2 and §3.6; here for both
/// parts together):
///
/// σ = −3 (f·r) r⊗r / R⁵ + (1−2ν) e, where e has in-plane components only,
/// e_xx = s (1/R³ − B) − F w − x² k − 2 B X x,  e_yy likewise,  e_xy = −x y k − B (X y + Y x),
/// s = X x + Y y,  B = 1/(R u²),  w = 1/(R u) − z/R³,
/// k = −s (1/R³ u² + 2/R² u³) − F (1/R³ u + 1/R² u²).
///
/// Nothing is divided by ρ: the axis needs no case of its own.
#[inline(always)]
pub(super) fn add<R: Real>(compressible: f64, load: &Source, at: Triple<R>, sum: &mut [R; COMPONENTS]) {
    let z = at.z;
    let all = |value: f64| z.all(value);
    let (x, y) = (at.x - all(load.x_m), at.y - all(load.y_m));
    let (fx, fy, fz) = (all(load.along_x), all(load.along_y), all(load.normal));
    let squared = distance_squared(x, y, z);
    let distance = squared.sqrt();
    let u = distance + z;
    // Every term has this factor, so that zero switches the load off.
    let one_over = all(1.0) / (distance * u);
    let q = R::choose(squared.below(all(load.near_m2)), all(0.0), one_over);
    let (ir, iu) = (u * q, distance * q);
    let ir2 = ir * ir;
    let ir3 = ir2 * ir;
    let s = fx * x + fy * y;
    let m = all(3.0) * ir3 * ir2 * (s + fz * z);
    let b = q * iu;
    let c = all(compressible);
    let common = s * (ir3 - b) - fz * (q - z * ir3);
    let k = s * (q * q * (ir + iu + iu)) + fz * (q * (ir2 + q));
    let twice = b + b;
    let (mx, my) = (m * x, m * y);
    sum[0] = sum[0] - mx * x + c * (common + x * x * k - twice * fx * x);
    sum[1] = sum[1] - my * y + c * (common + y * y * k - twice * fy * y);
    sum[2] = sum[2] - m * z * z;
    sum[3] = sum[3] - mx * y + c * (x * y * k - b * (fx * y + fy * x));
    sum[4] = sum[4] - my * z;
    sum[5] = sum[5] - mx * z;
}
