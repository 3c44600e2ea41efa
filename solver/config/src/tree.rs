//! A scene's TOML as a tree of values that know where they were written, in the order of the file.

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::problems::{Mistake, Place, cut, quoted};

/// A value and where it was written.
#[derive(Clone, Debug)]
pub struct Node {
    /// Where it was written.
    pub place: Place,
    /// What was written.
    pub item: Item,
}

/// A TOML value; numbers keep their spelling for messages.
#[derive(Clone, Debug)]
pub enum Item {
    /// A text.
    Text(String),
    /// A number, and how it was written.
    Float(f64, String),
    /// A whole number, and how it was written.
    Integer(i128, String),
    /// True or false.
    Flag(bool),
    /// A date, which no key takes.
    Date(String),
    /// A list.
    List(Vec<Node>),
    /// A table.
    Table(Vec<Entry>),
}

/// A key of a table, where it was written, and its value.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The name of the key.
    pub name: String,
    /// Where it was written.
    pub place: Place,
    /// Its value.
    pub node: Node,
}

impl Item {
    /// How a message names the value.
    pub fn describe(&self) -> String {
        match self {
            Self::Text(text) => quoted(text),
            Self::Float(_, text) | Self::Integer(_, text) | Self::Date(text) => cut(text).into_owned(),
            Self::Flag(flag) => flag.to_string(),
            Self::List(_) => "a list".into(),
            Self::Table(_) => "a table".into(),
        }
    }
}

/// Parses a whole scene.
///
/// Where the text is not TOML, only that is reported: what the parser recovers would raise mistakes nobody made.
pub fn parse(text: &str) -> Result<Vec<Entry>, Vec<Mistake>> {
    let starts: Vec<usize> = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let place = |at: usize| Place::Line(starts.partition_point(|start| *start <= at));
    let (document, errors) = DeTable::parse_recoverable(text);
    if errors.is_empty() {
        return Ok(entries(document.get_ref(), &place));
    }
    let mistake = |error: toml::de::Error| Mistake {
        place: place(error.span().map_or(0, |span| span.start)),
        key: String::new(),
        message: format!("not valid TOML: {}", error.message()),
        hint: None,
    };
    Err(errors.into_iter().map(mistake).collect())
}

/// Parses a value that stands alone: a default, or the right side of an override.
pub fn parse_value(text: &str, place: Place) -> Option<Node> {
    DeValue::parse(text).ok().map(|value| Node { place, item: item(value.get_ref(), &|_| place) })
}

/// Sets the value at a dotted path; `Err` holds the part of the path that is a value and no table.
pub fn set(entries: &mut Vec<Entry>, path: &[&str], node: Node) -> Result<(), String> {
    let Some((first, rest)) = path.split_first() else { return Ok(()) };
    let place = node.place;
    let index = entries.iter().position(|entry| entry.name == *first).unwrap_or_else(|| {
        let node = Node { place, item: Item::Table(Vec::new()) };
        entries.push(Entry { name: (*first).into(), place, node });
        entries.len() - 1
    });
    let entry = &mut entries[index];
    if rest.is_empty() {
        (entry.place, entry.node) = (place, node);
        return Ok(());
    }
    match &mut entry.node.item {
        Item::Table(inner) => set(inner, rest, node).map_err(|part| format!("{first}.{part}")),
        _ => Err((*first).into()),
    }
}

fn entries(table: &DeTable<'_>, place: &dyn Fn(usize) -> Place) -> Vec<Entry> {
    let mut pairs: Vec<_> = table.iter().collect();
    pairs.sort_by_key(|(key, _)| key.span().start);
    let entry = |(key, value): (&Spanned<toml::de::DeString<'_>>, &Spanned<DeValue<'_>>)| Entry {
        name: key.get_ref().to_string(),
        place: place(key.span().start),
        node: Node { place: place(value.span().start), item: item(value.get_ref(), place) },
    };
    pairs.into_iter().map(entry).collect()
}

fn item(value: &DeValue<'_>, place: &dyn Fn(usize) -> Place) -> Item {
    match value {
        DeValue::String(text) => Item::Text(text.to_string()),
        DeValue::Integer(integer) => match i128::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(whole) => Item::Integer(whole, integer.to_string()),
            Err(_) => Item::Float(integer.as_str().parse().unwrap_or(f64::NAN), integer.to_string()),
        },
        DeValue::Float(float) => Item::Float(float.as_str().parse().unwrap_or(f64::NAN), float.to_string()),
        DeValue::Boolean(flag) => Item::Flag(*flag),
        DeValue::Datetime(date) => Item::Date(date.to_string()),
        DeValue::Array(list) => {
            let node = |value: &Spanned<DeValue<'_>>| Node {
                place: place(value.span().start),
                item: item(value.get_ref(), place),
            };
            Item::List(list.iter().map(node).collect())
        }
        DeValue::Table(table) => Item::Table(entries(table, place)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_keep_the_order_and_the_line_of_the_file() {
        let tree = parse("b = 1\n\n[z]\nx = [\n 1,\n 2]\n[a.c]\ny = 0x10\n").unwrap();
        let names: Vec<&str> = tree.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["b", "z", "a"]);
        let Item::Table(z) = &tree[1].node.item else { panic!("z is a table") };
        let Item::List(list) = &z[0].node.item else { panic!("x is a list") };
        assert_eq!((z[0].place, list[1].place), (Place::Line(4), Place::Line(6)));
        assert_eq!(tree[2].place, Place::Line(7));
    }

    #[test]
    fn an_override_replaces_makes_tables_and_names_the_value_in_its_way() {
        let mut tree = parse("a = 1\n[t]\nb = 2\n").unwrap();
        let value = |number: &str| parse_value(number, Place::Set(0)).unwrap();
        set(&mut tree, &["t", "b"], value("3")).unwrap();
        set(&mut tree, &["t", "c", "d"], value("4")).unwrap();
        let Item::Table(t) = &tree[1].node.item else { panic!("t is a table") };
        assert!(matches!(t[0].node.item, Item::Integer(3, _)) && t[1].name == "c");
        assert_eq!(set(&mut tree, &["t", "b", "x"], value("5")), Err("t.b".into()));
    }
}
