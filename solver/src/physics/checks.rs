//! What a physics asks of its settings and of the fields it is given, and the one way energy is summed.

use stagger_messages::{Field, Fields, MessageError};

use crate::SolveError;

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
    if fits { Ok(()) } else { Err(SolveError::Start(format!("{node}: {what} is {value}, but must be {expected}"))) }
}

/// Energy in J of constant powers in W over `dt_s`, summed by index: writer and reader of a power book the same number.
pub(crate) fn energy_j(power_w: &[f64], dt_s: f64) -> f64 {
    power_w.iter().fold(0.0, |sum, power| sum + power * dt_s)
}
