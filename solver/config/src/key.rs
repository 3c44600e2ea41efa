//! What a scene may say: sections and keys as data, from which the reader, the documentation and the schema are made.

use super::units::Quantity;

/// A table of the scene.
#[derive(Debug)]
pub struct Section {
    /// Its path: `particles.contact`; `walls.NAME` where the user chooses the name; empty at the top.
    pub path: &'static str,
    /// What it describes.
    pub doc: &'static str,
    /// An example, shown where something else stands in its place.
    pub example: &'static str,
    /// The key that a plain value in place of the table stands for.
    pub shorthand: Option<&'static Key>,
    /// Its keys.
    pub keys: &'static [&'static Key],
}

/// A key of a table.
#[derive(Debug)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// What it takes.
    pub kind: Kind,
    /// What holds where it is not given.
    pub default: Fallback,
    /// The key of the same table and its values with which this one is allowed; `None` is always.
    pub when: Option<(&'static str, &'static [&'static str])>,
    /// What it does.
    pub doc: &'static str,
}

/// What a key takes.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A number with its quantity and range.
    Number(&'static Quantity, Range),
    /// A whole number from the first to the second.
    Whole(u64, u64),
    /// Three components.
    Vector(&'static Quantity),
    /// Numbers with their quantity and range, in a list; one number stands for a list of one.
    Series(&'static Quantity, Range),
    /// A list of three components each.
    Vectors(&'static Quantity),
    /// A number with its quantity and range, or a list of pairs of a temperature and such a number; temperatures rise.
    OverTemperature(&'static Quantity, Range),
    /// A text.
    Text,
    /// The path of a file, whose contents become part of the scene.
    File,
    /// A list of texts.
    Texts,
    /// True or false.
    Flag,
    /// One of some words, each with what it means.
    Choice(&'static [(&'static str, &'static str)]),
    /// A table of numbers under names the user chooses.
    Numbers(&'static Quantity, Range),
    /// A table of whole numbers, from the first to the second, under names the user chooses.
    Wholes(u64, u64),
    /// A table.
    Table(&'static Section),
    /// Tables under names the user chooses.
    Named(&'static Section),
    /// Tables under names the user chooses, each with keys of the scene as they stand in it.
    Scenes,
}

/// What holds where a key is not given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fallback {
    /// It must be given.
    Required,
    /// A value, as it would be written.
    Is(&'static str),
    /// Something else, in words.
    From(&'static str),
}

/// An interval of numbers; all numbers of a scene are finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Whether the lower end belongs to it.
    pub low_included: bool,
    /// Upper end, which belongs to it.
    pub high: f64,
}

impl Range {
    /// Every number.
    pub const ANY: Self = Self { low: f64::NEG_INFINITY, low_included: false, high: f64::INFINITY };
    /// Above zero.
    pub const POSITIVE: Self = Self { low: 0.0, ..Self::ANY };
    /// Zero and above.
    pub const NOT_NEGATIVE: Self = Self { low: 0.0, low_included: true, ..Self::ANY };

    /// Both ends included.
    #[must_use]
    pub const fn within(low: f64, high: f64) -> Self {
        Self { low, low_included: true, high }
    }

    /// Only the upper end included.
    #[must_use]
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, low_included: false, high }
    }

    /// Whether a number lies in it.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        let above = if self.low_included { value >= self.low } else { value > self.low };
        value.is_finite() && above && value <= self.high
    }

    /// The quantity with the range: `a positive length`, `a number from 0 to 1`.
    #[must_use]
    pub fn describe(&self, quantity: &Quantity) -> String {
        let (name, unit) = (quantity.with_article(), quantity.unit);
        // Zero is zero in every unit.
        let number =
            |value: f64| if unit.is_empty() || value == 0.0 { format!("{value}") } else { format!("{value} {unit}") };
        match (self.low.is_finite(), self.high.is_finite()) {
            (false, false) => name,
            (false, true) => format!("{name} of at most {}", number(self.high)),
            (true, false) if self.low_included => format!("{name} of at least {}", number(self.low)),
            (true, false) if self.low > 0.0 => format!("{name} above {}", number(self.low)),
            (true, false) => format!("a positive {}", quantity.name),
            (true, true) if self.low_included => format!("{name} from {} to {}", number(self.low), number(self.high)),
            (true, true) => format!("{name} above {} and at most {}", number(self.low), number(self.high)),
        }
    }
}

impl Kind {
    /// What a message and the documentation say is expected: `a positive length such as "25 um"`.
    #[must_use]
    pub fn expected(&self) -> String {
        let with_example = |text: String, quantity: &Quantity| {
            if quantity.unit.is_empty() { text } else { format!("{text} such as \"{}\"", quantity.example) }
        };
        match self {
            Self::Number(quantity, range) => with_example(range.describe(quantity), quantity),
            Self::Whole(low, high) if *high >= i64::MAX as u64 => format!("a whole number of at least {low}"),
            Self::Whole(low, high) => format!("a whole number from {low} to {high}"),
            Self::Vector(quantity) if quantity.unit.is_empty() => "a list of three numbers".into(),
            Self::Vector(quantity) => {
                format!("a list of three numbers, each {} such as \"{}\"", quantity.with_article(), quantity.example)
            }
            Self::Series(quantity, range) => {
                format!("{}, or a list of such", with_example(range.describe(quantity), quantity))
            }
            Self::Vectors(quantity) => format!("a list, each entry {}", Self::Vector(quantity).expected()),
            Self::OverTemperature(quantity, range) => {
                let number = with_example(range.describe(quantity), quantity);
                format!("{number}, or a list of pairs of a rising temperature and such a number")
            }
            Self::Text => "a text in quotes".into(),
            Self::File => "the path of a file, in quotes".into(),
            Self::Texts => "a list of texts in quotes".into(),
            Self::Flag => "true or false".into(),
            Self::Choice(words) => {
                let quoted: Vec<String> = words.iter().map(|(word, _)| format!("\"{word}\"")).collect();
                match quoted.as_slice() {
                    [only] => only.clone(),
                    [first @ .., last] => format!("{} or {last}", first.join(", ")),
                    [] => String::new(),
                }
            }
            Self::Numbers(quantity, range) => format!("a table of names, each with {}", range.describe(quantity)),
            Self::Wholes(low, high) => format!("a table of names, each with {}", Self::Whole(*low, *high).expected()),
            Self::Table(section) => match section.shorthand {
                Some(key) => format!("{}, or a table such as {}", key.kind.expected(), section.example),
                None => format!("a table such as {}", section.example),
            },
            Self::Named(section) => format!("tables named [{}]", section.path),
            Self::Scenes => "tables under names of your own, with keys of the scene".into(),
        }
    }
}

impl Key {
    /// A key of this kind that must be given.
    pub const fn new(name: &'static str, kind: Kind, doc: &'static str) -> Self {
        Self { name, kind, default: Fallback::Required, when: None, doc }
    }

    /// With a default, as it would be written.
    pub const fn or(mut self, value: &'static str) -> Self {
        self.default = Fallback::Is(value);
        self
    }

    /// With a default in words: the code that reads it supplies it.
    pub const fn or_from(mut self, words: &'static str) -> Self {
        self.default = Fallback::From(words);
        self
    }

    /// Allowed only where another key of the table has one of some values.
    pub const fn when(mut self, key: &'static str, values: &'static [&'static str]) -> Self {
        self.when = Some((key, values));
        self
    }
}

impl Section {
    /// All tables of the scene below and including this one, parents first; one that several keys take comes once.
    #[must_use]
    pub fn tree(&'static self) -> Vec<&'static Self> {
        let mut sections = vec![self];
        for key in self.keys {
            if let Kind::Table(inner) | Kind::Named(inner) = key.kind {
                for section in inner.tree() {
                    if sections.iter().all(|known| known.path != section.path) {
                        sections.push(section);
                    }
                }
            }
        }
        sections
    }
}
