//! Gauss–Legendre quadrature.

/// Positive abscissas and weights of the eight-point rule on [−1, 1] (Abramowitz & Stegun 1964, table 25.4).
const POINTS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// The integral of `f` over [0, 1]; exact for polynomials up to degree 15.
#[inline]
pub(crate) fn over_unit_interval(f: impl Fn(f64) -> f64) -> f64 {
    POINTS.iter().map(|&(x, weight)| 0.5 * weight * (f(0.5 * (1.0 - x)) + f(0.5 * (1.0 + x)))).sum()
}

#[cfg(test)]
mod tests {
    use super::over_unit_interval;

    #[test]
    fn exact_for_degree_fifteen_and_not_beyond() {
        // Rounding of sixteen terms of order one stays below 1e-15.
        assert!((over_unit_interval(|x| 16.0 * x.powi(15)) - 1.0).abs() < 1e-15);
        assert!((over_unit_interval(|x| 17.0 * x.powi(16)) - 1.0).abs() > 1e-10);
    }
}
