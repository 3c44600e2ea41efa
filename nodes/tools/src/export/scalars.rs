//! The scalars of a run as a table: a row for the start and for each accepted step.

use std::{
    collections::BTreeMap,
    io::{self, BufWriter},
    path::Path,
};

use stagger_messages::Field;
use stagger_recordings::{Recording, State};
use stagger_runtime::run::outputs::Output;

use super::{ExportError, Reading, read};

/// Columns every row has a value in; [`Row::from`] gives them in this order.
pub(super) const HEAD: &str = "step,t_s,dt_s,iterations,rejected";
/// More components are a list, such as the path of a ray, and only its rows are counted.
const LIST: usize = 9;

/// Writes the table into `output`, which is at `path` in the end; returns its number of rows. The recording is read twice:
/// which columns there are is known only at its end.
pub(super) fn write(recording: &Recording, path: &Path, output: Output) -> Result<(usize, Reading), ExportError> {
    let mut columns = BTreeMap::new();
    read(recording, |state| {
        columns.extend(Row::from(&state, false).values);
        Ok(())
    })?;
    let failed = |source: io::Error| ExportError::Io { path: path.into(), source };
    let wrong = |error: csv::Error| failed(error.into());
    let mut file = csv::Writer::from_writer(BufWriter::new(output));
    file.write_record(HEAD.split(',').chain(columns.keys().map(String::as_str))).map_err(wrong)?;
    let mut rows = 0;
    let reading = read(recording, |state| {
        rows += 1;
        file.write_record(Row::from(&state, true).cells(columns.keys())).map_err(wrong)
    })?;
    let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
    file.into_inner().map_err(|error| failed(error.into_error()))?.place()?;
    Ok((rows, reading))
}

/// One row: what every row has, and values by the names of their columns.
struct Row {
    head: [String; 5],
    values: BTreeMap<String, f64>,
}

impl Row {
    /// The row of a state. Without `values` the numbers that cost time are left at zero, and only the names are right.
    fn from(state: &State, values: bool) -> Self {
        let (step, work) = (&state.step, &state.work);
        let head = [
            step.version.step.to_string(),
            format!("{:?}", step.t_s),
            format!("{:?}", step.dt_s),
            work.iterations.to_string(),
            work.rejections.to_string(),
        ];
        let mut row = Self { head, values: BTreeMap::new() };
        for (node, done) in &state.replies {
            for (name, value) in &done.figures {
                row.put(format!("figure {node}: {name}"), *value);
            }
        }
        for (node, seconds) in &work.solve_s {
            row.put(format!("solve {node} [s]"), *seconds);
        }
        for (node, seconds) in &work.wait_s {
            row.put(format!("wait {node} [s]"), *seconds);
        }
        for (node, account) in state.ledger.nodes() {
            for (kind, map) in [("stored", &account.stored), ("gained", &account.gained), ("lost", &account.lost)] {
                for (name, joule) in map {
                    row.put(format!("energy {node}: {name}, {kind} [J]"), *joule);
                }
            }
        }
        // A thinned recording has no fields of some steps.
        for (name, field) in state.step.fields.iter().filter(|_| step.recorded) {
            row.field(name, field, values);
        }
        row
    }

    fn put(&mut self, column: String, value: f64) {
        self.values.insert(column, value);
    }

    fn field(&mut self, name: &str, field: &Field, values: bool) {
        self.put(format!("field {name}: rows"), field.rows() as f64);
        let components = field.components();
        // The mean of indices says nothing.
        let indices = field.u32().is_ok() && components > 1;
        if components > LIST || indices || field.rows() == 0 {
            return;
        }
        let unit = if field.port.unit == "1" { String::new() } else { format!(" [{}]", field.port.unit) };
        for component in 0..components {
            let range = if values { range(field, component) } else { [0.0; 3] };
            let of = match component {
                _ if components == 1 => String::new(),
                axis @ 0..3 if components == 3 => format!(" {}", ["x", "y", "z"][axis]),
                other => format!(" {other}"),
            };
            for (what, value) in ["min", "mean", "max"].into_iter().zip(range) {
                self.put(format!("field {name}{of}: {what}{unit}"), value);
            }
        }
    }

    /// Cells of the row in the order of the table; empty where the row has no value.
    fn cells<'c>(self, columns: impl Iterator<Item = &'c String>) -> impl Iterator<Item = String> {
        let Self { head, values } = self;
        let value = move |column| values.get(column).map_or_else(String::new, |value| format!("{value:?}"));
        head.into_iter().chain(columns.map(value))
    }
}

/// Smallest, mean and largest value of one component of a field with rows, summed in their order.
fn range(field: &Field, component: usize) -> [f64; 3] {
    let of = |values: &mut dyn Iterator<Item = f64>| {
        let start = (f64::INFINITY, 0.0, f64::NEG_INFINITY);
        let (low, sum, high) = values
            .skip(component)
            .step_by(field.components().max(1))
            .fold(start, |(low, sum, high), value| (low.min(value), sum + value, high.max(value)));
        [low, sum / field.rows().max(1) as f64, high]
    };
    match (field.f64(), field.u32(), field.u8()) {
        (Ok(values), ..) => of(&mut values.iter().copied()),
        (_, Ok(values), _) => of(&mut values.iter().map(|value| f64::from(*value))),
        (.., Ok(values)) => of(&mut values.iter().map(|value| f64::from(*value))),
        _ => [f64::NAN; 3],
    }
}
