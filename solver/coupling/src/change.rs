//! How far the fields move from one iteration to the next (Zohdi 2018, eq. 6.48).

use stagger_messages::{Change, Field, Measure, MessageError};

use crate::math;

/// Rows whose norms are taken together: square roots of neighbours cost the processor little more than one.
const LANES: usize = 8;
/// Between these sums of norms, no square that matters to them has left the normal numbers.
const SMALL: f64 = 1e-130;
const LARGE: f64 = 1e130;

/// Sums over rows that the relative change of a field is made of (Zohdi 2018, eq. 6.48); only those its measure asks
/// for, the others stay 0.
///
/// `previous` is the iterate K−1, `start` the value at the window's start (L). Sums run in a fixed order, so that they
/// are the same bits everywhere. From a value on other rows (another support) there is no distance, and the value
/// itself counts: from an iterate on other rows all of a field has changed. Rows that came or went since the last
/// commit are not in the way where `start` stands on the field's own rows ([`Reply::start`](super::Reply::start)).
///
/// # Errors
/// A field holds no floats.
pub fn change(field: &Field, previous: &Field, start: &Field) -> Result<Change, MessageError> {
    let (new, old, start) = (field.f64()?, on_rows_of(field, previous)?, on_rows_of(field, start)?);
    let components = field.components();
    let mut sums = Change { field: field.name().into(), rows: field.rows() as u64, ..Change::default() };
    let (change, worst) = distance(new, old, components);
    (sums.change, sums.worst_row) = (change, worst as u64);
    match field.port.measure() {
        Measure::Increment => sums.increment = distance(new, start, components).0,
        Measure::Magnitude => sums.magnitude = distance(new, None, components).0,
        Measure::None => {}
    }
    Ok(sums)
}

/// The values of `other`, where it stands on the rows of `field`.
fn on_rows_of<'o>(field: &Field, other: &'o Field) -> Result<Option<&'o [f64]>, MessageError> {
    let values = other.f64()?;
    let alike = other.support == field.support && other.components() == field.components();
    Ok(alike.then_some(values))
}

/// Sum over rows of the norm of `a` − `b` (of `a` where there is no `b`), and the row where it is largest.
///
/// Squares of numbers below 1e-154 or above 1e154 are no normal numbers: sums near these are taken again of numbers
/// brought near 1 by a power of two, which changes no digit.
fn distance(a: &[f64], b: Option<&[f64]>, components: usize) -> (f64, usize) {
    let result = unscaled(a, b, components);
    if (SMALL..=LARGE).contains(&result.0) {
        return result;
    }
    let differences: Vec<f64> = match b {
        Some(b) => a.iter().zip(b).map(|(a, b)| a - b).collect(),
        None => a.to_vec(),
    };
    let largest = differences.iter().fold(0.0_f64, |largest, difference| largest.max(difference.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return result;
    }
    // The exponent's bits alone; a number below the normal ones has none.
    let scale = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits()).max(f64::MIN_POSITIVE);
    let scaled: Vec<f64> = differences.iter().map(|difference| difference / scale).collect();
    let (sum, worst) = unscaled(&scaled, None, components);
    (sum * scale, worst)
}

fn unscaled(a: &[f64], b: Option<&[f64]>, components: usize) -> (f64, usize) {
    match components {
        1 => rows::<1>(a, b),
        2 => rows::<2>(a, b),
        3 => rows::<3>(a, b),
        _ => {
            let square = |row: usize| {
                let range = row * components..(row + 1) * components;
                range.map(|i| math::powi(a[i] - b.map_or(0.0, |b| b[i]), 2)).sum::<f64>()
            };
            let norms = (0..a.len().checked_div(components).unwrap_or(0)).map(|row| square(row).sqrt());
            let mut worst = (0.0, 0);
            let mut sum = 0.0;
            for (row, norm) in norms.enumerate() {
                sum += norm;
                worst = if norm > worst.0 { (norm, row) } else { worst };
            }
            (sum, worst.1)
        }
    }
}

fn rows<const N: usize>(a: &[f64], b: Option<&[f64]>) -> (f64, usize) {
    let mut lanes = [0.0; LANES];
    let mut worst = (0.0, 0);
    let none = [0.0; 3 * LANES];
    for (block, a) in a.chunks(N * LANES).enumerate() {
        let at = block * N * LANES;
        let b = b.map_or(&none[..a.len()], |b| &b[at..at + a.len()]);
        let mut norms = [0.0; LANES];
        for ((norm, a), b) in norms.iter_mut().zip(a.as_chunks::<N>().0).zip(b.as_chunks::<N>().0) {
            *norm = (0..N).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>();
        }
        let mut largest: f64 = 0.0;
        for (lane, norm) in lanes.iter_mut().zip(&mut norms) {
            *norm = norm.sqrt();
            *lane += *norm;
            largest = largest.max(*norm);
        }
        if largest > worst.0 {
            let lane = norms.iter().position(|norm| norm.total_cmp(&largest).is_eq()).unwrap_or(0);
            worst = (largest, block * LANES + lane);
        }
    }
    (lanes.iter().sum(), worst.1)
}

/// The relative change ε of a field in one iteration (Zohdi 2018, section 6.4).
///
/// A field that did not move has ε = 0. One that moved back to exactly where it started has no finite relative
/// change: it has not converged.
#[must_use]
pub fn relative(sums: &Change, measure: Measure) -> f64 {
    let denominator = match measure {
        Measure::Increment => sums.increment,
        Measure::Magnitude => sums.magnitude,
        Measure::None => return 0.0,
    };
    if sums.change == 0.0 {
        0.0
    } else if denominator == 0.0 {
        f64::INFINITY
    } else {
        sums.change / denominator
    }
}

/// Order p in which the iteration's error falls with the step size: 2 for motion, 1 for first-order fields.
#[must_use]
pub const fn order(measure: Measure) -> f64 {
    match measure {
        Measure::Increment => 2.0,
        Measure::Magnitude | Measure::None => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use stagger_messages::Port;

    fn field(components: u32, measure: Measure, values: &[f64]) -> Field {
        let port = Arc::new(Port::f64("w", "m", "particles", components, measure));
        Field::new(&port, 0, values.to_vec()).unwrap()
    }

    #[test]
    fn rows_are_measured_by_their_euclidean_norm() {
        for (measure, expected, error) in
            [(Measure::Increment, (6.0, 1.0, 0.0), 6.0), (Measure::Magnitude, (6.0, 0.0, 6.0), 1.0)]
        {
            let new = field(2, measure, &[0.0, 1.0, 3.0, 4.0]);
            let old = field(2, measure, &[0.0, 0.0, 0.0, 0.0]);
            let start = field(2, measure, &[0.0, 0.0, 3.0, 4.0]);
            let sums = change(&new, &old, &start).unwrap();
            // Exact: the norms are 1 and 5.
            assert_eq!((sums.change, sums.increment, sums.magnitude), expected);
            assert_eq!(sums.worst_row, 1);
            assert_eq!(relative(&sums, measure), error);
        }
    }

    #[test]
    fn many_rows_of_any_width_sum_as_few_do() {
        for components in 1..=5u32 {
            let rows = 1003;
            let values: Vec<f64> = (0..rows * components).map(|i| f64::from(i % 17) - 3.0).collect();
            let new = field(components, Measure::Magnitude, &values);
            let zero = field(components, Measure::Magnitude, &vec![0.0; values.len()]);
            let expected: f64 = values
                .chunks(components as usize)
                .map(|row| row.iter().map(|value| value * value).sum::<f64>().sqrt())
                .sum();
            let sums = change(&new, &zero, &zero).unwrap();
            // A thousand terms of about ten, summed in another order.
            assert!((sums.magnitude - expected).abs() < 1e-9, "{components} components");
            assert!((sums.change - expected).abs() < 1e-9, "{components} components");
        }
    }

    #[test]
    fn what_is_very_small_or_large_is_measured_as_what_is_not() {
        for components in [1, 2, 3, 4] {
            let values: Vec<f64> = (0..12 * components).map(|i| f64::from(i % 7) - 3.0).collect();
            let halves: Vec<f64> = values.iter().map(|value| 0.5 * value).collect();
            for scale in [1.0, 2f64.powi(-1000), 2f64.powi(1000)] {
                let scaled = |values: &[f64]| -> Vec<f64> { values.iter().map(|value| value * scale).collect() };
                let new = field(components, Measure::Magnitude, &scaled(&values));
                let old = field(components, Measure::Magnitude, &scaled(&halves));
                let sums = change(&new, &old, &old).unwrap();
                assert_eq!(relative(&sums, Measure::Magnitude), 0.5, "{components} components at {scale:e}");
            }
        }
    }

    #[test]
    fn a_field_at_rest_has_converged_and_one_that_came_back_has_not() {
        let field = |values: &[f64]| field(1, Measure::Increment, values);
        let rest = change(&field(&[1.0]), &field(&[1.0]), &field(&[1.0])).unwrap();
        assert_eq!(relative(&rest, Measure::Increment), 0.0);
        let back = change(&field(&[1.0]), &field(&[2.0]), &field(&[1.0])).unwrap();
        assert_eq!(relative(&back, Measure::Increment), f64::INFINITY);
    }

    #[test]
    fn from_other_rows_all_has_changed_and_from_the_own_ones_only_what_moved() {
        let of = |revision, measure, values: &[f64]| {
            let port = Arc::new(Port::f64("w", "m", "particles", 1, measure));
            Field::new(&port, revision, values.to_vec()).unwrap()
        };
        for measure in [Measure::Magnitude, Measure::Increment] {
            let committed = of(0, measure, &[3.0, 4.0]);
            // One fewer; and one gone for one that came.
            for first in [of(1, measure, &[3.0]), of(1, measure, &[3.0, 5.0])] {
                let sums = change(&first, &committed, &committed).unwrap();
                assert_eq!(relative(&sums, measure), 1.0);
                let second = change(&first, &first, &committed).unwrap();
                assert_eq!(relative(&second, measure), 0.0);
            }
        }
        // Against its own start a field is measured as in any window: (0 + 2)/(1 + 1).
        let increment = |values: &[f64]| of(1, Measure::Increment, values);
        let sums = change(&increment(&[4.0, 5.0]), &increment(&[4.0, 7.0]), &increment(&[3.0, 6.0])).unwrap();
        assert_eq!(relative(&sums, Measure::Increment), 1.0);
    }
}
