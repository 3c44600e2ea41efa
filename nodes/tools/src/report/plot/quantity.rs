//! Numbers with their units, as people write them.

/// Prefixes that are used, largest first, with their powers of ten.
const PREFIXES: [(i32, &str); 10] =
    [(12, "T"), (9, "G"), (6, "M"), (3, "k"), (0, ""), (-3, "m"), (-6, "µ"), (-9, "n"), (-12, "p"), (-15, "f")];

/// Symbols that take a prefix; kelvins, kilograms and pure numbers do not.
const PREFIXED: [&str; 12] = ["m", "s", "W", "N", "Pa", "J", "A", "V", "B", "Hz", "C", "S"];

/// A unit in which numbers of some size read well.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaled {
    /// What a value in the SI unit is divided by.
    pub divisor: f64,
    /// The unit with its prefix, empty for pure numbers.
    pub unit: String,
}

/// The unit with the prefix that leaves the largest value, `size` in the SI unit `unit`, with one to three digits before
/// the point. A unit to a power, such as `m^2`, is scaled by the prefix to that power, and may have some zeros behind the
/// point or more digits before it. What is smaller than the smallest prefix keeps the SI unit.
#[must_use]
pub fn scaled(unit: &str, size: f64) -> Scaled {
    let end = unit.find(|symbol: char| !symbol.is_ascii_alphabetic()).unwrap_or(unit.len());
    let (symbol, rest) = unit.split_at(end);
    let power = rest.strip_prefix('^').and_then(|rest| rest.chars().next()?.to_digit(10)).unwrap_or(1).max(1) as i32;
    let plain = Scaled { divisor: 1.0, unit: pretty(unit) };
    if !PREFIXED.contains(&symbol) || size == 0.0 || !size.is_finite() {
        return plain;
    }
    // A hair is allowed for, so that 1e-6 computed as 0.999…e-6 is a micro.
    let least = |exponent: i32| 10f64.powi(exponent * power - 2 * (power - 1)) * (1.0 - 1e-9);
    let Some((exponent, prefix)) = PREFIXES.iter().find(|(exponent, _)| size.abs() >= least(*exponent)) else {
        return plain;
    };
    Scaled { divisor: 10f64.powi(exponent * power), unit: format!("{prefix}{}", pretty(unit)) }
}

/// A value with four significant digits and its unit.
#[must_use]
pub fn quantity(value: f64, unit: &str) -> String {
    let Scaled { divisor, unit } = scaled(unit, value);
    let number = number(value / divisor);
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// A number with four significant digits, as a power of ten where it would be long.
#[must_use]
pub fn number(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        return value.to_string();
    }
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&size) {
        let text = format!("{value:.3e}");
        return match text.split_once('e') {
            Some((digits, exponent)) => minus(&format!("{digits}·10{}", superscript(exponent))),
            None => text,
        };
    }
    let digits = 3 - size.log10().floor() as i32;
    minus(&format!("{value:.*}", digits.max(0) as usize))
}

/// A count with a thin space between groups of three digits.
#[must_use]
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A power of ten: `10⁻⁶`.
#[must_use]
pub fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(&exponent.to_string()))
}

/// A number as text with a minus sign instead of a hyphen.
#[must_use]
pub fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

/// A unit with raised powers; empty for pure numbers.
fn pretty(unit: &str) -> String {
    if unit == "1" {
        return String::new();
    }
    let mut text = String::new();
    let mut parts = unit.split('^');
    text += parts.next().unwrap_or_default();
    for part in parts {
        let end = part.find(|symbol: char| symbol != '-' && !symbol.is_ascii_digit()).unwrap_or(part.len());
        text += &superscript(&part[..end]);
        text += &part[end..];
    }
    text.replace('*', "·")
}

fn superscript(digits: &str) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raise = |symbol: char| match symbol.to_digit(10) {
        Some(digit) => Some(RAISED[digit as usize]),
        None => (symbol == '-').then_some('⁻'),
    };
    digits.chars().filter_map(raise).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_carry_the_prefix_that_reads_best() {
        for (value, unit, expected) in [
            (0.02, "s", "20.00 ms"),
            (-1.5e-7, "J", "\u{2212}150.0 nJ"),
            (0.0, "J", "0 J"),
            (1e-6, "s", "1.000 µs"),
            (2.5e-9, "m^2", "2500 µm²"),
            (1234.0, "K", "1234 K"),
            (3.2e7, "A/m^2", "32.00 MA/m²"),
            (2e-20, "J", "2.000·10⁻²⁰ J"),
            (4.857e-13, "m^2", "0.4857 µm²"),
            (0.25, "1", "0.2500"),
            (f64::NAN, "J", "NaN J"),
        ] {
            assert_eq!(quantity(value, unit), expected);
        }
    }

    #[test]
    fn counts_are_grouped_and_powers_raised() {
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(count(999), "999");
        assert_eq!(power_of_ten(-12), "10⁻¹²");
        assert_eq!(pretty("N s/m^3"), "N s/m³");
        assert_eq!(pretty("1"), "");
    }
}
