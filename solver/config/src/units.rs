//! Quantities: what the numbers of a scene measure, and their SI units. [`parse`] reads them from texts.

mod text;

pub use text::{Parsed, UnitError, parse, parse_unit};

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
        for text in ["1e-400 m", "0.0001e-400", "1e-99999999999999999999 m"] {
            assert_eq!(parse(text), Err(UnitError::TooSmall), "{text}");
        }
        assert_eq!(parse("1e99999999999999999999 m"), Err(UnitError::TooLarge));
        assert_eq!(parse("0e-400 m").map(|parsed| parsed.value), Ok(0.0));
        for text in [
            "1 m/",
            "1 (m",
            "1 m)",
            "1 m^",
            "1 um^-",
            "1 m^ 2",
            "1 m^0",
            "1 m0",
            "1 m//s",
            "1 m/1",
            "1 m/1/s",
            "1 ()",
            "1 m ()",
            "1 ((((((m))))))",
            "1 m^9^9",
            "1 (m^9)^9",
            "1 m^12",
            "1 m s-1",
            "1 m,",
            "1 m 2",
            "1 m .5",
            "1/1 m",
            "1 % m",
        ] {
            assert!(matches!(parse(text), Err(UnitError::Malformed(_))), "{text}: {:?}", parse(text));
        }
        for text in
            ["inf m", "nan K", "-inf", "- 5 m", "+-5 m", "\u{ff11} m", "\u{2212}5 m", "m", "e5 m", "^-6 m", ",5 m"]
        {
            assert_eq!(parse(text), Err(UnitError::NoNumber), "{text}");
        }
        assert_eq!(parse_unit(""), Err(UnitError::Malformed(String::new())));
        assert!(matches!(parse_unit("5 um"), Err(UnitError::SecondNumber(_))));
        assert_eq!(parse_unit("um").map(|unit| unit.value), Ok(1e-6));
    }

    /// A space between thousands, a decimal comma, a power of ten: each was once read as the number before it.
    #[test]
    fn a_number_in_pieces_is_refused_whole() {
        for (text, rest) in [
            ("1 15 us", "15 us"),
            ("1 121 um", "121 um"),
            ("1\u{a0}121 um", "121 um"),
            ("1\u{202f}121 um", "121 um"),
            ("2 151 K", "151 K"),
            ("5 5", "5"),
            ("5 1", "1"),
            ("5 1 m", "1 m"),
            ("1e3 1e3 m", "1e3 m"),
            ("10^-6 m", "^-6 m"),
            ("1_000 um", "_000 um"),
            ("1,5 mm", ",5 mm"),
            ("1'000 mm", "'000 mm"),
            ("1.5.2 mm", ".2 mm"),
            ("1 1/2 m", "1/2 m"),
            ("1 \u{bd} m", "\u{bd} m"),
            ("5 -3 m", "-3 m"),
            ("5+3 m", "+3 m"),
        ] {
            match parse(text) {
                Err(UnitError::SecondNumber(found)) => assert_eq!(found, rest, "{text}"),
                Err(UnitError::Malformed(found)) if text.contains('/') => assert_eq!(found, rest, "{text}"),
                other => panic!("{text}: {other:?}"),
            }
        }
        let told = parse("1 121 um").unwrap_err().to_string();
        assert!(told.starts_with("the unit `121 um` cannot be read; a number is written in one piece"), "{told}");
        for (text, value) in
            [("1 1/m", 1.0), ("10 1/ mm", 1e4), ("7 (1/m)", 7.0), ("2 W 1/(m K)", 2.0), ("+5m", 5.0), ("3/m", 3.0)]
        {
            assert_eq!(parse(text).map(|parsed| parsed.value), Ok(value), "{text}");
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

        /// What is read is what the library's own parser makes of the number, and a unit of SI leaves it alone.
        #[test]
        fn what_is_accepted_is_the_number_it_begins_with(
            number in "[+-]?([0-9]{1,20}([.][0-9]{0,20})?|[.][0-9]{1,20})([eE][+-]?[0-9]{1,3})?",
            blanks in " {0,3}",
            unit in "(m|s|K|Pa|m/s|1/m|W/(m K)|N s/m|m2|)",
        ) {
            let expected: f64 = number.parse().unwrap();
            // Written together, a number and the `1` of `1/m` are one number.
            let blanks = if unit == "1/m" { " " } else { blanks.as_str() };
            match parse(&format!("{number}{blanks}{unit}")) {
                Ok(parsed) => {
                    prop_assert_eq!(parsed.value.to_bits(), expected.to_bits());
                    let again = parse(&format!("{:e} {unit}", parsed.value)).unwrap();
                    prop_assert_eq!(again, Parsed { has_unit: !unit.is_empty(), ..parsed });
                }
                Err(UnitError::TooLarge) => prop_assert!(expected.is_infinite()),
                Err(UnitError::TooSmall) => prop_assert!(expected == 0.0),
                Err(other) => prop_assert!(false, "{}", other),
            }
        }

        #[test]
        fn two_numbers_are_none(
            first in "[+-]?[0-9]{1,4}([.][0-9]{0,3})?(e[+-]?[0-9])?",
            blanks in "[ \t\u{a0}\u{202f}]{1,3}",
            second in "[+-]?[0-9]{1,4}([.][0-9]{0,3})?(e[+-]?[0-9])?",
            unit in " ?(m|um|K|us|W/(m K)|m 3|)",
        ) {
            let text = format!("{first}{blanks}{second}{unit}");
            prop_assert!(parse(&text).is_err(), "{}", text);
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
