//! Arrays of VTK's XML files: described in the XML, their bytes appended behind it.
//!
//! Values follow the XML as raw little-endian bytes: no digit is lost, and nothing is packed, so that a file is written as fast
//! as the disk takes it.

use std::{
    fmt::Write as _,
    io::{self, Write},
};

use stagger_messages::{Field, Fields, MessageError, ValueKind};

use crate::Step;

/// Why a state is not written.
#[derive(Debug, thiserror::Error)]
pub enum VtkError {
    /// A field is missing, or of another type than it should be.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// The description of a grid is not sound.
    #[error("the grid has no layout that can be written")]
    Grid,
    /// The file cannot be written.
    #[error("cannot write: {0}")]
    Write(#[from] io::Error),
}

/// An array of one file.
pub(super) struct Array {
    name: String,
    kind: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

impl Array {
    pub fn of(name: &str, field: &Field) -> Self {
        let kind = match field.values().kind() {
            ValueKind::U32 => "UInt32",
            ValueKind::U8 | ValueKind::Unspecified => "UInt8",
            ValueKind::F64 => "Float64",
        };
        let bytes = field.values().bytes().to_vec();
        Self { name: name.into(), kind, components: field.components(), bytes }
    }

    /// Points, whose coordinates are the bytes of a field with 3 values per point.
    pub fn points(field: &Field) -> Self {
        Self { components: 3, ..Self::of(field.name(), field) }
    }

    pub fn whole(name: &str, values: impl Iterator<Item = u64>) -> Self {
        let bytes = values.flat_map(u64::to_le_bytes).collect();
        Self { name: name.into(), kind: "Int64", components: 1, bytes }
    }

    /// Numbers without a field.
    pub fn numbers(name: &str, values: &[f64]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Self { name: name.into(), kind: "Float64", components: 1, bytes }
    }

    fn time(t_s: f64) -> Self {
        Self { name: "TimeValue".into(), kind: "Float64", components: 1, bytes: t_s.to_le_bytes().into() }
    }
}

/// Arrays that belong together.
pub(super) struct Section {
    pub name: &'static str,
    pub arrays: Vec<Array>,
}

/// Writes a file with one piece: what it `begin`s with, its time, the piece with its sections, what the XML ends with, and
/// the bytes.
pub(super) fn write(
    mut output: impl Write,
    begin: &str,
    t_s: f64,
    piece: &str,
    sections: &[Section],
    end: &str,
) -> Result<(), VtkError> {
    let time = Array::time(t_s);
    let mut head = String::from(begin);
    let mut offset = 0;
    head += "<FieldData>\n";
    describe(&mut head, &time, " NumberOfTuples=\"1\"", &mut offset);
    // Writing to a text cannot fail.
    let _ = writeln!(head, "</FieldData>\n{piece}");
    for section in sections {
        let _ = writeln!(head, "<{}>", section.name);
        for array in &section.arrays {
            describe(&mut head, array, "", &mut offset);
        }
        let _ = writeln!(head, "</{}>", section.name);
    }
    head += end;
    head += "<AppendedData encoding=\"raw\">\n_";
    output.write_all(head.as_bytes())?;
    for array in [&time].into_iter().chain(sections.iter().flat_map(|section| &section.arrays)) {
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

/// The fields on a grid with that many values.
pub(super) fn on_grid(step: &Step, support: &str, rows: usize) -> Vec<Array> {
    let on_it = step.fields.iter().filter(|(_, field)| field.port.support == support && field.rows() == rows);
    on_it.map(|(name, field)| Array::of(name, field)).collect()
}

/// The fields on the same rows as one of them.
pub(super) fn on_rows_of<'f>(fields: &'f Fields, like: &Field) -> impl Iterator<Item = (&'f str, &'f Field)> {
    let (support, rows) = (like.port.support.clone(), like.rows());
    let fits = move |field: &Field| field.port.support == support && field.rows() == rows;
    fields.iter().filter(move |(_, field)| fits(field)).map(|(name, field)| (name.as_str(), field))
}
