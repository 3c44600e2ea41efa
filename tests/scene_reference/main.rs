//! The key reference of scenes and their JSON Schema are made from the keys the parser reads, and are up to date.
//!
//! `STAGGER_BLESS=1 cargo test -p stagger-scene --test scene_reference` rewrites `docs/scene.md` and
//! `docs/scene.schema.json`.

use std::{fmt::Write as _, fs, path::PathBuf};

use serde_json::{Map, Value, json};
use stagger_config::{Fallback, Key, Kind, Range, Section};
use stagger_scene::Scene;

const INTRODUCTION: &str = "\
# A scene, key by key

A scene is a TOML file. `stagger check SCENE` reports every mistake in it at once and shows the values in effect,
defaults included; `--set particles.count=200` changes one for a run. Editors complete and check keys with
[scene.schema.json](scene.schema.json).

- A bare number is in SI units. A text carries its unit: `\"25 um\"`, `\"15 W/(m K)\"`, `\"9.81 m/s^2\"`; a wrong
  dimension is an error. Prefixes run from `p` to `T`; `/` divides by the one factor behind it. Temperatures are in kelvin.
  The number is written in one piece, with a point: `\"1 121 um\"`, `\"1,5 mm\"` and `\"10^-6 m\"` are errors. `1` is a unit only
  before `/`, as in `\"1e4 1/m\"`.
- Where a table has a *short form*, a plain value in its place stands for the key named: `radius = \"25 um\"`.
- A physics whose table is there runs; one whose table is not costs nothing.

This page is made from the parser's own keys.
";

fn docs(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs")).join(name)
}

/// Whether a page in `docs` is what it should be; blessing makes it so.
fn check(name: &str, wanted: &str) -> Result<(), String> {
    if std::env::var_os("STAGGER_BLESS").is_some() {
        fs::write(docs(name), wanted).map_err(|error| error.to_string())?;
    }
    match fs::read_to_string(docs(name)) {
        Ok(found) if found == wanted => Ok(()),
        _ => Err(format!("docs/{name} is stale: run this test again with STAGGER_BLESS=1")),
    }
}

#[test]
fn docs_name_every_key() {
    let mut page = INTRODUCTION.to_owned();
    for section in Scene::reference().tree() {
        let title = if section.path.is_empty() { "The top".into() } else { format!("`[{}]`", section.path) };
        write!(page, "\n## {title}\n\n{}", sentence(section.doc)).unwrap();
        if let Some(key) = section.shorthand {
            write!(page, " Short form: the value of `{}`.", key.name).unwrap();
        }
        page.push_str("\n\n| key | takes | default | what it does |\n|---|---|---|---|\n");
        for key in section.keys {
            let row = [format!("`{}`", key.name), takes(key), default(key), meaning(key)];
            writeln!(page, "| {} |", row.map(|cell| cell.replace('|', "\\|")).join(" | ")).unwrap();
        }
    }
    check("scene.md", &page).unwrap();
}

fn sentence(text: &str) -> String {
    if text.ends_with('.') { text.into() } else { format!("{text}.") }
}

fn takes(key: &Key) -> String {
    match key.kind {
        Kind::Number(quantity, range) if quantity.unit.is_empty() => range.describe(quantity),
        Kind::Number(quantity, range) => format!("{} in {}", range.describe(quantity), quantity.unit),
        Kind::Vector(quantity) if !quantity.unit.is_empty() => format!("three numbers in {}", quantity.unit),
        Kind::Vector(_) => "three numbers".into(),
        Kind::Series(quantity, range) if quantity.unit.is_empty() => format!("{}, or a list", range.describe(quantity)),
        Kind::Series(quantity, range) => format!("{} in {}, or a list", range.describe(quantity), quantity.unit),
        Kind::Vectors(quantity) => format!("a list of three numbers each, in {}", quantity.unit),
        Kind::OverTemperature(quantity, range) => {
            format!("{} in {}, or `[[K, value], …]`", range.describe(quantity), quantity.unit)
        }
        Kind::Table(section) | Kind::Named(section) => format!("`[{}]`", section.path),
        Kind::Choice(words) => words.iter().map(|(word, _)| format!("`\"{word}\"`")).collect::<Vec<_>>().join(", "),
        Kind::Whole(..)
        | Kind::Text
        | Kind::File
        | Kind::Texts
        | Kind::Flag
        | Kind::Numbers(..)
        | Kind::Wholes(..)
        | Kind::Scenes => key.kind.expected(),
    }
}

fn default(key: &Key) -> String {
    match key.default {
        Fallback::Required => "**required**".into(),
        Fallback::Is(value) => format!("`{value}`"),
        Fallback::From(words) => words.into(),
    }
}

fn meaning(key: &Key) -> String {
    let mut text = key.doc.to_owned();
    if let Kind::Choice(words) = key.kind {
        for (word, doc) in words {
            text += &format!("<br>`\"{word}\"`: {}", sentence(doc));
        }
    }
    if let Some((other, values)) = key.when {
        let values: Vec<String> = values.iter().map(|value| format!("`\"{value}\"`")).collect();
        text += &format!(" Only where `{other}` is {}.", values.join(" or "));
    }
    text
}

#[test]
fn the_schema_describes_every_key() {
    let mut schema = object(Scene::reference());
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("A scene of stagger");
    let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
    check("scene.schema.json", &text).unwrap();
}

fn object(section: &Section) -> Value {
    let property = |key: &&Key| (key.name.to_owned(), property(key));
    let required: Vec<&str> = section
        .keys
        .iter()
        .filter(|key| key.default == Fallback::Required && key.when.is_none())
        .map(|key| key.name)
        .collect();
    let mut schema = json!({
        "type": "object",
        "description": section.doc,
        "properties": section.keys.iter().map(property).collect::<Map<_, _>>(),
        "additionalProperties": false,
    });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    schema
}

fn property(key: &Key) -> Value {
    let mut schema = kind(key.kind);
    schema["description"] = json!(key.doc);
    if let Fallback::Is(value) = key.default {
        // A default that is no TOML would be left out here and fail the parser's own tests.
        let table: Option<toml::Table> = toml::from_str(&format!("value = {value}")).ok();
        schema["default"] = table.and_then(|table| serde_json::to_value(&table["value"]).ok()).unwrap_or_default();
    }
    schema
}

fn kind(kind: Kind) -> Value {
    match kind {
        Kind::Number(_, range) => number(range),
        Kind::Whole(low, high) => json!({ "type": "integer", "minimum": low, "maximum": high }),
        Kind::Vector(_) => {
            json!({ "type": "array", "items": number(Range::ANY), "minItems": 3, "maxItems": 3 })
        }
        Kind::Series(_, range) => {
            json!({ "anyOf": [number(range), { "type": "array", "items": number(range) }] })
        }
        Kind::Vectors(quantity) => json!({ "type": "array", "items": self::kind(Kind::Vector(quantity)) }),
        Kind::OverTemperature(_, range) => {
            let pair = json!({ "type": "array", "prefixItems": [number(Range::NOT_NEGATIVE), number(range)], "minItems": 2, "maxItems": 2 });
            json!({ "anyOf": [number(range), { "type": "array", "items": pair, "minItems": 1 }] })
        }
        Kind::Text | Kind::File => json!({ "type": "string" }),
        Kind::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Choice(words) => json!({ "enum": words.iter().map(|(word, _)| *word).collect::<Vec<_>>() }),
        Kind::Numbers(_, range) => {
            json!({ "type": "object", "additionalProperties": number(range) })
        }
        Kind::Wholes(low, high) => {
            json!({ "type": "object", "additionalProperties": self::kind(Kind::Whole(low, high)) })
        }
        Kind::Table(section) => match section.shorthand {
            Some(short) => json!({ "anyOf": [self::kind(short.kind), object(section)] }),
            None => object(section),
        },
        Kind::Scenes => json!({ "type": "object", "additionalProperties": { "type": "object" } }),
        Kind::Named(section) => json!({
            "type": "object",
            "propertyNames": { "pattern": "^[A-Za-z0-9_-]+$" },
            "additionalProperties": object(section),
        }),
    }
}

/// A number or a text that holds one; the bounds of a schema leave texts alone.
fn number(range: Range) -> Value {
    let mut schema = json!({ "type": ["number", "string"] });
    if range.low.is_finite() {
        schema[if range.low_included { "minimum" } else { "exclusiveMinimum" }] = json!(range.low);
    }
    if range.high.is_finite() {
        schema["maximum"] = json!(range.high);
    }
    schema
}

#[test]
fn every_scene_users_start_from_is_read() {
    let mut count = 0;
    for entry in fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let beside = |file: &str| fs::read(path.with_file_name(file)).map_err(|error| error.to_string());
            Scene::parse_with_files(&fs::read_to_string(&path).unwrap(), &name, &[], &beside)
                .unwrap_or_else(|problems| panic!("{problems}"));
            count += 1;
        }
    }
    assert!(count >= 3, "only {count} scenes found");
}
