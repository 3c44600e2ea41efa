//! `[decay]`: a scalar that decays.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{LENGTH, NUMBER, TIME},
};

use super::Settings;
use crate::{PhysicsKind, configured};

static HALF_LIFE: Key =
    Key::new("half-life", Kind::Number(&TIME, Range::POSITIVE), "Time in which half of it is gone.");
static CELLS: Key = Key::new("cells", Kind::Vector(&NUMBER), "Cells along each axis.").or("[4, 3, 2]");
static SPACING: Key = Key::new("spacing", Kind::Number(&LENGTH, Range::POSITIVE), "Side of a cell.").or("\"10 um\"");
static SECTION: Section = Section {
    path: "decay",
    doc: "A scalar that decays on a grid.",
    example: "{ half-life = \"1 ms\" }",
    shorthand: None,
    keys: &[&HALF_LIFE, &CELLS, &SPACING],
};

/// A decaying scalar as a physics of a scene.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "decay",
    computes: "the decay of [decay]",
    doc: "A scalar that decays.",
    absent: "does not run",
    section: &SECTION,
    rank: 6,
    bodies: None,
    read: |table, _| configured(Some(read(table))),
    advice: None,
    tradeoff: None,
    pictured: &[],
};

fn read(table: Table<'_>) -> Settings {
    let settings = Settings {
        rate_1_s: std::f64::consts::LN_2 / table.number(&HALF_LIFE),
        cells: table.vector(&CELLS).map(|count| count.max(1.0) as u32),
        spacing_m: table.number(&SPACING),
    };
    table.finish();
    settings
}
