//! What is looked at in every reply before anything is decided from it: nodes may be anybody's programs.

use std::collections::BTreeMap;

use stagger_messages::{Done, Energy, Failure, Field, Fields, Ports, Ready, Rows, geometry::Shape, shown_name};

use super::{ControlError, Frozen, OtherRows, Outcome};
use crate::SolveError;

/// Looks at the replies of one iteration. One with an energy or a figure that is not finite becomes a failure that a smaller
/// step may mend, as a field that is not finite is where it is solved; names lose what a terminal would act upon.
///
/// # Errors
/// [`ControlError::Rows`] where fields of two nodes on the same rows have different numbers of them.
pub(super) fn validate_replies(outcomes: &mut [Outcome]) -> Result<(), ControlError> {
    for Outcome { node, result } in outcomes.iter_mut() {
        let Ok(done) = result else { continue };
        tidy(done);
        if let Some(message) = not_finite(node, done) {
            *result = Err(Failure { message, retry: true });
        }
    }
    rows(outcomes)
}

/// Looks at what the nodes hold at t = 0.
///
/// # Errors
/// [`ControlError::Node`] names an energy that is not finite.
pub(super) fn validate_start(ready: &mut [(String, Ready)]) -> Result<(), ControlError> {
    for (node, ready) in ready {
        ready.ledger.iter_mut().for_each(tidy_energy);
        if let Some(message) = energy_not_finite(node, &ready.ledger) {
            return Err(ControlError::Node { node: node.clone(), message });
        }
    }
    Ok(())
}

fn tidy(done: &mut Done) {
    done.ledger.iter_mut().for_each(tidy_energy);
    if done.figures.keys().any(|name| shown_name(name) != *name) {
        let figures = std::mem::take(&mut done.figures);
        done.figures = figures.into_iter().map(|(name, value)| (shown_name(&name).into_owned(), value)).collect();
    }
}

fn tidy_energy(entry: &mut Energy) {
    if shown_name(&entry.name) != entry.name {
        entry.name = shown_name(&entry.name).into_owned();
    }
}

fn energy_not_finite(node: &str, ledger: &[Energy]) -> Option<String> {
    let entry = ledger.iter().find(|entry| !entry.joule.is_finite())?;
    let (node, name) = (node.to_owned(), entry.name.clone());
    Some(SolveError::Energy { node, name, joule: entry.joule }.to_string())
}

/// The first energy or figure of a reply that is not finite, in words.
fn not_finite(node: &str, done: &Done) -> Option<String> {
    let figure = || {
        let (name, value) = done.figures.iter().find(|(_, value)| value.is_nan())?;
        Some(SolveError::Figure { node: node.to_owned(), name: name.clone(), value: *value }.to_string())
    };
    energy_not_finite(node, &done.ledger).or_else(figure)
}

/// Fields of one support and revision have as many rows, whoever writes them.
fn rows(outcomes: &[Outcome]) -> Result<(), ControlError> {
    let mut known: BTreeMap<(&str, u64), (&str, &Rows)> = BTreeMap::new();
    for Outcome { node, result } in outcomes {
        for rows in result.iter().flat_map(|done| &done.rows) {
            let Some(support) = &rows.support else { continue };
            let (other, there) = *known.entry((&support.name, support.revision)).or_insert((node, rows));
            let count = there.support.as_ref().map_or(0, |support| support.count);
            if count != support.count {
                return Err(ControlError::Rows(Box::new(OtherRows {
                    node: node.clone(),
                    field: rows.field.clone(),
                    rows: support.count,
                    support: support.name.clone(),
                    revision: support.revision,
                    other: other.into(),
                    other_field: there.field.clone(),
                    other_rows: count,
                })));
            }
        }
    }
    Ok(())
}

/// Refuses a reply whose fields have other numbers of rows than the frozen fields on the same rows.
///
/// # Errors
/// [`SolveError::Mismatch`] names the node, the field, its rows and those expected.
pub(super) fn validate_rows(node: &str, fields: &Fields, frozen: &Frozen) -> Result<(), SolveError> {
    for field in fields.values() {
        let of = |read: &&Field| {
            (&read.support.name, read.support.revision) == (&field.support.name, field.support.revision)
        };
        let Some(read) = frozen.end.values().chain(frozen.start.values()).find(of) else { continue };
        if read.support.count != field.support.count {
            let (name, rows, support) = (field.name(), field.rows(), &field.support);
            return Err(SolveError::Mismatch(format!(
                "{node}: field `{name}` has {rows} rows on `{}`, but there are {} of them (field `{}`, revision {}): a row for each \
                 is expected",
                support.name,
                read.rows(),
                read.name(),
                support.revision
            )));
        }
    }
    Ok(())
}

/// Refuses fields on a described grid that do not have one row for each of its values.
///
/// # Errors
/// [`SolveError::Mismatch`] names the node, the field, its rows and those of the grid.
pub(super) fn validate_grids(node: &str, ports: &Ports, fields: &Fields) -> Result<(), SolveError> {
    for geometry in &ports.supports {
        let Some(Shape::Grid(grid)) = &geometry.shape else { continue };
        let on_it = |field: &&Field| field.support.name == geometry.support && field.rows() != grid.rows();
        if let Some(field) = fields.values().find(on_it) {
            return Err(SolveError::Mismatch(format!(
                "{node}: field `{}` has {} rows, but grid `{}` has {:?} values: {}",
                field.name(),
                field.rows(),
                geometry.support,
                grid.dims,
                grid.rows()
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Geometry, Grid, Measure, Port, Support};

    use super::*;

    fn outcome(node: &str, done: Done) -> Outcome {
        Outcome { node: node.into(), result: Ok(done) }
    }

    fn rows(field: &str, count: u64, revision: u64) -> Rows {
        Rows { field: field.into(), support: Some(Support { name: "particles".into(), count, revision }) }
    }

    fn on(node: &str, field: &str, count: u64, revision: u64) -> Outcome {
        outcome(node, Done { rows: vec![rows(field, count, revision)], ..Done::default() })
    }

    #[test]
    fn fields_of_one_support_have_as_many_rows_whoever_writes_them() {
        for count in [7, 9] {
            let mut replies = [on("particles", "positions", 8, 3), on("thermal", "temperature", count, 3)];
            let error = validate_replies(&mut replies).unwrap_err().to_string();
            for word in ["`thermal`", "`temperature`", &count.to_string(), "8", "`particles`", "`positions`"] {
                assert!(error.contains(word), "{word}: {error}");
            }
        }
        // Rows of an earlier revision are others.
        validate_replies(&mut [on("particles", "positions", 8, 3), on("thermal", "temperature", 7, 2)]).unwrap();
    }

    #[test]
    fn a_reply_on_other_rows_than_were_read_is_refused() {
        let field = |name: &str, support: &str, rows: usize, revision| {
            let port = Arc::new(Port::f64(name, "K", support, 1, Measure::None));
            (name.to_owned(), Field::new(&port, revision, vec![1.0; rows]).unwrap())
        };
        let frozen = Frozen { end: Fields::from([field("forces", "contacts", 5, 1)]), ..Frozen::default() };
        let error =
            validate_rows("own", &Fields::from([field("heat", "contacts", 4, 1)]), &frozen).unwrap_err().to_string();
        assert!(error.contains("own: field `heat` has 4 rows on `contacts`, but there are 5"), "{error}");
        validate_rows("own", &Fields::from([field("heat", "contacts", 4, 2)]), &frozen).unwrap();
        validate_rows("own", &Fields::from([field("heat", "grid", 4, 1)]), &frozen).unwrap();
    }

    #[test]
    fn fields_on_a_grid_have_a_row_for_each_of_its_values() {
        let grid = Grid::of_cells([0.0; 3], [1.0; 3], [4, 3, 2]);
        let ports = Ports::new(Vec::new(), Vec::new()).with(Geometry::grid("cells", grid));
        let fields = |rows: usize| {
            let port = Arc::new(Port::f64("w", "K", "cells", 1, Measure::None));
            Fields::from([("w".to_owned(), Field::new(&port, 0, vec![1.0; rows]).unwrap())])
        };
        validate_grids("own", &ports, &fields(24)).unwrap();
        let error = validate_grids("own", &ports, &fields(23)).unwrap_err().to_string();
        assert!(error.contains("own: field `w` has 23 rows, but grid `cells` has [4, 3, 2] values: 24"), "{error}");
    }

    #[test]
    fn what_is_not_finite_is_a_failure_and_names_lose_their_escapes() {
        let energy = Done { ledger: vec![Energy::stored("heat", f64::NAN)], ..Done::default() };
        let figure = Done { figures: [("speed".to_owned(), f64::NAN)].into(), ..Done::default() };
        for (done, word) in [(energy, "`heat`"), (figure, "`speed`")] {
            let mut replies = [outcome("own", done)];
            validate_replies(&mut replies).unwrap();
            let failure = replies[0].result.as_ref().unwrap_err();
            assert!(failure.retry && failure.message.contains(word) && failure.message.contains("NaN"), "{failure:?}");
        }
        let long = "x".repeat(100_000);
        let figures = [("\u{1b}[31mred".to_owned(), 1.0), (long, 2.0)].into();
        let mut replies = [outcome("own", Done { figures, ..Done::default() })];
        validate_replies(&mut replies).unwrap();
        let names: Vec<_> = replies[0].result.as_ref().unwrap().figures.keys().cloned().collect();
        assert!(names.iter().all(|name| name.chars().count() < 130 && !name.contains('\u{1b}')), "{names:?}");
        let mut ready = [("own".to_owned(), Ready { ledger: vec![Energy::stored("heat", f64::INFINITY)] })];
        assert!(validate_start(&mut ready).unwrap_err().to_string().contains("`heat`"));
    }
}
