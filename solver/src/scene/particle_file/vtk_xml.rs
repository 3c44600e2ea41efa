//! XML VTK (The VTK User's Guide, "XML File Formats"): points and point data of a PolyData or UnstructuredGrid, as text, base64 or raw
//! bytes, plain or packed by zlib.

use std::collections::BTreeMap;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use roxmltree::{Document, Node};

use super::{Columns, Faults, Values};

/// Type of a number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    /// By its name in a legacy file.
    pub fn legacy(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "char" | "signed_char" => Self::I8,
            "unsigned_char" | "bit" => Self::U8,
            "short" => Self::I16,
            "unsigned_short" => Self::U16,
            // A legacy file holds ids as 32 bits, whatever the library counts with.
            "int" | "vtkidtype" => Self::I32,
            "unsigned_int" => Self::U32,
            "long" | "vtktypeint64" => Self::I64,
            "unsigned_long" | "vtktypeuint64" => Self::U64,
            "float" => Self::F32,
            "double" => Self::F64,
            _ => return None,
        })
    }

    fn xml(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Self::I8,
            "UInt8" => Self::U8,
            "Int16" => Self::I16,
            "UInt16" => Self::U16,
            "Int32" => Self::I32,
            "UInt32" => Self::U32,
            "Int64" => Self::I64,
            "UInt64" => Self::U64,
            "Float32" => Self::F32,
            "Float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The numbers that bytes hold; what is left over at the end is not one.
    pub fn values(self, bytes: &[u8], little_endian: bool) -> Vec<f64> {
        let number = |chunk: &[u8]| {
            let mut word = [0u8; 8];
            let word = &mut word[..chunk.len()];
            word.copy_from_slice(chunk);
            if !little_endian {
                word.reverse();
            }
            let bits = word.iter().rev().fold(0u64, |bits, byte| bits << 8 | u64::from(*byte));
            // Whole numbers of a file that names particles are far below 2⁵³.
            match self {
                Self::I8 => f64::from(bits as i8),
                Self::I16 => f64::from(bits as i16),
                Self::I32 => f64::from(bits as i32),
                Self::I64 => bits as i64 as f64,
                Self::U8 | Self::U16 | Self::U32 | Self::U64 => bits as f64,
                Self::F32 => f64::from(f32::from_bits(bits as u32)),
                Self::F64 => f64::from_bits(bits),
            }
        };
        bytes.chunks_exact(self.bytes()).map(number).collect()
    }
}

/// Reads the points of all pieces and their data.
pub(super) fn read(contents: &[u8]) -> Result<Columns, Faults> {
    let (text, appended) = split(contents)?;
    let document = Document::parse(&text)
        .map_err(|error| Faults::one(Some(error.pos().row as usize), format!("not valid XML: {error}")))?;
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" {
        return Err(Faults::one(Some(1), "expected a VTKFile"));
    }
    let kind = root.attribute("type").unwrap_or_default();
    if !["PolyData", "UnstructuredGrid"].contains(&kind) {
        return Err(Faults::one(Some(1), format!("expected a PolyData or UnstructuredGrid, found {kind:?}")));
    }
    let packed = match root.attribute("compressor") {
        None => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => return Err(Faults::one(Some(1), format!("expected no compressor or zlib, found {other}"))),
    };
    let coding = Coding {
        little_endian: root.attribute("byte_order") != Some("BigEndian"),
        header: if root.attribute("header_type") == Some("UInt64") { Number::U64 } else { Number::U32 },
        packed,
        appended,
    };
    // In the order of the first piece; all pieces have the same arrays.
    let mut order: Vec<(String, usize)> = Vec::new();
    let mut arrays: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for piece in root.descendants().filter(|node| node.has_tag_name("Piece")) {
        let points: usize = piece.attribute("NumberOfPoints").and_then(|count| count.parse().ok()).unwrap_or(0);
        if points == 0 {
            continue;
        }
        for section in piece.children().filter(|node| ["Points", "PointData"].contains(&node.tag_name().name())) {
            for array in section.children().filter(|node| node.has_tag_name("DataArray")) {
                let is_points = section.has_tag_name("Points");
                let name = if is_points { "points" } else { array.attribute("Name").unwrap_or("") };
                let components =
                    array.attribute("NumberOfComponents").and_then(|count| count.parse().ok()).unwrap_or(1);
                let wrong = |message: String| Faults::one(line(&array), format!("the array `{name}`: {message}"));
                let Some(number) = array.attribute("type").and_then(Number::xml) else {
                    // Texts and bits: nothing a particle has.
                    continue;
                };
                let values = coding.values(&array, number).map_err(wrong)?;
                if components == 0 || values.len() != points.saturating_mul(components) {
                    let message =
                        format!("expected {points} points of {components} values, found {} values", values.len());
                    return Err(wrong(message));
                }
                if !order.iter().any(|(known, _)| known == name) {
                    order.push((name.to_owned(), components));
                }
                arrays.entry(name.to_owned()).or_default().extend(values);
            }
        }
    }
    let mut columns = Columns::default();
    for (name, components) in order {
        columns.push_array(&name, components, &arrays[&name]);
    }
    let rows = |values: &Values| match values {
        Values::Numbers(values) => values.len(),
        Values::Words(values) => values.len(),
    };
    let count = columns.find("x").map_or(0, rows);
    match columns.columns.iter().find(|(_, values)| rows(values) != count) {
        Some((name, _)) => Err(Faults::one(None, format!("the array `{name}` is not in every piece"))),
        None => Ok(columns),
    }
}

fn line(node: &Node<'_, '_>) -> Option<usize> {
    Some(node.document().text_pos_at(node.range().start).row as usize)
}

/// The XML without its appended data, and these: what follows the underscore. Raw ones are no text.
fn split(contents: &[u8]) -> Result<(String, Option<Appended>), Faults> {
    let find = |from: usize, wanted: &[u8]| {
        contents[from..].windows(wanted.len()).position(|window| window == wanted).map(|at| from + at)
    };
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).map_err(|_| Faults::one(None, "expected XML in UTF-8"));
    let Some(start) = find(0, b"<AppendedData") else { return Ok((text(contents)?, None)) };
    let Some(open) = find(start, b">") else { return Err(Faults::one(None, "AppendedData do not begin")) };
    let Some(mark) = find(open, b"_") else { return Err(Faults::one(None, "AppendedData do not begin with `_`")) };
    let raw = contents[start..open].windows(3).any(|window| window == b"raw");
    let data = if raw {
        contents[mark + 1..].to_vec()
    } else {
        let end = find(mark, b"<").unwrap_or(contents.len());
        contents[mark + 1..end].to_vec()
    };
    Ok((text(&contents[..start])? + "</VTKFile>", Some(Appended { data, raw })))
}

/// How numbers are written in a file.
struct Coding {
    little_endian: bool,
    header: Number,
    packed: bool,
    appended: Option<Appended>,
}

/// Data behind the XML.
struct Appended {
    data: Vec<u8>,
    /// Raw instead of base64.
    raw: bool,
}

impl Coding {
    fn values(&self, array: &Node<'_, '_>, number: Number) -> Result<Vec<f64>, String> {
        let text = array.text().unwrap_or("");
        let bytes = match array.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                let parse = |word: &str| word.parse().map_err(|_| format!("expected a number, found {word:?}"));
                return text.split_whitespace().map(parse).collect();
            }
            "binary" => self.unpack(&base64(text.as_bytes())?)?,
            "appended" => {
                let offset: usize = array.attribute("offset").and_then(|offset| offset.parse().ok()).unwrap_or(0);
                let Appended { data, raw } = self.appended.as_ref().ok_or("its data are appended, but nothing is")?;
                let data = data.get(offset..).ok_or("its data begin behind the end of the file")?;
                if *raw { self.unpack(data)? } else { self.unpack(&base64(data)?)? }
            }
            other => return Err(format!("expected the format ascii, binary or appended, found {other:?}")),
        };
        Ok(number.values(&bytes, self.little_endian))
    }

    /// The bytes behind a header that says how many there are.
    fn unpack(&self, data: &[u8]) -> Result<Vec<u8>, String> {
        const SHORT: &str = "its data are shorter than they say";
        let word = self.header.bytes();
        let header = |index: usize| -> Result<usize, String> {
            let at = index.checked_mul(word).ok_or(SHORT)?;
            let bytes = data.get(at..at.saturating_add(word)).ok_or(SHORT)?;
            Ok(self.header.values(bytes, self.little_endian).first().map_or(0, |value| *value as usize))
        };
        if !self.packed {
            let length = header(0)?;
            return data.get(word..word.saturating_add(length)).map(<[u8]>::to_vec).ok_or_else(|| SHORT.into());
        }
        // Number of blocks, their size, size of the last one (0: as the others), then the packed sizes.
        let (blocks, size) = (header(0)?, header(1)?);
        let mut at = blocks.checked_add(3).and_then(|words| words.checked_mul(word)).ok_or(SHORT)?;
        let mut unpacked = Vec::new();
        for block in 0..blocks {
            let length = header(3 + block)?;
            let bytes = data.get(at..at.saturating_add(length)).ok_or(SHORT)?;
            let block = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(bytes, size.max(1));
            unpacked.extend(block.map_err(|error| format!("its packed data are damaged: {error}"))?);
            at += length;
        }
        Ok(unpacked)
    }
}

/// Decodes base64 whose pieces may each be padded: VTK writes a header of its own before packed data.
fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let letters: Vec<u8> = text.iter().copied().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let mut bytes = Vec::with_capacity(letters.len() / 4 * 3);
    let mut rest = letters.as_slice();
    while !rest.is_empty() {
        let padding = rest.chunks(4).position(|group| group.contains(&b'='));
        let (piece, after) = rest.split_at(padding.map_or(rest.len(), |group| (4 * group + 4).min(rest.len())));
        STANDARD.decode_vec(piece, &mut bytes).map_err(|error| format!("its base64 is damaged: {error}"))?;
        rest = after;
    }
    Ok(bytes)
}
