//! Numbers as messages show them.

use std::fmt;

/// A number as messages show it: six digits, without the trace that a unit's factor leaves in the last ones (100 ns are
/// 1.0000000000000001e-7 s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown(pub f64);

impl Shown {
    /// The number that is written.
    fn rounded(self) -> f64 {
        // What is not finite is parsed back as it is.
        format!("{:.5e}", self.0).parse().unwrap_or(self.0)
    }
}

impl fmt::Display for Shown {
    /// In decimals between 0.001 and a million, else with an exponent.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = self.rounded();
        let plain = rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs());
        if plain { fmt::Display::fmt(&rounded, f) } else { fmt::LowerExp::fmt(&rounded, f) }
    }
}

impl fmt::LowerExp for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::LowerExp::fmt(&self.rounded(), f)
    }
}

#[cfg(test)]
mod tests {
    use super::Shown;

    #[test]
    fn a_unit_s_factor_leaves_no_trace() {
        let hundred_nanoseconds = 100.0 * 1e-9;
        assert_eq!(format!("{hundred_nanoseconds:e}"), "1.0000000000000001e-7");
        assert_eq!(format!("{:e} {}", Shown(hundred_nanoseconds), Shown(hundred_nanoseconds)), "1e-7 1e-7");
        assert_eq!(format!("{} {} {}", Shown(0.1 + 0.2), Shown(1273.15), Shown(0.0)), "0.3 1273.15 0");
        assert_eq!(format!("{} {:e}", Shown(f64::NAN), Shown(f64::INFINITY)), "NaN inf");
        assert_eq!(Shown(2.0_f64.powi(40)).to_string(), "1.09951e12");
    }
}
