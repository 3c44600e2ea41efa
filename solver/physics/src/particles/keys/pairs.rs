//! `[particles.pairs.NAME]`: contacts of two materials that differ from the others.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    problems::quoted,
    reader::Table,
    units::{AREA_DAMPING, NUMBER},
};
use std::collections::BTreeSet;

use crate::{
    common::Wall,
    particles::settings::{Material, Pair},
};

static BETWEEN: Key = Key::new(
    "between",
    Kind::Texts,
    "The two: names of materials, those of walls among them, or of walls that have no material of their own. One name twice is a material with itself.",
);
static DAMPING: Key = Key::new(
    "damping",
    Kind::Number(&AREA_DAMPING, Range::NOT_NEGATIVE),
    "Normal damping per contact area c_cd (eq. 6.10).",
)
.or_from("that of all contacts");
static RESTITUTION: Key =
    Key::new("restitution", Kind::Number(&NUMBER, Range::above(0.0, 1.0)), "Restitution coefficient.")
        .or_from("that of all contacts");
static STATIC: Key =
    Key::new("static", Kind::Number(&NUMBER, Range::within(0.0, 10.0)), "Static coefficient of friction μ_s.")
        .or_from("that of all contacts");
static DYNAMIC: Key =
    Key::new("dynamic", Kind::Number(&NUMBER, Range::within(0.0, 10.0)), "Dynamic coefficient of friction μ_d.")
        .or_from("that of all contacts, at most the static one");
static ROLLING: Key =
    Key::new("rolling", Kind::Number(&NUMBER, Range::within(0.0, 10.0)), "Coefficient of rolling resistance.")
        .or_from("that of all contacts");
static TORSION: Key =
    Key::new("torsion", Kind::Number(&NUMBER, Range::within(0.0, 10.0)), "Coefficient of torsion resistance.")
        .or_from("that of all contacts");

pub(crate) static PAIR: Section = Section {
    path: "particles.pairs.NAME",
    doc: "The contact of two materials, or of a material and a wall, where it differs from what holds for all contacts.",
    example: "{ between = [\"316L\", \"plate\"], static = 0.2, dynamic = 0.2 }",
    shorthand: None,
    keys: &[&BETWEEN, &DAMPING, &RESTITUTION, &STATIC, &DYNAMIC, &ROLLING, &TORSION],
};

/// Reads all pairs of the particles' `materials` and the walls.
pub(crate) fn read(particles: &Table<'_>, key: &'static Key, materials: &[Material], walls: &[Wall]) -> Vec<Pair> {
    let of_walls = walls.iter().map(|wall| wall.material.as_ref().unwrap_or(&wall.name));
    let mut known: Vec<&String> = materials.iter().map(|material| &material.name).chain(of_walls).collect();
    let mut seen = BTreeSet::new();
    known.retain(|name| seen.insert(*name));
    let mut pairs = Vec::new();
    for (_, table) in particles.named(key) {
        let names = table.texts(&BETWEEN).unwrap_or_default();
        if let Some(unknown) = names.iter().find(|name| !known.contains(name)) {
            let wall = walls.iter().find(|wall| wall.name == *unknown);
            if let Some(material) = wall.and_then(|wall| wall.material.as_ref()) {
                let (unknown, material) = (quoted(unknown), quoted(material));
                let message = format!(
                    "the wall {unknown} is of {material}, and a pair is of two materials: what holds for this wall holds for \
                     all that is of {material}"
                );
                table.reject_with(&BETWEEN, message, Some(format!("write {material} in place of {unknown}")));
            } else {
                let known: Vec<_> = known.iter().map(|name| name.as_str()).collect();
                let message = format!(
                    "no particle and no wall is of a material called {}, and no wall without a material is called \
                     that; there are {}",
                    quoted(unknown),
                    known.join(", ")
                );
                table.reject(&BETWEEN, message);
            }
        } else if names.len() != 2 && !names.is_empty() {
            table.reject(&BETWEEN, format!("expected two names, found {}", names.len()));
        }
        let pair = Pair {
            between: [names.first().cloned().unwrap_or_default(), names.get(1).cloned().unwrap_or_default()],
            damping_n_s_m3: table.optional_number(&DAMPING),
            restitution: table.optional_number(&RESTITUTION),
            static_coefficient: table.optional_number(&STATIC),
            dynamic_coefficient: table.optional_number(&DYNAMIC),
            rolling: table.optional_number(&ROLLING),
            torsion: table.optional_number(&TORSION),
        };
        table.finish();
        pairs.push(pair);
    }
    pairs
}
