//! VTK PolyData files (The VTK User's Guide, "XML File Formats") of points, paths and pairs, and the list that makes a series of
//! files.

use std::{fmt::Write as _, io::Write};

use stagger_messages::{Field, MessageError, Pairs, Points, geometry::Shape};

use super::arrays::{self, Array, Section, VtkError, on_rows_of};
use crate::Step;

/// What the file of a state begins with.
pub const BEGIN: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" \
                         header_type=\"UInt64\">\n<PolyData>\n";
/// What the list of a series begins with.
pub const SERIES_BEGIN: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n";

/// Writes the rows of a support that are points, with every field on them: of spheres the radius and, in m/s, the velocity
/// have the names that a scene's particle files have. Rows that are paths become lines.
///
/// # Errors
/// The places are missing, or the file cannot be written.
pub fn points(step: &Step, points: &Points, output: impl Write) -> Result<(), VtkError> {
    let (positions, of_one) = points.places(&step.fields)?;
    let rows = positions.rows();
    let data = on_rows_of(&step.fields, positions).filter(|(name, _)| *name != points.positions);
    let data = data.map(|(name, field)| {
        // As a scene's particle files call them: an exported file can be the start of another run.
        let name = match name {
            radii if radii == points.radii => "radius",
            "velocities" => "velocity",
            other => other,
        };
        Array::of(name, field)
    });
    let cells = [
        Array::whole("connectivity", 0..(rows * of_one) as u64),
        Array::whole("offsets", (1..=rows as u64).map(|row| row * of_one as u64)),
    ];
    let (data, cells) = if of_one == 1 {
        (Section { name: "PointData", arrays: data.collect() }, Cells::Vertices(cells))
    } else {
        (Section { name: "CellData", arrays: data.collect() }, Cells::Lines(cells))
    };
    write(output, step, positions, rows, cells, data)
}

/// Writes the rows of a support that are pairs: lines between the points of another support, with every field on the pairs.
///
/// # Errors
/// The places or the pairs are missing, or the file cannot be written.
pub fn pairs(step: &Step, pairs: &Pairs, output: impl Write) -> Result<(), VtkError> {
    let Shape::Points(ends) = step.supports.shape(&pairs.of, &step.fields) else {
        return Err(MessageError::NoField(format!("of the points on `{}`", pairs.of)).into());
    };
    let (positions, _) = ends.places(&step.fields)?;
    let found = step.fields.get(&pairs.indices).ok_or_else(|| MessageError::Absent(pairs.indices.clone()))?;
    let lines = found.rows();
    // `contact_area` of `contact_pairs` is the area.
    let prefix = pairs.indices.strip_suffix("pairs").unwrap_or_default();
    let data = on_rows_of(&step.fields, found).filter(|(name, _)| *name != pairs.indices);
    let data = data.map(|(name, field)| Array::of(name.strip_prefix(prefix).unwrap_or(name), field)).collect();
    let cells = [
        Array::whole("connectivity", found.u32()?.iter().map(|&row| u64::from(row))),
        Array::whole("offsets", (1..=lines as u64).map(|line| 2 * line)),
    ];
    write(output, step, positions, lines, Cells::Lines(cells), Section { name: "CellData", arrays: data })
}

/// Whether the lines of a support of pairs can be drawn: both ends are rows of one support of single points.
#[must_use]
pub fn has_lines(step: &Step, pairs: &Pairs) -> bool {
    let Shape::Points(ends) = step.supports.shape(&pairs.of, &step.fields) else { return false };
    pairs.others.is_empty()
        && step.fields.contains_key(&pairs.indices)
        && ends.places(&step.fields).is_ok_and(|(_, of_one)| of_one == 1)
}

/// The list of a series: each file with its time, in s.
#[must_use]
pub fn series(files: &[(f64, String)]) -> String {
    let mut text = String::from(SERIES_BEGIN);
    for (t_s, file) in files {
        // Writing to a text cannot fail.
        let _ = writeln!(text, "<DataSet timestep=\"{t_s:e}\" part=\"0\" file=\"{file}\"/>");
    }
    text + "</Collection>\n</VTKFile>\n"
}

/// What the points make up: their connectivity and offsets.
enum Cells {
    Vertices([Array; 2]),
    Lines([Array; 2]),
}

fn write(
    output: impl Write,
    step: &Step,
    positions: &Field,
    count: usize,
    cells: Cells,
    data: Section,
) -> Result<(), VtkError> {
    let points = positions.rows() * (positions.components() / 3);
    let (vertices, lines) = if matches!(cells, Cells::Vertices(_)) { (count, 0) } else { (0, count) };
    let cells = match cells {
        Cells::Vertices(arrays) => Section { name: "Verts", arrays: arrays.into() },
        Cells::Lines(arrays) => Section { name: "Lines", arrays: arrays.into() },
    };
    let sections = [Section { name: "Points", arrays: vec![Array::points(positions)] }, cells, data];
    let piece = format!(
        "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"{vertices}\" NumberOfLines=\"{lines}\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"0\">"
    );
    arrays::write(output, BEGIN, step.t_s, &piece, &sections, "</Piece>\n</PolyData>\n")
}
