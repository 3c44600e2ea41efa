//! Quantities with units: `"25 um"`, `"15 W/(m K)"`, `"1.8e-5 Pa s"`, read into SI.

use crate::math;

/// Exponents of the SI base units a quantity is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension {
    /// Power of the metre.
    pub m: i32,
    /// Power of the kilogram.
    pub kg: i32,
    /// Power of the second.
    pub s: i32,
    /// Power of the kelvin.
    pub k: i32,
    /// Power of the ampere.
    pub a: i32,
}

/// What a number in a scene measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Its name: `length`.
    pub name: &'static str,
    /// The SI unit of a bare number: `m`; empty for plain numbers.
    pub unit: &'static str,
    /// An example with a unit, shown in errors.
    pub example: &'static str,
    /// Its dimension.
    pub dimension: Dimension,
}

const fn quantity(name: &'static str, unit: &'static str, example: &'static str, exponents: [i32; 4]) -> Quantity {
    let [m, kg, s, k] = exponents;
    Quantity { name, unit, example, dimension: Dimension { m, kg, s, k, a: 0 } }
}

/// A quantity whose unit holds the ampere: exponents of m, kg, s, A.
const fn electric(name: &'static str, unit: &'static str, example: &'static str, exponents: [i32; 4]) -> Quantity {
    let [m, kg, s, a] = exponents;
    Quantity { name, unit, example, dimension: Dimension { m, kg, s, k: 0, a } }
}

/// A number without a unit.
pub const NUMBER: Quantity = quantity("number", "", "0.5", [0, 0, 0, 0]);
/// A length.
pub const LENGTH: Quantity = quantity("length", "m", "25 um", [1, 0, 0, 0]);
/// A time.
pub const TIME: Quantity = quantity("time", "s", "20 ms", [0, 0, 1, 0]);
/// A speed or a component of a velocity.
pub const SPEED: Quantity = quantity("speed", "m/s", "0.5 m/s", [1, 0, -1, 0]);
/// An acceleration.
pub const ACCELERATION: Quantity = quantity("acceleration", "m/s^2", "9.81 m/s^2", [1, 0, -2, 0]);
/// A frequency.
pub const FREQUENCY: Quantity = quantity("frequency", "Hz", "50 Hz", [0, 0, -1, 0]);
/// A mass.
pub const MASS: Quantity = quantity("mass", "kg", "1 kg", [0, 1, 0, 0]);
/// A force.
pub const FORCE: Quantity = quantity("force", "N", "1 N", [1, 1, -2, 0]);
/// A damping: a force per speed.
pub const DAMPING: Quantity = quantity("damping", "N s/m", "10 N s/m", [0, 1, -1, 0]);
/// A power per area.
pub const INTENSITY: Quantity = quantity("intensity", "W/m^2", "1e5 W/m^2", [0, 1, -3, 0]);
/// An absolute temperature.
pub const TEMPERATURE: Quantity = quantity("temperature", "K", "320 K", [0, 0, 0, 1]);
/// A power.
pub const POWER: Quantity = quantity("power", "W", "40 W", [2, 1, -3, 0]);
/// A pressure, stiffness or modulus.
pub const PRESSURE: Quantity = quantity("pressure", "Pa", "1e9 Pa", [-1, 1, -2, 0]);
/// A mass density.
pub const DENSITY: Quantity = quantity("density", "kg/m^3", "7950 kg/m^3", [-3, 1, 0, 0]);
/// A specific heat capacity.
pub const HEAT_CAPACITY: Quantity = quantity("heat capacity", "J/(kg K)", "500 J/(kg K)", [2, 0, -2, -1]);
/// A latent heat.
pub const LATENT_HEAT: Quantity = quantity("latent heat", "J/kg", "260 kJ/kg", [2, 0, -2, 0]);
/// A coefficient of heat transfer.
pub const HEAT_TRANSFER: Quantity = quantity("heat transfer", "W/(m^2 K)", "20 W/(m^2 K)", [0, 1, -3, -1]);
/// A thermal conductivity.
pub const CONDUCTIVITY: Quantity = quantity("conductivity", "W/(m K)", "15 W/(m K)", [1, 1, -3, -1]);
/// A dynamic viscosity.
pub const VISCOSITY: Quantity = quantity("viscosity", "Pa s", "1.8e-5 Pa s", [-1, 1, -1, 0]);
/// A reciprocal length: absorption of light, decay of a profile.
pub const PER_LENGTH: Quantity = quantity("reciprocal length", "1/m", "1e4 1/m", [-1, 0, 0, 0]);
/// Events per time.
pub const RATE: Quantity = quantity("rate", "1/s", "1e5 1/s", [0, 0, -1, 0]);
/// A mass per time.
pub const MASS_FLOW: Quantity = quantity("mass flow", "kg/s", "2 g/s", [0, 1, -1, 0]);
/// A damping per contact area.
pub const AREA_DAMPING: Quantity = quantity("damping per area", "N s/m^3", "1e5 N s/m^3", [-2, 1, -1, 0]);
/// A stiffness against sliding per contact area.
pub const AREA_STIFFNESS: Quantity = quantity("stiffness per area", "N/m^3", "1e12 N/m^3", [-2, 1, -2, 0]);

/// A stiffness of a spring.
pub const SPRING_STIFFNESS: Quantity = quantity("spring stiffness", "N/m", "1e5 N/m", [0, 1, -2, 0]);
/// An electric charge.
pub const CHARGE: Quantity = electric("charge", "C", "1e-12 C", [0, 0, 1, 1]);
/// An electric charge per mass.
pub const CHARGE_PER_MASS: Quantity = electric("charge per mass", "C/kg", "1e-3 C/kg", [0, -1, 1, 1]);
/// An electric charge per area.
pub const CHARGE_PER_AREA: Quantity = electric("charge per area", "C/m^2", "1e-5 C/m^2", [-2, 0, 1, 1]);
/// An electric charge per volume.
pub const CHARGE_PER_VOLUME: Quantity = electric("charge per volume", "C/m^3", "10 C/m^3", [-3, 0, 1, 1]);
/// An electric field.
pub const ELECTRIC_FIELD: Quantity = electric("electric field", "V/m", "2 kV/mm", [1, 1, -3, -1]);
/// A magnetic flux density.
pub const MAGNETIC_FIELD: Quantity = electric("magnetic field", "T", "50 mT", [0, 1, -2, -1]);
/// A gradient of a magnetic flux density.
pub const MAGNETIC_GRADIENT: Quantity = electric("magnetic field gradient", "T/m", "10 T/m", [-1, 1, -2, -1]);
/// A magnetic dipole moment.
pub const MAGNETIC_MOMENT: Quantity = electric("magnetic moment", "A m^2", "1.2 A m^2", [2, 0, 0, 1]);
/// Magnetisability γ per volume: a force per volume over the gradient of B·B.
pub const MAGNETISABILITY: Quantity = electric("magnetisability", "A^2/N", "4e5 A^2/N", [-1, -1, 2, 2]);

/// An electric current.
pub const CURRENT: Quantity = electric("current", "A", "1 A", [0, 0, 0, 1]);
/// An electric current per area.
pub const CURRENT_DENSITY: Quantity = electric("current density", "A/m^2", "1e5 A/m^2", [-2, 0, 0, 1]);
/// An electric potential.
pub const VOLTAGE: Quantity = electric("voltage", "V", "1 V", [2, 1, -3, -1]);
/// An electrical conductivity.
pub const ELECTRICAL_CONDUCTIVITY: Quantity = electric("electrical conductivity", "S/m", "1e6 S/m", [-3, -1, 3, 2]);
/// A reciprocal electric field.
pub const PER_ELECTRIC_FIELD: Quantity = electric("reciprocal electric field", "m/V", "1e-4 m/V", [-1, -1, 3, 1]);
/// A reciprocal temperature.
pub const PER_TEMPERATURE: Quantity = quantity("reciprocal temperature", "1/K", "0.01 1/K", [0, 0, 0, -1]);

/// All quantities that have a name in messages; the last ones occur only as a wrong dimension.
const NAMED: &[Quantity] = &[
    NUMBER,
    LENGTH,
    TIME,
    SPEED,
    ACCELERATION,
    TEMPERATURE,
    POWER,
    PRESSURE,
    DENSITY,
    HEAT_CAPACITY,
    LATENT_HEAT,
    HEAT_TRANSFER,
    CONDUCTIVITY,
    VISCOSITY,
    PER_LENGTH,
    AREA_DAMPING,
    AREA_STIFFNESS,
    SPRING_STIFFNESS,
    CHARGE,
    CHARGE_PER_MASS,
    CHARGE_PER_AREA,
    CHARGE_PER_VOLUME,
    ELECTRIC_FIELD,
    MAGNETIC_FIELD,
    MAGNETIC_GRADIENT,
    MAGNETIC_MOMENT,
    MAGNETISABILITY,
    CURRENT,
    CURRENT_DENSITY,
    VOLTAGE,
    ELECTRICAL_CONDUCTIVITY,
    PER_ELECTRIC_FIELD,
    PER_TEMPERATURE,
    MASS,
    FORCE,
    FREQUENCY,
    DAMPING,
    quantity("energy", "J", "1 J", [2, 1, -2, 0]),
    INTENSITY,
];

impl Quantity {
    /// The name with its article: `a length`, `an acceleration`.
    #[must_use]
    pub fn with_article(&self) -> String {
        let article = if self.name.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
        format!("{article} {}", self.name)
    }
}

impl Dimension {
    const ONE: Self = NUMBER.dimension;

    /// What a quantity of this dimension is called, with its article: `a power`; else its base units.
    #[must_use]
    pub fn describe(self) -> String {
        if let Some(known) = NAMED.iter().find(|quantity| quantity.dimension == self) {
            return known.with_article();
        }
        let powers = [("kg", self.kg), ("m", self.m), ("s", self.s), ("K", self.k), ("A", self.a)];
        let factor = |(unit, power): (&str, i32)| if power == 1 { unit.to_owned() } else { format!("{unit}^{power}") };
        let factors: Vec<String> = powers.iter().filter(|(_, power)| *power != 0).map(|pair| factor(*pair)).collect();
        format!("in {}", factors.join(" "))
    }

    fn combine(self, other: Self, power: i32) -> Self {
        Self {
            m: self.m + power * other.m,
            kg: self.kg + power * other.kg,
            s: self.s + power * other.s,
            k: self.k + power * other.k,
            a: self.a + power * other.a,
        }
    }
}

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
    /// A unit that is not known.
    #[error("no unit is called `{0}`")]
    Unknown(String),
    /// Degrees Celsius: an offset scale, which does not combine with others.
    #[error("temperatures are in kelvin: 20 degrees Celsius are 293.15 K")]
    Celsius,
    /// The unit's parts do not fit together.
    #[error("the unit `{0}` cannot be read")]
    Malformed(String),
}

/// Reads a number with a unit, or without one.
///
/// The decimal exponent of a prefix is applied to the number's text, so `"25 um"` and `2.5e-5` are the same bits.
///
/// # Errors
/// The text does not start with a finite number, or its unit is not known.
pub fn parse(text: &str) -> Result<Parsed, UnitError> {
    let text = text.trim();
    let (mantissa, exponent, rest) = split_number(text).ok_or(UnitError::NoNumber)?;
    let unit_text = rest.trim();
    let mut cursor = Cursor { rest: unit_text, whole: unit_text, depth: 0 };
    let unit = cursor.product()?;
    if !cursor.rest.is_empty() {
        return Err(cursor.malformed());
    }
    let number: f64 = format!("{mantissa}e{}", exponent.saturating_add(i64::from(unit.exponent)))
        .parse()
        .map_err(|_| UnitError::NoNumber)?;
    let value = number * unit.factor;
    if !value.is_finite() {
        return Err(UnitError::TooLarge);
    }
    Ok(Parsed { value, dimension: unit.dimension, has_unit: !unit_text.is_empty() })
}

/// Splits a text into mantissa, decimal exponent and the rest.
fn split_number(text: &str) -> Option<(&str, i64, &str)> {
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
            return Some((mantissa, text[end + 1..stop].parse().ok()?, &text[stop..]));
        }
    }
    Some((mantissa, 0, &text[end..]))
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
        "\u{b0}C" | "degC" | "celsius" | "Celsius" => return Err(UnitError::Celsius),
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

    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut product = Unit::ONE;
        loop {
            let operator = self.take(&['/', '*', '\u{b7}', '\u{22c5}']);
            if operator.is_none() && (self.rest.is_empty() || self.rest.starts_with(')')) {
                return Ok(product);
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
            let inner = self.product()?;
            self.take(&[')']).ok_or_else(|| self.malformed())?;
            self.depth -= 1;
            inner
        } else if self.take(&['1']).is_some() {
            Unit::ONE
        } else {
            let end = self.rest.find(|c: char| !c.is_alphabetic() && c != '\u{b0}').unwrap_or(self.rest.len());
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn units_of_scenes_are_read_bit_for_bit_as_the_bare_number() {
        for (text, value, quantity) in [
            ("25 um", 2.5e-5f64, LENGTH),
            ("25um", 2.5e-5, LENGTH),
            ("25 \u{b5}m", 2.5e-5, LENGTH),
            ("0.5 m/s", 0.5, SPEED),
            ("0.5 m s^-1", 0.5, SPEED),
            ("500 mm/s", 0.5, SPEED),
            ("40 W", 40.0, POWER),
            ("320 K", 320.0, TEMPERATURE),
            ("15 W/(m K)", 15.0, CONDUCTIVITY),
            ("100 C/kg", 100.0, CHARGE_PER_MASS),
            ("3 pC", 3e-12, CHARGE),
            ("-100 N/C", -100.0, ELECTRIC_FIELD),
            ("50 mT", 0.05, MAGNETIC_FIELD),
            ("2 kV/mm", 2e6, ELECTRIC_FIELD),
            ("1.3 MS/m", 1.3e6, ELECTRICAL_CONDUCTIVITY),
            ("15 W/m/K", 15.0, CONDUCTIVITY),
            ("500 J/kg/K", 500.0, HEAT_CAPACITY),
            ("1.8e-5 Pa s", 1.8e-5, VISCOSITY),
            ("20 ms", 0.02, TIME),
            ("2 min", 120.0, TIME),
            ("9.81 m/s^2", 9.81, ACCELERATION),
            ("9.81 m/s\u{b2}", 9.81, ACCELERATION),
            ("193 GPa", 1.93e11, PRESSURE),
            ("7.95 g/cm^3", 7950.0, DENSITY),
            ("1e4 1/m", 1e4, PER_LENGTH),
            ("10 1/mm", 1e4, PER_LENGTH),
            ("1e12 N/m^3", 1e12, AREA_STIFFNESS),
            ("-.5", -0.5, NUMBER),
        ] {
            let parsed = parse(text).unwrap();
            assert_eq!(parsed.value.to_bits(), value.to_bits(), "{text}: {}", parsed.value);
            assert_eq!(parsed.dimension, quantity.dimension, "{text}");
        }
        assert_eq!(parse("1e5 W/m^2").unwrap().dimension.describe(), "an intensity");
        assert_eq!(parse("1 m^2 K").unwrap().dimension.describe(), "in m^2 K");
    }

    #[test]
    fn every_example_has_the_dimension_and_the_unit_it_stands_for() {
        for quantity in NAMED {
            assert_eq!(parse(quantity.example).unwrap().dimension, quantity.dimension, "{}", quantity.name);
            let one = parse(&format!("1 {}", quantity.unit)).unwrap().value;
            assert_eq!(one.to_bits(), 1f64.to_bits(), "{}", quantity.name);
        }
    }

    #[test]
    fn what_is_no_quantity_says_why() {
        assert_eq!(parse("fast"), Err(UnitError::NoNumber));
        assert_eq!(parse("."), Err(UnitError::NoNumber));
        assert_eq!(parse("1e999 m"), Err(UnitError::TooLarge));
        assert_eq!(parse("3 furlong"), Err(UnitError::Unknown("furlong".into())));
        assert_eq!(parse("20 \u{b0}C"), Err(UnitError::Celsius));
        for text in ["1 m/", "1 (m", "1 m)", "1 m^", "1 ((((((m))))))", "1 m^9^9", "1 (m^9)^9"] {
            assert!(matches!(parse(text), Err(UnitError::Malformed(_))), "{text}");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in ".*") {
            let _ = parse(&text);
        }

        #[test]
        fn no_unit_makes_it_panic(text in "[0-9.eE+-]{0,6}[ umkgsKNPaJWHzACVT/*()^0-9.-]{0,40}") {
            if let Ok(parsed) = parse(&text) {
                prop_assert!(parsed.value.is_finite());
            }
        }

        #[test]
        fn a_prefix_is_its_power_of_ten(value in -1e6f64..1e6) {
            let plain: f64 = format!("{value:e}").parse().unwrap();
            prop_assert_eq!(parse(&format!("{value:e} m")).unwrap().value.to_bits(), plain.to_bits());
            let milli = parse(&format!("{value:e} mm")).unwrap().value;
            // Correctly rounded against one rounding of 1e-3 and one of the product.
            prop_assert!((milli - value * 1e-3).abs() <= 2.0 * f64::EPSILON * milli.abs());
        }
    }
}
