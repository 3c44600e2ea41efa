//! Sizes and words: what grew with the square of the walls, files without an end, and values that made errors of a megabyte.

use std::{
    fmt::Write as _,
    time::{Duration, Instant},
};

use super::{
    particle_files::scene,
    program::{folder, stagger, stderr},
};

const MEBIBYTE: usize = 1 << 20;

fn small(more: &str) -> String {
    format!(
        "duration = \"2 us\"\n{more}\n[particles]\ncount = 2\nradius = \"25 um\"\nstart = {{ box = [\"1 mm\", \"1 mm\", \"1 mm\"] }}\n\
         [coupling]\ndt = \"1 us\"\n"
    )
}

/// Ten thousand walls took more than 20 s and 5.3 GB: a law for each pair of them, though walls do not meet.
#[test]
fn ten_thousand_walls_are_no_square() {
    let mut text = small("");
    for wall in 0..10_000 {
        write!(text, "[walls.w{wall}]\nplane = {{ through = [0, 0, \"-{wall} um\"], normal = [0, 0, 1] }}\n").unwrap();
    }
    let folder = folder(&[("scene.toml", &text)]);
    // Of addresses, most of which are the threads' and never used: a law for each pair took 8 GB.
    let command = "ulimit -v 3000000; exec \"$0\" check scene.toml --json";
    let begun = Instant::now();
    let output = std::process::Command::new("sh")
        .args(["-c", command, env!("CARGO_BIN_EXE_stagger")])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    // A machine that is busy with other tests needs some of these.
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
}

#[test]
fn long_values_are_cut_in_messages() {
    let long = "a".repeat(MEBIBYTE);
    let digits = "1".repeat(MEBIBYTE);
    for text in [
        small(&format!("title = {long}")),
        small(&format!("seed = \"{long}\"")),
        small(&format!("{long} = 1")),
        small(&format!("preset = \"{long}\"")),
        small("").replace("25 um", &long),
        small("").replace("25 um", &format!("25 {long}")),
        small("").replace("25 um", &format!("25 {digits} um")),
        small("").replace("\"25 um\"", &format!("0.{digits}e9")),
        small("").replace("\"25 um\"", &digits),
        small("").replace("1 us", &format!("1 (m {long}")),
        small("") + &format!("[walls.{long}]\n"),
        small("") + &format!("[walls.w]\nmesh = {{ file = \"{long}\", unit = 1 }}\n"),
        small("") + &format!("[walls.w]\nmaterial = \"{long}\"\nplane = {{ normal = [0, 0, 1] }}\n"),
    ] {
        let folder = folder(&[("scene.toml", &text)]);
        let output = stagger(folder.path(), &["check", "scene.toml"]);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{}", &message[..message.len().min(2000)]);
        assert!(message.len() < 10_000, "{} bytes: {}", message.len(), &message[..2000]);
    }
    for (name, contents) in [
        ("p.csv", format!("x,y,z,radius\n0,0,0,{long}\n")),
        ("p.csv", format!("{long},x\n")),
        ("p.csv", format!("x,y,z,radius,material\n0,0,0,1,{long}\n")),
        ("p.csv", format!("{}x\n", "column,".repeat(100_000))),
        ("p.xyz", format!("{long}\n\n")),
        ("p.xyz", format!("1\nProperties={long}\n")),
        ("p.xyz", format!("1\nProperties=pos:R:3:radius:R:1\n0 0 0 {long}\n")),
        ("p.vtk", format!("# vtk DataFile Version 3.0\n\n{long}\n")),
        ("p.vtk", format!("# vtk DataFile Version 3.0\n\nASCII\n{long}\n")),
        ("p.vtp", format!("<VTKFile type=\"{long}\"/>")),
        ("p.vtp", format!("<VTKFile type=\"PolyData\" compressor=\"{long}\"/>")),
        ("p.vtp", format!("<{long}>")),
    ] {
        let folder = folder(&[("scene.toml", &scene(name)), (name, &contents)]);
        let output = stagger(folder.path(), &["check", "scene.toml"]);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{}", &message[..message.len().min(2000)]);
        assert!(message.len() < 10_000, "{} bytes: {}", message.len(), &message[..2000]);
    }
    let value = format!("particles.radius={}", &long[..100_000]);
    let folder = folder(&[("scene.toml", &small(""))]);
    let message = stderr(&stagger(folder.path(), &["check", "scene.toml", "--set", &value]));
    assert!(message.contains("(100000 characters)") && message.len() < 1000, "{message}");
}

#[test]
fn a_key_of_ten_megabytes_is_unknown_within_seconds() {
    let folder = folder(&[("scene.toml", &small(&format!("{} = 1", "k".repeat(10 * MEBIBYTE))))]);
    let begun = Instant::now();
    let message = stderr(&stagger(folder.path(), &["check", "scene.toml"]));
    assert!(
        message.contains("scene.toml:2: kkk") && message.contains("unknown key"),
        "{}",
        &message[..message.len().min(2000)]
    );
    assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
}

#[test]
fn files_without_an_end_are_refused() {
    let folder = folder(&[("scene.toml", &scene("bed.csv"))]);
    // Nothing of it is on the disk.
    let sparse = std::fs::File::create(folder.path().join("bed.csv")).unwrap();
    sparse.set_len(3 << 30).unwrap();
    let message = stderr(&stagger(folder.path(), &["check", "scene.toml"]));
    assert!(message.contains("cannot read \"bed.csv\"") && message.contains("1024 MiB"), "{message}");
}
