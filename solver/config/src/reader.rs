//! Reads the keys of a scene's tables by their descriptions, collecting every mistake instead of stopping at the first.
//!
//! A value that cannot be read is replaced by a placeholder (NaN, 0, an empty text) so that reading goes on; as a
//! scene with mistakes is never handed out, nothing computes with it. Checks between keys are written so that NaN
//! passes them.

use std::{cell::RefCell, collections::BTreeMap, sync::Arc};

use super::{
    Value,
    files::{ReadFile, Reader},
    key::{Fallback, Key, Kind, Section},
    node_values::{Mismatch, mismatch, numbers_in, show, show_si, si_value, text, vector, whole},
    over_temperature,
    problems::{Mistake, Place, nearest, quoted},
    tree::{self, Entry, Item, Node},
    units,
};

/// What reading a scene yields besides its settings.
pub struct Log<'r> {
    /// Every mistake so far.
    pub mistakes: RefCell<Vec<Mistake>>,
    /// Every value that was read.
    pub values: RefCell<Vec<Value>>,
    /// What was read, exactly, however it is spelled and whether it was given or is a default.
    pub identity: RefCell<Vec<u8>>,
    /// The files that values name.
    pub files: Reader<'r>,
}

impl<'r> Log<'r> {
    /// Nothing read yet; `read` reads the files the scene names.
    pub fn new(read: ReadFile<'r>) -> Self {
        Self {
            mistakes: RefCell::default(),
            values: RefCell::default(),
            identity: RefCell::default(),
            files: Reader::new(read),
        }
    }
}

/// A table being read.
pub struct Table<'d> {
    log: &'d Log<'d>,
    section: &'static Section,
    path: String,
    place: Place,
    entries: Vec<(&'d str, Place, &'d Node)>,
    /// Names of the keys asked for, and of those a mistyped key was surely meant to be.
    asked: RefCell<Vec<&'static str>>,
    meant: Vec<&'static str>,
}

impl<'d> Table<'d> {
    /// The top of a scene.
    pub fn root(log: &'d Log<'d>, section: &'static Section, entries: &'d [Entry]) -> Self {
        let entries = entries.iter().map(|entry| (entry.name.as_str(), entry.place, &entry.node)).collect();
        Self::open(log, section, String::new(), Place::Line(1), entries)
    }

    fn open(
        log: &'d Log<'d>,
        section: &'static Section,
        path: String,
        place: Place,
        entries: Vec<(&'d str, Place, &'d Node)>,
    ) -> Self {
        let mut table = Self { log, section, path, place, entries, asked: RefCell::default(), meant: Vec::new() };
        // That a table is there may mean something of its own.
        identify(log, &table.path, &[]);
        for index in 0..table.entries.len() {
            let (name, place, _) = table.entries[index];
            let known = || section.keys.iter().map(|key| key.name);
            if known().any(|key| key == name) {
                continue;
            }
            let message = match nearest(name, known()) {
                Some(meant) => {
                    table.meant.push(meant);
                    format!("unknown key, did you mean `{meant}`?")
                }
                None => format!("unknown key; known are {}", known().collect::<Vec<_>>().join(", ")),
            };
            table.mistake(place, table.path_of(name), message, None);
        }
        table
    }

    /// The dotted path of a key of this table.
    pub fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() { name.into() } else { format!("{}.{name}", self.path) }
    }

    fn mistake(&self, place: Place, key: String, message: String, hint: Option<String>) {
        self.log.mistakes.borrow_mut().push(Mistake { place, key, message, hint });
    }

    /// Reports a mistake that concerns a key: at its place where it is given, else at the table's.
    pub fn reject(&self, key: &Key, message: impl Into<String>) {
        self.reject_with(key, message, None);
    }

    /// As [`Self::reject`], with what to do about it.
    pub fn reject_with(&self, key: &Key, message: impl Into<String>, hint: Option<String>) {
        let place = self.given(key).map_or(self.place, |(place, _)| place);
        self.mistake(place, self.path_of(key.name), message.into(), hint);
    }

    /// Reports a mistake in a name the user chose in the table a key holds.
    pub fn reject_name(&self, key: &Key, name: &str, message: String, hint: Option<String>) {
        let Some((_, Node { item: Item::Table(entries), .. })) = self.given(key) else { return };
        let place = entries.iter().find(|entry| entry.name == name).map_or(self.place, |entry| entry.place);
        self.mistake(place, format!("{}.{name}", self.path_of(key.name)), message, hint);
    }

    /// Whether a key is given, be its value right or wrong.
    pub fn is_given(&self, key: &Key) -> bool {
        self.given(key).is_some()
    }

    fn given(&self, key: &Key) -> Option<(Place, &'d Node)> {
        self.entries.iter().find(|(name, _, _)| *name == key.name).map(|&(_, place, node)| (place, node))
    }

    fn ask(&self, key: &'static Key) -> Option<(Place, &'d Node)> {
        self.asked.borrow_mut().push(key.name);
        self.given(key)
    }

    fn record(&self, key: &Key, shown: String, si: Vec<f64>, is_default: bool) {
        let exact = match key.kind {
            Kind::Number(..) | Kind::Vector(_) | Kind::Vectors(_) | Kind::Series(..) => bits(&si),
            _ => shown.clone().into_bytes(),
        };
        identify(self.log, &self.path_of(key.name), &exact);
        let value = Value { path: self.path_of(key.name), value: shown, si, is_default, doc: key.doc };
        self.log.values.borrow_mut().push(value);
    }

    /// Adds a remark to a value as `check` shows it.
    pub fn remark(&self, key: &Key, remark: &str) {
        let path = self.path_of(key.name);
        if let Some(value) = self.log.values.borrow_mut().iter_mut().rev().find(|value| value.path == path) {
            value.value += &format!(" ({remark})");
        }
    }

    /// Reports a key that must be given and is not, unless a mistyped one was surely meant to be it.
    pub fn missing(&self, key: &Key) {
        if !self.meant.contains(&key.name) {
            self.mistake(
                self.place,
                self.path_of(key.name),
                format!("missing; expected {}", key.kind.expected()),
                None,
            );
        }
    }

    /// Reads a key; `None` where it is absent without a default, or wrong (which is reported).
    fn read<T>(&self, key: &'static Key, convert: impl Fn(&Node) -> Result<T, Mismatch>) -> Option<T> {
        let default;
        let (node, is_default) = match (self.ask(key), key.default) {
            (Some((_, node)), _) => (node, false),
            (None, Fallback::Is(text)) => {
                default = tree::parse_value(text, self.place)?;
                (&default, true)
            }
            (None, Fallback::From(_)) => return None,
            (None, Fallback::Required) => {
                self.missing(key);
                return None;
            }
        };
        match convert(node) {
            Ok(value) => {
                self.record(key, show(&key.kind, node), numbers_in(&key.kind, node), is_default);
                Some(value)
            }
            Err((found, hint)) => {
                let message = format!("expected {}, found {found}", key.kind.expected());
                self.mistake(node.place, self.path_of(key.name), message, hint);
                None
            }
        }
    }

    /// A number in SI units, where it is given or has a default.
    pub fn optional_number(&self, key: &'static Key) -> Option<f64> {
        self.read(key, |node| match key.kind {
            Kind::Number(quantity, range) => {
                let (value, found) = si_value(node, quantity)?;
                if range.contains(value) { Ok(value) } else { Err((found, None)) }
            }
            _ => Err(mismatch(node)),
        })
    }

    /// A number in SI units.
    pub fn number(&self, key: &'static Key) -> f64 {
        self.optional_number(key).unwrap_or(f64::NAN)
    }

    /// A number in SI units whose default follows from other keys.
    pub fn number_or(&self, key: &'static Key, default: impl FnOnce() -> f64) -> f64 {
        self.optional_number(key).unwrap_or_else(|| {
            let default = default();
            if let Kind::Number(quantity, _) = key.kind {
                self.record(key, show_si(default, quantity), vec![default], true);
            }
            default
        })
    }

    /// A whole number.
    pub fn whole(&self, key: &'static Key) -> u64 {
        let value = self.read(key, |node| match key.kind {
            Kind::Whole(low, high) => whole(node, low, high),
            _ => Err(mismatch(node)),
        });
        value.unwrap_or(0)
    }

    /// A whole number that fits 32 bits, as its range says.
    pub fn whole_u32(&self, key: &'static Key) -> u32 {
        u32::try_from(self.whole(key)).unwrap_or(u32::MAX)
    }

    /// Three components in SI units, where they are given or have a default.
    pub fn optional_vector(&self, key: &'static Key) -> Option<[f64; 3]> {
        self.read(key, |node| match key.kind {
            Kind::Vector(quantity) => vector(node, quantity),
            _ => Err(mismatch(node)),
        })
    }

    /// Lists of three components in SI units, where they are given or have a default.
    pub fn vectors(&self, key: &'static Key) -> Option<Vec<[f64; 3]>> {
        self.read(key, |node| {
            let (Kind::Vectors(quantity), Item::List(list)) = (key.kind, &node.item) else {
                return Err(mismatch(node));
            };
            let entry = |(number, node)| {
                vector(node, quantity).map_err(|(found, hint)| (format!("{found} in entry {number}"), hint))
            };
            (1..).zip(list).map(entry).collect()
        })
    }

    /// Pairs of a temperature in K and a number in SI units, where they are given; one number stands for one at 0 K.
    pub fn over_temperature(&self, key: &'static Key) -> Option<Vec<[f64; 2]>> {
        self.read(key, |node| {
            let Kind::OverTemperature(quantity, range) = key.kind else { return Err(mismatch(node)) };
            over_temperature::read(node, quantity, range)
        })
    }

    /// Numbers in SI units, where they are given or have a default.
    pub fn series(&self, key: &'static Key) -> Option<Vec<f64>> {
        self.read(key, |node| {
            let Kind::Series(quantity, range) = key.kind else { return Err(mismatch(node)) };
            let number = |node: &Node| {
                let (value, found) = si_value(node, quantity)?;
                if range.contains(value) { Ok(value) } else { Err((found, None)) }
            };
            let Item::List(list) = &node.item else { return Ok(vec![number(node)?]) };
            let entry =
                |(entry, node)| number(node).map_err(|(found, hint)| (format!("{found} as entry {entry}"), hint));
            (1..).zip(list).map(entry).collect()
        })
    }

    /// Three components in SI units.
    pub fn vector(&self, key: &'static Key) -> [f64; 3] {
        self.optional_vector(key).unwrap_or([f64::NAN; 3])
    }

    /// Three components whose default follows from other keys.
    pub fn vector_or(&self, key: &'static Key, default: [f64; 3]) -> [f64; 3] {
        self.optional_vector(key).unwrap_or_else(|| {
            if let Kind::Vector(quantity) = key.kind {
                let shown = default.map(|component| show_si(component, &units::NUMBER)).join(", ");
                self.record(key, format!("[{shown}] {}", quantity.unit), default.to_vec(), true);
            }
            default
        })
    }

    /// A direction, normalised; a zero vector is reported.
    pub fn direction(&self, key: &'static Key) -> [f64; 3] {
        let vector = self.vector(key);
        // Scaled first, so that neither tiny nor huge components lose their squares.
        let largest = vector.iter().fold(0.0f64, |largest, component| largest.max(component.abs()));
        if vector.iter().all(|component| *component == 0.0) {
            self.reject(key, "expected a direction, found a vector of length zero");
            return [f64::NAN; 3];
        }
        let scaled = vector.map(|component| component / largest);
        let length = scaled.iter().map(|component| component * component).sum::<f64>().sqrt();
        scaled.map(|component| component / length)
    }

    /// A text, where it is given.
    pub fn optional_text(&self, key: &'static Key) -> Option<String> {
        self.read(key, text)
    }

    /// A text.
    pub fn text(&self, key: &'static Key) -> String {
        self.optional_text(key).unwrap_or_default()
    }

    /// The path a key gives and the contents of the file there; `None` where it is absent or cannot be read.
    pub fn optional_file(&self, key: &'static Key) -> Option<(String, Arc<[u8]>)> {
        let path = self.read(key, text)?;
        match self.log.files.contents(&path) {
            Ok(contents) => Some((path, contents)),
            Err(error) => {
                let hint = "a relative path begins at the folder of the scene".into();
                self.reject_with(key, format!("cannot read {}: {error}", quoted(&path)), Some(hint));
                None
            }
        }
    }

    /// A list of texts, where it is given or has a default.
    pub fn texts(&self, key: &'static Key) -> Option<Vec<String>> {
        self.read(key, |node| match &node.item {
            Item::List(list) => list.iter().map(text).collect(),
            _ => Err(mismatch(node)),
        })
    }

    /// True or false.
    pub fn flag(&self, key: &'static Key) -> bool {
        let value = self.read(key, |node| match node.item {
            Item::Flag(flag) => Ok(flag),
            _ => Err(mismatch(node)),
        });
        value.unwrap_or(false)
    }

    /// One of the key's words, where it is given or has a default.
    pub fn optional_choice(&self, key: &'static Key) -> Option<&'static str> {
        self.read(key, |node| {
            let (Kind::Choice(words), Item::Text(text)) = (key.kind, &node.item) else { return Err(mismatch(node)) };
            words.iter().map(|(word, _)| *word).find(|word| word == text).ok_or_else(|| {
                let near = nearest(text, words.iter().map(|(word, _)| *word));
                (node.item.describe(), near.map(|word| format!("did you mean \"{word}\"?")))
            })
        })
    }

    /// One of the key's words.
    pub fn choice(&self, key: &'static Key) -> &'static str {
        self.optional_choice(key).unwrap_or("")
    }

    /// Numbers under names the user chose.
    pub fn numbers(&self, key: &'static Key) -> BTreeMap<String, f64> {
        let Kind::Numbers(quantity, range) = key.kind else { return BTreeMap::new() };
        let convert = |node: &Node| {
            let (value, found) = si_value(node, quantity)?;
            if range.contains(value) { Ok(value) } else { Err((found, None)) }
        };
        self.by_name(key, &Kind::Number(quantity, range), &range.describe(quantity), convert, |value| value)
    }

    /// Whole numbers under names the user chose.
    pub fn wholes(&self, key: &'static Key) -> BTreeMap<String, u64> {
        let Kind::Wholes(low, high) = key.kind else { return BTreeMap::new() };
        let kind = Kind::Whole(low, high);
        self.by_name(key, &kind, &kind.expected(), |node| whole(node, low, high), |value| value as f64)
    }

    /// Values under names the user chose, each of a kind.
    fn by_name<T: Copy>(
        &self,
        key: &'static Key,
        kind: &Kind,
        expected: &str,
        convert: impl Fn(&Node) -> Result<T, Mismatch>,
        si: impl Fn(T) -> f64,
    ) -> BTreeMap<String, T> {
        let Some((place, node)) = self.ask(key) else { return BTreeMap::new() };
        let Item::Table(entries) = &node.item else {
            let message = format!("expected {}, found {}", key.kind.expected(), node.item.describe());
            self.mistake(place, self.path_of(key.name), message, None);
            return BTreeMap::new();
        };
        let mut values = BTreeMap::new();
        for Entry { name, node, .. } in entries {
            let path = format!("{}.{name}", self.path_of(key.name));
            match convert(node) {
                Ok(value) => {
                    values.insert(name.clone(), value);
                    let si = vec![si(value)];
                    let value = Value { path, value: show(kind, node), si, is_default: false, doc: key.doc };
                    self.log.values.borrow_mut().push(value);
                }
                Err((found, _)) => self.mistake(node.place, path, format!("expected {expected}, found {found}"), None),
            }
        }
        for (name, value) in &values {
            identify(self.log, &format!("{}.{name}", self.path_of(key.name)), &bits(&[si(*value)]));
        }
        values
    }

    /// A table, where it is given; a plain value stands for the key its section names.
    pub fn optional_table(&self, key: &'static Key) -> Option<Table<'d>> {
        let given = self.ask(key);
        if given.is_none() && key.default == Fallback::Required {
            self.missing(key);
        }
        let (Some((place, node)), Kind::Table(section)) = (given, key.kind) else { return None };
        let entries = match (&node.item, section.shorthand) {
            (Item::Table(inner), _) => {
                inner.iter().map(|entry| (entry.name.as_str(), entry.place, &entry.node)).collect()
            }
            (_, Some(short)) => vec![(short.name, place, node)],
            _ => {
                let message = format!("expected {}, found {}", key.kind.expected(), node.item.describe());
                self.mistake(place, self.path_of(key.name), message, None);
                return None;
            }
        };
        Some(Self::open(self.log, section, self.path_of(key.name), place, entries))
    }

    /// A table, where absent one without entries: its keys take their defaults.
    pub fn table(&self, key: &'static Key) -> Option<Table<'d>> {
        let given = self.given(key).is_some();
        match key.kind {
            Kind::Table(section) if !given => {
                self.asked.borrow_mut().push(key.name);
                Some(Self::open(self.log, section, self.path_of(key.name), self.place, Vec::new()))
            }
            _ => self.optional_table(key),
        }
    }

    /// Tables under names the user chose, in the order of the file.
    pub fn named(&self, key: &'static Key) -> Vec<(String, Table<'d>)> {
        let (Some((place, node)), Kind::Named(section)) = (self.ask(key), key.kind) else { return Vec::new() };
        let Item::Table(entries) = &node.item else {
            let message = format!("expected {}, found {}", key.kind.expected(), node.item.describe());
            self.mistake(place, self.path_of(key.name), message, None);
            return Vec::new();
        };
        let mut tables = Vec::new();
        for Entry { name, place, node } in entries {
            let path = format!("{}.{name}", self.path_of(key.name));
            if stagger_messages::keys::check_name(name).is_err() {
                self.mistake(*place, path, "expected a name of letters, digits, `-` and `_`".into(), None);
                continue;
            }
            let Item::Table(inner) = &node.item else {
                let message = format!("expected a table such as {}, found {}", section.example, node.item.describe());
                self.mistake(node.place, path, message, None);
                continue;
            };
            let inner = inner.iter().map(|entry| (entry.name.as_str(), entry.place, &entry.node)).collect();
            tables.push((name.clone(), Self::open(self.log, section, path, *place, inner)));
        }
        tables
    }

    /// Asks for tables that hold keys of the scene: what is in them is read where it applies.
    pub fn scenes(&self, key: &'static Key) {
        let Some((place, node)) = self.ask(key) else { return };
        if !matches!(node.item, Item::Table(_)) {
            let message = format!("expected {}, found {}", key.kind.expected(), node.item.describe());
            self.mistake(place, self.path_of(key.name), message, None);
        }
    }

    /// Reports the given keys that nothing asked for: they do not go with the others.
    pub fn finish(self) {
        for (name, place, _) in &self.entries {
            let unused = |key: &&&Key| key.name == *name && !self.asked.borrow().contains(&key.name);
            let Some(key) = self.section.keys.iter().find(unused) else { continue };
            let message = match key.when {
                Some((other, values)) => {
                    let values: Vec<String> = values.iter().map(|value| format!("\"{value}\"")).collect();
                    format!("applies only where {other} is {}", values.join(" or "))
                }
                None => "does not apply here".into(),
            };
            self.mistake(*place, self.path_of(name), message, None);
        }
    }
}

/// Adds what was read at a path to the scene's identity; separators that no text holds keep the parts apart.
fn identify(log: &Log<'_>, path: &str, exact: &[u8]) {
    let mut identity = log.identity.borrow_mut();
    identity.extend_from_slice(path.as_bytes());
    identity.push(0xff);
    identity.extend_from_slice(&(exact.len() as u64).to_le_bytes());
    identity.extend_from_slice(exact);
}

fn bits(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}
