//! Texts with units: `"25 um"`, `"15 W/(m K)"`, `"1.8e-5 Pa s"`, read into SI.
//!
//! ```text
//! text     = number [ unit ]
//! number   = [ sign ] digits with one point at most [ "e" [ sign ] digits ]
//! unit     = [ "/" | "*" ] factor { [ "/" | "*" | blanks ] factor }
//! factor   = ( symbol | "(" unit ")" ) [ power ] | "1", where a "/" follows
//! power    = digit from 1 to 9 | "^" [ "-" ] digit from 1 to 9 | "²" | "³"
//! ```
//!
//! A second number is never a part of the unit: `1 121 um` is refused, not read as 1 um.

use super::{super::problems::cut, Dimension, TIME};
use stagger_coupling::math;

/// A quantity as read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parsed {
    /// Its value in SI units; finite.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
    /// False where no unit was written.
    pub has_unit: bool,
}

/// Why a text is no quantity; reads as a remark behind the text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnitError {
    /// It does not start with a number.
    #[error("not a number with a unit")]
    NoNumber,
    /// The number does not fit into binary64.
    #[error("too large a number")]
    TooLarge,
    /// The number is not zero, but nearer to it than any of binary64.
    #[error("too small a number")]
    TooSmall,
    /// A unit that is not known.
    #[error("no unit is called `{}`", cut(.0))]
    Unknown(String),
    /// Degrees Celsius: an offset scale, which does not combine with others.
    #[error("temperatures are in kelvin: 20 degrees Celsius are 293.15 K")]
    Celsius,
    /// The unit's parts do not fit together.
    #[error("the unit `{}` cannot be read", cut(.0))]
    Malformed(String),
    /// What follows the number goes on as one, or begins another.
    #[error(
        "the unit `{}` cannot be read; a number is written in one piece, with a point and without other marks, such as \
         1121.5 or 1.5e-6",
        cut(.0)
    )]
    SecondNumber(String),
}

/// Reads a number with a unit, or without one.
///
/// The decimal exponent of a prefix is applied to the number's text, so `"25 um"` and `2.5e-5` are the same bits.
///
/// # Errors
/// The text does not start with a finite number, or its unit is not known.
pub fn parse(text: &str) -> Result<Parsed, UnitError> {
    let text = text.trim();
    let Number { mantissa, exponent, rest } = Number::split(text).ok_or(UnitError::NoNumber)?;
    let unit_text = rest.trim();
    let unit = unit_of(unit_text)?;
    let number: f64 = format!("{mantissa}e{}", exponent.saturating_add(i64::from(unit.exponent)))
        .parse()
        .map_err(|_| UnitError::NoNumber)?;
    let value = number * unit.factor;
    if !value.is_finite() {
        return Err(UnitError::TooLarge);
    }
    if value == 0.0 && mantissa.bytes().any(|byte| (b'1'..=b'9').contains(&byte)) {
        return Err(UnitError::TooSmall);
    }
    Ok(Parsed { value, dimension: unit.dimension, has_unit: !unit_text.is_empty() })
}

/// Reads a unit alone: what 1 of it is in SI units.
///
/// # Errors
/// It is empty, or no unit.
pub fn parse_unit(text: &str) -> Result<Parsed, UnitError> {
    match text.trim() {
        "" => Err(UnitError::Malformed(String::new())),
        unit => parse(&format!("1 {unit}")),
    }
}

/// A text's number and what follows it.
struct Number<'t> {
    mantissa: &'t str,
    /// Its power of ten; what is beyond the integers is as large as these go.
    exponent: i64,
    rest: &'t str,
}

impl<'t> Number<'t> {
    fn split(text: &'t str) -> Option<Self> {
        let digits = |from: usize| from + text[from..].bytes().take_while(u8::is_ascii_digit).count();
        let start = usize::from(text.starts_with(['+', '-']));
        let mut end = digits(start);
        let mut count = end - start;
        if text[end..].starts_with('.') {
            let fraction = digits(end + 1);
            count += fraction - end - 1;
            end = fraction;
        }
        if count == 0 {
            return None;
        }
        let mantissa = &text[..end];
        // An `e` that no digits follow belongs to the unit.
        if text[end..].starts_with(['e', 'E']) {
            let sign = end + 1 + usize::from(text[end + 1..].starts_with(['+', '-']));
            let stop = digits(sign);
            if stop > sign {
                let negative = text[end + 1..].starts_with('-');
                let exponent = text[end + 1..stop].parse().unwrap_or(if negative { i64::MIN } else { i64::MAX });
                return Some(Self { mantissa, exponent, rest: &text[stop..] });
            }
        }
        Some(Self { mantissa, exponent: 0, rest: &text[end..] })
    }
}

/// The unit a text behind a number stands for; an empty one is that of plain numbers.
fn unit_of(text: &str) -> Result<Unit, UnitError> {
    // What a number goes on with where its thousands are set apart, its point is a comma, or its exponent is written `^`.
    let another = |c: char| c.is_numeric() || [',', '.', '_', '\'', '\u{2019}', '^', '+', '-'].contains(&c);
    let mut cursor = Cursor { rest: text, whole: text, depth: 0 };
    let is_one = cursor.one().is_some();
    if !is_one && text.starts_with(another) {
        return Err(UnitError::SecondNumber(text.into()));
    }
    let mut cursor = Cursor { rest: text, whole: text, depth: 0 };
    let unit = cursor.product()?;
    if cursor.rest.is_empty() { Ok(unit) } else { Err(cursor.malformed()) }
}

/// A unit: `factor` × 10^`exponent` of the SI unit of its dimension.
#[derive(Clone, Copy)]
struct Unit {
    dimension: Dimension,
    exponent: i32,
    factor: f64,
}

impl Unit {
    const ONE: Self = Self { dimension: Dimension::ONE, exponent: 0, factor: 1.0 };
}

/// Units that take prefixes: symbol, quantity's exponents (m, kg, s, K, A), power of ten to SI.
const PREFIXED: [(&str, [i32; 5], i32); 14] = [
    ("m", [1, 0, 0, 0, 0], 0),
    ("g", [0, 1, 0, 0, 0], -3),
    ("s", [0, 0, 1, 0, 0], 0),
    ("K", [0, 0, 0, 1, 0], 0),
    ("N", [1, 1, -2, 0, 0], 0),
    ("Pa", [-1, 1, -2, 0, 0], 0),
    ("J", [2, 1, -2, 0, 0], 0),
    ("W", [2, 1, -3, 0, 0], 0),
    ("Hz", [0, 0, -1, 0, 0], 0),
    ("A", [0, 0, 0, 0, 1], 0),
    ("C", [0, 0, 1, 0, 1], 0),
    ("V", [2, 1, -3, 0, -1], 0),
    ("T", [0, 1, -2, 0, -1], 0),
    ("S", [-2, -1, 3, 0, 2], 0),
];

/// Prefixes and their powers of ten; micro is also written with the micro sign and with the Greek letter.
const PREFIXES: [(char, i32); 11] = [
    ('p', -12),
    ('n', -9),
    ('u', -6),
    ('\u{b5}', -6),
    ('\u{3bc}', -6),
    ('m', -3),
    ('c', -2),
    ('k', 3),
    ('M', 6),
    ('G', 9),
    ('T', 12),
];

fn named_unit(name: &str) -> Result<Unit, UnitError> {
    let base = |name: &str| PREFIXED.iter().find(|unit| unit.0 == name);
    let unit = |&(_, [m, kg, s, k, a], exponent): &(&str, [i32; 5], i32), prefix: i32| Unit {
        dimension: Dimension { m, kg, s, k, a },
        exponent: exponent + prefix,
        factor: 1.0,
    };
    let time = |factor| Unit { dimension: TIME.dimension, exponent: 0, factor };
    match name {
        "min" => return Ok(time(60.0)),
        "h" => return Ok(time(3600.0)),
        "\u{b0}C" | "\u{2103}" | "degC" | "celsius" | "Celsius" => return Err(UnitError::Celsius),
        _ => {}
    }
    if let Some(known) = base(name) {
        return Ok(unit(known, 0));
    }
    let mut letters = name.chars();
    let prefix = letters.next().and_then(|letter| PREFIXES.iter().find(|prefix| prefix.0 == letter));
    match (prefix, base(letters.as_str())) {
        (Some(&(_, power)), Some(known)) => Ok(unit(known, power)),
        _ => Err(UnitError::Unknown(name.into())),
    }
}

/// Reads a unit: factors joined by spaces, `*` and `/` (which divides by the next factor only), powers, parentheses.
struct Cursor<'t> {
    rest: &'t str,
    whole: &'t str,
    depth: u32,
}

impl Cursor<'_> {
    fn malformed(&self) -> UnitError {
        UnitError::Malformed(self.whole.into())
    }

    fn take(&mut self, symbols: &[char]) -> Option<char> {
        self.rest = self.rest.trim_start();
        let symbol = self.rest.chars().next().filter(|c| symbols.contains(c))?;
        self.rest = &self.rest[symbol.len_utf8()..];
        Some(symbol)
    }

    /// Takes the `1` that a `/` follows: of `1/m`, never of `1 15 us`.
    fn one(&mut self) -> Option<Unit> {
        let rest = self.rest.trim_start().strip_prefix('1')?;
        rest.trim_start().starts_with('/').then(|| {
            self.rest = rest;
            Unit::ONE
        })
    }

    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut product = Unit::ONE;
        loop {
            let operator = self.take(&['/', '*', '\u{b7}', '\u{22c5}']);
            if operator.is_none() {
                self.rest = self.rest.trim_start();
                if self.rest.is_empty() || self.rest.starts_with(')') {
                    return Ok(product);
                }
                if let Some(one) = self.one() {
                    product = self.multiply(product, one, 1)?;
                    continue;
                }
            }
            let factor = self.factor()?;
            product = self.multiply(product, factor, if operator == Some('/') { -1 } else { 1 })?;
        }
    }

    fn factor(&mut self) -> Result<Unit, UnitError> {
        let unit = if self.take(&['(']).is_some() {
            // Nesting deeper than any unit needs would only serve to exhaust the stack.
            self.depth += 1;
            if self.depth > 4 {
                return Err(self.malformed());
            }
            if self.take(&[')']).is_some() {
                return Err(self.malformed());
            }
            let inner = self.product()?;
            self.take(&[')']).ok_or_else(|| self.malformed())?;
            self.depth -= 1;
            inner
        } else {
            self.rest = self.rest.trim_start();
            let letter = |c: char| c.is_alphabetic() || ['\u{b0}', '\u{2103}'].contains(&c);
            let end = self.rest.find(|c| !letter(c)).unwrap_or(self.rest.len());
            let (name, rest) = self.rest.split_at(end);
            if name.is_empty() {
                return Err(self.malformed());
            }
            self.rest = rest;
            named_unit(name)?
        };
        let power = self.power()?;
        self.multiply(Unit::ONE, unit, power)
    }

    /// `^2`, `^-1`, `²`, `³`, or the digit of `m2`; 1 where there is none.
    fn power(&mut self) -> Result<i32, UnitError> {
        for (symbol, power) in [('\u{b2}', 2), ('\u{b3}', 3)] {
            if let Some(rest) = self.rest.strip_prefix(symbol) {
                self.rest = rest;
                return Ok(power);
            }
        }
        let marked = self.rest.strip_prefix('^');
        let digits = marked.unwrap_or(self.rest);
        let negative = marked.and_then(|rest| rest.strip_prefix('-'));
        let digits = negative.unwrap_or(digits);
        match digits.chars().next().and_then(|c| c.to_digit(10)) {
            // A unit to the power of zero is none; nobody means that.
            Some(0) => Err(self.malformed()),
            Some(digit) => {
                self.rest = &digits[1..];
                let power = i32::try_from(digit).map_err(|_| self.malformed())?;
                Ok(if negative.is_some() { -power } else { power })
            }
            None if marked.is_some() => Err(self.malformed()),
            None => Ok(1),
        }
    }

    fn multiply(&self, left: Unit, right: Unit, power: i32) -> Result<Unit, UnitError> {
        let dimension = left.dimension.combine(right.dimension, power);
        let exponent = left.exponent + power * right.exponent;
        // No quantity comes near these bounds, which keep the exponents from overflowing.
        let largest =
            [dimension.m, dimension.kg, dimension.s, dimension.k, dimension.a].map(i32::abs).into_iter().max();
        if largest.unwrap_or(0) > 60 || exponent.abs() > 300 {
            return Err(self.malformed());
        }
        Ok(Unit { dimension, exponent, factor: left.factor * math::powi(right.factor, power) })
    }
}
