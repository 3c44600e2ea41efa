//! Properties over temperature: one number, or a list of pairs of a temperature and a number.

use super::{
    key::{Kind, Range},
    node_values::{Mismatch, mismatch, show, si_value},
    tree::{Item, Node},
    units::{Quantity, TEMPERATURE},
};
use stagger_messages::Shown;

/// Pairs of a temperature in K, rising, and a value in SI units; one number stands for one at 0 K.
pub fn read(node: &Node, quantity: &Quantity, range: Range) -> Result<Vec<[f64; 2]>, Mismatch> {
    let number = |node: &Node, quantity: &Quantity, range: Range| {
        let (value, found) = si_value(node, quantity)?;
        if range.contains(value) { Ok(value) } else { Err((found, None)) }
    };
    let Item::List(list) = &node.item else { return Ok(vec![[0.0, number(node, quantity, range)?]]) };
    let mut points: Vec<[f64; 2]> = Vec::with_capacity(list.len());
    for (place, entry) in (1..).zip(list) {
        let told = |(found, hint)| (format!("{found} in pair {place}"), hint);
        let Item::List(pair) = &entry.item else { return Err(told(mismatch(entry))) };
        let [temperature, value] = pair.as_slice() else {
            return Err(told((format!("a list of {}", pair.len()), None)));
        };
        let temperature_k = number(temperature, &TEMPERATURE, Range::NOT_NEGATIVE).map_err(told)?;
        if points.last().is_some_and(|last| last[0] >= temperature_k) {
            return Err(told((format!("{} K, which does not rise,", Shown(temperature_k)), None)));
        }
        points.push([temperature_k, number(value, quantity, range).map_err(told)?]);
    }
    if points.is_empty() { Err(("an empty list".into(), None)) } else { Ok(points) }
}

/// The pairs as `check` shows them: `300 K: 500 J/(kg K), 1000 K: 600 J/(kg K)`.
pub fn shown(list: &[Node], quantity: &'static Quantity, range: Range) -> String {
    let pair = |pair: &Node| match &pair.item {
        Item::List(pair) => {
            let value = |(node, quantity)| show(&Kind::Number(quantity, range), node);
            pair.iter().zip([&TEMPERATURE, quantity]).map(value).collect::<Vec<_>>().join(": ")
        }
        other => other.describe(),
    };
    list.iter().map(pair).collect::<Vec<_>>().join(", ")
}
