//! `[optics.rays]`, and the same table of `[acoustics]`: how a beam is sampled.

use crate::common::{
    Wall,
    rays::{Limits, Pattern, Sampling},
};
use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::NUMBER,
};

static COUNT: Key =
    Key::new("count", Kind::Whole(1, 16_777_216), "Number of rays; each carries the same share of the beam's power.")
        .or("1000");
static PATTERN: Key = Key::new(
    "pattern",
    Kind::Choice(&[
        ("stratified", "spread evenly by the power, on circles turned by the golden angle"),
        ("random", "independent of each other, from the scene's seed; the same in every window"),
    ]),
    "Where rays start over the beam's cross-section.",
)
.or("\"stratified\"");
static THRESHOLD: Key = Key::new(
    "threshold",
    Kind::Number(&NUMBER, Range::within(0.0, 0.5)),
    "Share of its power at the start below which a ray ends; what is left is booked as residual.",
)
.or("1e-6");
static REFLECTIONS: Key = Key::new(
    "reflections",
    Kind::Whole(1, 1_000_000),
    "Reflections after which a ray ends, whatever its power; it is booked as residual.",
)
.or("1000");

pub(crate) static SECTION: Section = Section {
    path: "optics.rays",
    doc: "Rays that sample a beam, of light in [optics] or of sound in [acoustics].",
    example: "{ count = 10000 }",
    shorthand: None,
    keys: &[&COUNT, &PATTERN, &THRESHOLD, &REFLECTIONS],
};

/// Reads the rays under `key` of a physics' table.
pub(crate) fn read(physics: &Table<'_>, key: &'static Key, seed: u64) -> Option<Sampling> {
    let table = physics.table(key)?;
    let pattern = match table.choice(&PATTERN) {
        "random" => Pattern::Random { seed },
        _ => Pattern::Stratified,
    };
    let limits = Limits { threshold: table.number(&THRESHOLD), reflections: table.whole_u32(&REFLECTIONS) };
    let count = usize::try_from(table.whole(&COUNT)).unwrap_or(usize::MAX);
    table.finish();
    Some(Sampling { count, pattern, limits })
}

/// Normals of the planes among the walls.
pub(crate) fn normals(walls: &[Wall]) -> Vec<[f64; 3]> {
    walls.iter().flat_map(|wall| wall.shape.planes()).map(|plane| plane.normal).collect()
}
