//! Extended XYZ (github.com/libAtoms/extxyz, "The Extended XYZ specification"): the number of particles, a line of `key=value` with
//! `Properties=name:type:columns:…`, then a line for each particle.

use super::{Columns, Faults, MATERIAL, columns_of, csv, cut, lines, quoted};

/// Reads the first frame of the text; how many there are is told with the columns.
pub(crate) fn read(text: &str) -> Result<Columns, Faults> {
    let mut lines = lines(text).peekable();
    let count = count_of(lines.next().map_or("", |(_, line)| line), 1)?;
    let comment = lines.next().map_or("", |(_, line)| line);
    let names = columns(comment)?;
    let row = |(number, line): (usize, &str)| Ok((number, line.split_whitespace().map(str::to_owned).collect()));
    let mut read = csv::table(2, &names, lines.by_ref().take(count).map(row), number)?;
    if read.lines.len() < count {
        return Err(Faults::one(Some(1), format!("expected {count} particles, found {}", read.lines.len())));
    }
    read.frames = 1;
    // What follows is another frame, or the count was wrong.
    loop {
        while lines.next_if(|(_, line)| line.trim().is_empty()).is_some() {}
        let Some((number, line)) = lines.next() else { return Ok(read) };
        let count = count_of(line, number).map_err(|_| {
            let message = format!("expected another frame or the end behind {count} particles, found {}", quoted(line));
            Faults::one(Some(number), message)
        })?;
        // That a later frame is cut off does not change the first.
        lines.by_ref().take(count.saturating_add(1)).for_each(drop);
        read.frames += 1;
    }
}

fn count_of(line: &str, number: usize) -> Result<usize, Faults> {
    let wrong =
        |_| Faults::one(Some(number), format!("expected the number of particles, found {}", quoted(line.trim())));
    line.trim().parse().map_err(wrong)
}

/// A number of the specification, whose exponents may be Fortran's: `1.5d-6`.
fn number(word: &str) -> Option<f64> {
    let exponent = word.find(['d', 'D']).filter(|at| word[..*at].ends_with(|c: char| c.is_ascii_digit() || c == '.'));
    match exponent {
        None => csv::f64_of(word),
        Some(at) => csv::f64_of(&format!("{}e{}", &word[..at], &word[at + 1..])),
    }
}

/// The columns that `Properties` in the second line names, and whether they hold numbers.
fn columns(comment: &str) -> Result<Vec<(String, bool)>, Faults> {
    let wrong = |message: String| Faults::one(Some(2), message);
    let properties: Vec<String> = pairs(comment)
        .map_err(wrong)?
        .into_iter()
        .filter(|(key, _)| key.eq_ignore_ascii_case("Properties"))
        .map(|(_, value)| value)
        .collect();
    let [properties] = properties.as_slice() else {
        return Err(wrong(match properties.len() {
            0 => "expected Properties=pos:R:3:radius:R:1, which names the columns".into(),
            count => format!("expected Properties once, found it {count} times"),
        }));
    };
    let mut names = Vec::new();
    let parts: Vec<&str> = properties.split(':').map(str::trim).collect();
    for part in parts.chunks(3) {
        let malformed =
            || wrong(format!("expected name:type:columns in Properties, found {}", quoted(&part.join(":"))));
        let [name, kind, columns] = part else { return Err(malformed()) };
        let columns: usize = columns.parse().ok().filter(|count| (1..=100).contains(count)).ok_or_else(malformed)?;
        if !["R", "I", "S", "L"].contains(kind) {
            return Err(malformed());
        }
        // Types other than numbers are read as texts, and so is what may be either.
        let numbers = ["R", "I"].contains(kind);
        names.extend(columns_of(name, columns).map_err(wrong)?.into_iter().map(|name| {
            let number = numbers && name != MATERIAL;
            (name, number)
        }));
    }
    Ok(names)
}

/// The pairs of a line of `key=value`. Either may stand in quotes, with `\` before what would end them; a value also in
/// `{}` or `[]`. A key alone is true.
fn pairs(line: &str) -> Result<Vec<(String, String)>, String> {
    let mut pairs = Vec::new();
    let mut rest = line.trim_start();
    while !rest.is_empty() {
        let (key, after) = word(rest, &['='])?;
        // A blank on either side of `=` is allowed.
        match after.trim_start().strip_prefix('=') {
            Some(value) => {
                let (value, after) = word(value.trim_start(), &[])?;
                pairs.push((key, value));
                rest = after.trim_start();
            }
            None => {
                pairs.push((key, "T".into()));
                rest = after.trim_start();
            }
        }
    }
    Ok(pairs)
}

/// The next word, quoted, in brackets or plain; a plain one ends at a blank or at one of `ends`.
fn word<'t>(text: &'t str, ends: &[char]) -> Result<(String, &'t str), String> {
    let close = match text.chars().next() {
        Some(quote @ ('"' | '\'')) => quote,
        Some('{') => '}',
        Some('[') => ']',
        _ => {
            let end = text.find(|c: char| c.is_whitespace() || ends.contains(&c)).unwrap_or(text.len());
            // A lone `=` has no key; it is stepped over as one.
            let end = if end == 0 { text.chars().next().map_or(0, char::len_utf8) } else { end };
            return Ok((text[..end].to_owned(), &text[end..]));
        }
    };
    let open = text.chars().next().unwrap_or(close);
    let mut depth = 0usize;
    let mut value = String::new();
    let mut letters = text.char_indices().skip(1);
    while let Some((at, letter)) = letters.next() {
        match letter {
            '\\' if close == open => value.extend(letters.next().map(|(_, escaped)| escaped)),
            letter if letter == close && depth == 0 => return Ok((value, &text[at + letter.len_utf8()..])),
            letter => {
                depth += usize::from(letter == open);
                depth -= usize::from(letter == close);
                value.push(letter);
            }
        }
    }
    Err(format!("expected `{close}` to end what {} begins", cut(text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_may_be_quoted() {
        let found = pairs("a=1 'b c' = \"d \\\" Properties=e\" f g={1 2} h=[[1, 2], [3]] i=''").unwrap();
        let expected =
            [("a", "1"), ("b c", "d \" Properties=e"), ("f", "T"), ("g", "1 2"), ("h", "[1, 2], [3]"), ("i", "")];
        assert_eq!(found, expected.map(|(key, value)| (key.to_owned(), value.to_owned())));
        assert!(pairs("a=\"b").is_err() && pairs("a=[[1]").is_err());
        assert_eq!(pairs("= =b").unwrap().len(), 1);
    }

    #[test]
    fn numbers_may_have_the_exponents_of_fortran() {
        for (word, value) in [("1.5d-6", Some(1.5e-6)), ("1.D+02", Some(100.0)), ("1e2", Some(100.0)), ("d2", None)] {
            assert_eq!(number(word), value, "{word}");
        }
    }
}
