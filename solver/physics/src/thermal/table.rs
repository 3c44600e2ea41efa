//! A property that depends on temperature, as a table.

use serde::Serialize;
use stagger_coupling::SolveError;

use super::NODE;
use crate::common::checks::setting;

/// A property that depends on temperature: linear between its points, constant beyond them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// Temperature in K and value, temperatures rising; at least one point, and one is a constant.
    pub points: Vec<[f64; 2]>,
}

impl Table {
    /// One value for every temperature.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self { points: vec![[0.0, value]] }
    }

    /// Whether one value holds for every temperature.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.points.iter().all(|point| point[1].to_bits() == self.points[0][1].to_bits())
    }

    /// The value at a temperature in K.
    #[must_use]
    pub fn at(&self, temperature_k: f64) -> f64 {
        let next = self.points.partition_point(|point| point[0] <= temperature_k);
        let [before, after] = [next.saturating_sub(1), next.min(self.points.len() - 1)].map(|place| self.points[place]);
        let width_k = after[0] - before[0];
        if width_k <= 0.0 {
            before[1]
        } else {
            before[1] + (temperature_k - before[0]) / width_k * (after[1] - before[1])
        }
    }

    /// Refuses a table without points, with points that do not rise, or with a value for which `fits` is false.
    pub(super) fn check(&self, what: &str, fits: impl Fn(f64) -> bool, expected: &str) -> Result<(), SolveError> {
        if self.points.is_empty() {
            return Err(SolveError::Start(format!("{NODE}: {what} has no values, but needs at least one")));
        }
        for &[temperature_k, value] in &self.points {
            setting(NODE, what, value, value.is_finite() && fits(value), expected)?;
            let of = format!("temperature of {what}");
            setting(NODE, &of, temperature_k, temperature_k.is_finite() && temperature_k >= 0.0, "at least 0 K")?;
        }
        match self.points.array_windows().find(|[a, b]| b[0] <= a[0]) {
            None => Ok(()),
            Some([a, b]) => Err(SolveError::Start(format!(
                "{NODE}: temperatures of {what} must rise, but {} K follows {} K",
                b[0], a[0]
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_linear_between_points_and_constant_beyond() {
        let table = Table { points: vec![[300.0, 500.0], [500.0, 600.0], [900.0, 400.0]] };
        for (at_k, value) in
            [(0.0, 500.0), (300.0, 500.0), (400.0, 550.0), (500.0, 600.0), (700.0, 500.0), (900.0, 400.0), (5e3, 400.0)]
        {
            assert_eq!(table.at(at_k), value, "{at_k} K");
        }
        assert!(!table.is_constant() && Table::constant(3.0).is_constant());
        assert_eq!(Table::constant(3.0).at(800.0), 3.0);
    }
}
