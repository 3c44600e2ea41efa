//! VTK PolyData files (The VTK User's Guide, "XML File Formats") of a state of a run, and the list that makes a series of them.
//!
//! Values follow the XML as raw little-endian bytes: no digit is lost, and nothing is packed, so that a file is written as fast
//! as the disk takes it.

use std::{
    fmt::Write as _,
    io::{self, Write},
};

use stagger_messages::{Field, Fields, MessageError, ValueKind};

use crate::Step;

/// What the file of a state begins with.
pub const BEGIN: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" \
                         header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n";
/// What the list of a series begins with.
pub const SERIES_BEGIN: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n";

/// A field that is written as an array.
struct Array {
    name: String,
    kind: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

impl Array {
    fn of(name: &str, field: &Field) -> Self {
        let kind = match field.values().kind() {
            ValueKind::U32 => "UInt32",
            ValueKind::U8 | ValueKind::Unspecified => "UInt8",
            ValueKind::F64 => "Float64",
        };
        let bytes = field.values().bytes().to_vec();
        Self { name: name.into(), kind, components: field.components(), bytes }
    }

    fn whole(name: &str, values: impl Iterator<Item = u64>) -> Self {
        let bytes = values.flat_map(u64::to_le_bytes).collect();
        Self { name: name.into(), kind: "Int64", components: 1, bytes }
    }
}

/// Why a state is not written.
#[derive(Debug, thiserror::Error)]
pub enum VtpError {
    /// It holds no particles.
    #[error("the recording holds no field `{0}`: only a run with particles can be exported")]
    NoField(&'static str),
    /// A field is of another type than it should be.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// The file cannot be written.
    #[error("cannot write: {0}")]
    Write(#[from] io::Error),
}

/// Writes the particles of a state: points with their radius, velocity and every other field on particles.
///
/// # Errors
/// There are no particles, or the file cannot be written.
pub fn particles(step: &Step, output: impl Write) -> Result<(), VtpError> {
    let positions = field(&step.fields, "positions")?;
    let count = positions.rows();
    let data: Vec<Array> = on_support(&step.fields, positions)
        .filter(|(name, _)| *name != "positions")
        .map(|(name, field)| {
            // As a scene's particle files call them: an exported file can be the start of another run.
            let name = match name {
                "radii" => "radius",
                "velocities" => "velocity",
                other => other,
            };
            Array::of(name, field)
        })
        .collect();
    let cells = [Array::whole("connectivity", 0..count as u64), Array::whole("offsets", 1..=count as u64)];
    let data = Section { name: "PointData", arrays: data };
    write(output, step, Counts { points: count, vertices: count, lines: 0 }, positions, &data, "Verts", cells)
}

/// Writes the contacts between particles of a state: lines between their centres, with every field on contacts.
///
/// # Errors
/// There are no particles or contacts, or the file cannot be written.
pub fn contacts(step: &Step, output: impl Write) -> Result<(), VtpError> {
    let (positions, pairs) = (field(&step.fields, "positions")?, field(&step.fields, "contact_pairs")?);
    let lines = pairs.rows();
    let data = on_support(&step.fields, pairs).filter(|(name, _)| *name != "contact_pairs");
    let data = data.map(|(name, field)| Array::of(name.strip_prefix("contact_").unwrap_or(name), field)).collect();
    let cells = [
        Array::whole("connectivity", pairs.u32()?.iter().map(|&particle| u64::from(particle))),
        Array::whole("offsets", (1..=lines as u64).map(|line| 2 * line)),
    ];
    let data = Section { name: "CellData", arrays: data };
    write(output, step, Counts { points: positions.rows(), vertices: 0, lines }, positions, &data, "Lines", cells)
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

fn field<'f>(fields: &'f Fields, name: &'static str) -> Result<&'f Field, VtpError> {
    fields.get(name).ok_or(VtpError::NoField(name))
}

/// The fields on the same rows as one of them.
fn on_support<'f>(fields: &'f Fields, like: &Field) -> impl Iterator<Item = (&'f str, &'f Field)> {
    let (support, rows) = (like.port.support.clone(), like.rows());
    let fits = move |field: &Field| field.port.support == support && field.rows() == rows;
    fields.iter().filter(move |(_, field)| fits(field)).map(|(name, field)| (name.as_str(), field))
}

struct Counts {
    points: usize,
    vertices: usize,
    lines: usize,
}

/// Arrays that belong together.
struct Section {
    name: &'static str,
    arrays: Vec<Array>,
}

fn write(
    mut output: impl Write,
    step: &Step,
    counts: Counts,
    positions: &Field,
    data: &Section,
    cells_name: &'static str,
    cells: [Array; 2],
) -> Result<(), VtpError> {
    let Counts { points, vertices, lines } = counts;
    let time = Array { name: "TimeValue".into(), kind: "Float64", components: 1, bytes: step.t_s.to_le_bytes().into() };
    let sections = [
        Section { name: "Points", arrays: vec![Array::of("positions", positions)] },
        Section { name: cells_name, arrays: cells.into() },
    ];
    let mut head = String::from(BEGIN);
    let mut offset = 0;
    describe(&mut head, &time, " NumberOfTuples=\"1\"", &mut offset);
    // Writing to a text cannot fail.
    let _ = writeln!(
        head,
        "</FieldData>\n<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"{vertices}\" NumberOfLines=\"{lines}\" \
         NumberOfStrips=\"0\" NumberOfPolys=\"0\">"
    );
    for section in sections.iter().chain([data]) {
        let _ = writeln!(head, "<{}>", section.name);
        for array in &section.arrays {
            describe(&mut head, array, "", &mut offset);
        }
        let _ = writeln!(head, "</{}>", section.name);
    }
    head += "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
    output.write_all(head.as_bytes())?;
    for array in [&time].into_iter().chain(sections.iter().chain([data]).flat_map(|section| &section.arrays)) {
        output.write_all(&(array.bytes.len() as u64).to_le_bytes())?;
        output.write_all(&array.bytes)?;
    }
    output.write_all(b"\n</AppendedData>\n</VTKFile>\n")?;
    Ok(output.flush()?)
}

/// Describes an array whose bytes begin at `offset`, and moves that behind them.
fn describe(head: &mut String, array: &Array, more: &str, offset: &mut usize) {
    let Array { name, kind, components, bytes } = array;
    // Names of fields hold no character that XML would mind. Writing to a text cannot fail.
    let _ = writeln!(
        head,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"{more} format=\"appended\" \
         offset=\"{offset}\"/>"
    );
    *offset += size_of::<u64>() + bytes.len();
}
