//! `[particles.start]`: where particles start.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    problems::quoted,
    reader::Table,
    units::{self, LENGTH, NUMBER, SPEED, TIME},
};
use std::collections::BTreeMap;

use super::{groups::Used, particle_file};
use crate::common::keys::materials::{self, Material};
use crate::{
    common::Wall,
    particles::settings::{Lattice, Start, StartRegion},
};
use stagger_messages::Shown;

pub(crate) static START: Key = Key::new("start", Kind::Table(&SECTION), "Where particles start.")
    .or_from("**required**, unless all come from dispensers");

static KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        (
            "sequential-addition",
            "one after the other at random, none overlapping, up to a packing fraction of about 0.35 \
                                 (Widom 1966)",
        ),
        ("lattice", "on the sites of a crystal lattice, from the floor up"),
        (
            "growth",
            "moving and growing between the walls of a box to their size, up to about 0.6 (Lubachevsky and \
                    Stillinger 1990)",
        ),
        (
            "settle",
            "filled in loosely at random, then fallen and come to rest between the walls, touching: 0.55 and denser without \
             friction",
        ),
        ("file", "as a file says"),
    ]),
    "How places are chosen.",
)
.or("\"sequential-addition\"");
static BOX: Key = Key::new("box", Kind::Vector(&LENGTH), "Edges of the box that holds the particles.")
    .or_from("one of box, cylinder and sphere is **required**")
    .when("kind", &["sequential-addition", "lattice", "growth", "settle"]);
static CYLINDER: Key = Key::new("cylinder", Kind::Table(&CYLINDER_SECTION), "The cylinder that holds the particles.")
    .or_from("one of box, cylinder and sphere is **required**")
    .when("kind", &["sequential-addition", "lattice", "settle"]);
static SPHERE: Key =
    Key::new("sphere", Kind::Number(&LENGTH, Range::POSITIVE), "Radius of the sphere that holds the particles.")
        .or_from("one of box, cylinder and sphere is **required**")
        .when("kind", &["sequential-addition", "lattice", "settle"]);
static AT: Key = Key::new(
    "at",
    Kind::Vector(&LENGTH),
    "Lower corner of the box, centre of the cylinder's lower face, or centre of the sphere.",
)
.or_from("centred over the origin, floor at z = 0; a lying cylinder begins at the origin")
.when("kind", &["sequential-addition", "lattice", "growth", "settle"]);
static LATTICE: Key = Key::new(
    "lattice",
    Kind::Choice(&[
        ("simple-cubic", "packing fraction 0.524"),
        ("bcc", "body-centred cubic, 0.680"),
        ("fcc", "face-centred cubic, 0.740"),
        ("hcp", "hexagonal close-packed, 0.740"),
    ]),
    "The lattice.",
)
.or("\"simple-cubic\"")
.when("kind", &["lattice"]);
static SPACING: Key = Key::new(
    "spacing",
    Kind::Number(&NUMBER, Range::within(1.0, 100.0)),
    "Distance of nearest neighbours as a share of the largest diameter.",
)
.or("1")
.when("kind", &["lattice"]);
static JITTER: Key = Key::new(
    "jitter",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "Random displacement as a share of the largest that cannot make neighbours overlap.",
)
.or("0")
.when("kind", &["lattice"]);
static PATH: Key = Key::new(
    "path",
    Kind::File,
    "The file: CSV, extended XYZ (.xyz, .extxyz) or VTK (.vtk, .vtp, .vtu); a relative path begins at the scene's folder. \
     Its contents belong to the scene: they are in its hash and in the recording (docs/particle-files.md).",
)
.when("kind", &["file"]);
static UNIT: Key =
    Key::new("unit", Kind::Text, "Unit of the file's lengths; speeds are in m/s.").or("\"m\"").when("kind", &["file"]);
static MATERIALS: Key =
    Key::new("materials", Kind::Texts, "Materials that the file calls by numbers: 0 is the first of these.")
        .or_from("that of [particles]")
        .when("kind", &["file"]);
static COLUMNS: Key = Key::new(
    "columns",
    Kind::Texts,
    "What is taken from the file beside places and radii: of `velocity`, `spin`, `temperature`, `melted` and `material`. \
     `check` shows what that is, and which columns nothing reads.",
)
.or_from("all of these that it has")
.when("kind", &["file"]);
static VELOCITY: Key =
    Key::new("velocity", Kind::Vector(&SPEED), "Velocity of every particle, unless a file gives their own.")
        .or("[0, 0, 0]")
        .when("kind", &["sequential-addition", "lattice", "growth", "file"]);
static UNTIL: Key = Key::new(
    "until",
    Kind::Number(&NUMBER, Range::above(0.0, 0.1)),
    "Mean kinetic energy, over the mean of m g R, at which they are at rest.",
)
.or("1e-4")
.when("kind", &["settle"]);
static DAMPING: Key = Key::new(
    "damping",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Rate at which velocities decay while they settle, over √(g/R) with the mean radius, beside what contacts lose.",
)
.or("0.5")
.when("kind", &["settle"]);
static LONGEST: Key = Key::new(
    "longest",
    Kind::Number(&TIME, Range::POSITIVE),
    "Longest time to settle; the scene cannot run where they are not at rest by then. A node settles its particles before \
     it announces itself: a large bed needs a longer recovery.start.",
)
.or_from("50 falls from the top of the filling")
.when("kind", &["settle"]);
static SECTION: Section = Section {
    path: "particles.start",
    doc: "Where particles start.",
    example: "{ box = [\"1 mm\", \"1 mm\", \"2 mm\"], velocity = [0, 0, \"-0.5 m/s\"] }",
    shorthand: None,
    keys: &[
        &KIND, &BOX, &CYLINDER, &SPHERE, &AT, &LATTICE, &SPACING, &JITTER, &PATH, &UNIT, &MATERIALS, &COLUMNS,
        &VELOCITY, &UNTIL, &DAMPING, &LONGEST,
    ],
};

static CYLINDER_RADIUS: Key = Key::new("radius", Kind::Number(&LENGTH, Range::POSITIVE), "Radius.");
static CYLINDER_HEIGHT: Key = Key::new("height", Kind::Number(&LENGTH, Range::POSITIVE), "Height.");
static CYLINDER_AXIS: Key = Key::new(
    "axis",
    Kind::Choice(&[("x", "along x"), ("y", "along y"), ("z", "along z")]),
    "Axis of coordinates it stands along.",
)
.or("\"z\"");
static CYLINDER_SECTION: Section = Section {
    path: "particles.start.cylinder",
    doc: "A cylinder.",
    example: "{ radius = \"1 mm\", height = \"2 mm\" }",
    shorthand: None,
    keys: &[&CYLINDER_RADIUS, &CYLINDER_HEIGHT, &CYLINDER_AXIS],
};

/// A start that is being read: its kind decides what else the particles' table must say.
pub(crate) struct Starting<'d> {
    table: Table<'d>,
    kind: &'static str,
}

impl<'d> Starting<'d> {
    /// Reads the kind.
    pub fn read(particles: &Table<'d>) -> Option<Self> {
        let table = particles.optional_table(&START)?;
        Some(Self { kind: table.choice(&KIND), table })
    }

    /// Whether a file says what the particles are.
    pub fn gives_all(&self) -> bool {
        self.kind == "file"
    }

    /// Reads where particles of at most the given radius are placed.
    pub fn place(self, largest_m: f64, walls: &[Wall]) -> Option<Start> {
        let Self { table, kind } = self;
        let (region, key) = region(&table, kind, largest_m)?;
        for wall in walls {
            let key = if table.is_given(&AT) { &AT } else { key };
            if wall.shape.planes().iter().any(|plane| reaches_behind(&region, plane.through, plane.normal)) {
                table.reject(key, format!("the {} reaches behind the wall `{}`", key_name(key, &region), wall.name));
            }
        }
        let velocity_m_s = if kind == "settle" { [0.0; 3] } else { table.vector(&VELOCITY) };
        let start = match kind {
            "settle" => {
                if walls.is_empty() {
                    let hint = "add at least [walls.floor] with plane = { normal = [0, 0, 1] }";
                    table.reject_with(&KIND, "particles settle on walls, and there are none", Some(hint.into()));
                }
                Start::Settle {
                    region,
                    until: table.number(&UNTIL),
                    damping: table.number(&DAMPING),
                    longest_s: table.optional_number(&LONGEST),
                }
            }
            "lattice" => Start::Lattice {
                region,
                lattice: match table.choice(&LATTICE) {
                    "bcc" => Lattice::BodyCentredCubic,
                    "fcc" => Lattice::FaceCentredCubic,
                    "hcp" => Lattice::HexagonalClosePacked,
                    _ => Lattice::SimpleCubic,
                },
                spacing: table.number(&SPACING),
                jitter: table.number(&JITTER),
                velocity_m_s,
            },
            "growth" => {
                let (lower_m, upper_m) = region.bounds();
                Start::Growth { lower_m, upper_m, velocity_m_s }
            }
            _ => Start::SequentialAddition { region, velocity_m_s },
        };
        table.finish();
        Some(start)
    }

    /// Reads the particles of the file, and what it tells of their heat.
    pub fn given(
        self,
        materials: &BTreeMap<String, Material>,
        used: &mut Used,
    ) -> Option<(Start, Option<particle_file::Heat>)> {
        let table = self.table;
        let unit = table.text(&UNIT);
        let metres = units::parse_unit(&unit).ok().filter(|parsed| parsed.dimension == LENGTH.dimension);
        if metres.is_none() {
            table.reject(&UNIT, format!("expected a unit of length such as \"m\" or \"um\", found {}", quoted(&unit)));
        }
        let numbered = table.texts(&MATERIALS).unwrap_or_default();
        for name in numbered.iter().filter(|name| !materials.contains_key(*name)) {
            table.reject_with(
                &MATERIALS,
                format!("no material is called {}", quoted(name)),
                materials::known(name, materials),
            );
        }
        let velocity_m_s = table.vector(&VELOCITY);
        let wanted = table.texts(&COLUMNS);
        for name in wanted.iter().flatten() {
            let known = particle_file::OPTIONAL.map(|(name, _)| name);
            if !known.contains(&name.as_str()) {
                table.reject(&COLUMNS, format!("expected some of {}, found {}", known.join(", "), quoted(name)));
            }
        }
        let file = table.optional_file(&PATH);
        let mut start = None;
        // Whatever the unit should be, the file's other mistakes are found.
        let unit_m = metres.map_or(1.0, |metres| metres.value);
        if let Some((path, contents)) = file {
            let given = particle_file::read(&path, &contents).and_then(|read| {
                if read.frames > 1 {
                    table.remark(&PATH, &format!("the first of its {} frames", read.frames));
                }
                let mut read = read;
                if let Some(wanted) = &wanted {
                    read.leave_out(|name| !wanted.iter().any(|other| other == name));
                }
                let mut material = |word: &str| material(word, &numbered, materials, used);
                let start = read.given(unit_m, velocity_m_s, &mut material)?;
                let (told, unread) = read.told();
                table.remark(&PATH, &remark(&told, &unread));
                Ok((start, read.heat()?))
            });
            match given {
                Ok(given) => start = Some(given),
                Err(faults) => faults.tell(&path, |message, hint| table.reject_with(&PATH, message, hint)),
            }
        }
        table.finish();
        start
    }
}

/// What of a file is taken and what is not, as `check` says it.
fn remark(told: &[&str], unread: &[&str]) -> String {
    const LISTED: usize = 20;
    let taken = if told.is_empty() { "nothing more".to_owned() } else { told.join(", ") };
    let listed: Vec<&str> = unread.iter().copied().take(LISTED).collect();
    let more = unread.len() - listed.len();
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    let unread = if listed.is_empty() { String::new() } else { format!("; not read: {}{rest}", listed.join(", ")) };
    format!("places, radii, {taken}{unread}")
}

/// The index of a material that a file names, or calls by its number in a list.
fn material(
    word: &str,
    numbered: &[String],
    materials: &BTreeMap<String, Material>,
    used: &mut Used,
) -> Result<u16, (String, Option<String>)> {
    if let Some(material) = materials.get(word) {
        return Ok(used.index(word.into(), material.clone()));
    }
    match word.parse::<f64>() {
        // Without a list, 0 is the material of `[particles]`, which comes first.
        Ok(0.0) if numbered.is_empty() => Ok(0),
        Ok(number) => match numbered.get(number as usize).filter(|_| number >= 0.0 && number.fract() == 0.0) {
            Some(name) => Ok(used.index(name.clone(), materials.get(name).cloned().unwrap_or_default())),
            None => {
                let hint = "particles.start.materials lists the materials that a file calls by numbers";
                Err((format!("there is no material number {word}"), Some(hint.into())))
            }
        },
        Err(_) => Err((format!("no material is called {}", quoted(word)), materials::known(word, materials))),
    }
}

fn region(table: &Table<'_>, kind: &str, largest_m: f64) -> Option<(StartRegion, &'static Key)> {
    let given: Vec<&Key> = [&BOX, &CYLINDER, &SPHERE].into_iter().filter(|key| table.is_given(key)).collect();
    let diameter = 2.0 * largest_m;
    let too_small = |key: &'static Key, what: &str, sizes: &[f64]| {
        if sizes.iter().any(|size| *size < diameter) {
            table.reject(
                key,
                format!("expected {what} of at least the largest particle's diameter, {:e} m", Shown(diameter)),
            );
        }
    };
    let (region, key) = match given.as_slice() {
        _ if kind == "growth" && !table.is_given(&BOX) => {
            table.missing(&BOX);
            return None;
        }
        [] => {
            table.missing(&BOX);
            return None;
        }
        [key, other, ..] => {
            table.reject(other, format!("particles start in a {} or a {}, not both", key.name, other.name));
            return None;
        }
        [key] if key.name == CYLINDER.name => {
            let cylinder = table.optional_table(&CYLINDER)?;
            let (radius_m, height_m) = (cylinder.number(&CYLINDER_RADIUS), cylinder.number(&CYLINDER_HEIGHT));
            let axis = match cylinder.choice(&CYLINDER_AXIS) {
                "x" => 0,
                "y" => 1,
                _ => 2,
            };
            cylinder.finish();
            too_small(&CYLINDER, "a width and a height", &[2.0 * radius_m, height_m]);
            let floor = if axis == 2 { 0.0 } else { radius_m };
            let base_m = table.vector_or(&AT, [0.0, 0.0, floor]);
            (StartRegion::Cylinder { base_m, axis, radius_m, height_m }, &CYLINDER)
        }
        [key] if key.name == SPHERE.name => {
            let radius_m = table.number(&SPHERE);
            too_small(&SPHERE, "a width", &[2.0 * radius_m]);
            (StartRegion::Sphere { centre_m: table.vector_or(&AT, [0.0, 0.0, radius_m]), radius_m }, &SPHERE)
        }
        [_] => {
            let edges = table.vector(&BOX);
            too_small(&BOX, "edges", &edges);
            let lower_m = table.vector_or(&AT, [-edges[0] / 2.0, -edges[1] / 2.0, 0.0]);
            (StartRegion::Box { lower_m, upper_m: std::array::from_fn(|axis| lower_m[axis] + edges[axis]) }, &BOX)
        }
    };
    Some((region, key))
}

fn key_name(key: &Key, region: &StartRegion) -> &'static str {
    match region {
        _ if key.name != AT.name => key.name,
        StartRegion::Box { .. } => "box",
        StartRegion::Cylinder { .. } => "cylinder",
        StartRegion::Sphere { .. } => "sphere",
    }
}

/// Whether a part of the region lies behind a plane, by more than rounding.
fn reaches_behind(region: &StartRegion, through: [f64; 3], normal: [f64; 3]) -> bool {
    let (lower, upper) = region.bounds();
    let offset: f64 = (0..3).map(|axis| through[axis] * normal[axis]).sum();
    let size: f64 = (0..3).map(|axis| (upper[axis] - lower[axis]).abs() + through[axis].abs()).sum();
    region.lowest_along(normal) - offset < -1e-9 * size
}
