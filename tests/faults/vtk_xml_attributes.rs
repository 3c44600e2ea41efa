//! Attributes and contents of XML VTK that were replaced by defaults without a word: an offset padded by a blank, as Fortran writes
//! it, was read as 0, and radii came from another array. Right is what VTK's own reader makes of them, or a refusal.

use super::particle_files::{five, read, refused};

fn le(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn be(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

/// A file with appended raw data: an array that is not asked for, the radii, and the points.
fn appended(offset: &str) -> Vec<u8> {
    let (positions, radii) = five();
    let other: Vec<f64> = radii.iter().map(|radius| 3.0 * radius).collect();
    let mut file = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         <PolyData><Piece NumberOfPoints=\"5\" NumberOfVerts=\"0\"><PointData>\n\
         <DataArray type=\"Float64\" Name=\"other\" format=\"appended\" offset=\"0\"/>\n\
         <DataArray type=\"Float64\" Name=\"radius\" format=\"appended\" offset=\"{offset}\"/>\n\
         </PointData><Points><DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\" \
         offset=\"88\"/></Points></Piece></PolyData>\n<AppendedData encoding=\"raw\">\n_"
    )
    .into_bytes();
    for values in [&other, &radii, &positions.concat()] {
        file.extend((8 * values.len() as u32).to_le_bytes());
        file.extend(le(values));
    }
    file.extend(b"\n</AppendedData>\n</VTKFile>\n");
    file
}

fn words(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

/// A file in text; `radii` is the array's element.
fn text(root: &str, piece: &str, radii: &str) -> String {
    let points = words(&five().0.concat());
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile {root}>\n<PolyData><Piece {piece}>\n<PointData>{radii}</PointData>\n\
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{points}</DataArray></Points>\n\
         </Piece></PolyData></VTKFile>\n"
    )
}

const ROOT: &str = "type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"";
const PIECE: &str = "NumberOfPoints=\"5\"";

fn radii(attributes: &str, contents: &str) -> String {
    format!("<DataArray type=\"Float64\" Name=\"radius\" {attributes}>{contents}</DataArray>")
}

#[test]
fn blanks_around_numbers_do_not_change_them() {
    for offset in ["44", " 44", "44 ", "\t44\n"] {
        assert_eq!(read("a.vtp", &appended(offset)), Ok(five()), "{offset:?}");
    }
    let plain = radii("format=\"ascii\"", &words(&five().1));
    for (root, piece, array) in [
        (ROOT, "NumberOfPoints=\" 5 \" NumberOfVerts=\"0\"", plain.clone()),
        (
            ROOT,
            PIECE,
            radii("NumberOfComponents=\" 1\" format=\" ascii \" RangeMin=\"x\" RangeMax=\"\"", &words(&five().1)),
        ),
        ("type=\" PolyData \" byte_order=\"BigEndian\" header_type=\" UInt64\" compressor=\"\"", PIECE, plain),
    ] {
        assert_eq!(read("a.vtp", text(root, piece, &array).as_bytes()), Ok(five()), "{root} {piece} {array}");
    }
}

#[test]
fn numbers_that_cannot_be_read_are_refused_by_their_attribute() {
    for offset in ["", "44x", "-44", "4.4e1", "99999999999999999999999"] {
        let expected = "the array `radius`: expected a whole number as offset of the DataArray, found";
        refused("a.vtp", &appended(offset), &["a.vtp:5", expected]);
    }
    let absent = String::from_utf8_lossy(&appended("44")).replace(" offset=\"44\"", "").into_bytes();
    refused("a.vtp", &absent, &["expected a whole number as offset of the DataArray, found none"]);
    refused("a.vtp", &appended("45"), &["the array `radius`: expected 40 bytes of values"]);
    refused("a.vtp", &appended("100000"), &["its data begin behind the end"]);
    let plain = radii("", &words(&five().1));
    for (root, piece, array, expected) in [
        (
            ROOT,
            "NumberOfPoints=\"five\"",
            plain.as_str(),
            "whole number as NumberOfPoints of the Piece, found \"five\"",
        ),
        (ROOT, "", &plain, "whole number as NumberOfPoints of the Piece, found none"),
        (ROOT, "NumberOfPoints=\"0\"", &plain, "expected a Piece with points"),
        (ROOT, "NumberOfPoints=\"4611686018427387904\"", &plain, "cannot be read"),
        (ROOT, PIECE, &radii("NumberOfComponents=\"x\"", "1"), "whole number as NumberOfComponents"),
        (ROOT, PIECE, &radii("NumberOfComponents=\"0\"", ""), "cannot be read"),
        (ROOT, PIECE, &radii("", "1 2 3 4 5d-1"), "expected a number, found \"5d-1\""),
        (ROOT, PIECE, &radii("", "1 2 3 4"), "expected 5 points of 1 values, found 4 values"),
        (ROOT, PIECE, &radii("format=\"hexadecimal\"", "1"), "expected ascii or binary or appended as format"),
        (ROOT, PIECE, &plain.replace("Float64", "Flaot64"), "expected a DataArray with a type such as Float64"),
        (ROOT, PIECE, &plain.replace("Float64", "String"), "expected a DataArray with a type such as Float64"),
        (ROOT, PIECE, &(plain.clone() + &plain), "expected it once in a piece, found it twice"),
        (ROOT, PIECE, &(plain.clone() + &plain.replace("radius", "Radius")), "expected one column `radius`, found two"),
        (ROOT, PIECE, &plain.replace("Name", "name"), "expected a column `radius`"),
        ("type=\"PolyData\" byte_order=\"MiddleEndian\"", PIECE, &plain, "LittleEndian or BigEndian as byte_order"),
        ("type=\"PolyData\" header_type=\"UInt16\"", PIECE, &plain, "UInt32 or UInt64 as header_type"),
        (
            "type=\"PolyData\" compressor=\"vtkLZ4DataCompressor\"",
            PIECE,
            &plain,
            "packed by \"vtkLZ4DataCompressor\": save it with zlib",
        ),
        ("type=\"PolyData\" compressor=\"vtkLZMADataCompressor\"", PIECE, &plain, "save it with zlib or unpacked"),
        ("type=\"ImageData\"", PIECE, &plain, "PolyData or UnstructuredGrid, found \"ImageData\""),
    ] {
        refused("a.vtp", text(root, piece, array).as_bytes(), &["particles.start.path: a.vtp", expected]);
    }
    // A velocity of two components is not silently at rest.
    let flat = radii("", &words(&five().1))
        + &radii("NumberOfComponents=\"2\"", &words(&[0.5; 10])).replace("radius", "velocity");
    refused(
        "a.vtp",
        text(ROOT, PIECE, &flat).as_bytes(),
        &["`velocity` stands for vx, vy, vz: expected 3 components, found 2"],
    );
}

#[test]
fn what_stands_between_the_numbers_is_not_their_end() {
    let [first, rest] = [words(&five().1[..2]), words(&five().1[2..])];
    for contents in [
        format!("<!-- radii in m -->\n{first} {rest}"),
        format!("{first} <!-- half --> {rest} <?mark it?>"),
        format!("<![CDATA[{first} ]]>{rest}"),
        format!(
            "{first}\n{rest}\n<InformationKey name=\"L2_NORM_RANGE\" location=\"vtkDataArray\"><Value>7</Value></InformationKey>"
        ),
        format!("&#32;{first}&#10;{rest}"),
    ] {
        let file = text(ROOT, PIECE, &radii("format=\"ascii\"", &contents));
        assert_eq!(read("a.vtp", file.as_bytes()), Ok(five()), "{contents}");
        // A byte order mark, and words that look like appended data.
        let file =
            format!("\u{feff}{}", file.replace("\n<PolyData>", "<!-- <AppendedData encoding=\"raw\">_ --><PolyData>"));
        assert_eq!(read("a.vtp", file.as_bytes()), Ok(five()), "{contents}");
    }
}

#[test]
fn every_coding_is_read_and_a_damaged_one_refused() {
    use base64::{Engine as _, engine::general_purpose::STANDARD};
    let (positions, sizes) = five();
    let points = positions.concat();
    for (wide, big) in [(false, false), (true, false), (false, true), (true, true)] {
        let header = |length: usize| match (wide, big) {
            (false, false) => (length as u32).to_le_bytes().to_vec(),
            (false, true) => (length as u32).to_be_bytes().to_vec(),
            (true, false) => (length as u64).to_le_bytes().to_vec(),
            (true, true) => (length as u64).to_be_bytes().to_vec(),
        };
        let bytes = |values: &[f64]| if big { be(values) } else { le(values) };
        // The header in one piece with the data, as meshio writes it, or padded by itself, as VTK does.
        let whole = |values: &[f64]| STANDARD.encode([header(8 * values.len()), bytes(values)].concat());
        let apart = |values: &[f64]| STANDARD.encode(header(8 * values.len())) + &STANDARD.encode(bytes(values));
        let root = format!(
            "type=\"PolyData\" byte_order=\"{}\" header_type=\"{}\"",
            if big { "BigEndian" } else { "LittleEndian" },
            if wide { "UInt64" } else { "UInt32" }
        );
        let inline = |coded: &dyn Fn(&[f64]) -> String| {
            let array = |name: &str, components: u8, coded: String| {
                format!(
                    "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">\n  {coded}\n</DataArray>"
                )
            };
            format!(
                "<VTKFile {root}><PolyData><Piece NumberOfPoints=\"5\"><Points>{}</Points><PointData>{}</PointData></Piece></PolyData></VTKFile>",
                array("Points", 3, coded(&points)),
                array("radius", 1, coded(&sizes)),
            )
        };
        let file = inline(&whole);
        assert_eq!(read("a.vtp", file.as_bytes()), Ok(five()), "{root}");
        assert_eq!(read("a.vtp", inline(&apart).as_bytes()), Ok(five()), "{root}");
        // As appended base64: offsets count its letters.
        let appended = |offset: usize| {
            format!(
                "<VTKFile {root}><PolyData><Piece NumberOfPoints=\"5\"><Points><DataArray type=\"Float64\" \
                 NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points><PointData><DataArray type=\"Float64\" \
                 Name=\"radius\" format=\"appended\" offset=\"{offset}\"/></PointData></Piece></PolyData>\
                 <AppendedData encoding=\"base64\">\n   _{}{}\n  </AppendedData></VTKFile>",
                whole(&points),
                whole(&sizes),
            )
        };
        let offset = whole(&points).len();
        assert_eq!(read("a.vtp", appended(offset).as_bytes()), Ok(five()), "{root}");
        refused("a.vtp", appended(offset + 1).as_bytes(), &["the array `radius`: "]);
        refused(
            "a.vtp",
            appended(offset).replace("\"base64\"", "\"base85\"").as_bytes(),
            &["base64 or raw as encoding"],
        );
        refused("a.vtp", appended(offset).replace("   _", "   ").as_bytes(), &["begin with `_`"]);
        // Another byte order or header makes other lengths of it.
        let other =
            if big { file.replace("BigEndian", "LittleEndian") } else { file.replace("LittleEndian", "BigEndian") };
        refused("a.vtp", other.as_bytes(), &["bytes of values, found a header that says"]);
        refused("a.vtp", file.replace("Float64", "Float32").as_bytes(), &["expected 60 bytes of values"]);
        let coded = whole(&points);
        refused(
            "a.vtp",
            file.replace(&coded, &coded[..coded.len() - 8]).as_bytes(),
            &["its data are shorter than they say"],
        );
        refused("a.vtp", file.replace(&coded, &coded.replacen('A', "*", 1)).as_bytes(), &["its base64 is damaged"]);
    }
}

#[test]
fn pieces_are_put_together_and_must_agree() {
    let (positions, sizes) = five();
    let piece = |rows: std::ops::Range<usize>, extra: &str| {
        format!(
            "<Piece NumberOfPoints=\"{}\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\">{}</DataArray></Points>\
             <PointData>{}{extra}</PointData></Piece>",
            rows.len(),
            words(&positions[rows.clone()].concat()),
            radii("", &words(&sizes[rows])),
        )
    };
    let file = |pieces: &[String]| format!("<VTKFile {ROOT}><PolyData>{}</PolyData></VTKFile>", pieces.concat());
    let empty = "<Piece NumberOfPoints=\"0\"/>".to_owned();
    let whole = file(&[empty, piece(0..2, ""), piece(2..5, "")]);
    assert_eq!(read("a.vtp", whole.as_bytes()), Ok(five()));
    let extra = |rows: usize, components: usize| {
        radii(&format!("NumberOfComponents=\"{components}\""), &"0 ".repeat(rows * components))
            .replace("radius", "heat")
    };
    for (pieces, expected) in [
        ([piece(0..2, &extra(2, 1)), piece(2..5, "")], "the array `heat` is not in every piece"),
        ([piece(0..2, ""), piece(2..5, &extra(3, 1))], "not in every piece"),
        ([piece(0..2, &extra(2, 1)), piece(2..5, &extra(3, 2))], "has 1 and 2 components"),
    ] {
        refused("a.vtp", file(&pieces).as_bytes(), &[expected]);
    }
}
