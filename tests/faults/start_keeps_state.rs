//! Fault: a start from a file forgot what the file says of temperatures, so that a bed exported hot went on at 300 K.

use std::path::Path;

use super::program::{field, folder, stagger, stderr, stdout, summary};

const HOT: &str = r#"
duration = "200 us"
[particles]
count = 20
radius = { mean = "20 um", spread = "4 um" }
material = "316L"
start = { box = ["0.2 mm", "0.2 mm", "0.4 mm"], velocity = [0, 0, -0.1] }
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = 300
[thermal]
phases = { melting-band = 0 }
[optics]
power = "80 W"
absorption = "5e4 1/m"
profile = { kind = "gaussian", radius = "200 um" }
path = { kind = "fixed", at = [0, 0, 0] }
[coupling]
dt = "10 us"
"#;

/// The same without the laser, for so short that nothing changes.
const NEXT: &str = r#"
duration = "1 ns"
[particles]
material = "316L"
start = { kind = "file", path = "start.vtp" }
gravity = [0, 0, 0]
[walls.plate]
plane = { normal = [0, 0, 1] }
[thermal]
phases = { melting-band = 0 }
[coupling]
dt = "1 ns"
"#;

fn last_state(folder: &Path) -> std::path::PathBuf {
    let series = std::fs::read_dir(folder.join("series")).unwrap().map(|entry| entry.unwrap().path());
    series.filter(|path| path.extension().is_some_and(|end| end == "vtp")).max().unwrap()
}

#[test]
fn a_start_from_an_exported_state_keeps_temperatures_and_liquid_shares() {
    let folder = folder(&[("hot.toml", HOT), ("next.toml", NEXT)]);
    let run = stagger(folder.path(), &["run", "hot.toml", "--in-process", "--record", "hot.mcap", "--json"]);
    assert!(run.status.success(), "{}", stderr(&run));
    let before: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let exported = stagger(folder.path(), &["export", "hot.mcap", "--out", "series"]);
    assert!(exported.status.success(), "{}", stderr(&exported));
    std::fs::copy(last_state(folder.path()), folder.path().join("start.vtp")).unwrap();

    let after = summary(folder.path(), "next.toml", &[]);
    for name in ["temperature", "melted", "velocities"] {
        let (before, after) = (field(&before, name), field(&after, name));
        for which in ["min", "mean", "max"] {
            let [before, after] = [before, after].map(|field| field[which].as_f64().unwrap());
            // A nanosecond of conduction between contacts, if there are some.
            assert!((before - after).abs() <= 1e-4 * before.abs(), "{name}, {which}: {after} instead of {before}");
        }
    }
    assert!(field(&after, "temperature")["max"].as_f64().unwrap() > 1000.0, "{}", field(&after, "temperature"));
    // What they have above 300 K is there from the start: nothing came in.
    let [before, after] = [&before, &after].map(|run| run["ledger"]["thermal"]["stored"].clone());
    for name in ["heat", "latent"] {
        let [before, after] = [&before, &after].map(|stored| stored[name].as_f64().unwrap());
        assert!((before - after).abs() <= 1e-6 * before.abs(), "{name}: {after} J instead of {before} J");
    }

    // The scene may take less of it.
    let cold = summary(folder.path(), "next.toml", &["particles.start.columns=[\"velocity\"]"]);
    assert_eq!(field(&cold, "temperature")["max"], 300.0);

    let told = stagger(folder.path(), &["check", "next.toml"]);
    let told = stdout(&told);
    for part in ["velocity, temperature, melted", "not read: ", "absorbed_power"] {
        assert!(told.contains(part), "{part} is not in {told}");
    }
}

#[test]
fn texts_have_temperatures_and_spins_too_and_what_cannot_be_is_refused() {
    let csv = "x,y,z,radius,temperature,wx,wy,wz,mood\n0,0,1e-3,2e-5,700,0,0,5,1\n0,0,2e-3,2e-5,900,0,0,5,2\n";
    let xyz = "2\nProperties=pos:R:3:radius:R:1:temperature:R:1:spins:R:3\n0 0 1e-3 2e-5 700 0 0 5\n0 0 2e-3 2e-5 900 0 0 5\n";
    let folder = folder(&[
        ("next.toml", NEXT),
        ("a.csv", csv),
        ("a.xyz", xyz),
        ("cold.csv", "x,y,z,radius,temperature\n0,0,1e-3,2e-5,-3\n"),
        ("half.csv", "x,y,z,radius,wx,wy\n0,0,1e-3,2e-5,1,2\n"),
    ]);
    let start = |name: &str| format!("particles.start={{ kind = \"file\", path = \"{name}\" }}");
    for name in ["a.csv", "a.xyz"] {
        let found = summary(folder.path(), "next.toml", &[&start(name)]);
        let temperature = field(&found, "temperature");
        assert_eq!([&temperature["min"], &temperature["max"]], [700.0, 900.0], "{name}");
    }
    for (name, why) in
        [("cold.csv", "cold.csv:2: expected a temperature of at least 0 K, found -3"), ("half.csv", "`wz`")]
    {
        let refused = stagger(folder.path(), &["check", "next.toml", "--set", &start(name)]);
        assert!(!refused.status.success() && stderr(&refused).contains(why), "{name}: {}", stderr(&refused));
    }
}
