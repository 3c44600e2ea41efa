//! Edges of cells that are of one size in a part of an axis and grow geometrically beyond it.

/// The part of an axis in which cells have their least width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fine {
    /// Where it begins, in m.
    pub from_m: f64,
    /// Where it ends, in m.
    pub to_m: f64,
    /// Largest width of a cell over that of its neighbour nearer to the fine part; at least 1.
    pub growth: f64,
}

/// Edges from `lower_m` to `upper_m` of cells that are `width_m` wide in the fine part, or everywhere where there is none.
///
/// The width is rounded so that whole cells fill a part. Beyond the fine part widths follow a geometric series whose ratio is
/// at most `growth`, and just as large as whole cells need to fill what is left: the number of cells grows with the logarithm
/// of the distance. Where two or three cells are left, they may shrink instead, to 0.62 of their neighbour at least; a single
/// one takes what there is. All lengths in m; lower < upper, and the width positive.
#[must_use]
pub fn graded_edges(lower_m: f64, upper_m: f64, width_m: f64, fine: Option<Fine>) -> Vec<f64> {
    let Some(Fine { from_m, to_m, growth }) = fine else { return equal(lower_m, upper_m, width_m) };
    let (from_m, to_m) = (from_m.clamp(lower_m, upper_m), to_m.clamp(lower_m, upper_m));
    let middle = if to_m > from_m { equal(from_m, to_m, width_m) } else { vec![from_m] };
    let least_m = match middle.as_slice() {
        [first, second, ..] => second - first,
        _ => width_m,
    };
    let mut edges = growing(from_m - lower_m, least_m, growth);
    edges.reverse();
    let mut edges: Vec<f64> = edges.into_iter().map(|away_m| from_m - away_m).collect();
    edges.extend(&middle);
    edges.extend(growing(upper_m - to_m, least_m, growth).into_iter().map(|away_m| to_m + away_m));
    // The corners are those given, not what rounding makes of them.
    if let Some(first) = edges.first_mut() {
        *first = lower_m;
    }
    if let Some(last) = edges.last_mut() {
        *last = upper_m;
    }
    edges
}

fn equal(lower_m: f64, upper_m: f64, width_m: f64) -> Vec<f64> {
    let count = ((upper_m - lower_m) / width_m).round().max(1.0);
    (0..=count as usize).map(|place| lower_m + (upper_m - lower_m) * (place as f64 / count)).collect()
}

/// Distances of the outer edges of cells that fill `length_m` beside a cell of width `least_m`.
fn growing(length_m: f64, least_m: f64, growth: f64) -> Vec<f64> {
    // Less than half a cell is rounding.
    if length_m < 1e-9 * least_m {
        return Vec::new();
    }
    // As many cells as a series with the ratio allowed needs; then the ratio that fills the length with as many.
    let (mut count, mut sum_m, mut width_m) = (0, 0.0, least_m);
    while sum_m < length_m * (1.0 - 1e-12) {
        width_m *= growth;
        sum_m += width_m;
        count += 1;
    }
    let filled_m =
        |ratio: f64| (0..count).fold((0.0, least_m), |(sum, width), _| (sum + width * ratio, width * ratio)).0;
    let (mut low, mut high) = (0.0, growth);
    loop {
        let middle = 0.5 * (low + high);
        // Also where the growth is no number.
        if !(middle > low && middle < high) {
            break;
        }
        if filled_m(middle) < length_m { low = middle } else { high = middle }
    }
    let mut edges = Vec::with_capacity(count);
    let (mut at_m, mut width_m) = (0.0, least_m);
    for _ in 0..count {
        width_m *= high;
        at_m += width_m;
        edges.push(at_m);
    }
    edges
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_plate_under_a_spot_needs_few_cells() {
        // 10 mm deep, 2 µm at the surface over 100 µm.
        let fine = Fine { from_m: -1e-4, to_m: 0.0, growth: 1.2 };
        let edges = graded_edges(-1e-2, 0.0, 2e-6, Some(fine));
        assert!(edges.len() < 100, "{}", edges.len());
        assert_eq!((edges[0], edges[edges.len() - 1]), (-1e-2, 0.0));
        assert_eq!(graded_edges(0.0, 1.0, 0.25, None), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(graded_edges(0.0, 1.0, 5.0, None), [0.0, 1.0]);
    }

    #[test]
    fn what_is_no_number_ends() {
        for growth in [f64::NAN, f64::INFINITY] {
            let fine = Fine { from_m: 0.2, to_m: 0.4, growth };
            assert!(graded_edges(0.0, 1.0, 0.1, Some(fine)).len() > 2);
        }
    }

    proptest! {
        #[test]
        fn edges_rise_and_neighbours_differ_by_no_more_than_the_growth(
            lower in -1.0f64..0.0,
            length in 0.1f64..10.0,
            part in (0.0f64..1.0, 0.0f64..1.0),
            cells in 3.0f64..300.0,
            growth in 1.0f64..3.0,
        ) {
            let upper = lower + length;
            let [from_m, to_m] = [part.0.min(part.1), part.0.max(part.1)].map(|share| lower + share * length);
            let edges = graded_edges(lower, upper, length / cells, Some(Fine { from_m, to_m, growth }));
            prop_assert_eq!((edges[0], edges[edges.len() - 1]), (lower, upper));
            let widths: Vec<f64> = edges.windows(2).map(|pair| pair[1] - pair[0]).collect();
            prop_assert!(widths.iter().all(|width| *width > 0.0), "{widths:?}");
            // What is left beside the fine part may be less than one cell of it.
            for pair in widths.windows(2) {
                let ratio = (pair[0] / pair[1]).max(pair[1] / pair[0]);
                let is_remainder = pair[0] == widths[0] || pair[1] == widths[widths.len() - 1];
                prop_assert!(ratio <= growth.max(1.6181) * (1.0 + 1e-6) || is_remainder, "{ratio} in {widths:?}");
            }
        }
    }
}
