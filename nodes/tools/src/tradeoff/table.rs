//! The table on the terminal and as CSV.

use stagger_runtime::launch::words;
use std::{fmt::Write as _, io};

use super::{Case, Study, axis::Set, quantity::Quantity};

/// Width of the first column.
const LABEL: usize = 36;

/// The head of the table.
#[must_use]
pub fn head(quantities: &[Quantity]) -> String {
    let mut text = String::from("errors are shares of how far a quantity came, against the reference:");
    for quantity in quantities {
        let _ = write!(text, "\n  {quantity}");
    }
    let columns = ["wall", "cpu", "faster", "exchanges", "error"].iter().zip([9, 9, 7, 10, 9]);
    let columns: String = columns.map(|(name, width)| format!(" {name:>width$}")).collect();
    text + &format!("\n\n{:<LABEL$}{columns}  largest in", "")
}

/// A share as people read it.
#[must_use]
pub fn share(error: f64) -> String {
    let percent = 100.0 * error;
    match percent {
        _ if !percent.is_finite() => "?".into(),
        0.0 => "0".into(),
        _ if percent < 1e-3 => format!("{percent:.0e} %"),
        _ if percent < 0.1 => format!("{percent:.3} %"),
        _ if percent < 10.0 => format!("{percent:.2} %"),
        _ => format!("{percent:.0} %"),
    }
}

/// A time as people read it.
#[must_use]
pub fn time(seconds: f64) -> String {
    if seconds.is_finite() { format!("{seconds:.2} s") } else { "?".into() }
}

/// A row of the table; `standing` is the scene as it stands.
#[must_use]
pub fn row(case: &Case, standing: &Case, quantities: &[Quantity]) -> String {
    let mut label: String = case.label.chars().take(LABEL).collect();
    if case.label.chars().count() > LABEL {
        label.pop();
        label.push('…');
    }
    let outcome = &case.outcome;
    if let Some(why) = &outcome.failed {
        return format!("{label:<LABEL$} not possible: {why}");
    }
    let faster = standing.outcome.wall() / outcome.wall();
    let errors = case.errors.iter().map(|error| error.unwrap_or(f64::INFINITY));
    let worst = errors.zip(quantities).max_by(|left, right| left.0.total_cmp(&right.0));
    let worst = worst.filter(|(error, _)| *error > 0.0).map_or(String::new(), |(_, quantity)| quantity.to_string());
    format!(
        "{label:<LABEL$} {:>9} {:>9} {:>7} {:>10} {:>9}  {worst}",
        time(outcome.wall()),
        time(outcome.cpu()),
        format!("{faster:.2}x"),
        outcome.exchanges,
        share(case.error()),
    )
}

/// Overrides as they are typed.
#[must_use]
pub fn typed(set: &Set) -> String {
    set.iter()
        .map(|(key, value)| format!("--set {}", words::quote(&format!("{key}={value}"))))
        .collect::<Vec<_>>()
        .join(" ")
}

/// The Pareto front and the recommended run.
#[must_use]
pub fn verdict(study: &Study) -> String {
    let standing = &study.cases[0];
    let known = study.known_to.iter().map(|error| error.unwrap_or(f64::INFINITY)).fold(0.0, f64::max);
    let mut text = format!("\nthe reference is known to about {}: a run half as tight differs by this\n", share(known));
    text += "no other run is both faster and at least as exact as one of these\n";
    for case in study.front.iter().map(|index| &study.cases[*index]) {
        let faster = standing.outcome.wall() / case.outcome.wall();
        let _ = writeln!(text, "  {:>9} {:>8}  {}", share(case.error()), format!("{faster:.2}x"), case.label);
    }
    match study.recommended.map(|index| &study.cases[index]) {
        Some(case) => {
            let faster = standing.outcome.wall() / case.outcome.wall();
            let _ = write!(
                text,
                "recommended within {}: {}, {faster:.2} times as fast as the scene as it stands, error {}",
                share(study.bound),
                case.label,
                share(case.error()),
            );
            if !case.outcome.set.is_empty() {
                let _ = write!(text, "\n  {}", typed(&case.outcome.set));
            }
        }
        None => {
            let nearest = study.cases.iter().filter(|case| case.axis != "reference" && !case.errors.is_empty());
            let nearest = nearest.min_by(|left, right| left.error().total_cmp(&right.error()));
            let _ = write!(text, "no run is within {}", share(study.bound));
            if let Some(case) = nearest {
                let _ = write!(text, "; the nearest is {}, error {}", case.label, share(case.error()));
            }
        }
    }
    text
}

/// What every table begins with.
pub const BEGIN: &str =
    "case,axis,settings,wall_s,cpu_s,steps,rejected,iterations,exchanges,bytes,largest_error,front,recommended,failed";

/// The table as CSV: times in s, values in SI units, errors as shares; empty where there is none.
///
/// # Errors
/// None on a study whose cases have one value for each quantity: nothing is written to a file.
pub fn csv(study: &Study) -> io::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let quantities = study.quantities.iter();
    let head = quantities.flat_map(|quantity| [quantity.clone(), format!("error of {quantity}")]);
    table.write_record(BEGIN.split(',').map(String::from).chain(head))?;
    let number = |value: Option<f64>| {
        value.filter(|value| value.is_finite()).map_or(String::new(), |value| format!("{value:e}"))
    };
    for (index, case) in study.cases.iter().enumerate() {
        let outcome = &case.outcome;
        let cells: [String; 14] = [
            case.label.clone(),
            case.axis.clone(),
            typed(&outcome.set),
            number(Some(outcome.wall())),
            number(Some(outcome.cpu())),
            outcome.steps.to_string(),
            outcome.rejected.to_string(),
            outcome.iterations.to_string(),
            outcome.exchanges.to_string(),
            outcome.bytes.to_string(),
            number(Some(case.rated().error)),
            u8::from(study.front.contains(&index)).to_string(),
            u8::from(study.recommended == Some(index)).to_string(),
            outcome.failed.clone().unwrap_or_default(),
        ];
        let at = |values: &[Option<f64>], place: usize| number(values.get(place).copied().flatten());
        let places = 0..study.quantities.len();
        table.write_record(
            cells.into_iter().chain(places.flat_map(|place| [at(&case.values, place), at(&case.errors, place)])),
        )?;
    }
    table.into_inner().map_err(csv::IntoInnerError::into_error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tradeoff::{FORMAT, Outcome};

    fn case(label: &str, wall_s: f64, error: f64, set: Set) -> Case {
        let outcome = Outcome { set, wall_s: vec![wall_s], cpu_s: vec![2.0 * wall_s], ..Outcome::default() };
        let (label, axis) = (label.into(), String::new());
        Case { label, axis, outcome, values: vec![Some(310.0)], errors: vec![Some(error)] }
    }

    #[test]
    fn rows_and_the_verdict_say_what_was_measured() {
        let set = vec![("coupling.dt".to_owned(), "{ start = 1e-6 }".to_owned())];
        let mut cases = vec![case("as it stands", 4.0, 0.004, Set::new()), case("dt, x 2", 2.0, 0.0123, set)];
        cases.push(Case {
            outcome: Outcome { failed: Some("no".into()), ..Outcome::default() },
            errors: vec![],
            ..cases[0].clone()
        });
        let quantities = ["mean temperature".parse().unwrap()];
        let told = row(&cases[1], &cases[0], &quantities);
        assert!(told.contains("2.00x") && told.contains("1.23 %  mean temperature"), "{told}");
        assert!(row(&cases[2], &cases[0], &quantities).ends_with("not possible: no"));
        let study = Study {
            format: FORMAT,
            title: String::new(),
            quantities: vec!["mean temperature".into()],
            overrides: Set::new(),
            bound: 0.02,
            known_to: vec![Some(1e-4)],
            cases,
            front: vec![1, 0],
            recommended: Some(1),
        };
        let told = verdict(&study);
        assert!(told.contains("within 2.00 %: dt, x 2, 2.00 times as fast"), "{told}");
        assert!(told.ends_with("--set 'coupling.dt={ start = 1e-6 }'"), "{told}");
        assert!(
            verdict(&Study { recommended: None, ..study.clone() })
                .ends_with("the nearest is as it stands, error 0.40 %")
        );
        let csv = String::from_utf8(csv(&study).unwrap()).unwrap();
        let lines: Vec<_> = csv.lines().collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[0].ends_with(",mean temperature,error of mean temperature"), "{csv}");
        assert!(lines[2].starts_with("\"dt, x 2\",") && lines[2].ends_with("3.1e2,1.23e-2"), "{csv}");
        assert!(lines[3].contains(",no,"), "{csv}");
    }
}
