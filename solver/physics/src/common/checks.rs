//! What a physics asks of its settings and of the fields it is given, and the one way energy is summed.

use stagger_coupling::SolveError;
use stagger_messages::Shown;
use stagger_messages::{Field, Fields, MessageError};

/// Share of a time by which a sum of steps may miss it, and counts as having reached it: a million additions miss by some
/// 1e-10.
const ROUNDING: f64 = 1e-9;

/// Whether a time that steps add up to has come to a time of the scene, in s.
pub(crate) fn reached(t_s: f64, at_s: f64) -> bool {
    t_s >= at_s - ROUNDING * at_s.abs()
}

/// The field `name` of `fields`.
pub(crate) fn field<'a>(fields: &'a Fields, name: &str) -> Result<&'a Field, SolveError> {
    Ok(fields.get(name).ok_or_else(|| MessageError::Absent(name.into()))?)
}

/// The values of a binary64 field that must stand on `rows` rows, all finite.
pub(crate) fn values<'a>(
    node: &str,
    fields: &'a Fields,
    name: &str,
    rows: usize,
    of: &str,
) -> Result<&'a [f64], SolveError> {
    let field = field(fields, name)?;
    if field.rows() != rows {
        let found = field.rows();
        return Err(SolveError::Mismatch(format!("{node}: field `{name}` has {found} rows, but {of} has {rows}")));
    }
    let values = field.f64()?;
    finite(node, name, field.components(), values)?;
    Ok(values)
}

/// The radii of the particles, in m; all positive.
pub(crate) fn radii<'a>(node: &str, fields: &'a Fields) -> Result<&'a [f64], SolveError> {
    let radii = field(fields, "radii")?.f64()?;
    finite(node, "radii", 1, radii)?;
    if let Some(row) = radii.iter().position(|&radius| radius <= 0.0) {
        let found = radii[row];
        return Err(SolveError::Mismatch(format!(
            "{node}: field `radii` is {found} m in row {row}, but a radius is positive"
        )));
    }
    Ok(radii)
}

/// Refuses a value that is not finite, naming its row.
pub(crate) fn finite(node: &str, name: &str, components: usize, values: &[f64]) -> Result<(), SolveError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(at) => Err(not_physical(node, name, at / components.max(1), values[at])),
        None => Ok(()),
    }
}

/// A value that a smaller step may mend.
pub(crate) fn not_physical(node: &str, name: &str, row: usize, value: f64) -> SolveError {
    SolveError::NotFinite { node: node.into(), field: name.into(), row, value }
}

/// Refuses a setting that is not positive and finite.
pub(crate) fn positive(node: &str, what: &str, value: f64) -> Result<(), SolveError> {
    setting(node, what, value, value.is_finite() && value > 0.0, "positive and finite")
}

/// Refuses a setting for which `fits` is false; `expected` says what would fit.
pub(crate) fn setting(node: &str, what: &str, value: f64, fits: bool, expected: &str) -> Result<(), SolveError> {
    if fits {
        Ok(())
    } else {
        Err(SolveError::Start(format!("{node}: {what} is {}, but must be {expected}", Shown(value))))
    }
}

/// Energy in J of constant powers in W over `dt_s`, summed by index: writer and reader of a power book the same number.
pub(crate) fn energy_j(power_w: &[f64], dt_s: f64) -> f64 {
    power_w.iter().fold(0.0, |sum, power| sum + power * dt_s)
}

#[cfg(test)]
mod tests {
    use super::reached;

    #[test]
    fn a_time_is_reached_by_a_sum_of_steps_that_misses_it_by_rounding_and_not_before() {
        for steps in [10u32, 1000, 1_000_000] {
            let (dt_s, mut t_s) = (1.0 / f64::from(steps), 0.0);
            for step in 1..=steps {
                t_s += dt_s;
                // Its exact neighbours: this step's time and the next one's.
                if step % (steps / 10) == 0 {
                    assert!(reached(t_s, f64::from(step) / f64::from(steps)), "{step} of {steps}: {t_s:e}");
                }
                assert!(!reached(t_s, f64::from(step + 1) / f64::from(steps)), "{step} of {steps}: {t_s:e}");
            }
        }
        assert!(reached(0.0, 0.0) && !reached(1e300, f64::INFINITY) && reached(f64::INFINITY, 1.0));
    }
}
