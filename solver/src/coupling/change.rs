use stagger_messages::{Change, Field, Measure, MessageError};

/// Sums over rows that the relative change of a field is made of (Zohdi 2018, eq. 6.48).
///
/// `previous` is the iterate K−1, `committed` the value at the window's start (L). Sums run in row order, so that
/// they are the same bits everywhere. Where the number of rows changed, every row counts as changed.
///
/// # Errors
/// A field holds no floats.
pub fn change(field: &Field, previous: &Field, committed: &Field) -> Result<Change, MessageError> {
    let components = field.components();
    let (new, old, start) = (field.f64()?, previous.f64()?, committed.f64()?);
    let mut sums = Change { field: field.name().into(), ..Change::default() };
    let comparable = new.len() == old.len() && new.len() == start.len();
    let mut worst = 0.0;
    for (row, new) in new.chunks_exact(components).enumerate() {
        let at = row * components;
        let magnitude = norm(new.iter().copied());
        sums.magnitude += magnitude;
        if !comparable {
            sums.change += magnitude;
            sums.increment += magnitude;
            continue;
        }
        let step = norm(new.iter().zip(&old[at..]).map(|(a, b)| a - b));
        sums.change += step;
        sums.increment += norm(new.iter().zip(&start[at..]).map(|(a, b)| a - b));
        if step > worst {
            worst = step;
            sums.worst_row = row as u64;
        }
    }
    Ok(sums)
}

fn norm(row: impl Iterator<Item = f64>) -> f64 {
    row.map(|x| x * x).sum::<f64>().sqrt()
}

/// The relative change ε of a field in one iteration (physics.md section 1).
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

    fn field(components: u32, values: &[f64]) -> Field {
        let port = Arc::new(Port::f64("w", "m", "particles", components, Measure::Increment));
        Field::new(&port, 0, values.to_vec()).unwrap()
    }

    #[test]
    fn rows_are_measured_by_their_euclidean_norm() {
        let new = field(2, &[3.0, 4.0, 0.0, 1.0]);
        let old = field(2, &[0.0, 0.0, 0.0, 0.0]);
        let start = field(2, &[3.0, 4.0, 0.0, 0.0]);
        let sums = change(&new, &old, &start).unwrap();
        // Exact: the norms are 5 and 1.
        assert_eq!((sums.change, sums.increment, sums.magnitude, sums.worst_row), (6.0, 1.0, 6.0, 0));
        assert_eq!(relative(&sums, Measure::Increment), 6.0);
        assert_eq!(relative(&sums, Measure::Magnitude), 1.0);
    }

    #[test]
    fn a_field_at_rest_has_converged_and_one_that_came_back_has_not() {
        let rest = change(&field(1, &[1.0]), &field(1, &[1.0]), &field(1, &[1.0])).unwrap();
        assert_eq!(relative(&rest, Measure::Increment), 0.0);
        let back = change(&field(1, &[1.0]), &field(1, &[2.0]), &field(1, &[1.0])).unwrap();
        assert_eq!(relative(&back, Measure::Increment), f64::INFINITY);
    }
}
