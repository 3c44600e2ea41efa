//! Legacy VTK files that VTK writes and reads itself, and that were refused: metadata, cell data first, ids, tables of colours, texts.

use super::particle_files::{five, read, refused};

fn lines<T: ToString>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|value| value.to_string() + "\n").collect()
}

/// Head and points.
fn head() -> String {
    let points = lines(five().0.concat());
    format!("# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 5 float\n{points}")
}

fn radius() -> String {
    format!("SCALARS radius double 1\nLOOKUP_TABLE default\n{}", lines(five().1))
}

const METADATA: &str = "METADATA\nINFORMATION 2\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\
                        NAME L2_NORM_FINITE_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n";
const NAMES: &str = "METADATA \nCOMPONENT_NAMES\na%20b\n\nc\nINFORMATION 0\n\n";

#[test]
fn what_vtk_writes_beside_points_is_stepped_over() {
    let vectors = lines(vec![0.5; 15]);
    let ids = "0 1 2 3 4\n";
    for (between, data) in [
        (String::new(), String::new()),
        (METADATA.into(), METADATA.into()),
        (NAMES.into(), format!("VECTORS push double\n{vectors}{NAMES}")),
        (String::new(), format!("GLOBAL_IDS ids vtkIdType\n{ids}PEDIGREE_IDS who vtktypeint64\n{ids}")),
        (String::new(), "PEDIGREE_IDS who string\na%20b\n\nc\nd\nRADIUS\n".into()),
        (
            String::new(),
            format!(
                "NORMALS n float\n{vectors}TENSORS t double\n{vectors}{vectors}{vectors}TENSORS6 s float\n{vectors}{vectors}"
            ),
        ),
        (
            String::new(),
            format!("TEXTURE_COORDINATES t 2 float\n{ids}{ids}COLOR_SCALARS c 3\n{vectors}EDGE_FLAGS e int\n{ids}"),
        ),
        (
            String::new(),
            format!(
                "FIELD FieldData 3\nNULL_ARRAY\nheat 1 5 double\n{ids}{METADATA}flag 1 5 bit\n1 0 1 0 1\n{METADATA}"
            ),
        ),
        (
            String::new(),
            "FIELD FieldData 2\nwho 1 5 string\na\nb\n\nd\ne\nany 1 5 variant\n10 1\n13 x\n10 2\n10 3\n10 4\n".into(),
        ),
        (
            format!("FIELD FieldData 2\nTIME 1 1 double\n0.25\n{METADATA}who 1 1 string\nme%20and%20you\n"),
            String::new(),
        ),
        ("LINES 2 6\n2 0 1\n2 1 2\nVERTICES 2 4\n1 0\n1 1\nPOLYGONS 0 0\n".into(), String::new()),
        (
            format!("LINES 3 4\nOFFSETS vtktypeint64\n0 2 4\n{METADATA}CONNECTIVITY vtktypeint64\n0 1 1 2\n{METADATA}"),
            String::new(),
        ),
        ("VERTICES 0 0\nLINES 2 2\nOFFSETS int\n0 2\nCONNECTIVITY int\n0 1\n".into(), String::new()),
        // Cell data come before point data where VTK writes both.
        (
            format!(
                "LINES 2 6\n2 0 1\n2 1 2\nCELL_DATA 2\nSCALARS radius double 1\nLOOKUP_TABLE default\n1\n2\n{METADATA}FIELD FieldData 1\nradius 1 2 int\n1 2\n"
            ),
            String::new(),
        ),
    ] {
        for file in [
            head() + &between + "POINT_DATA 5\n" + &data + &radius(),
            head() + &between + "POINT_DATA 5\n" + &radius() + &data,
            head()
                + &between
                + "\n\nPOINT_DATA 5 \n\n"
                + &data
                + "FIELD FieldData 1\nradius 1 5 double\n"
                + &lines(five().1)
                + METADATA,
        ] {
            assert_eq!(read("a.vtk", file.as_bytes()), Ok(five()), "{file}");
        }
    }
}

#[test]
fn keywords_in_any_case_and_tables_of_colours() {
    let table = |name: &str| radius().replace("default", name) + &format!("LOOKUP_TABLE {name} 2\n0 0 0 1\n1 1 1 1\n");
    for file in [
        head() + "POINT_DATA 5\n" + &table("mine"),
        head() + "POINT_DATA 5\n" + &table("mine") + "VECTORS push float\n" + &lines([0; 15]),
        (head() + "POINT_DATA 5\n" + &radius()).to_lowercase(),
        (head() + "POINT_DATA 5\nSCALARS radius double\n" + &lines(five().1)).replacen("x\n", "\n", 1),
        (head() + "POINT_DATA 5\n" + &radius()).replace('\n', "\r\n"),
        (head() + "POINT_DATA 5\n" + &radius()).replace('\n', "\r"),
        "\u{feff}".to_owned() + &head() + "POINT_DATA 5\n" + &radius(),
        (head() + "POINT_DATA 5\n" + &radius())
            .replace("POLYDATA", "unstructured_grid")
            .replace("POINT_DATA", "CELLS 1 2\n1 0\nCELL_TYPES 1\n1\nPOINT_DATA"),
    ] {
        assert_eq!(read("a.vtk", file.as_bytes()), Ok(five()), "{file}");
    }
}

#[test]
fn binary_files_hold_texts_bits_and_colours_too() {
    let (positions, sizes) = five();
    let mut file = b"# vtk DataFile Version 5.1\nASCII\nBINARY\nDATASET POLYDATA\nPOINTS 5 float\n".to_vec();
    file.extend(positions.concat().iter().flat_map(|x| (*x as f32).to_be_bytes()));
    file.extend(b"\nMETADATA\nINFORMATION 0\n\nVERTICES 2 5\nOFFSETS vtktypeint64\n");
    file.extend([0i64, 5].iter().flat_map(|x| x.to_be_bytes()));
    file.extend(b"\nCONNECTIVITY vtktypeint64\n");
    file.extend([0i64, 1, 2, 3, 4].iter().flat_map(|x| x.to_be_bytes()));
    file.extend(b"\nPOINT_DATA 5\nCOLOR_SCALARS c 3\n");
    file.extend([b'\n'; 15]);
    file.extend(b"\nGLOBAL_IDS ids vtkIdType\n");
    file.extend([7i32; 5].iter().flat_map(|x| x.to_be_bytes()));
    file.extend(b"\nSCALARS radius double 1\nLOOKUP_TABLE mine\n");
    file.extend(sizes.iter().flat_map(|x| x.to_be_bytes()));
    file.extend(b"\nLOOKUP_TABLE mine 2\n");
    file.extend([255; 8]);
    file.extend(b"\nFIELD FieldData 2\nwho 1 5 string\n");
    let long = [b'\n'; 300];
    for text in [b"a".as_slice(), b"", b"\nb", &long, b"METADATA\n"] {
        match text.len() {
            short @ 0..64 => file.push(0xc0 | short as u8),
            long => file.extend((0x8000 | long as u16).to_be_bytes()),
        }
        file.extend(text);
    }
    file.extend(b"\nflag 1 5 bit\n");
    file.extend([0b0101_0000]);
    file.extend(b"\n");
    // The points are binary32, and JSON is not read to the last bit here.
    let single =
        |read: (Vec<[f64; 3]>, Vec<f64>)| (read.0.concat().iter().map(|x| *x as f32).collect::<Vec<_>>(), read.1);
    assert_eq!(read("a.vtk", &file).map(single), Ok(single(five())));
    // Wherever it ends, it is refused, or whole but for what is not asked for.
    for length in (0..file.len()).step_by(17) {
        match read("a.vtk", &file[..length]) {
            Ok(read) => assert_eq!(single(read), single(five()), "{length}"),
            Err(message) => assert!(message.contains("a.vtk"), "{message}"),
        }
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_its_line() {
    let data = head() + "POINT_DATA 5\n";
    for (file, expected) in [
        (
            data.clone() + &radius().replace("double 1", "double one"),
            "a.vtk:22: expected the number of components of `radius`, found \"one\"",
        ),
        (data.clone() + &radius().replace("double", "real"), "expected a type such as double, found \"real\""),
        (data.clone() + &radius().replace("0.0003", "3,0e-4"), "a.vtk:26: expected a number, found \"3,0e-4\""),
        (data.clone() + &radius().replace("0.0003\n", ""), "expected 5 numbers, found 4 and the end of the file"),
        (data.clone() + &radius() + "GARBAGE\n", "expected a section such as POINT_DATA, found \"GARBAGE\""),
        (data.clone() + &radius() + &radius().replace("radius", "Radius"), "expected one column `radius`, found two"),
        (
            data.clone() + "FIELD f 1\nmaterial 1 5 string\na\nb\nc\nd\ne\n" + &radius(),
            "the array `material`: expected numbers, found texts",
        ),
        (
            data.clone() + "FIELD f 1\nvelocity 3 4 double\n" + &lines([0; 12]) + &radius(),
            "the array `velocity`: expected 5 rows, found 4",
        ),
        (
            data.clone() + "FIELD f 1\nvelocity 2 5 double\n" + &lines([0; 10]) + &radius(),
            "expected 3 components, found 2",
        ),
        (head() + "POINT_DATA 4\n" + &radius(), "found 4 rows and 5 points"),
        (head() + &radius(), "expected POINT_DATA or CELL_DATA before SCALARS"),
        (data.replace("POINTS 5", "POINTS 4611686018427387904") + &radius(), "numbers, found"),
        (data.replace("POINTS 5", "POINTS -5") + &radius(), "a.vtk:5: expected a whole number, found \"-5\""),
        (data.replace("POLYDATA", "STRUCTURED_POINTS"), "a.vtk:4: expected POLYDATA or UNSTRUCTURED_GRID"),
    ] {
        refused("a.vtk", file.as_bytes(), &["particles.start.path: a.vtk:", expected]);
    }
}
