//! Comma-separated values: a line of names, then a line for each particle.

use super::{Columns, Faults, MATERIAL, Values};

/// Reads the text; empty lines and those that begin with `#` are left out. Semicolons and tabs separate, too.
pub(super) fn read(text: &str) -> Result<Columns, Faults> {
    // A byte order mark is what some spreadsheets begin with.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let Some((_, head)) = lines.next() else {
        return Err(Faults::one(None, "expected a line of names such as x,y,z,radius, found nothing"));
    };
    let separator = [',', ';', '\t'].into_iter().find(|separator| head.contains(*separator)).unwrap_or(',');
    let unquoted = |field: &str| field.trim().trim_matches('"').to_owned();
    let names: Vec<String> = head.split(separator).map(|name| unquoted(name).to_ascii_lowercase()).collect();
    let rows = lines.map(|(number, line)| (number, line.split(separator).map(unquoted).collect()));
    table(&names.iter().map(|name| (name.clone(), name != MATERIAL)).collect::<Vec<_>>(), rows)
}

/// Columns from rows of words with their lines; names say whether they hold numbers.
pub(super) fn table(
    names: &[(String, bool)],
    rows: impl Iterator<Item = (usize, Vec<String>)>,
) -> Result<Columns, Faults> {
    let mut faults = Faults::default();
    let mut columns: Vec<Values> = names
        .iter()
        .map(|(_, numbers)| if *numbers { Values::Numbers(Vec::new()) } else { Values::Words(Vec::new()) })
        .collect();
    let mut lines = Vec::new();
    for (line, words) in rows {
        if words.len() != names.len() {
            faults.push(Some(line), format!("expected {} values, found {}", names.len(), words.len()), None);
            continue;
        }
        lines.push(line);
        for ((column, (name, _)), word) in columns.iter_mut().zip(names).zip(words) {
            match column {
                Values::Words(column) => column.push(word),
                Values::Numbers(column) => match word.parse() {
                    Ok(number) => column.push(number),
                    // Whatever else a file holds besides particles may be text.
                    Err(_) if !super::is_known(name) => column.push(f64::NAN),
                    Err(_) => faults.push(Some(line), format!("expected a number as `{name}`, found {word:?}"), None),
                },
            }
        }
    }
    if !faults.0.is_empty() {
        return Err(faults);
    }
    let columns = names.iter().map(|(name, _)| name.clone()).zip(columns).collect();
    Ok(Columns { columns, lines })
}
