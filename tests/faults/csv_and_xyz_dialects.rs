//! Dialects of CSV (RFC 4180) and extended XYZ that were misread or refused.

use super::particle_files::{five, read, refused};

/// Lines of the five: names, and rows of what `row` makes of position and radius.
fn table(head: &str, end: &str, row: impl Fn([f64; 3], f64) -> String) -> String {
    let (positions, radii) = five();
    let rows = positions.iter().zip(&radii).map(|(position, radius)| row(*position, *radius) + end);
    head.to_owned() + end + &rows.collect::<String>()
}

fn plain(end: &str) -> String {
    table("x,y,z,radius", end, |[x, y, z], radius| format!("{x},{y},{z},{radius}"))
}

fn xyz(comment: &str) -> String {
    format!("5\n{}", table(comment, "\n", |[x, y, z], radius| format!("{radius} {x} {y} {z}")))
}

#[test]
fn csv_is_read_as_its_writers_mean_it() {
    let named =
        |name: &str| table("name,x,y,z,radius", "\n", |[x, y, z], radius| format!("{name},{x},{y},{z},{radius}"));
    for file in [
        plain("\n"),
        plain("\r\n"),
        // The line ends of old Macs.
        plain("\r"),
        plain("\n").trim_end().to_owned(),
        format!("\u{feff}{}", plain("\r\n")),
        plain("\n\n").replacen('\n', "\n  # pause\n\t#\n   \n", 3),
        plain("\n").replace(',', ";"),
        plain("\n").replace(',', "\t"),
        plain("\n").replace(',', " , "),
        named("\"powder, fine\""),
        named("  \"powder, fine\" "),
        named("\"a \"\"fine\"\" powder\""),
        named("\"two\r\nlines, # and no comment\n\n\""),
        named("a\"b"),
        table("\"x\",\"y\",\"z\",\"radius\"", "\n", |[x, y, z], radius| {
            format!("\"{x}\",\"{y}\",\"{z}\",\"{radius}\"")
        }),
        // pandas writes a number of the row under no name; spreadsheets end lines with separators.
        table(",x,y,z,radius", "\n", |[x, y, z], radius| format!("7,{x},{y},{z},{radius}")),
        table("x,y,z,radius,", "\n", |[x, y, z], radius| format!("{x},{y},{z},{radius},")),
        table("X,Y,Z,Radii", "\n", |[x, y, z], radius| format!("{x:e},+{y},0{z},{radius:E}")),
        table("\"x;1\",x,y,z,radius", "\n", |[x, y, z], radius| format!("a,{x},{y},{z},{radius}")),
    ] {
        assert_eq!(read("a.csv", file.as_bytes()), Ok(five()), "{file}");
    }
}

#[test]
fn csv_that_can_be_taken_in_two_ways_is_refused() {
    let twice = |names: &str| table(names, "\n", |[x, y, z], radius| format!("{x},{y},{z},{radius},{radius}"));
    for (file, parts) in [
        (twice("x,y,z,radius,Radius"), ["a.csv:1: ", "expected one column `radius`, found two"].as_slice()),
        (twice("x,y,z,radius,radii"), &["expected one column `radius`, found two"]),
        (twice("x,y,z,radius,X"), &["expected one column `x`, found two"]),
        (plain("\n").replace("0.0002", "nan"), &["a.csv:3: ", "expected a positive radius, found NaN"]),
        (plain("\n").replace("0.005", "inf"), &["a.csv:3: expected finite numbers"]),
        (plain("\n").replace("0.0002", ""), &["a.csv:3: expected a number as `radius`, found \"\""]),
        (plain("\n").replace("0.0002", "2 e-4"), &["a.csv:3: expected a number as `radius`, found \"2 e-4\""]),
        (
            plain("\n").replace(',', ";").replace('.', ","),
            &["a.csv:2: expected a number as `x`", "write a point, not a comma: 0.001"],
        ),
        (plain("\n").replace('.', ","), &["a.csv:2: expected 4 values, found 8", "write a point, not a comma"]),
        (
            plain("\n").replace("0.0002", "2.0D-04"),
            &["a.csv:3: expected a number as `radius`", "write the exponent with e"],
        ),
        (
            plain("\n").replace("0.0002\n", "0.0002,\n"),
            &["a.csv:3: expected 4 values, found 5", "ends with a separator"],
        ),
        (plain("\n").replace("0.0002\n", "0.0002,7\n"), &["a.csv:3: expected 4 values, found 5"]),
        (plain("\n").replace(",0.0002\n", "\n"), &["a.csv:3: expected 4 values, found 3"]),
        (plain("\n").replace("0.0002\n", "\"0.0002\n"), &["a.csv:3: expected a closing quote"]),
        (
            plain("\n").replace("0.0002\n", "\"0.0002\"7\n"),
            &["a.csv:3: expected ',' or the end of the line behind the closing quote, found \"7\""],
        ),
        (plain("\n").replace("0.0002\n", "0.0002 # note\n"), &["a.csv:3: expected a number as `radius`"]),
        (
            plain("\n").replacen("x,", "# x,", 1),
            &["a.csv:2: expected names such as x,y,z,radius, found numbers", "is a comment"],
        ),
        (plain("\n").replace(',', " "), &["expected a column `x`"]),
        (plain("\n").replace(",radius", ",radius (m)"), &["expected a column `radius`"]),
        ("\n# nothing\n".into(), &["expected a line of names"]),
        (String::new(), &["expected a line of names"]),
    ] {
        refused("a.csv", file.as_bytes(), parts);
    }
    let lines = plain("\n");
    refused("a.csv", &[lines.as_bytes(), b"\xe9,0,0,1\n"].concat(), &["a.csv:7: expected text in UTF-8"]);
    let utf16: Vec<u8> = "\u{feff}x,y".encode_utf16().flat_map(u16::to_le_bytes).collect();
    refused("a.csv", &utf16, &["found UTF-16"]);
}

#[test]
fn extended_xyz_is_read_by_its_specification() {
    const PLAIN: &str = "Properties=radius:R:1:pos:R:3";
    for file in [
        xyz(PLAIN),
        format!("\u{feff}{}", xyz(PLAIN)),
        xyz(PLAIN).replace('\n', "\r\n"),
        xyz(PLAIN).replace('\n', "\r"),
        xyz("Properties='radius:R:1:pos:R:3'"),
        xyz("properties = \"radius:R:1:pos:R:3\""),
        xyz("note=\"the file Properties=x:R:1 was\" Properties=radius:R:1:pos:R:3"),
        xyz(
            "Lattice=\"1 0 0 0 1 0 0 0 1\" Properties=radius:R:1:pos:R:3 pbc=\"F F F\" Time=0 virial={1 2 3} a=[[1, 2], [3, 4]] done",
        ),
        xyz("'it''s' Properties=radius:R:1:pos:R:3 note='a \\' Properties=x:R:1'"),
        xyz(PLAIN).replace("0.0002", "2.0D-04").replace("0.005", "0.5d-2"),
        xyz(PLAIN) + "\n  \n",
        // The first of several frames.
        xyz(PLAIN) + "2\nProperties=pos:R:3\n1 2 3\n4 5 6\n",
        xyz(PLAIN) + "1\n\n1 2 3\n" + &xyz(PLAIN),
        format!(
            "5\n{}",
            table("Properties=species:S:1:on:L:1:radius:R:1:pos:R:3", "\n", |[x, y, z], radius| format!(
                "Fe T {radius} {x} {y} {z}"
            ))
        ),
    ] {
        assert_eq!(read("a.xyz", file.as_bytes()), Ok(five()), "{file}");
    }
    for (file, parts) in [
        (xyz(PLAIN).replacen('5', "4", 1), ["a.xyz:7: expected another frame or the end"].as_slice()),
        (xyz(PLAIN).replacen('5', "6", 1), &["expected 6 particles, found 5"]),
        (xyz("pos:R:3"), &["a.xyz:2: expected Properties="]),
        (xyz("Properties=radius:R:1:pos:R:3 Properties=radius:R:1:pos:R:3"), &["a.xyz:2: expected Properties once"]),
        (xyz("Properties=\"radius:R:1:pos:R:3"), &["a.xyz:2: expected `\"` to end"]),
        (
            xyz("Properties=radius:R:1:pos:R:2:w:R:1"),
            &["a.xyz:2: `pos` stands for x, y, z: expected 3 components, found 2"],
        ),
        (xyz("Properties=radius:R:1:pos:R"), &["a.xyz:2: expected name:type:columns"]),
        (xyz("Properties=radius:R:1:radii:R:1:w:R:2"), &["a.xyz:2: expected one column `radius`, found two"]),
        (xyz(PLAIN).replace("0.0002", "2,0e-4"), &["a.xyz:4: expected a number as `radius`, found \"2,0e-4\""]),
        (xyz(PLAIN).replace("0.0002", "2e-4 7"), &["a.xyz:4: expected 4 values, found 5"]),
    ] {
        refused("a.xyz", file.as_bytes(), parts);
    }
}

#[test]
fn a_scene_says_that_it_starts_from_the_first_frame() {
    let frame = xyz("Properties=radius:R:1:pos:R:3");
    let files = [("a.xyz", frame.repeat(3)), ("scene.toml", super::particle_files::scene("a.xyz"))];
    let folder = super::program::folder(&files.each_ref().map(|(name, text)| (*name, text.as_str())));
    let shown = super::program::stdout(&super::program::stagger(folder.path(), &["check", "scene.toml"]));
    assert!(shown.contains("a.xyz (the first of its 3 frames)"), "{shown}");
}
