//! XML VTK (The VTK User's Guide, "XML File Formats"): points and point data of a PolyData or UnstructuredGrid, as text, base64 or raw
//! bytes, plain or packed by zlib.
//!
//! An attribute that is there is read or refused, never replaced; one that is absent means what VTK's own reader takes it for.

mod appended;
mod coding;

use coding::Coding;
use roxmltree::{Document, Node};

use super::{Columns, Faults, MOST_VALUES, columns_of, cut, is_known, quoted, vtk_number::Number};

/// Reads the points of all pieces and their data.
pub(crate) fn read(contents: &[u8]) -> Result<Columns, Faults> {
    let (text, data) = appended::split(contents)?;
    let document = Document::parse(&text).map_err(|error| {
        Faults::one(Some(error.pos().row as usize), format!("not valid XML: {}", cut(&error.to_string())))
    })?;
    let root = document.root_element();
    let at_root = |message: String| Faults::one(line(&root), message);
    if root.tag_name().name() != "VTKFile" {
        return Err(at_root(format!("expected a VTKFile, found {}", cut(root.tag_name().name()))));
    }
    let kind = attribute(&root, "type").unwrap_or_default();
    if !["PolyData", "UnstructuredGrid"].contains(&kind) {
        return Err(at_root(format!(
            "expected a VTKFile of type PolyData or UnstructuredGrid, found {}",
            quoted(kind)
        )));
    }
    let coding = Coding::of(&root, data)?;
    let mut arrays: Vec<Array> = Vec::new();
    let mut total = 0usize;
    for (index, piece) in root.descendants().filter(|node| node.has_tag_name("Piece")).enumerate() {
        let points = whole(&piece, "NumberOfPoints", None)?;
        let before = total;
        total = total.saturating_add(points);
        if points == 0 {
            continue;
        }
        for mut array in piece_arrays(&piece, points, &coding)? {
            let known = arrays.iter_mut().find(|known| known.is_points == array.is_points && known.name == array.name);
            match known {
                // The first piece with points says which arrays there are.
                None if before > 0 => {
                    let message =
                        format!("the array `{}` is in piece {index} alone, not in every piece", cut(&array.name));
                    return Err(Faults::one(line(&piece), message));
                }
                None => arrays.push(array),
                Some(known) if known.components != array.components => {
                    let (first, second) = (known.components, array.components);
                    let message = format!("the array `{}` has {first} and {second} components", cut(&array.name));
                    return Err(Faults::one(line(&piece), message));
                }
                Some(known) => known.values.append(&mut array.values),
            }
        }
    }
    if total == 0 {
        return Err(at_root("expected a Piece with points, found none".into()));
    }
    let mut columns = Columns::default();
    for Array { is_points, name, components, values } in arrays {
        if values.len() != total.saturating_mul(components) {
            return Err(Faults::one(None, format!("the array `{}` is not in every piece", cut(&name))));
        }
        let pushed = match is_points {
            true => columns.push_array("points", components, &values),
            false => columns.push_point_data(&name, components, &values),
        };
        pushed.map_err(|message| Faults::one(None, message))?;
    }
    Ok(columns)
}

/// An array on points.
struct Array {
    /// The points themselves.
    is_points: bool,
    name: String,
    components: usize,
    values: Vec<f64>,
}

/// The arrays of a piece: its points, once, and the data on them.
fn piece_arrays(piece: &Node<'_, '_>, points: usize, coding: &Coding) -> Result<Vec<Array>, Faults> {
    let mut arrays: Vec<Array> = Vec::new();
    for section in piece.children().filter(|node| ["Points", "PointData"].contains(&node.tag_name().name())) {
        let is_points = section.has_tag_name("Points");
        for node in section.children().filter(Node::is_element) {
            let name = if is_points { "points" } else { attribute(&node, "Name").unwrap_or("") };
            let wrong = |message: String| Faults::one(line(&node), format!("the array `{}`: {message}", cut(name)));
            if name.is_empty() {
                continue;
            }
            let kind = attribute(&node, "type").unwrap_or("");
            let Some(number) = Number::xml(kind).filter(|_| node.has_tag_name("DataArray")) else {
                let is_text =
                    ["Array", "DataArray"].contains(&node.tag_name().name()) && ["String", "Bit"].contains(&kind);
                // Texts are nothing a particle has, unless they are called so.
                if is_text && !is_points && columns_of(name, 1).is_ok_and(|names| !is_known(&names[0])) {
                    continue;
                }
                let message = format!("expected a DataArray with a type such as Float64, found {}", quoted(kind));
                return Err(wrong(message));
            };
            let components = whole(&node, "NumberOfComponents", Some(1))?;
            let count = points.saturating_mul(components);
            if components == 0 || count > MOST_VALUES {
                return Err(wrong(format!("{points} points of {components} components cannot be read")));
            }
            let told = |message| wrong(format!("{message}; expected {points} points of {components} values"));
            let values = coding.values(&node, number, count).map_err(told)?;
            if values.len() != count {
                let found = values.len();
                return Err(wrong(format!("expected {points} points of {components} values, found {found} values")));
            }
            if arrays.iter().any(|array| array.is_points == is_points && array.name == name) {
                return Err(wrong("expected it once in a piece, found it twice".into()));
            }
            arrays.push(Array { is_points, name: name.into(), components, values });
        }
    }
    if arrays.iter().any(|array| array.is_points) {
        Ok(arrays)
    } else {
        Err(Faults::one(line(piece), "expected Points, found none"))
    }
}

fn line(node: &Node<'_, '_>) -> Option<usize> {
    Some(node.document().text_pos_at(node.range().start).row as usize)
}

/// An attribute without the blanks that some writers pad it with.
fn attribute<'n>(node: &Node<'n, '_>, name: &str) -> Option<&'n str> {
    node.attribute(name).map(str::trim)
}

/// An attribute that is a whole number; where it is absent, what that means.
fn whole(node: &Node<'_, '_>, name: &str, absent: Option<usize>) -> Result<usize, Faults> {
    let element = node.tag_name().name();
    let expected = || format!("expected a whole number as {name} of the {element}");
    let Some(text) = attribute(node, name) else {
        return absent.ok_or_else(|| Faults::one(line(node), format!("{}, found none", expected())));
    };
    text.parse().map_err(|_| Faults::one(line(node), format!("{}, found {}", expected(), quoted(text))))
}

/// An attribute that is one of some words; the first where it is absent or empty.
fn word(node: &Node<'_, '_>, name: &str, words: &[&'static str]) -> Result<&'static str, Faults> {
    let text = attribute(node, name).unwrap_or_default();
    let found = if text.is_empty() { words.first() } else { words.iter().find(|word| word.eq_ignore_ascii_case(text)) };
    found.copied().ok_or_else(|| {
        let (element, known) = (node.tag_name().name(), words.join(" or "));
        Faults::one(line(node), format!("expected {known} as {name} of the {element}, found {}", quoted(text)))
    })
}
