//! `[walls.NAME]`: what holds the particles.

use super::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{LENGTH, NUMBER, TEMPERATURE},
};
use crate::physics::{Shape, Wall};

static PLANE: Key =
    Key::new("plane", Kind::Table(&PLANE_SECTION), "An infinite plane.").or_from("none; a wall is a plane or a box");
static BOX: Key = Key::new("box", Kind::Table(&BOX_SECTION), "Six planes around the particles.")
    .or_from("none; a wall is a plane or a box");
static TEMPERATURE_KEY: Key =
    Key::new("temperature", Kind::Number(&TEMPERATURE, Range::POSITIVE), "Temperature, held throughout.")
        .or_from("insulated");

pub(super) static SECTION: Section = Section {
    path: "walls.NAME",
    doc: "A wall. Particles stay on the side its normal points to, or inside its box.",
    example: "{ plane = { normal = [0, 0, 1] }, temperature = \"320 K\" }",
    shorthand: None,
    keys: &[&PLANE, &BOX, &TEMPERATURE_KEY],
};

static THROUGH: Key = Key::new("through", Kind::Vector(&LENGTH), "A point on the plane.").or("[0, 0, 0]");
static NORMAL: Key = Key::new(
    "normal",
    Kind::Vector(&NUMBER),
    "Direction of its normal, towards the particles; of any length but zero.",
);
static PLANE_SECTION: Section = Section {
    path: "walls.NAME.plane",
    doc: "An infinite plane.",
    example: "{ through = [0, 0, 0], normal = [0, 0, 1] }",
    shorthand: None,
    keys: &[&THROUGH, &NORMAL],
};

static LOWER: Key = Key::new("lower", Kind::Vector(&LENGTH), "Lower corner.");
static UPPER: Key = Key::new("upper", Kind::Vector(&LENGTH), "Upper corner; above the lower one along every axis.");
static BOX_SECTION: Section = Section {
    path: "walls.NAME.box",
    doc: "An axis-aligned box with the particles inside.",
    example: "{ lower = [0, 0, 0], upper = [\"1 mm\", \"1 mm\", \"2 mm\"] }",
    shorthand: None,
    keys: &[&LOWER, &UPPER],
};

/// Reads all walls, in the order of the file.
pub(super) fn read(root: &Table<'_>, key: &'static Key) -> Vec<Wall> {
    let mut walls = Vec::new();
    for (name, table) in root.named(key) {
        let shape = match (table.optional_table(&PLANE), table.optional_table(&BOX)) {
            (Some(plane), None) => {
                let shape = Shape::plane(plane.vector(&THROUGH), plane.direction(&NORMAL));
                plane.finish();
                Some(shape)
            }
            (None, Some(inside)) => Some(sides(inside)),
            (Some(_), Some(_)) => {
                table.reject(&BOX, "a wall is a plane or a box, not both; give them two names");
                None
            }
            (None, None) => {
                // A plane or box that is no table has been reported already.
                if !table.is_given(&PLANE) && !table.is_given(&BOX) {
                    table.reject(&PLANE, "missing; expected a plane or a box");
                }
                None
            }
        };
        let temperature_k = table.optional_number(&TEMPERATURE_KEY);
        walls.extend(shape.map(|shape| Wall::fixed(&name, shape, temperature_k)));
        table.finish();
    }
    walls
}

fn sides(table: Table<'_>) -> Shape {
    let (lower_m, upper_m) = (table.vector(&LOWER), table.vector(&UPPER));
    if (0..3).any(|axis| lower_m[axis] >= upper_m[axis]) {
        table.reject(&UPPER, "expected to lie above the lower corner along every axis");
    }
    table.finish();
    Shape::Box { lower_m, upper_m, open: Vec::new() }
}
