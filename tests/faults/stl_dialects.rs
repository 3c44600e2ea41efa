//! STL files that other readers take were refused, with messages that mislead. Each is the same square under a sphere at rest.

use super::program::{folder, stagger, stderr, stdout};

const SCENE: &str = "duration = \"2 ms\"\n[particles]\nstart = { kind = \"file\", path = \"p.csv\" }\n\
                     contact = { law = \"linear\", spring = \"1000 N/m\", restitution = 0.5 }\n\
                     [walls.m]\nmesh = { file = \"m.stl\", unit = \"1 mm\" }\n[coupling]\ndt = \"10 us\"\n";
const PARTICLE: &str = "x,y,z,radius\n0.3e-3,0.1e-3,0.0505e-3,0.05e-3\n";

/// The corners of the square's two triangles, in mm.
const CORNERS: [[[f32; 3]; 3]; 2] =
    [[[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.]], [[-1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]]];

fn text() -> String {
    let facet = |corners: &[[f32; 3]; 3]| {
        let vertices: String = corners.iter().map(|[x, y, z]| format!("   vertex {x} {y} {z}\n")).collect();
        format!(" facet normal 0 0 1\n  outer loop\n{vertices}  endloop\n endfacet\n")
    };
    format!("solid p\n{}endsolid p\n", CORNERS.iter().map(facet).collect::<String>())
}

fn binary(header: &[u8], count: u32) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(count.to_le_bytes());
    for triangle in CORNERS {
        let numbers = [[f32::NAN; 3]].into_iter().chain(triangle);
        bytes.extend(numbers.flatten().flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

fn run(stl: &[u8]) -> Result<String, String> {
    let folder = folder(&[("scene.toml", SCENE), ("p.csv", PARTICLE)]);
    std::fs::write(folder.path().join("m.stl"), stl).unwrap();
    let output = stagger(folder.path(), &["run", "scene.toml", "--in-process", "--no-record", "--json"]);
    match output.status.code() {
        Some(0) => {
            let summary: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
            Ok(super::program::field(&summary, "positions").to_string())
        }
        Some(2) => Err(stderr(&output)),
        other => panic!("exit {other:?}: {}", stderr(&output)),
    }
}

#[test]
fn every_dialect_is_the_same_square() {
    let plain = run(text().as_bytes()).unwrap();
    let mut named = text().into_bytes();
    named[6] = 0xe9;
    for (what, stl) in [
        ("upper case", text().to_uppercase().into_bytes()),
        ("mixed case", text().replace("facet normal", "Facet Normal").into_bytes()),
        ("end solid", text().replace("end", "end ").into_bytes()),
        ("another encoding", named),
        ("normals", text().replace("normal 0 0 1", "normal -nan(ind) -nan(ind) -nan(ind)").into_bytes()),
        ("old Mac", text().replace('\n', "\r").into_bytes()),
        ("Windows", text().replace('\n', "\r\n").into_bytes()),
        ("byte order mark", format!("\u{feff}{}", text()).into_bytes()),
        ("two solids", text().replacen(" endfacet\n", " endfacet\nendsolid p\nsolid q r\n", 1).into_bytes()),
        ("no name", text().replace("solid p", "solid").into_bytes()),
        ("binary", binary(b"", 2)),
        ("binary that begins with solid", binary(b"solid p\nfacet normal", 2)),
        ("bytes behind the last triangle", [binary(b"", 2), vec![0; 10]].concat()),
        ("solid and bytes behind", [binary(b"solid x", 2), vec![b'\n'; 3]].concat()),
        ("filled to a block", [binary(b"solid x", 2), vec![0; 328]].concat()),
    ] {
        assert_eq!(run(&stl).as_ref(), Ok(&plain), "{what}");
    }
}

#[test]
fn what_is_damaged_is_refused_by_what_is_wrong() {
    for (stl, expected) in [
        (
            text().replace("vertex 1 1 0", "vertex 1 1.0D+00 0"),
            "line 6 of ASCII STL: expected a number such as 1.5e-3, found `1.0D+00`",
        ),
        (text().replace("vertex 1 1 0", "vertex 1 1,0 0"), "line 6 of ASCII STL: expected a number"),
        (text().replace("vertex 1 1 0", "vertex 1 nan 0"), "triangle 1 has a corner that is not finite"),
        (text().replace("endsolid p\n", ""), "expected `facet` or `endsolid`, found the end of the file"),
        (text().replace('\n', " "), "expected `facet` or `endsolid`, found the end of the file"),
        (
            text().replace("normal 0 0 1", "normal 0 0"),
            "line 3 of ASCII STL: expected a normal of three numbers, found `outer`",
        ),
        ("o cube\nv 0 0 0\n".into(), "not an STL file"),
    ] {
        let message = run(stl.as_bytes()).unwrap_err();
        assert!(
            message.contains("walls.m.mesh.file: \"m.stl\"") && message.contains(expected),
            "{expected}: {message}"
        );
    }
    let whole = binary(b"", 2);
    for (stl, expected) in [
        (&whole[..whole.len() - 1], "binary STL of 2 triangles has 184 bytes, not 183"),
        (&[&whole[..], &[7; 50]].concat(), "count says 2 triangles, with 50 bytes behind them"),
        (&binary(b"solid", 1), "count says 1 triangles, with 50 bytes behind them"),
    ] {
        let message = run(stl).unwrap_err();
        assert!(message.contains(expected), "{expected}: {message}");
    }
}
