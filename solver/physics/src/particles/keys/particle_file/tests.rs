//! Files of particles in every format, whole and broken.

// Values are read here, not computed: they are equal to the last bit.
#![allow(clippy::float_cmp)]

use proptest::prelude::*;

use super::*;

/// Two particles; the material of the second is called 1.
fn given(path: &str, contents: &[u8]) -> Result<Start, String> {
    let mut find = |word: &str| match word {
        "steel" | "0" => Ok(0),
        "1" => Ok(1),
        _ => Err((format!("no material {word}"), None)),
    };
    let read = read(path, contents).and_then(|columns| columns.given(1e-3, [0.0, 0.0, -1.0], &mut find));
    read.map_err(|faults| {
        let mut told = Vec::new();
        faults
            .tell(path, |message, hint| told.push(message + &hint.map_or(String::new(), |hint| format!(" ({hint})"))));
        told.join("\n")
    })
}

fn two(velocities_m_s: [[f64; 3]; 2], materials: [u16; 2]) -> Start {
    Start::Given {
        positions_m: vec![[0.0, 0.5e-3, 1e-3], [2.5e-3, -3e-3, 4e-3]],
        velocities_m_s: velocities_m_s.into(),
        radii_m: vec![0.25e-3, 0.125e-3],
        materials: materials.into(),
        spins_rad_s: Vec::new(),
    }
}

const AT_REST: [[f64; 3]; 2] = [[0.0, 0.0, -1.0]; 2];
const MOVING: [[f64; 3]; 2] = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];

#[test]
fn the_same_particles_are_read_from_every_text_format() {
    let csv = "\u{feff}# a bed\nX;y;z;id;radius;note\n0;0.5;1;7;0.25;first\n\n2.5;-3;4;8;0.125;second\n";
    assert_eq!(given("a.CSV", csv.as_bytes()), Ok(two(AT_REST, [0, 0])));
    let csv = "vx,vy,vz,material,x,y,z,radius\n1,2,3,steel,0,0.5,1,0.25\n4,5,6,1,2.5,-3,4,0.125\n";
    assert_eq!(given("a.csv", csv.as_bytes()), Ok(two(MOVING, [0, 1])));
    let xyz = "2\nLattice=\"1 0 0 0 1 0 0 0 1\" Properties=species:S:1:pos:R:3:velo:R:3:Radius:R:1:material:I:1 \
               Time=0\nFe 0 0.5 1 1 2 3 0.25 0\nFe 2.5 -3 4 4 5 6 0.125 1\n2\nnext frame\n";
    assert_eq!(given("a.extxyz", xyz.as_bytes()), Ok(two(MOVING, [0, 1])));
    let vtk = "# vtk DataFile Version 3.0\nTwo\nASCII\nDATASET POLYDATA\nPOINTS 2 double\n0 0.5 1\n2.5 -3 4\n\
               VERTICES 2 4\n1 0\n1 1\nPOINT_DATA 2\nSCALARS radius double\nLOOKUP_TABLE default\n0.25 0.125\n\
               SCALARS material int 1\nLOOKUP_TABLE default\n0 1\nVECTORS velocity float\n1 2 3 4 5 6\n\
               CELL_DATA 2\nSCALARS radius int\nLOOKUP_TABLE default\n9 9\n";
    assert_eq!(given("a.vtk", vtk.as_bytes()), Ok(two(MOVING, [0, 1])));
    let vtp = "<?xml version=\"1.0\"?><VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"2\"><Points>\
               <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0.5 1 2.5 -3 4</DataArray></Points>\
               <PointData><DataArray type=\"Float32\" Name=\"radius\">0.25 0.125</DataArray></PointData></Piece>\
               </PolyData></VTKFile>";
    assert_eq!(given("a.vtp", vtp.as_bytes()), Ok(two(AT_REST, [0, 0])));
}

/// What the VTK library itself wrote (9.7, `make_fixtures.py` beside the files).
#[test]
fn files_of_the_vtk_library_are_read_in_every_coding() {
    let files: [(&str, &[u8]); 7] = [
        ("ascii.vtk", include_bytes!("fixtures/ascii.vtk")),
        ("binary.vtk", include_bytes!("fixtures/binary.vtk")),
        ("ascii.vtp", include_bytes!("fixtures/ascii.vtp")),
        ("base64.vtp", include_bytes!("fixtures/base64.vtp")),
        ("base64-zlib.vtp", include_bytes!("fixtures/base64-zlib.vtp")),
        ("raw-zlib.vtp", include_bytes!("fixtures/raw-zlib.vtp")),
        ("raw-big-endian.vtu", include_bytes!("fixtures/raw-big-endian.vtu")),
    ];
    for (name, contents) in files {
        assert_eq!(given(name, contents), Ok(two(MOVING, [0, 1])), "{name}");
    }
}

#[test]
fn mistakes_name_their_line_and_what_was_expected() {
    let message = |path: &str, text: &str| given(path, text.as_bytes()).unwrap_err();
    assert!(message("a.stl", "").contains("expected a name that ends with .csv"));
    assert!(message("a.csv", "").contains("expected a line of names"));
    assert!(message("a.xyz", "").contains("expected the number of particles"));
    assert!(message("a.vtk", "").contains("expected `# vtk DataFile Version`"));
    assert_eq!(message("a.xyz", "many\n"), "a.xyz:1: expected the number of particles, found \"many\"");
    assert!(message("a.xyz", "1\nProperties=pos:R\n").contains("a.xyz:2: expected name:type:columns"));
    assert!(message("a.xyz", "3\nProperties=pos:R:3:radius:R:1\n0 0 0 1\n").contains("expected 3 particles, found 1"));
    let near = message("a.csv", "x,y,z,radius,materal\n0,0,0,1,2\n");
    assert!(near.contains("did you mean `material` where the file has `materal`?"), "{near}");
    let many = (0..9).map(|_| "0,0,0,0\n").collect::<String>();
    let many = message("a.csv", &("x,y,z,radius\n".to_owned() + &many));
    assert!(many.lines().count() == 5 && many.ends_with("(and 4 more mistakes)"), "{many}");
    let vtk = "# vtk DataFile Version 3.0\nTwo\nASCII\nDATASET STRUCTURED_POINTS\n";
    assert!(message("a.vtk", vtk).contains("a.vtk:4: expected POLYDATA or UNSTRUCTURED_GRID"));
    assert!(message("a.vtp", "<VTKFile").contains("a.vtp:1: not valid XML"));
    let long = include_str!("fixtures/base64.vtp").replace("NumberOfPoints=\"2\"", "NumberOfPoints=\"3\"");
    assert!(message("a.vtp", &long).contains("expected 3 points of"), "{}", message("a.vtp", &long));
}

proptest! {
    #[test]
    fn no_contents_make_it_panic(
        which in 0usize..7, at in 0usize..4000, byte in any::<u8>(), cut in 0usize..4000, text in ".{0,60}"
    ) {
        let files: [(&str, &[u8]); 7] = [
            ("a.vtk", include_bytes!("fixtures/ascii.vtk")),
            ("a.vtk", include_bytes!("fixtures/binary.vtk")),
            ("a.vtp", include_bytes!("fixtures/base64-zlib.vtp")),
            ("a.vtp", include_bytes!("fixtures/raw-zlib.vtp")),
            ("a.vtu", include_bytes!("fixtures/raw-big-endian.vtu")),
            ("a.xyz", b"2\nProperties=pos:R:3:radius:R:1\n0 0 0 1\n0 0 0 1\n"),
            ("a.csv", b"x,y,z,radius\n0,0,0,1\n"),
        ];
        let (name, contents) = files[which];
        let mut changed = contents.to_vec();
        let length = changed.len();
        changed[at % length] = byte;
        let _ = given(name, &changed);
        changed.truncate(cut % length);
        let _ = given(name, &changed);
        let _ = given(name, text.as_bytes());
    }

    /// Counts that no memory holds, and words where others stood.
    #[test]
    fn no_numbers_or_words_make_it_panic(
        which in 0usize..6,
        at in 0usize..400,
        word in prop_oneof![
            Just("18446744073709551615"), Just("4611686018427387904"), Just("1073741824"), Just("-1"), Just("nan"), Just(""),
            Just("\""), Just("METADATA"), Just("FIELD f 9"), Just("string"), Just("<!--"), Just("_"), Just("=="), Just("UInt64"),
        ],
    ) {
        let files: [(&str, &[u8]); 6] = [
            ("a.vtk", include_bytes!("fixtures/ascii.vtk")),
            ("a.vtk", include_bytes!("fixtures/binary.vtk")),
            ("a.vtp", include_bytes!("fixtures/base64-zlib.vtp")),
            ("a.vtu", include_bytes!("fixtures/raw-big-endian.vtu")),
            ("a.xyz", b"2\nLattice=\"1 0 0\" Properties=pos:R:3:radius:R:1\n0 0 0 1\n0 0 0 1\n"),
            ("a.csv", b"x,y,z,radius,\"note\"\n0,0,0,1,\"a, b\"\n"),
        ];
        let (name, contents) = files[which];
        // The n-th run of bytes between blanks, quotes and brackets.
        let ends = |byte: &u8| byte.is_ascii_whitespace() || b"\"<>,:=".contains(byte);
        let starts: Vec<usize> = (1..contents.len()).filter(|at| ends(&contents[at - 1]) && !ends(&contents[*at])).collect();
        let start = starts[at % starts.len()];
        let end = contents[start..].iter().position(ends).map_or(contents.len(), |length| start + length);
        let changed = [&contents[..start], word.as_bytes(), &contents[end..]].concat();
        let _ = given(name, &changed);
    }
}
