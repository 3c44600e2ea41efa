//! Extended XYZ: the number of particles, a line of `key=value` with `Properties=name:type:columns:…`, then a line for
//! each particle.

use super::{Columns, Faults, MATERIAL, columns_of, csv};

/// Reads the first frame of the text.
pub(super) fn read(text: &str) -> Result<Columns, Faults> {
    let mut lines = (1..).zip(text.lines());
    let first = lines.next().map_or("", |(_, line)| line.trim());
    let count: usize = first
        .parse()
        .map_err(|_| Faults::one(Some(1), format!("expected the number of particles, found {first:?}")))?;
    let comment = lines.next().map_or("", |(_, line)| line);
    let Some(properties) = value_of(comment, "Properties") else {
        let expected = "expected Properties=pos:R:3:radius:R:1, which names the columns";
        return Err(Faults::one(Some(2), expected));
    };
    let mut names = Vec::new();
    let parts: Vec<&str> = properties.split(':').collect();
    for part in parts.chunks(3) {
        let wrong = || Faults::one(Some(2), format!("expected name:type:columns in Properties, found {part:?}"));
        let [name, kind, columns] = part else { return Err(wrong()) };
        let columns: usize = columns.parse().ok().filter(|count| (1..=100).contains(count)).ok_or_else(wrong)?;
        if !["R", "I", "S", "L"].contains(kind) {
            return Err(wrong());
        }
        // Types other than numbers are read as texts, and so is what may be either.
        let numbers = ["R", "I"].contains(kind);
        names.extend(columns_of(name, columns).into_iter().map(|name| {
            let number = numbers && name != MATERIAL;
            (name, number)
        }));
    }
    let rows = lines.take(count).map(|(number, line)| (number, line.split_whitespace().map(str::to_owned).collect()));
    let read = csv::table(&names, rows)?;
    if read.lines.len() < count {
        return Err(Faults::one(Some(1), format!("expected {count} particles, found {}", read.lines.len())));
    }
    Ok(read)
}

/// The value of a key in a line of `key=value` or `key="value"`.
fn value_of<'t>(line: &'t str, key: &str) -> Option<&'t str> {
    let at = line.match_indices(key).map(|(at, _)| at).find(|at| {
        let before = line[..*at].chars().next_back();
        before.is_none_or(char::is_whitespace) && line[at + key.len()..].starts_with('=')
    })?;
    let value = &line[at + key.len() + 1..];
    match value.strip_prefix('"') {
        Some(quoted) => quoted.split('"').next(),
        None => value.split_whitespace().next(),
    }
}
