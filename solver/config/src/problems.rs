//! Everything wrong with a scene, in one go: each mistake with its place, its key, and what was expected.

use std::{borrow::Cow, fmt};

/// All mistakes of a scene, in the order of the file; those of `--set` follow.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct Problems {
    /// The mistakes; never empty.
    pub list: Vec<Problem>,
}

/// One mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where it is: `scenes/x.toml:12`, or `--set particles.count`.
    pub location: String,
    /// The key it concerns: `particles.radius.mean`; empty where the file is not TOML.
    pub key: String,
    /// What was expected and what was found.
    pub message: String,
    /// What to do about it, where that is not plain.
    pub hint: Option<String>,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.location)?;
        if !self.key.is_empty() && self.location != format!("--set {}", self.key) {
            write!(f, "{}: ", self.key)?;
        }
        write!(f, "{}", self.message)?;
        self.hint.as_ref().map_or(Ok(()), |hint| write!(f, "\n  hint: {hint}"))
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.list.iter().take(TOLD).enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            write!(f, "{separator}{problem}")?;
        }
        match self.list.len().saturating_sub(TOLD) {
            0 => Ok(()),
            more => write!(f, "\n(and {more} more mistakes)"),
        }
    }
}

/// Mistakes that a message tells; the rest are counted.
const TOLD: usize = 100;
/// Characters of one message: what quotes its values needs a few hundred.
const MESSAGE: usize = 2000;

/// Where something in a scene was written; lines come before overrides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// A line of the file, from 1.
    Line(usize),
    /// An override, by its number.
    Set(usize),
}

/// A mistake before the names of places are known.
#[derive(Clone, Debug)]
pub struct Mistake {
    /// Where it stands.
    pub place: Place,
    /// The key.
    pub key: String,
    /// What was expected and what was found.
    pub message: String,
    /// What to do.
    pub hint: Option<String>,
}

impl Problems {
    /// Sorts the mistakes and names their places.
    pub fn new(file: &str, overrides: &[(String, String)], mut mistakes: Vec<Mistake>) -> Self {
        mistakes.sort_by_key(|mistake| mistake.place);
        // A property of a material that two physics need is missing once.
        mistakes.dedup_by(|right, left| {
            (right.place, &right.key, &right.message) == (left.place, &left.key, &left.message)
        });
        let location = |place| match place {
            Place::Line(line) => format!("{file}:{line}"),
            Place::Set(index) => {
                let key = overrides.get(index).map_or_else(String::new, |(key, _)| at_most(key.clone(), MESSAGE / 10));
                format!("--set {key}")
            }
        };
        let problem = |Mistake { place, key, message, hint }| Problem {
            location: location(place),
            key: at_most(key, MESSAGE / 10),
            message: at_most(message, MESSAGE),
            hint: hint.map(|hint| at_most(hint, MESSAGE)),
        };
        Self { list: mistakes.into_iter().map(problem).collect() }
    }
}

/// The first characters of a text, and a mark where there are more.
fn at_most(mut text: String, characters: usize) -> String {
    if let Some((end, _)) = text.char_indices().nth(characters) {
        text.truncate(end);
        text.push('\u{2026}');
    }
    text
}

/// Characters of a value that a message quotes.
const QUOTED: usize = 60;

/// A user's text as messages quote it: up to 60 characters, else how it begins and how long it is; on one line, without
/// characters that command a terminal.
pub fn cut(text: &str) -> Cow<'_, str> {
    let end = text.char_indices().nth(QUOTED).map(|(at, _)| at);
    let kept = &text[..end.unwrap_or(text.len())];
    let shown = match kept.chars().any(char::is_control) {
        true => {
            kept.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
        }
        false => Cow::Borrowed(kept),
    };
    match end {
        None => shown,
        Some(_) => format!("{shown}\u{2026} ({} characters)", text.chars().count()).into(),
    }
}

/// As [`cut`], in quotes.
pub fn quoted(text: &str) -> String {
    match text.char_indices().nth(QUOTED) {
        None => format!("{text:?}"),
        Some((end, _)) => format!("{:?}\u{2026} ({} characters)", &text[..end], text.chars().count()),
    }
}

/// The name nearest to a mistyped one, where one is near: at most a third of its letters differ.
pub fn nearest<'n>(typed: &str, names: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let letters = |name: &str| name.to_lowercase().replace('_', "-");
    let length = typed.chars().count();
    let near = (length / 3).max(1);
    names
        .into_iter()
        // Names that differ in length by more are not near, and comparing long ones takes long.
        .filter(|name| name.chars().count().abs_diff(length) <= near)
        .map(|name| (strsim::osa_distance(&letters(typed), &letters(name)), name))
        .filter(|(distance, _)| *distance <= near)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typing_mistakes_find_their_name() {
        let names = ["radius", "mean", "contact", "default-tolerance"];
        for (typed, meant) in [
            ("raduis", Some("radius")),
            ("maen", Some("mean")),
            ("contacts", Some("contact")),
            ("default_tolerance", Some("default-tolerance")),
            ("colour", None),
        ] {
            assert_eq!(nearest(typed, names), meant, "{typed}");
        }
    }
}
