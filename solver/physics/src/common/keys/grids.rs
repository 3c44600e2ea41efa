//! `[grids.NAME]`: grids of cells in a box, on which a physics computes its fields.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    problems::nearest,
    reader::Table,
    units::{LENGTH, NUMBER},
};

use crate::common::grid::{CellGrid, Fine, graded_edges};

static LOWER: Key = Key::new("lower", Kind::Vector(&LENGTH), "Lower corner of the box.");
static UPPER: Key = Key::new("upper", Kind::Vector(&LENGTH), "Upper corner; above the lower one along each axis.");
static CELL: Key = Key::new(
    "cell",
    Kind::Series(&LENGTH, Range::POSITIVE),
    "Width of a cell, or a list of its widths along x, y and z; rounded so that whole cells fill the box, or its fine part.",
);
static FINE: Key =
    Key::new("fine", Kind::Table(&FINE_SECTION), "The part of the box with cells of that width.").or_from("all of it");
/// Keys of a grid.
pub static SECTION: Section = Section {
    path: "grids.NAME",
    doc: "A grid of cells in an axis-aligned box, regular or graded. A physics names the grid it computes on.",
    example: "{ lower = [\"-1 mm\", \"-1 mm\", \"-1 mm\"], upper = [\"1 mm\", \"1 mm\", 0], cell = \"20 um\" }",
    shorthand: None,
    keys: &[&LOWER, &UPPER, &CELL, &FINE],
};

static FINE_LOWER: Key = Key::new("lower", Kind::Vector(&LENGTH), "Lower corner of the fine part.");
static FINE_UPPER: Key =
    Key::new("upper", Kind::Vector(&LENGTH), "Its upper corner; not below the lower one along any axis.");
static GROWTH: Key = Key::new(
    "growth",
    Kind::Number(&NUMBER, Range::within(1.0, 3.0)),
    "Largest width of a cell outside over that of its neighbour nearer to the fine part.",
)
.or("1.2");
static FINE_SECTION: Section = Section {
    path: "grids.NAME.fine",
    doc: "Where cells have their least width. Outside they grow with the distance, along each axis for itself.",
    example: "{ lower = [\"-0.2 mm\", \"-0.1 mm\", \"-0.1 mm\"], upper = [\"0.2 mm\", \"0.1 mm\", 0] }",
    shorthand: None,
    keys: &[&FINE_LOWER, &FINE_UPPER, &GROWTH],
};

/// Most cells along an axis: beyond, edges alone would fill memory.
const MOST_ALONG: f64 = 100_000.0;
/// Most cells of a grid: some 200 bytes each are 50 GB.
const MOST_CELLS: f64 = 250e6;
/// Growth below which cells hardly grow, and are counted as if they did not.
const HARDLY: f64 = 1.01;

/// Reads all grids, in the order of the file; one with a mistake is left out.
pub fn read(root: &Table<'_>, key: &'static Key) -> Vec<CellGrid> {
    root.named(key).into_iter().filter_map(|(name, table)| grid(&name, table)).collect()
}

fn grid(name: &str, table: Table<'_>) -> Option<CellGrid> {
    let (lower_m, upper_m) = (table.vector(&LOWER), table.vector(&UPPER));
    let widths_m = widths(&table);
    let is_box = (0..3).all(|axis| lower_m[axis] < upper_m[axis]);
    if (0..3).any(|axis| upper_m[axis] <= lower_m[axis]) {
        table.reject(&UPPER, "expected every component above that of `lower`");
    }
    let fine = table.optional_table(&FINE).map(|fine| {
        let (lower, upper, growth) = (fine.vector(&FINE_LOWER), fine.vector(&FINE_UPPER), fine.number(&GROWTH));
        if (0..3).any(|axis| upper[axis] < lower[axis]) {
            fine.reject(&FINE_UPPER, "expected no component below that of `lower`");
        }
        fine.finish();
        growth.is_finite().then(|| [0, 1, 2].map(|axis| Fine { from_m: lower[axis], to_m: upper[axis], growth }))
    });
    let (is_sound, fine) = (fine.is_none_or(|fine| fine.is_some()), fine.flatten());
    let widths_m = widths_m.filter(|widths_m| {
        let fits = (0..3).all(|axis| {
            let whole_m = upper_m[axis] - lower_m[axis];
            let grows = |fine: &[Fine; 3]| fine[axis].growth > HARDLY;
            let fine_m = fine.filter(grows).map_or(whole_m, |fine| fine[axis].to_m - fine[axis].from_m);
            fine_m.min(whole_m) / widths_m[axis] <= MOST_ALONG
        });
        if is_box && !fits {
            table.reject(&CELL, format!("expected at most {MOST_ALONG} cells along each axis, found more"));
        }
        fits
    });
    let edges =
        |axis: usize, width_m: f64| graded_edges(lower_m[axis], upper_m[axis], width_m, fine.map(|fine| fine[axis]));
    let grid = widths_m
        .filter(|_| is_box && is_sound)
        .map(|widths_m| CellGrid { name: name.into(), edges_m: [0, 1, 2].map(|axis| edges(axis, widths_m[axis])) });
    let cells = grid.as_ref().map_or(0.0, |grid| grid.counts().iter().map(|&count| count as f64).product());
    if cells > MOST_CELLS {
        let hint = Some("give a part of the box as `fine`, or take wider cells".into());
        table.reject_with(&CELL, format!("expected at most {MOST_CELLS:e} cells, found {cells:.0}"), hint);
    }
    table.finish();
    grid.filter(|_| cells <= MOST_CELLS)
}

fn widths(table: &Table<'_>) -> Option<[f64; 3]> {
    let widths_m = table.series(&CELL)?;
    match widths_m[..] {
        [width_m] => Some([width_m; 3]),
        [x, y, z] => Some([x, y, z]),
        _ => {
            table.reject(&CELL, format!("expected one width or three, found {}", widths_m.len()));
            None
        }
    }
}

/// The grid that a key of a table names; an unknown one is reported there.
pub(crate) fn choose<'g>(table: &Table<'_>, key: &'static Key, grids: &'g [CellGrid]) -> Option<&'g CellGrid> {
    let name = table.optional_text(key)?;
    let found = grids.iter().find(|grid| grid.name == name);
    if found.is_none() {
        let names: Vec<&str> = grids.iter().map(|grid| grid.name.as_str()).collect();
        let hint = match nearest(&name, names.iter().copied()) {
            Some(near) => format!("did you mean \"{near}\"?"),
            None if names.is_empty() => format!("add [grids.{name}]"),
            None => format!("the grids of this scene are {}", names.join(", ")),
        };
        table.reject_with(key, format!("there is no [grids.{name}]"), Some(hint));
    }
    found
}
