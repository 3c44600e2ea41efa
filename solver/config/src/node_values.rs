//! What one value of a scene holds, in SI units, and how it is shown.

use super::{
    key::{Kind, Range},
    over_temperature,
    problems::{cut, quoted},
    tree::{Item, Node},
    units::{self, Quantity},
};
use stagger_messages::Shown;

/// What was found instead of what was expected, and perhaps what to do.
pub type Mismatch = (String, Option<String>);

/// What stands there, where something else was expected.
pub fn mismatch(node: &Node) -> Mismatch {
    (node.item.describe(), None)
}

/// A whole number from `low` to `high`.
///
/// # Errors
/// It is something else.
pub fn whole(node: &Node, low: u64, high: u64) -> Result<u64, Mismatch> {
    let Item::Integer(value, _) = node.item else { return Err(mismatch(node)) };
    u64::try_from(value).ok().filter(|value| (low..=high).contains(value)).ok_or_else(|| mismatch(node))
}

/// Three numbers of a quantity, in SI units.
///
/// # Errors
/// It is something else.
pub fn vector(node: &Node, quantity: &Quantity) -> Result<[f64; 3], Mismatch> {
    let Item::List(list) = &node.item else { return Err(mismatch(node)) };
    let [x, y, z] = list.as_slice() else { return Err((format!("a list of {}", list.len()), None)) };
    let component = |number: usize, node: &Node| match si_value(node, quantity) {
        Ok((value, _)) if value.is_finite() => Ok(value),
        Ok((_, found)) => Err((format!("{found} as component {number}"), None)),
        Err((found, hint)) => Err((format!("{found} as component {number}"), hint)),
    };
    Ok([component(1, x)?, component(2, y)?, component(3, z)?])
}

/// A text.
///
/// # Errors
/// It is something else.
pub fn text(node: &Node) -> Result<String, Mismatch> {
    match &node.item {
        Item::Text(text) => Ok(text.clone()),
        _ => Err(mismatch(node)),
    }
}

/// The value in SI units, and how a message names it; a bare number is SI, a text carries its unit.
pub fn si_value(node: &Node, quantity: &Quantity) -> Result<(f64, String), Mismatch> {
    let text = match &node.item {
        // Every whole number a scene can sensibly hold is exact in binary64.
        Item::Integer(value, spelling) => return Ok((*value as f64, cut(spelling).into_owned())),
        Item::Float(value, spelling) => return Ok((*value, cut(spelling).into_owned())),
        Item::Text(text) => text,
        _ => return Err(mismatch(node)),
    };
    let parsed = units::parse(text).map_err(|error| (format!("{} ({error})", quoted(text)), None))?;
    // Zero is zero in every unit.
    if parsed.dimension == quantity.dimension || (!parsed.has_unit && parsed.value == 0.0) {
        return Ok((parsed.value, cut(text).into_owned()));
    }
    if parsed.dimension == units::CHARGE.dimension && *quantity == units::TEMPERATURE {
        return Err((
            format!("{} ({})", cut(text), parsed.dimension.describe()),
            Some(units::UnitError::Celsius.to_string()),
        ));
    }
    if parsed.has_unit {
        return Err((format!("{} ({})", cut(text), parsed.dimension.describe()), None));
    }
    let hint = format!("write \"{} {}\"; a number without quotes is in SI units", cut(text), quantity.unit);
    Err((format!("{} without a unit", quoted(text)), Some(hint)))
}

/// The numbers a value holds, in SI units; none in a text, a choice or a flag.
pub fn numbers_in(kind: &Kind, node: &Node) -> Vec<f64> {
    match (kind, &node.item) {
        (Kind::Number(quantity, _), _) => si_value(node, quantity).into_iter().map(|(value, _)| value).collect(),
        // To 53 bits: a longer seed is exact in its text.
        (Kind::Whole(..), Item::Integer(value, _)) => vec![*value as f64],
        (Kind::Vectors(quantity), Item::List(list)) => {
            list.iter().flat_map(|node| numbers_in(&Kind::Vector(quantity), node)).collect()
        }
        (Kind::Vector(quantity) | Kind::Series(quantity, _), Item::List(list)) => {
            list.iter().filter_map(|node| si_value(node, quantity).ok()).map(|(value, _)| value).collect()
        }
        (Kind::Series(quantity, range), _) => numbers_in(&Kind::Number(quantity, *range), node),
        (Kind::OverTemperature(quantity, range), _) => {
            over_temperature::read(node, quantity, *range).into_iter().flatten().map(|[_, value]| value).collect()
        }
        _ => Vec::new(),
    }
}

/// A value as `check` shows it: as it was written, with the SI unit where it had none.
pub fn show(kind: &Kind, node: &Node) -> String {
    match (kind, &node.item) {
        (Kind::Number(quantity, _), Item::Float(_, number) | Item::Integer(_, number)) => {
            format!("{number} {}", quantity.unit).trim_end().into()
        }
        (Kind::Number(..) | Kind::Text | Kind::File | Kind::Choice(_), Item::Text(text)) => text.clone(),
        (Kind::Vectors(quantity), Item::List(list)) => {
            format!("[{}]", list.iter().map(|node| show(&Kind::Vector(quantity), node)).collect::<Vec<_>>().join(", "))
        }
        (Kind::Series(quantity, range) | Kind::OverTemperature(quantity, range), item)
            if !matches!(item, Item::List(_)) =>
        {
            show(&Kind::Number(quantity, *range), node)
        }
        (Kind::OverTemperature(quantity, range), Item::List(list)) => over_temperature::shown(list, quantity, *range),
        (Kind::Vector(quantity) | Kind::Series(quantity, _), Item::List(list)) => {
            let texts = list.iter().any(|node| matches!(node.item, Item::Text(_)));
            let kind = Kind::Number(if texts { quantity } else { &units::NUMBER }, Range::ANY);
            let shown = list.iter().map(|node| show(&kind, node)).collect::<Vec<_>>().join(", ");
            format!("[{shown}] {}", if texts { "" } else { quantity.unit }).trim_end().into()
        }
        (Kind::Texts, Item::List(list)) => {
            format!("[{}]", list.iter().map(|node| node.item.describe()).collect::<Vec<_>>().join(", "))
        }
        (_, item) => item.describe(),
    }
}

/// A computed value, to six digits.
pub fn show_si(value: f64, quantity: &Quantity) -> String {
    format!("{} {}", Shown(value), quantity.unit).trim_end().into()
}
