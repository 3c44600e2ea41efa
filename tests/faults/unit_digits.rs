//! A second number was taken for a unit: "1 15 us" was 1 us, "1 121 um" (a blank between thousands) 1 um, "2 151 K" 2 K.

use super::program::{folder, stagger, stderr};

fn check(duration: &str, radius: &str, temperature: &str) -> Result<(), String> {
    let scene = format!(
        "duration = \"{duration}\"\n[particles]\ncount = 2\nradius = \"{radius}\"\ntemperature = \"{temperature}\"\n\
         start = {{ box = [\"10 mm\", \"10 mm\", \"10 mm\"] }}\n[thermal]\n[coupling]\ndt = \"1 us\"\n"
    );
    let output = stagger(folder(&[("scene.toml", &scene)]).path(), &["check", "scene.toml"]);
    match output.status.code() {
        Some(0) => Ok(()),
        Some(2) => Err(stderr(&output)),
        other => panic!("exit {other:?}: {}", stderr(&output)),
    }
}

#[test]
fn a_second_number_is_no_unit() {
    check("15 us", "121 um", "2151 K").unwrap();
    let message = check("1 15 us", "1 121 um", "2 151 K").unwrap_err();
    for (line, part) in [
        (1, "the unit `15 us` cannot be read"),
        (4, "the unit `121 um` cannot be read"),
        (5, "the unit `151 K` cannot"),
    ] {
        assert!(message.contains(&format!("scene.toml:{line}: ")) && message.contains(part), "{part}: {message}");
    }
    for radius in [
        "1_000 um",
        "1,5 um",
        "1'000 um",
        "10^-6 m",
        "5 5",
        "1e3 1e3 m",
        "\u{ff11} m",
        "- 5 um",
        "inf m",
        "nan m",
        "5 um^-",
    ] {
        let message = check("15 us", radius, "300 K").unwrap_err();
        assert!(message.contains("scene.toml:4: particles.radius.mean: "), "{radius}: {message}");
    }
}

#[test]
fn the_unit_of_a_file_is_a_unit_alone() {
    let files = |unit: &str| {
        let scene =
            super::particle_files::scene("p.csv").replace("\"p.csv\"", &format!("\"p.csv\", unit = \"{unit}\""));
        folder(&[("scene.toml", &scene), ("p.csv", "x,y,z,radius\n0,0,0,2\n")])
    };
    let radius = |unit: &str| super::particle_files::read_in(files(unit).path()).map(|(_, radii)| radii);
    assert_eq!(radius("um"), Ok(vec![2e-6]));
    assert_eq!(radius("\u{3bc}m"), Ok(vec![2e-6]));
    // "5 um" was once 1 to the fifth, times 1 um.
    for unit in ["5 um", "15 um", "", "K", "e3 m", "1/m"] {
        let message = radius(unit).unwrap_err();
        assert!(message.contains("expected a unit of length"), "{unit}: {message}");
    }
}
