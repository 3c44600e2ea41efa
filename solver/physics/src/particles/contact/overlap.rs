//! The monograph's law of the normal force by overlap strain and lens area (Zohdi 2018, eqs. 6.6–6.9 and 6.52–6.57).

use std::f64::consts::PI;

use stagger_coupling::math;

use super::normal::{Normal, NormalStiffness};
use crate::common::{quadrature, simd::Real};

/// The monograph's overlap law K_p |E|^p A with E = δ/(R_i+R_j) (Zohdi 2018, eqs. 6.6–6.9), A the area of the lens
/// plane (eqs. 6.52–6.57). Its modulus of a pair is the mean of the particles' K_p (eq. 6.34).
#[derive(Clone, Copy, Debug)]
pub enum Overlap {
    /// p = 2, without a power function in the contact loop.
    Square,
    /// Any positive p.
    Power(f64),
}

impl Overlap {
    /// The law of exponent p.
    pub fn new(exponent: f64) -> Self {
        if (exponent - 2.0).abs() < f64::EPSILON { Self::Square } else { Self::Power(exponent) }
    }

    /// p.
    pub fn exponent(self) -> f64 {
        match self {
            Self::Square => 2.0,
            Self::Power(exponent) => exponent,
        }
    }

    /// |E|^p.
    #[inline(always)]
    fn strain_power(self, strain: f64) -> f64 {
        match self {
            Self::Square => strain * strain,
            Self::Power(exponent) => math::powf(strain, exponent),
        }
    }

    #[inline(always)]
    fn stiffness<R: Real>(self, overlap: R, length: R, area_m2: R) -> NormalStiffness<R> {
        let secant = match self {
            Self::Square => overlap * area_m2 / (length * length),
            Self::Power(exponent) => (overlap / length).power(exponent) * area_m2 / overlap,
        };
        NormalStiffness { secant, area_m2 }
    }

    /// ∫ |E|^p A dδ of two spheres, the elastic energy over the modulus, in m³.
    ///
    /// The part up to the clamp of A is integrated by eight Gauss points (exact for equal radii and p = 2), the part
    /// beyond it in closed form.
    pub fn pair_energy(self, overlap: f64, radius_i: f64, radius_j: f64) -> f64 {
        let sum = radius_i + radius_j;
        let smooth = overlap.min(sum - clamp_distance_squared(radius_i, radius_j).sqrt());
        let force = |depth: f64| self.pair(depth, sum - depth, radius_i, radius_j).secant * depth;
        let lens = match self {
            Self::Square => smooth * quadrature::over_unit_interval(|u| force(smooth * u)),
            // δ ~ u² makes the integrand smooth at first touch for half-integer p too.
            Self::Power(_) => smooth * quadrature::over_unit_interval(|u| 2.0 * u * force(smooth * u * u)),
        };
        let smaller = radius_i.min(radius_j);
        lens + self.clamped_energy(overlap, smooth, sum, smaller)
    }

    /// ∫ |E|^p A dδ of a sphere at a plane, in m³; closed form.
    pub fn wall_energy(self, overlap: f64, radius: f64) -> f64 {
        let p = self.exponent();
        let depth = overlap.min(radius);
        let strain = depth / radius;
        let lens = PI * self.strain_power(strain) * depth * depth * (2.0 * radius / (p + 2.0) - depth / (p + 3.0));
        lens + self.clamped_energy(overlap, depth, radius, radius)
    }

    /// The part from depth `from` to `to` with A = π R², E = δ/`length`.
    fn clamped_energy(self, to: f64, from: f64, length: f64, radius: f64) -> f64 {
        if to <= from {
            return 0.0;
        }
        let primitive = |depth: f64| self.strain_power(depth / length) * depth / (self.exponent() + 1.0);
        PI * radius * radius * (primitive(to) - primitive(from))
    }
}

impl Normal for Overlap {
    fn power(self) -> f64 {
        self.exponent() + 2.0
    }

    /// The mean (eq. 6.34).
    #[inline(always)]
    fn pair_modulus<R: Real>(self, modulus_i: R, modulus_j: R) -> R {
        (modulus_i + modulus_j) * modulus_i.all(0.5)
    }

    #[inline(always)]
    fn pair<R: Real>(self, overlap: R, distance: R, radius_i: R, radius_j: R) -> NormalStiffness<R> {
        let area_m2 = overlap.all(PI) * lens_radius_squared(overlap, distance, radius_i, radius_j);
        self.stiffness(overlap, radius_i + radius_j, area_m2)
    }

    /// The sphere's centre is at the signed distance R − δ from the plane: E = δ/R, A = π(R² − (R−δ)²), and A = πR² once
    /// the centre is behind the plane.
    #[inline(always)]
    fn wall<R: Real>(self, overlap: R, radius: R) -> NormalStiffness<R> {
        let depth = overlap.least(radius);
        self.stiffness(overlap, radius, overlap.all(PI) * depth * (radius + radius - depth))
    }
}

/// |R_j² − R_i²|: d² below which the smaller sphere's centre is past the lens plane, L < 0.
#[inline(always)]
fn clamp_distance_squared<R: Real>(radius_i: R, radius_j: R) -> R {
    let difference = (radius_j - radius_i) * (radius_j + radius_i);
    difference.most(-difference)
}

/// a² of the lens plane (eqs. 6.52–6.57), in m², in Heron's form, which does not cancel at small overlap:
/// R_i² − ¼ (d − (R_j²−R_i²)/d)² = δ (2S−δ) (d² − (R_i−R_j)²) / (4 d²) with S = R_i + R_j.
///
/// Once the smaller centre has passed the lens plane, a is the smaller radius.
#[inline(always)]
fn lens_radius_squared<R: Real>(overlap: R, distance: R, radius_i: R, radius_j: R) -> R {
    let smaller = radius_i.least(radius_j);
    let distance_squared = distance * distance;
    let difference = radius_i - radius_j;
    let sum = radius_i + radius_j;
    let heron = overlap * (sum + distance) * (distance_squared - difference * difference);
    let lens = clamp_distance_squared(radius_i, radius_j).below(distance_squared);
    // Outside the lens the divisor is not used; only rounding could exceed the clamp.
    let divisor = R::choose(lens, overlap.all(4.0) * distance_squared, overlap.all(1.0));
    R::choose(lens, (heron / divisor).least(smaller * smaller), smaller * smaller)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lens_area_is_the_monographs_and_clamped() {
        let (ri, rj, d) = (1.0f64, 1.5f64, 2.2f64);
        let l = 0.5 * (d - (rj * rj - ri * ri) / d);
        // Both forms are exact to a few units of rounding here.
        assert!((lens_radius_squared(ri + rj - d, d, ri, rj) - (ri * ri - l * l)).abs() < 1e-14);
        for d in [0.0, 0.1, 0.5, 1.0] {
            assert!((lens_radius_squared(ri + rj - d, d, ri, rj) - 1.0).abs() < f64::EPSILON, "swallowed: a = R_i");
        }
        assert!((lens_radius_squared(2.0, 0.0, 1.0, 1.0) - 1.0).abs() < f64::EPSILON, "coincident");
    }

    #[test]
    fn energy_is_the_integral_of_the_force() {
        for law in [Overlap::new(2.0), Overlap::new(1.5), Overlap::new(1.0)] {
            for (ri, rj) in [(1.0, 1.0), (1.0, 1.3), (0.2, 1.0)] {
                for overlap in [0.02, 0.15, 0.38] {
                    let h = 1e-5;
                    let slope =
                        (law.pair_energy(overlap + h, ri, rj) - law.pair_energy(overlap - h, ri, rj)) / (2.0 * h);
                    let force = law.pair(overlap, ri + rj - overlap, ri, rj).secant * overlap;
                    // Central difference: h² F''/6 and rounding 1e-16/h, both below 1e-8.
                    assert!((slope - force).abs() < 1e-8, "{law:?} {ri} {rj} {overlap}: {slope} {force}");
                    let slope = (law.wall_energy(overlap + h, ri) - law.wall_energy(overlap - h, ri)) / (2.0 * h);
                    assert!((slope - law.wall(overlap, ri).secant * overlap).abs() < 1e-8);
                }
            }
        }
    }
}
