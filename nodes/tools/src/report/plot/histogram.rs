//! How values are distributed.

use std::fmt::Write as _;

use super::{
    WIDTH,
    axis::Axis,
    chart::Frame,
    figure,
    quantity::{count, quantity},
    series_class,
    svg::{Drawing, place},
};

/// Height of the drawing.
const HEIGHT: f64 = 190.0;
/// Most intervals.
const INTERVALS: usize = 40;

/// Values counted in intervals of one width.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distribution {
    /// Name in the legend.
    pub name: String,
    /// Values in each interval.
    pub counts: Vec<u64>,
    /// Start of the first and end of the last interval.
    pub range: [f64; 2],
    /// Values that are not finite, which are in none.
    pub not_finite: u64,
}

impl Distribution {
    /// Counts values over a range that is the smallest around all finite ones of `over`, so that several distributions can
    /// stand on one axis. The number of intervals is the square root of that of the values, from 8 to 40.
    #[must_use]
    pub fn of(name: &str, values: &[f64], over: &[f64]) -> Self {
        let finite = || over.iter().copied().filter(|value| value.is_finite());
        let (mut low, mut high) =
            finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if high / 2.0 - low / 2.0 <= 1e-12 * low.abs().max(high.abs()) {
            // All equal: one bar in the middle.
            let room = if low == 0.0 { 0.5 } else { 0.05 * low.abs() };
            (low, high) = (low - room, high + room);
        }
        let intervals = ((values.len() as f64).sqrt() as usize).clamp(8, INTERVALS) | 1;
        let mut found = Self { name: name.into(), counts: vec![0; intervals], range: [low, high], not_finite: 0 };
        // Halves, so that the width of the largest range there is does not overflow.
        let half = high / 2.0 - low / 2.0;
        for value in values {
            if !value.is_finite() {
                found.not_finite += 1;
                continue;
            }
            let fraction = (value / 2.0 - low / 2.0) / half;
            let interval = (fraction * intervals as f64) as usize;
            found.counts[interval.min(intervals - 1)] += 1;
        }
        found
    }

    fn edge(&self, number: usize) -> f64 {
        let [low, high] = self.range;
        let share = number as f64 / self.counts.len().max(1) as f64;
        low * (1.0 - share) + high * share
    }
}

/// Distributions over one axis as a figure: bars for one, outlines for several. Counts that differ by more than a
/// hundredfold stand on a logarithmic axis.
#[must_use]
pub fn histogram(title: &str, axis: &Axis, distributions: &[Distribution]) -> String {
    let counts = || distributions.iter().flat_map(|distribution| &distribution.counts).copied();
    let most = counts().max().unwrap_or_default();
    let least = counts().filter(|count| *count > 0).min().unwrap_or_default();
    let decades = most > 100 * least.max(1);
    let upright = if decades { Axis::log("rows", "1") } else { Axis::linear("rows", "1").with(&[0.0]) };
    // One row is seen on a logarithmic axis too.
    let floor = if decades { 0.5 } else { 0.0 };
    let y = upright.over([floor, most as f64].into_iter(), 4);
    let x = axis.over(distributions.iter().flat_map(|distribution| distribution.range), 5);
    let bottom = y.low;
    let frame = Frame::new(x, y, HEIGHT);
    let mut drawing = Drawing::new(WIDTH, HEIGHT, title);
    frame.draw(&mut drawing);
    for (number, distribution) in distributions.iter().enumerate() {
        let mut outline = String::new();
        for (interval, &rows) in distribution.counts.iter().enumerate() {
            let [low, high] = [interval, interval + 1].map(|number| distribution.edge(number));
            let height = (rows as f64).max(bottom);
            let (Some([x1, base]), Some([x2, top])) = (frame.at([low, bottom]), frame.at([high, height])) else {
                continue;
            };
            if distributions.len() == 1 {
                let note =
                    format!("{} to {}: {} rows", quantity(low, &axis.unit), quantity(high, &axis.unit), count(rows));
                let gap = if x2 - x1 > 4.0 { 1.0 } else { 0.0 };
                drawing.rectangle("c0 d0 fill", [x1, top], [x2 - x1 - gap, base - top], &note);
            } else {
                let start = if outline.is_empty() { format!("M{} {}", place(x1), place(base)) } else { String::new() };
                // Writing to a text cannot fail.
                let _ = write!(outline, "{start}V{}H{}", place(top), place(x2));
            }
        }
        if !outline.is_empty() {
            if let Some([_, base]) = frame.at([distribution.edge(0), bottom]) {
                let _ = write!(outline, "V{}", place(base));
            }
            drawing.path(&format!("{} line", series_class(number)), &outline);
        }
    }
    let entry = |(number, distribution): (usize, &Distribution)| {
        (format!("{} line", series_class(number)), distribution.name.clone())
    };
    let legend: Vec<_> =
        if distributions.len() > 1 { distributions.iter().enumerate().map(entry).collect() } else { Vec::new() };
    figure(title, &drawing.finish(), &legend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finite_value_is_in_one_interval() {
        let values: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).chain([f64::NAN, f64::INFINITY]).collect();
        let found = Distribution::of("x", &values, &values);
        assert_eq!((found.counts.iter().sum::<u64>(), found.not_finite), (1000, 2));
        assert_eq!(found.counts.len(), 31);
        // 1000 values over 31 equal intervals: 32 or 33 in each, one more or less by rounding at an edge.
        assert!(found.counts.iter().all(|count| (31..=34).contains(count)), "{found:?}");
    }

    #[test]
    fn equal_values_no_values_and_the_largest_ones_have_a_histogram() {
        for values in [vec![], vec![0.0; 5], vec![300.0; 5], vec![-f64::MAX, f64::MAX], vec![f64::NAN]] {
            let found = Distribution::of("x", &values, &values);
            let finite = values.iter().filter(|value| value.is_finite()).count();
            assert_eq!(found.counts.iter().sum::<u64>() as usize, finite, "{values:?}");
            let text = histogram("x", &Axis::linear("x", "m"), &[found]);
            roxmltree::Document::parse(&text).unwrap();
            assert!(!text.contains("NaN") && !text.contains("inf"), "{values:?}: {text}");
        }
    }

    #[test]
    fn counts_of_different_size_are_all_seen() {
        let mut values = vec![0.0; 10_000];
        values.push(1.0);
        let text = histogram("x", &Axis::linear("x", "1"), &[Distribution::of("x", &values, &values)]);
        let page = roxmltree::Document::parse(&text).unwrap();
        let tall = |node: roxmltree::Node<'_, '_>| {
            node.attribute("height")?.parse::<f64>().ok().filter(|height| *height > 5.0)
        };
        assert_eq!(page.descendants().filter_map(tall).count(), 2, "{text}");
    }
}
