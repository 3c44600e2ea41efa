//! Axes: from values to places, with ticks at round numbers.

use super::quantity::{Scaled, minus, number as number_text, power_of_ten, scaled};

/// Room beyond the values on a linear axis, as a share of what they span.
const ROOM: f64 = 0.04;

/// How values are laid along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; values that are not positive have no place.
    Log,
}

/// What an axis shows.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// The quantity in words.
    pub label: String,
    /// Its SI unit, `1` for pure numbers; values are given in it.
    pub unit: String,
    /// How values are laid along it.
    pub scale: Scale,
    /// Values that belong to it whatever is shown. Where one of them is its end, the axis has no room beyond.
    pub holds: Vec<f64>,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn linear(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), ..Self::default() }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), scale: Scale::Log, holds: Vec::new() }
    }

    /// The same axis, with some values on it whatever is shown.
    #[must_use]
    pub fn with(mut self, values: &[f64]) -> Self {
        self.holds.extend(values);
        self
    }

    /// Whether a value has a place on the axis.
    #[must_use]
    pub fn shows(&self, value: f64) -> bool {
        value.is_finite() && (self.scale == Scale::Linear || value > 0.0)
    }

    /// Lays the axis over the values it shows, with about `ticks` ticks.
    #[must_use]
    pub fn over(&self, values: impl Iterator<Item = f64>, ticks: usize) -> Ruler {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.chain(self.holds.iter().copied()).filter(|value| self.shows(*value)) {
            (low, high) = (low.min(value), high.max(value));
        }
        match self.scale {
            Scale::Linear => self.linear_over(low, high, ticks.max(2)),
            Scale::Log => self.log_over(low, high, ticks.max(2)),
        }
    }

    fn linear_over(&self, mut low: f64, mut high: f64, ticks: usize) -> Ruler {
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        let room = if high / 2.0 - low / 2.0 <= 1e-12 * low.abs().max(high.abs()) {
            // All equal.
            if low == 0.0 { 1.0 } else { 0.1 * low.abs() }
        } else {
            ROOM * (high - low)
        };
        // The room may be beyond the largest number there is.
        let room = if room.is_finite() { room } else { 0.0 };
        let ends = [low, high].map(|end| self.holds.contains(&end));
        if !ends[0] || (ends[1] && low == high && low != 0.0) {
            low -= room;
        }
        if !ends[1] || low == high {
            high += room;
        }
        let Scaled { divisor, unit } = scaled(&self.unit, low.abs().max(high.abs()));
        let step = round_step(high / divisor / ticks as f64 - low / divisor / ticks as f64);
        // A hair is allowed for, so that a value at a mark has it.
        let (first, last) = ((low / divisor / step - 1e-9).ceil(), (high / divisor / step + 1e-9).floor());
        let decimals = (-step.log10().floor()).clamp(0.0, 15.0) as usize;
        let count = (last - first).clamp(0.0, 4.0 * ticks as f64) as u32;
        let ticks = (0..=count).map(|number| {
            let value = (first + f64::from(number)) * step;
            // No "−0".
            let value = if value == 0.0 { 0.0 } else { value };
            let plain = (1e-6..1e7).contains(&step);
            let label = if plain { minus(&format!("{value:.decimals$}")) } else { number_text(value) };
            Tick { at: value * divisor, label }
        });
        let title = title(&self.label, &unit);
        Ruler { low, high, scale: Scale::Linear, ticks: ticks.collect(), title }
    }

    fn log_over(&self, low: f64, high: f64, ticks: usize) -> Ruler {
        let (low, high) = if low > high { (0.1, 1.0) } else { (low, high) };
        // A hair is allowed for, so that a value at a decade does not open the next.
        let (first, mut last) = ((low.log10() + 1e-9).floor() as i32, (high.log10() - 1e-9).ceil() as i32);
        last = last.max(first + 1);
        let every = ((last - first) as usize).div_ceil(ticks).max(1);
        let mut found: Vec<Tick> = (first..=last)
            .step_by(every)
            .map(|exponent| Tick { at: 10f64.powi(exponent), label: power_of_ten(exponent) })
            .collect();
        if last - first <= 2 {
            let between = (first..last).flat_map(|exponent| {
                [2, 5].map(|digit| Tick {
                    at: f64::from(digit) * 10f64.powi(exponent),
                    label: format!("{digit}·{}", power_of_ten(exponent)),
                })
            });
            found.extend(between);
            found.sort_by(|a, b| a.at.total_cmp(&b.at));
        }
        let Scaled { unit, .. } = scaled(&self.unit, 1.0);
        let title = title(&self.label, &unit);
        Ruler { low: 10f64.powi(first), high: 10f64.powi(last), scale: Scale::Log, ticks: found, title }
    }
}

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// The value it stands at, in the axis's SI unit.
    pub at: f64,
    /// What is written there, in the ruler's unit.
    pub label: String,
}

/// An axis laid over a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Ruler {
    /// Value at its start.
    pub low: f64,
    /// Value at its end.
    pub high: f64,
    /// How values are laid along it.
    pub scale: Scale,
    /// Its marks from low to high.
    pub ticks: Vec<Tick>,
    /// What it shows, with the unit of its numbers.
    pub title: String,
}

impl Ruler {
    /// Place of a value, 0 at the start and 1 at the end; `None` where it has none.
    #[must_use]
    pub fn place(&self, value: f64) -> Option<f64> {
        let (value, low, high) = match self.scale {
            Scale::Linear => (value, self.low, self.high),
            Scale::Log => (value.log10(), self.low.log10(), self.high.log10()),
        };
        // Halves, so that a difference of the largest numbers there are does not overflow.
        let (above, width) = (value / 2.0 - low / 2.0, high / 2.0 - low / 2.0);
        (value.is_finite() && width > 0.0).then(|| above / width)
    }
}

fn title(label: &str, unit: &str) -> String {
    if unit.is_empty() { label.into() } else { format!("{label} [{unit}]") }
}

/// The least of 1, 2, 5 times a power of ten that is not below `least`.
pub(super) fn round_step(least: f64) -> f64 {
    if !(least > 0.0 && least.is_finite()) {
        return 1.0;
    }
    let power = 10f64.powi(least.log10().floor() as i32);
    let digit = least / power;
    // A hair is allowed for, so that 0.2/0.1 is 2.
    power * [1.0, 2.0, 5.0].into_iter().find(|round| digit <= round * (1.0 + 1e-9)).unwrap_or(10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ruler: &Ruler) -> Vec<&str> {
        ruler.ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn ticks_stand_at_round_numbers_in_a_unit_that_reads_well() {
        let ruler = Axis::linear("time", "s").with(&[0.0, 8e-3]).over([0.0, 8e-3].into_iter(), 5);
        assert_eq!(labels(&ruler), ["0", "2", "4", "6", "8"]);
        assert_eq!(ruler.title, "time [ms]");
        assert_eq!(ruler.place(4e-3), Some(0.5));
        let ruler = Axis::linear("temperature", "K").over([293.0, 301.0].into_iter(), 5);
        assert_eq!(labels(&ruler), ["294", "296", "298", "300"]);
        let spare = [ruler.place(293.0), ruler.place(301.0)].map(|place| (place.unwrap() - 0.5).abs());
        // 4 % on both sides of what is shown.
        assert!(spare.into_iter().all(|place| (place - 0.5 / 1.08).abs() < 1e-12), "{spare:?}");
        let ruler = Axis::linear("power", "W").over([-0.1, 0.23].into_iter(), 4);
        assert_eq!(ruler.title, "power [mW]");
        assert_eq!(labels(&ruler), ["\u{2212}100", "0", "100", "200"]);
    }

    #[test]
    fn ranges_without_width_or_values_still_have_ticks() {
        for (axis, values) in [
            (Axis::linear("a", "1"), vec![]),
            (Axis::linear("a", "1"), vec![0.0, 0.0]),
            (Axis::linear("a", "m").with(&[0.0]), vec![0.0]),
            (Axis::linear("a", "m").with(&[0.0]), vec![-2.0]),
            (Axis::linear("a", "m").with(&[3.0]), vec![3.0]),
            (Axis::linear("a", "K"), vec![300.0]),
            (Axis::linear("a", "1"), vec![f64::NAN, f64::INFINITY]),
            (Axis::linear("a", "1"), vec![-f64::MAX, f64::MAX]),
            (Axis::linear("a", "1"), vec![f64::MIN_POSITIVE]),
            (Axis::log("a", "1"), vec![]),
            (Axis::log("a", "1"), vec![0.0, -1.0]),
            (Axis::log("a", "1"), vec![1e-300, 1e300]),
        ] {
            let ruler = axis.over(values.clone().into_iter(), 5);
            assert!((1..=24).contains(&ruler.ticks.len()) && ruler.low < ruler.high, "{values:?}: {ruler:?}");
            assert!(ruler.ticks.is_sorted_by(|a, b| a.at < b.at), "{values:?}: {ruler:?}");
            for value in values.into_iter().filter(|value| axis.shows(*value) && value.abs() < 1e300) {
                let place = ruler.place(value).unwrap();
                assert!((-1e-9..=1.0 + 1e-9).contains(&place), "{value} at {place} of {ruler:?}");
            }
        }
    }

    #[test]
    fn decades_are_thinned_and_short_ranges_have_marks_between() {
        let ruler = Axis::log("error", "1").over([3e-9, 1e3].into_iter(), 6);
        assert_eq!(labels(&ruler), ["10⁻⁹", "10⁻⁷", "10⁻⁵", "10⁻³", "10⁻¹", "10¹", "10³"]);
        let ruler = Axis::log("N", "1").over([1.0, 10.0].into_iter(), 5);
        assert_eq!(labels(&ruler), ["10⁰", "2·10⁰", "5·10⁰", "10¹"]);
        assert!((ruler.place(2.0).unwrap() - 2f64.log10()).abs() < 1e-12);
        assert_eq!(ruler.place(0.0), None);
    }
}
