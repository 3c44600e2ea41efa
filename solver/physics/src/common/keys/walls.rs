//! `[walls.NAME]`: what holds the particles.

mod motion;
mod shape;
use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{CURRENT, CURRENT_DENSITY, TEMPERATURE, VOLTAGE},
};

use std::collections::BTreeMap;

use super::materials::{self, Material};
use crate::common::{
    Wall,
    walls::{Electrode, Motion},
};

static MOTION: Key = Key::new("motion", Kind::Table(&motion::SECTION), "How it moves.").or_from("it does not");
static MATERIAL: Key =
    Key::new("material", Kind::Text, "Material, for friction and restitution between pairs of them.")
        .or_from("none: what holds for all contacts");
static TEMPERATURE_KEY: Key =
    Key::new("temperature", Kind::Number(&TEMPERATURE, Range::POSITIVE), "Temperature, held throughout.")
        .or_from("insulated");
static POTENTIAL: Key = Key::new(
    "potential",
    Kind::Number(&VOLTAGE, Range::ANY),
    "Electric potential it is held at, for the potential model of [current].",
)
.or_from("insulated, unless a current is given");
static CURRENT_KEY: Key = Key::new(
    "current",
    Kind::Number(&CURRENT, Range::ANY),
    "Current from it into the particles, for the potential model of [current]; another wall must be held at a potential.",
)
.or_from("insulated, unless a potential is given");
static CURRENT_DENSITY_KEY: Key = Key::new(
    "current-density",
    Kind::Number(&CURRENT_DENSITY, Range::ANY),
    "Current density it is held at, for the averaging model of [current].",
)
.or_from("insulated");

/// Keys of a wall.
pub static SECTION: Section = Section {
    path: "walls.NAME",
    doc: "A wall, of one shape. Particles stay on the side a plane's normal points to, inside a box, on their side of a \
          cylinder; a tube and a mesh are thin and hold them off on both sides. Walls are rigid; where the contacts of a particle \
          with neighbouring faces of a mesh overlap, they share one contact's force and area.",
    example: "{ plane = { normal = [0, 0, 1] }, temperature = \"320 K\" }",
    shorthand: None,
    keys: &[
        &shape::PLANE,
        &shape::BOX,
        &shape::CYLINDER,
        &shape::MESH,
        &MOTION,
        &MATERIAL,
        &TEMPERATURE_KEY,
        &POTENTIAL,
        &CURRENT_KEY,
        &CURRENT_DENSITY_KEY,
    ],
};

/// Reads all walls, in the order of the file.
pub fn read(root: &Table<'_>, key: &'static Key, materials: &BTreeMap<String, Material>) -> Vec<Wall> {
    let mut walls = Vec::new();
    for (name, table) in root.named(key) {
        // Everything is read before anything is given up, so that every mistake is found.
        let shape = shape::read(&table);
        let motion = match table.optional_table(&MOTION) {
            Some(motion) => motion::read(motion),
            None => Some(Motion::Fixed),
        };
        let material = table.is_given(&MATERIAL).then(|| materials::choose(&table, &MATERIAL, materials).0);
        let temperature_k = table.optional_number(&TEMPERATURE_KEY);
        let electrode = Electrode {
            potential_v: table.optional_number(&POTENTIAL),
            current_a: table.optional_number(&CURRENT_KEY),
            current_density_a_m2: table.optional_number(&CURRENT_DENSITY_KEY),
        };
        table.finish();
        if let (Some(shape), Some(motion)) = (shape, motion) {
            walls.push(Wall { name, shape, motion, material, temperature_k, electrode });
        }
    }
    walls
}
