//! Elementary functions that give the same bits on every processor.
//!
//! The standard library passes `exp`, `sin`, `powf` and their like on to the system's C library, which picks its code by the
//! processor: with fused multiplication and addition the last bit is another. The functions here are those of the `libm` crate,
//! Rust throughout and made of IEEE operations alone, so that a result depends on the arguments only. All of the solver, and
//! whatever else is recorded, hashed or decided upon, takes them from here; `clippy.toml` refuses the others.
//!
//! Errors are below 1 ulp unless a function says otherwise (the sources are FreeBSD's msun and musl's). `sqrt`, `abs`, `floor`,
//! `ceil`, `round`, `%` and the four operations are exactly rounded by IEEE 754 and stay methods.

use nalgebra::{Complex, Matrix3, Rotation3, Unit, Vector3};

/// e^x.
#[must_use]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// e^x − 1, without loss of digits near x = 0.
#[must_use]
pub fn exp_m1(x: f64) -> f64 {
    libm::expm1(x)
}

/// Natural logarithm; −∞ at 0, NaN below.
#[must_use]
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// ln(1 + x), without loss of digits near x = 0; −∞ at −1, NaN below.
#[must_use]
pub fn ln_1p(x: f64) -> f64 {
    libm::log1p(x)
}

/// Logarithm to base 2; −∞ at 0, NaN below.
#[must_use]
pub fn log2(x: f64) -> f64 {
    libm::log2(x)
}

/// Logarithm to base 10; −∞ at 0, NaN below.
#[must_use]
pub fn log10(x: f64) -> f64 {
    libm::log10(x)
}

/// Sine of an angle in rad.
#[must_use]
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// Cosine of an angle in rad.
#[must_use]
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Sine and cosine of an angle in rad, the same as those of [`sin`] and [`cos`].
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Tangent of an angle in rad.
#[must_use]
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// Angle in rad from −π/2 to π/2 with this sine; NaN beyond ±1.
#[must_use]
pub fn asin(x: f64) -> f64 {
    libm::asin(x)
}

/// Angle in rad from 0 to π with this cosine; NaN beyond ±1.
#[must_use]
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}

/// Angle in rad from −π/2 to π/2 with this tangent.
#[must_use]
pub fn atan(x: f64) -> f64 {
    libm::atan(x)
}

/// Angle in rad from −π to π of the point (x, y); mind the order.
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Hyperbolic tangent, to 2 ulp.
#[must_use]
pub fn tanh(x: f64) -> f64 {
    libm::tanh(x)
}

/// x^y; NaN for x < 0 unless y is whole.
///
/// Whole and half powers up to the fourth, which contact laws mostly have, are products and a root, to 3 ulp: three to five
/// times as fast.
#[must_use]
#[inline]
pub fn powf(x: f64, y: f64) -> f64 {
    let twice = 2.0 * y;
    if x >= 0.0 && twice.abs() <= 8.0 && twice.trunc() == twice { half_power(x, twice as i32) } else { libm::pow(x, y) }
}

/// x^(n/2) for x ≥ 0.
#[inline]
fn half_power(x: f64, twice: i32) -> f64 {
    let whole = powi(x, twice.abs() / 2);
    let power = if twice % 2 == 0 { whole } else { whole * x.sqrt() };
    if twice < 0 { 1.0 / power } else { power }
}

/// x^n by repeated squaring, as exact as its few products: to n/2 ulp. A negative power is one over the positive one.
#[must_use]
#[inline]
pub fn powi(x: f64, n: i32) -> f64 {
    let (mut power, mut factor, mut left) = (1.0, x, n.unsigned_abs());
    loop {
        if left & 1 == 1 {
            power *= factor;
        }
        left >>= 1;
        if left == 0 {
            break;
        }
        factor *= factor;
    }
    if n < 0 { 1.0 / power } else { power }
}

/// Cube root, exactly rounded.
#[must_use]
pub fn cbrt(x: f64) -> f64 {
    libm::cbrt(x)
}

/// √(x² + y²), also where the squares are beyond binary64.
#[must_use]
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

/// The root of a complex number with a real part that is not negative; where that is zero, the imaginary part has the sign of
/// the number's.
#[must_use]
pub fn complex_sqrt(z: Complex<f64>) -> Complex<f64> {
    if z.re == 0.0 && z.im == 0.0 {
        return Complex::new(0.0, z.im);
    }
    // The part of the same sign first: no digits cancel.
    let larger = (0.5 * (z.re.abs() + hypot(z.re, z.im))).sqrt();
    let smaller = 0.5 * z.im.abs() / larger;
    let (re, im) = if z.re >= 0.0 { (larger, smaller) } else { (smaller, larger) };
    Complex::new(re, im.copysign(z.im))
}

/// Natural logarithm of a complex number, with an imaginary part from −π to π.
#[must_use]
pub fn complex_ln(z: Complex<f64>) -> Complex<f64> {
    Complex::new(ln(hypot(z.re, z.im)), atan2(z.im, z.re))
}

/// The turn by an angle in rad around an axis (Rodrigues' formula): `R = cos I + sin [a]ₓ + (1 − cos) a aᵀ`.
#[must_use]
pub fn rotation(axis: Unit<Vector3<f64>>, angle: f64) -> Rotation3<f64> {
    let (sine, cosine) = sin_cos(angle);
    let axis = axis.into_inner();
    let along = axis * axis.transpose() * (1.0 - cosine);
    Rotation3::from_matrix_unchecked(Matrix3::identity() * cosine + axis.cross_matrix() * sine + along)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{E, PI};

    use proptest::prelude::*;

    use super::*;

    /// Bits that no other library and no other processor changes.
    #[test]
    fn bits_are_the_same_everywhere() {
        for (k, (value, bits)) in [
            (exp(0.7), 0x4000_1c2a_6126_8987),
            (exp_m1(-1e-3), 0xbf50_6035_21ca_c48c),
            (ln(3.3), 0x3ff3_1a4e_7240_c777),
            (ln_1p(1e-3), 0x3f50_6035_4f8c_3ebf),
            (log2(3.3), 0x3ffb_8f38_88b9_3109),
            (log10(3.3), 0x3fe0_97aa_8bc9_75db),
            (sin(2.5), 0x3fe3_26af_0dcf_cab0),
            (cos(2.5), 0xbfe9_a2f7_ef85_8b7d),
            (tan(2.5), 0xbfe7_e79b_4e00_bb15),
            (asin(0.3), 0x3fd3_8015_9e14_f6ff),
            (acos(0.3), 0x3ff4_41f5_ecbe_ef59),
            (atan(1.7), 0x3ff0_a00a_3bce_369f),
            (atan2(-1.0, -3.0), 0xc006_8f09_5fdf_593c),
            (tanh(0.4), 0x3fd8_5115_73c2_42d6),
            (powf(1e-3, 1.5), 0x3f00_9456_549b_e1bd),
            (powf(7.0, -2.3), 0x3f87_5036_eb61_f82e),
            (powi(1.1, 7), 0x3fff_2df1_fb5a_7ed7),
            (cbrt(5.0), 0x3ffb_5c0f_bcfe_c4d4),
            (hypot(1.1, 2.3), 0x4004_6565_5f12_2ff6),
            (sin(1e22), 0xbfeb_453a_b76b_f397),
            (exp(-700.0), 0x00d1_4f2b_0fb9_307f),
            (powf(2.0, 1023.5), 0x7fe6_a09e_667f_3bcc),
        ]
        .into_iter()
        .enumerate()
        {
            assert_eq!(value.to_bits(), bits, "function {k}: {value} is not {}", f64::from_bits(bits));
        }
    }

    #[test]
    fn whole_powers_are_products() {
        assert_eq!(powi(3.0, 0), 1.0);
        assert_eq!(powi(3.0, 4), 81.0);
        assert_eq!(powi(-2.0, 3), -8.0);
        assert_eq!(powi(2.0, -2), 0.25);
        assert_eq!(powi(0.0, -1), f64::INFINITY);
        let x = 1.234_567_f64;
        assert_eq!((powi(x, 2), powi(x, 3)), (x * x, x * (x * x)));
    }

    #[test]
    fn half_powers_are_products_and_roots() {
        for twice in -9..=9 {
            let y = 0.5 * f64::from(twice);
            for x in [1e-9, 0.3, 1.0, 2.5, 7e4] {
                let (ours, exact) = (powf(x, y), f64::powf(x, y));
                assert!((ours - exact).abs() <= 3.0 * f64::EPSILON * exact, "{x}^{y}: {ours} {exact}");
            }
        }
        assert_eq!((powf(0.0, 0.0), powf(0.0, 1.5), powf(0.0, -0.5)), (1.0, 0.0, f64::INFINITY));
        assert_eq!((powf(f64::INFINITY, 1.5), powf(f64::INFINITY, -1.5)), (f64::INFINITY, 0.0));
        assert_eq!((powf(-2.0, 3.0), powf(-2.0, -1.0)), (-8.0, -0.5));
        assert!(powf(-2.0, 0.5).is_nan() && powf(f64::NAN, 1.5).is_nan());
    }

    #[test]
    fn a_turn_takes_one_axis_to_the_next() {
        let turned = rotation(Unit::new_normalize(Vector3::new(0.0, 0.0, 2.0)), 0.5 * PI) * Vector3::x();
        assert!((turned - Vector3::y()).norm() < 1e-15);
        let axis = Unit::new_normalize(Vector3::new(1.0, -2.0, 0.5));
        assert!((rotation(axis, 1.1).matrix() - Rotation3::from_axis_angle(&axis, 1.1).matrix()).norm() < 1e-15);
    }

    proptest! {
        /// Against the system's library, which has its own errors.
        #[test]
        fn functions_are_those_of_their_names(x in -20.0..20.0, y in -20.0..20.0) {
            let close = |ours: f64, theirs: f64| (ours - theirs).abs() <= 4.0 * f64::EPSILON * theirs.abs();
            let positive = f64::exp(x);
            for (ours, theirs) in [
                (exp(x), x.exp()), (exp_m1(x), x.exp_m1()), (ln(positive), positive.ln()), (ln_1p(positive), positive.ln_1p()),
                (log2(positive), positive.log2()), (log10(positive), positive.log10()), (sin(x), x.sin()), (cos(x), x.cos()),
                (tan(x), x.tan()), (asin(x / 20.0), (x / 20.0).asin()), (acos(x / 20.0), (x / 20.0).acos()), (atan(x), x.atan()),
                (atan2(y, x), y.atan2(x)), (tanh(x), x.tanh()), (powf(positive, y), positive.powf(y)), (cbrt(x), x.cbrt()),
                (hypot(x, y), x.hypot(y)), (sin_cos(x).0, x.sin()), (sin_cos(x).1, x.cos()), (powi(x, 3), x.powi(3)),
            ] {
                prop_assert!(close(ours, theirs), "{ours} {theirs} at {x}, {y}");
            }
        }

        #[test]
        fn complex_functions_undo_squares_and_powers(re in -20.0..20.0, im in -20.0..20.0) {
            let z = Complex::new(re, im);
            let root = complex_sqrt(z);
            prop_assert!(root.re >= 0.0 && (root * root - z).norm() <= 4.0 * f64::EPSILON * z.norm());
            let log = complex_ln(z);
            prop_assert!((Complex::from_polar(E.powf(log.re), log.im) - z).norm() <= 1e-14 * z.norm());
        }
    }

    #[test]
    fn complex_roots_at_the_axes() {
        assert_eq!(complex_sqrt(Complex::new(4.0, 0.0)), Complex::new(2.0, 0.0));
        assert_eq!(complex_sqrt(Complex::new(-4.0, 0.0)), Complex::new(0.0, 2.0));
        assert_eq!(complex_sqrt(Complex::new(-4.0, -0.0)), Complex::new(0.0, -2.0));
        assert_eq!(complex_sqrt(Complex::new(0.0, 8.0)), Complex::new(2.0, 2.0));
        assert_eq!(complex_sqrt(Complex::new(0.0, 0.0)), Complex::new(0.0, 0.0));
    }
}
