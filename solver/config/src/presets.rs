//! `[presets.NAME]`: other values for keys of the scene, under a name that a run can choose. `[tradeoff]`: what the scene is judged by.

use super::{
    key::{Key, Kind, Section},
    problems::{Mistake, Place, nearest, quoted},
    tree::{Entry, Item, Node},
};

/// The scene as it stands, unless it has a preset of this name.
pub const STANDARD: &str = "standard";

/// The preset that is put over the scene.
pub static PRESET: Key = Key::new(
    "preset",
    Kind::Text,
    "The preset that applies: its values take the place of the scene's own, and `--set` values that of both. `standard` is the scene as it stands.",
)
.or("\"standard\"");
/// The presets of a scene, each a part of a scene.
pub static PRESETS: Key = Key::new(
    "presets",
    Kind::Scenes,
    "Other values for keys of the scene, written as they are in it: `[presets.draft]` with `coupling.dt.limit = \"40 us\"` in it.",
)
.or_from("none");

static QUANTITIES: Key = Key::new(
    "quantities",
    Kind::Texts,
    "What errors are measured by: `mean FIELD`, `peak FIELD`, `rms FIELD`, `each FIELD` (row by row), `energy NAME`, `height`, `porosity`.",
)
.or_from("those of its fields that have a meaning on their own (docs/tradeoff.md)");
/// What errors are measured by.
pub static TRADEOFF: Section = Section {
    path: "tradeoff",
    doc: "What `stagger tradeoff` judges the scene by.",
    example: "{ quantities = [\"mean temperature\"] }",
    shorthand: Some(&QUANTITIES),
    keys: &[&QUANTITIES],
};

/// The quantities of `[tradeoff]`; none where the scene leaves them to the program.
pub fn quantities(table: super::reader::Table<'_>) -> Vec<String> {
    let quantities = table.texts(&QUANTITIES).unwrap_or_default();
    table.finish();
    quantities
}

/// Names of a scene's presets, in their order; [`STANDARD`] first where it is not among them.
pub fn names(entries: &[Entry]) -> Vec<String> {
    let own: Vec<String> = tables(entries).iter().map(|entry| entry.name.clone()).collect();
    let standard = (!own.iter().any(|name| name == STANDARD)).then(|| STANDARD.to_owned());
    standard.into_iter().chain(own).collect()
}

/// Puts the values of the preset the tree names in the place of its own; returns what is wrong with the presets.
pub fn merge(entries: &mut Vec<Entry>) -> Vec<Mistake> {
    let mut mistakes = Vec::new();
    let mistake =
        |place: Place, key: String, message: String, hint: Option<String>| Mistake { place, key, message, hint };
    for Entry { name, place, node } in tables(entries) {
        let key = format!("presets.{name}");
        if stagger_messages::keys::check_name(name).is_err() {
            mistakes.push(mistake(*place, key, "expected a name of letters, digits, `-` and `_`".into(), None));
        } else if let Item::Table(inner) = &node.item {
            for entry in inner.iter().filter(|entry| entry.name.starts_with("preset")) {
                let message = "a preset cannot hold or choose presets".into();
                mistakes.push(mistake(entry.place, format!("{key}.{}", entry.name), message, None));
            }
        } else {
            let message = format!("expected a table of keys of the scene, found {}", node.item.describe());
            mistakes.push(mistake(node.place, key, message, None));
        }
    }
    // A value that is no text is the reader's to report.
    let chosen = entries.iter().find(|entry| entry.name == PRESET.name);
    let Some((name, place)) = chosen.and_then(|entry| match &entry.node.item {
        Item::Text(name) => Some((name.clone(), entry.place)),
        _ => None,
    }) else {
        return mistakes;
    };
    match tables(entries).iter().find(|entry| entry.name == name).map(|entry| entry.node.item.clone()) {
        Some(Item::Table(values)) if mistakes.is_empty() => over(entries, values),
        Some(_) => {}
        None if name == STANDARD => {}
        None => {
            let names = names(entries);
            let known = format!("presets of this scene are {}", names.join(", "));
            let near = nearest(&name, names.iter().map(String::as_str));
            let hint = near.map_or(known, |near| format!("did you mean \"{near}\"?"));
            mistakes.push(mistake(
                place,
                PRESET.name.into(),
                format!("no preset is called {}", quoted(&name)),
                Some(hint),
            ));
        }
    }
    mistakes
}

fn tables(entries: &[Entry]) -> &[Entry] {
    match entries.iter().find(|entry| entry.name == PRESETS.name) {
        Some(Entry { node: Node { item: Item::Table(presets), .. }, .. }) => presets,
        _ => &[],
    }
}

/// Lays values over a table: tables are merged, everything else is replaced.
fn over(entries: &mut Vec<Entry>, values: Vec<Entry>) {
    for value in values {
        let Some(entry) = entries.iter_mut().find(|entry| entry.name == value.name) else {
            entries.push(value);
            continue;
        };
        match (&mut entry.node.item, value.node.item) {
            (Item::Table(inner), Item::Table(values)) => over(inner, values),
            (_, item) => (entry.place, entry.node) = (value.place, Node { place: value.node.place, item }),
        }
    }
}
