//! Comma-separated values (RFC 4180): a line of names, then a line for each particle. Semicolons and tabs separate, too.

use super::{Columns, Faults, MATERIAL, Values, columns_of, cut, hint_for_number, lines, quoted};

/// What may stand between values.
const SEPARATORS: [char; 3] = [',', ';', '\t'];

/// Reads the text; blank lines and those that begin with `#` are left out.
pub(crate) fn read(text: &str) -> Result<Columns, Faults> {
    let Some((number, head)) = lines(text).find(|(_, line)| !is_left_out(line)) else {
        return Err(Faults::one(None, "expected a line of names such as x,y,z,radius, found nothing"));
    };
    let mut records = Records { rest: text, line: 1, separator: separator_of(head) };
    let names: Vec<String> = match records.next() {
        Some(Ok((_, names))) => names,
        Some(Err(faults)) => return Err(faults),
        None => Vec::new(),
    };
    let mut faults = Faults::default();
    if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        let hint = "a line that begins with # is a comment: names stand in a line without";
        faults.push(Some(number), "expected names such as x,y,z,radius, found numbers", Some(hint.into()));
        return Err(faults);
    }
    let mut columns = Vec::new();
    for name in &names {
        match columns_of(name, 1) {
            Ok(mut name) => columns.append(&mut name),
            Err(message) => faults.push(Some(number), message, None),
        }
    }
    if !faults.0.is_empty() {
        return Err(faults);
    }
    let columns: Vec<(String, bool)> = columns.into_iter().map(|name| (name.clone(), name != MATERIAL)).collect();
    table(number, &columns, records, f64_of)
}

/// A number as Rust writes and reads it: `1`, `-2.5`, `1e-6`.
pub(crate) fn f64_of(word: &str) -> Option<f64> {
    word.parse().ok()
}

fn is_left_out(line: &str) -> bool {
    let line = line.trim_start();
    line.is_empty() || line.starts_with('#')
}

/// What separates most often in the line of names, outside of quotes; a comma where nothing does.
fn separator_of(head: &str) -> char {
    let count = |separator: char| head.split('"').step_by(2).map(|part| part.matches(separator).count()).sum::<usize>();
    // The first of equals.
    SEPARATORS.into_iter().rev().max_by_key(|separator| count(*separator)).unwrap_or(',')
}

/// The records of a text, each with the line it begins in.
struct Records<'t> {
    rest: &'t str,
    line: usize,
    separator: char,
}

impl Iterator for Records<'_> {
    type Item = Result<(usize, Vec<String>), Faults>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if self.rest.is_empty() {
                return None;
            }
            let end = self.rest.find(['\n', '\r']).unwrap_or(self.rest.len());
            if !is_left_out(&self.rest[..end]) {
                let line = self.line;
                return Some(self.fields().map(|fields| (line, fields)));
            }
            self.rest = &self.rest[end..];
            self.end_line();
        }
    }
}

impl Records<'_> {
    /// Steps over the end of a line, where there is one.
    fn end_line(&mut self) -> bool {
        let end = ["\r\n", "\n", "\r"].into_iter().find_map(|end| self.rest.strip_prefix(end));
        if let Some(rest) = end {
            self.rest = rest;
            self.line += 1;
        }
        end.is_some()
    }

    fn fields(&mut self) -> Result<Vec<String>, Faults> {
        let mut fields = Vec::new();
        loop {
            let separator = self.separator;
            let blank = |c: char| c.is_whitespace() && !['\n', '\r', separator].contains(&c);
            let begin = self.rest.trim_start_matches(blank);
            if let Some(quoted) = begin.strip_prefix('"') {
                self.rest = quoted;
                fields.push(self.quoted()?);
                self.rest = self.rest.trim_start_matches(blank);
            } else {
                let end = self.rest.find(['\n', '\r', separator]).unwrap_or(self.rest.len());
                fields.push(self.rest[..end].trim().to_owned());
                self.rest = &self.rest[end..];
            }
            if let Some(rest) = self.rest.strip_prefix(separator) {
                self.rest = rest;
            } else if self.end_line() || self.rest.is_empty() {
                return Ok(fields);
            } else {
                let line = self.line;
                let end = self.rest.find(['\n', '\r', separator]).unwrap_or(self.rest.len());
                let found = quoted(&self.rest[..end]);
                // What follows cannot be told apart.
                self.rest = "";
                let message =
                    format!("expected {separator:?} or the end of the line behind the closing quote, found {found}");
                return Err(Faults::one(Some(line), message));
            }
        }
    }

    /// A value behind its opening quote: to the next one that is not doubled, over lines.
    fn quoted(&mut self) -> Result<String, Faults> {
        let first = self.line;
        let mut value = String::new();
        loop {
            let Some(end) = self.rest.find('"') else {
                self.rest = "";
                return Err(Faults::one(Some(first), "expected a closing quote, found the end of the file"));
            };
            let part = &self.rest[..end];
            self.line += lines(part).count().saturating_sub(1) + usize::from(part.ends_with(['\n', '\r']));
            value.push_str(part);
            match self.rest[end + 1..].strip_prefix('"') {
                Some(rest) => {
                    value.push('"');
                    self.rest = rest;
                }
                None => {
                    self.rest = &self.rest[end + 1..];
                    return Ok(value.trim().to_owned());
                }
            }
        }
    }
}

/// Columns from rows of words with their lines; names, in the line `head`, say whether they hold numbers, which
/// `number` reads.
pub(crate) fn table(
    head: usize,
    names: &[(String, bool)],
    rows: impl Iterator<Item = Result<(usize, Vec<String>), Faults>>,
    number: fn(&str) -> Option<f64>,
) -> Result<Columns, Faults> {
    let mut faults = Faults::default();
    let mut columns: Vec<Values> = names
        .iter()
        .map(|(_, numbers)| if *numbers { Values::Numbers(Vec::new()) } else { Values::Words(Vec::new()) })
        .collect();
    let mut lines = Vec::new();
    for row in rows {
        let (line, words) = match row {
            Ok(row) => row,
            Err(more) => {
                faults.0.extend(more.0);
                continue;
            }
        };
        if words.len() != names.len() {
            let is_longer = words.len() > names.len();
            let hint = match words.last() {
                Some(last) if is_longer && last.is_empty() => Some("the line ends with a separator".to_owned()),
                _ if words.len() == 2 * names.len() => Some("write a point, not a comma, in numbers".to_owned()),
                _ => None,
            };
            faults.push(Some(line), format!("expected {} values, found {}", names.len(), words.len()), hint);
            continue;
        }
        lines.push(line);
        for ((column, (name, _)), word) in columns.iter_mut().zip(names).zip(words) {
            match column {
                Values::Words(column) => column.push(word),
                Values::Numbers(column) => match number(&word) {
                    Some(number) => column.push(number),
                    // Whatever else a file holds besides particles may be text.
                    None if !super::is_known(name) => column.push(f64::NAN),
                    None => {
                        let message = format!("expected a number as `{}`, found {}", cut(name), quoted(&word));
                        faults.push(Some(line), message, hint_for_number(&word));
                    }
                },
            }
        }
    }
    let mut table = Columns { lines, ..Columns::default() };
    for ((name, _), values) in names.iter().zip(columns) {
        if let Err(message) = table.push(name.clone(), values) {
            faults.push(Some(head), message, None);
        }
    }
    if faults.0.is_empty() { Ok(table) } else { Err(faults) }
}
