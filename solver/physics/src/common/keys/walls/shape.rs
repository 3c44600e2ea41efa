//! The shape of a wall.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    problems::quoted,
    reader::Table,
    units::{LENGTH, NUMBER},
};
use std::sync::Arc;

use crate::common::walls::{Cylinder, Face, Mesh, Shape, Side};

/// What stands where a shape is not given.
const NONE: &str = "none; a wall has one shape";

pub(crate) static PLANE: Key = Key::new("plane", Kind::Table(&PLANE_SECTION), "An infinite plane.").or_from(NONE);
pub(crate) static BOX: Key = Key::new("box", Kind::Table(&BOX_SECTION), "Planes around the particles.").or_from(NONE);
pub(crate) static CYLINDER: Key =
    Key::new("cylinder", Kind::Table(&CYLINDER_SECTION), "A cylinder, or a tube.").or_from(NONE);
pub(crate) static MESH: Key = Key::new("mesh", Kind::Table(&MESH_SECTION), "Triangles of an STL file.").or_from(NONE);

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
static OPEN: Key = Key::new(
    "open",
    Kind::Texts,
    "Sides left out, of `\"-x\"`, `\"+x\"`, `\"-y\"`, `\"+y\"`, `\"-z\"`, `\"+z\"`. The planes of the others go on beyond \
     their edges.",
)
.or("[]");
static BOX_SECTION: Section = Section {
    path: "walls.NAME.box",
    doc: "An axis-aligned box with the particles inside.",
    example: "{ lower = [0, 0, 0], upper = [\"1 mm\", \"1 mm\", \"2 mm\"], open = [\"+z\"] }",
    shorthand: None,
    keys: &[&LOWER, &UPPER, &OPEN],
};

static ON_AXIS: Key =
    Key::new("through", Kind::Vector(&LENGTH), "A point on its axis; the middle of a tube's first end.")
        .or("[0, 0, 0]");
static AXIS: Key = Key::new(
    "axis",
    Kind::Vector(&NUMBER),
    "Direction of its axis, for a tube towards its second end; of any length but zero.",
);
static RADIUS: Key = Key::new("radius", Kind::Number(&LENGTH, Range::POSITIVE), "Radius.");
static PARTICLES: Key = Key::new(
    "particles",
    Kind::Choice(&[("inside", "it surrounds them"), ("outside", "they surround it")]),
    "Where the particles are; only without `length`.",
)
.or("\"inside\"");
static TUBE_LENGTH: Key = Key::new(
    "length",
    Kind::Number(&LENGTH, Range::POSITIVE),
    "Length of a tube: thin, with open ends, touched from both sides and at its rims.",
)
.or_from("infinite");
static CYLINDER_SECTION: Section = Section {
    path: "walls.NAME.cylinder",
    doc: "A cylinder, infinite and with the particles on one side; or a tube.",
    example: "{ axis = [0, 0, 1], radius = \"1 mm\" }",
    shorthand: None,
    keys: &[&ON_AXIS, &AXIS, &RADIUS, &PARTICLES, &TUBE_LENGTH],
};

static FILE: Key = Key::new("file", Kind::File, "STL file, binary or ASCII; its normals are not used.");
static UNIT: Key = Key::new("unit", Kind::Number(&LENGTH, Range::POSITIVE), "What 1 in the file stands for.");
static AT: Key = Key::new("at", Kind::Vector(&LENGTH), "Where the file's origin comes to.").or("[0, 0, 0]");
static MESH_SECTION: Section = Section {
    path: "walls.NAME.mesh",
    doc: "A thin surface of triangles, touched from both sides. Its faces, edges and corners hold; edges within a plane \
          are not felt.",
    example: "{ file = \"hopper.stl\", unit = \"1 mm\" }",
    shorthand: None,
    keys: &[&FILE, &UNIT, &AT],
};

/// Reads the one shape of a wall.
pub(crate) fn read(wall: &Table<'_>) -> Option<Shape> {
    let keys = [&PLANE, &BOX, &CYLINDER, &MESH];
    let given: Vec<_> = keys.into_iter().filter(|key| wall.is_given(key)).collect();
    if given.is_empty() {
        wall.reject(&PLANE, "missing; expected a plane, a box, a cylinder or a mesh");
    }
    for second in given.iter().skip(1) {
        wall.reject(second, format!("the wall is a {} already; give the two a name each", given[0].name));
    }
    let plane = wall.optional_table(&PLANE).map(plane);
    let inside = wall.optional_table(&BOX).map(sides);
    let cylinder = wall.optional_table(&CYLINDER).map(cylinder);
    let mesh = wall.optional_table(&MESH).and_then(mesh);
    plane.or(inside).or(cylinder).or(mesh)
}

fn plane(table: Table<'_>) -> Shape {
    let shape = Shape::plane(table.vector(&THROUGH), table.direction(&NORMAL));
    table.finish();
    shape
}

fn sides(table: Table<'_>) -> Shape {
    let (lower_m, upper_m) = (table.vector(&LOWER), table.vector(&UPPER));
    if (0..3).any(|axis| lower_m[axis] >= upper_m[axis]) {
        table.reject(&UPPER, "expected to lie above the lower corner along every axis");
    }
    let mut open = Vec::new();
    for name in table.texts(&OPEN).unwrap_or_default() {
        let face = Face::ALL.into_iter().find(|face| side(face) == name);
        if face.is_none() {
            let known = Face::ALL.map(|face| format!("{:?}", side(&face))).join(", ");
            table.reject(&OPEN, format!("expected sides of {known}, found {}", quoted(&name)));
        }
        open.extend(face);
    }
    table.finish();
    Shape::Box { lower_m, upper_m, open }
}

/// The name of a side: `+z`.
fn side(face: &Face) -> String {
    format!("{}{}", if face.upper { '+' } else { '-' }, ['x', 'y', 'z'][face.axis])
}

fn cylinder(table: Table<'_>) -> Shape {
    let length_m = table.optional_number(&TUBE_LENGTH);
    if table.is_given(&TUBE_LENGTH) && table.is_given(&PARTICLES) {
        table.reject(&PARTICLES, "a tube, which has a length, is touched from both sides");
    }
    let particles = if table.choice(&PARTICLES) == "outside" { Side::Outside } else { Side::Inside };
    let (through_m, axis) = (table.vector(&ON_AXIS), table.direction(&AXIS));
    let shape = Shape::Cylinder(Cylinder { through_m, axis, radius_m: table.number(&RADIUS), particles, length_m });
    table.finish();
    shape
}

fn mesh(table: Table<'_>) -> Option<Shape> {
    if !table.is_given(&FILE) {
        table.reject(&FILE, format!("missing; expected {}", FILE.kind.expected()));
    }
    let (file, unit_m, at_m) = (table.optional_file(&FILE), table.number(&UNIT), table.vector(&AT));
    // Where the unit is wrong and reported, the file is looked at all the same.
    let unit_m = if unit_m.is_finite() { unit_m } else { 1.0 };
    let mesh = file.and_then(|(path, bytes)| {
        let mesh = Mesh::from_stl(&bytes, unit_m, at_m);
        mesh.map_err(|error| table.reject(&FILE, format!("{}: {error}", quoted(&path)))).ok()
    });
    table.finish();
    mesh.map(|mesh| Shape::Mesh(Arc::new(mesh)))
}
