//! `[substrate]`: stress in the solid under a wall.

use super::{Grid, Settings, tradeoff::TRADEOFF};
use crate::{
    PhysicsKind, Surroundings,
    common::{Pictured, Shape, Wall, walls::Motion},
    configured,
};
use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{LENGTH, NUMBER, PRESSURE},
};

static WALL: Key = Key::new("wall", Kind::Text, "Its surface: the name of a plane wall at rest.");
static POISSON: Key =
    Key::new("poisson", Kind::Number(&NUMBER, Range::above(-1.0, 0.5)), "Poisson's ratio ν.").or("0.3");
static YOUNG: Key = Key::new(
    "young",
    Kind::Number(&PRESSURE, Range::POSITIVE),
    "Young's modulus E, for the deflection; stress under given loads does not depend on it.",
)
.or_from("must be given where the surface deflects");
static DEFLECTION: Key = Key::new(
    "deflection",
    Kind::Flag,
    "Whether the surface gives way under each particle by what all other contacts press in. Its own contact's deflection is \
     the contact law's matter. The node is then part of the iteration; `wall_deflection` has converged at a mean change of 1e-9 of the mean radius, \
     unless [coupling] says otherwise.",
)
.or("false");
static FAR_FIELD: Key =
    Key::new("far-field", Kind::Table(&FAR_FIELD_SECTION), "How loads far from a point are summed.")
        .or_from("none: each for itself");
static GRIDS: Key =
    Key::new("grids", Kind::Named(&GRID), "Grids of points at which stress is computed.").or_from("none");
static POINTS: Key = Key::new("points", Kind::Vectors(&LENGTH), "Single points at which stress is computed.").or("[]");

static SECTION: Section = Section {
    path: "substrate",
    doc: "Stress in an elastic half-space under the contacts with a plane wall (Zohdi 2018, ch. 9). Points lie on its surface \
          or below.",
    example: "{ wall = \"plate\", grids.top = { lower = [-1e-3, -1e-3, 0], upper = [1e-3, 1e-3, 0], spacing = 5e-5 } }",
    shorthand: None,
    keys: &[&WALL, &POISSON, &YOUNG, &DEFLECTION, &FAR_FIELD, &GRIDS, &POINTS],
};

static METHOD: Key = Key::new(
    "method",
    Kind::Choice(&[
        ("none", "every load is summed at every point"),
        ("grouped", "loads far away are taken together, within a tolerance"),
    ]),
    "How.",
);
static TOLERANCE: Key = Key::new(
    "tolerance",
    Kind::Number(&NUMBER, Range::within(1e-4, 0.5)),
    "Largest error of the stress at a point, over Σ F/(2πγ²) of all loads F at their distances γ.",
)
.or("0.01")
.when("method", &["grouped"]);
static FAR_FIELD_SECTION: Section = Section {
    path: "substrate.far-field",
    doc: "How loads far from a point are summed.",
    example: "{ method = \"grouped\", tolerance = 0.01 }",
    shorthand: Some(&METHOD),
    keys: &[&METHOD, &TOLERANCE],
};

static LOWER: Key = Key::new("lower", Kind::Vector(&LENGTH), "Lower corner of the grid's box.");
static UPPER: Key = Key::new(
    "upper",
    Kind::Vector(&LENGTH),
    "Upper corner; not below the lower one. A side of no length makes the box a plane.",
);
static SPACING: Key = Key::new(
    "spacing",
    Kind::Number(&LENGTH, Range::POSITIVE),
    "Side of the box's cells, rounded so that a whole number fits; the points are the cells' centres.",
);
static GRID: Section = Section {
    path: "substrate.grids.NAME",
    doc: "A regular grid: the centres of equal cells of an axis-aligned box.",
    example: "{ lower = [\"-1 mm\", 0, \"-1 mm\"], upper = [\"1 mm\", 0, 0], spacing = \"50 um\" }",
    shorthand: None,
    keys: &[&LOWER, &UPPER, &SPACING],
};

/// Stress in the solid under a wall as a physics of a scene.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "substrate",
    computes: "the stress of [substrate]",
    doc: "Stress in the solid under a wall.",
    absent: "does not run",
    section: &SECTION,
    rank: 5,
    bodies: None,
    read: |table, surroundings| configured(read(table, surroundings)),
    advice: None,
    tradeoff: Some(&TRADEOFF),
    pictured: &[Pictured {
        decades: true,
        ..Pictured::new("stress_deviator_norm", "norm of the stress deviator", "Stress")
    }],
};

/// Reads the table.
fn read(table: Table<'_>, surroundings: &Surroundings<'_, '_>) -> Option<Settings> {
    let Surroundings { bodies, walls, .. } = *surroundings;
    let count = bodies.count;
    // Everything is read before anything is given up, so that every mistake is found.
    let name = table.optional_text(&WALL);
    let wall = name.and_then(|name| surface(&table, walls, &name));
    let (poisson, young_pa) = (table.number(&POISSON), table.optional_number(&YOUNG));
    let deflects = table.flag(&DEFLECTION);
    if deflects && !table.is_given(&YOUNG) {
        table.missing(&YOUNG);
    }
    let far_field_tolerance = table.optional_table(&FAR_FIELD).and_then(|far_field| {
        let grouped = far_field.choice(&METHOD) == "grouped";
        let tolerance = grouped.then(|| far_field.number(&TOLERANCE));
        far_field.finish();
        tolerance
    });
    let grids = table.named(&GRIDS).into_iter().map(|(name, table)| grid(name, table)).collect::<Vec<_>>();
    let points_m = table.vectors(&POINTS).unwrap_or_default();
    if grids.is_empty() && points_m.is_empty() && !deflects && !table.is_given(&POINTS) {
        table.reject(&GRIDS, "missing; stress is computed at grids or points, and there are none");
    }
    if let Some((_, wall)) = &wall {
        let outside = |point: &[f64; 3]| above(wall, point) > 0.0;
        for grid in grids.iter().filter(|grid| grid.spacing_m > 0.0) {
            if grid.lower_m.iter().zip(&grid.upper_m).all(|(lower, upper)| lower <= upper)
                && [grid.lower_m, grid.upper_m].iter().any(outside)
            {
                let message =
                    format!("its box reaches out of the substrate: expected it on wall `{}` or below", wall.name);
                table.reject_name(&GRIDS, &grid.name, message, None);
            }
        }
        if let Some(row) = points_m.iter().position(outside) {
            let message = format!("entry {} lies above wall `{}`: expected points on it or below", row + 1, wall.name);
            table.reject(&POINTS, message);
        }
    }
    table.finish();
    let (wall_index, wall) = wall?;
    let deflection_young_pa = young_pa.filter(|_| deflects);
    Some(Settings { count, wall, wall_index, poisson, deflection_young_pa, grids, points_m, far_field_tolerance })
}

/// The wall of that name, which must be a plane at rest, and its index.
fn surface(table: &Table<'_>, walls: &[Wall], name: &str) -> Option<(u32, Wall)> {
    let Some((index, wall)) = (0u32..).zip(walls).find(|(_, wall)| wall.name == name) else {
        let names: Vec<&str> = walls.iter().map(|wall| wall.name.as_str()).collect();
        let walls = if names.is_empty() { "there are none".into() } else { format!("they are {}", names.join(", ")) };
        table.reject(&WALL, format!("there is no wall `{name}`; {walls}"));
        return None;
    };
    if !matches!(wall.shape, Shape::Plane(_)) || wall.motion != Motion::Fixed {
        table.reject(&WALL, format!("expected a plane that does not move, which wall `{name}` is not"));
        return None;
    }
    Some((index, wall.clone()))
}

/// Height of a point over a plane wall, in m; zero within rounding.
fn above(wall: &Wall, point: &[f64; 3]) -> f64 {
    let Shape::Plane(plane) = &wall.shape else { return 0.0 };
    let sum = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>();
    let height = sum(&|axis| (point[axis] - plane.through[axis]) * plane.normal[axis]);
    let scale = sum(&|axis| point[axis].abs() + plane.through[axis].abs());
    if height.abs() <= 1e-9 * scale { 0.0 } else { height }
}

fn grid(name: String, table: Table<'_>) -> Grid {
    let (lower_m, upper_m) = (table.vector(&LOWER), table.vector(&UPPER));
    if (0..3).any(|axis| upper_m[axis] < lower_m[axis]) {
        table.reject(&UPPER, "expected no component below that of `lower`");
    }
    let grid = Grid { name, lower_m, upper_m, spacing_m: table.number(&SPACING) };
    table.finish();
    grid
}
