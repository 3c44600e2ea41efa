//! Five particles in files of every dialect, read by `stagger check`.

use std::path::Path;

use super::program::{stagger, stderr};

/// A scene that starts from `path`.
pub fn scene(path: &str) -> String {
    format!(
        "duration = \"2 us\"\n[particles]\nstart = {{ kind = \"file\", path = \"{path}\" }}\ngravity = [0, 0, 0]\n\
         integrator = \"held\"\n[coupling]\ndt = \"1 us\"\n"
    )
}

/// Positions and radii that a scene starts from where its particles' file has these contents, or what is said about it.
pub fn read(path: &str, contents: &[u8]) -> Result<(Vec<[f64; 3]>, Vec<f64>), String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(path), contents).unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene(path)).unwrap();
    read_in(folder.path())
}

/// As [`read`], of a scene that is there.
pub fn read_in(folder: &Path) -> Result<(Vec<[f64; 3]>, Vec<f64>), String> {
    let output = stagger(folder, &["check", "scene.toml", "--json"]);
    match output.status.code() {
        Some(0) => {}
        Some(2) => return Err(stderr(&output)),
        other => panic!("exit {other:?}: {}", stderr(&output)),
    }
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let given = &json["physics"]["particles"]["start"]["given"];
    let value = |name: &str| given[name].clone();
    Ok((serde_json::from_value(value("positions_m")).unwrap(), serde_json::from_value(value("radii_m")).unwrap()))
}

/// The five particles, in m.
pub fn five() -> (Vec<[f64; 3]>, Vec<f64>) {
    let rows = || (0..5).map(|row| f64::from(row) * 3.0);
    // As a reader of decimal text makes them.
    let decimal = |number: f64, exponent: &str| format!("{number}{exponent}").parse::<f64>().unwrap();
    let positions = rows().map(|first| [1.0, 2.0, 3.0].map(|x| decimal(first + x, "e-3"))).collect();
    (positions, (1..=5).map(|radius| decimal(f64::from(radius), "e-4")).collect())
}

/// Checks that a file is refused, and that the message has every one of some parts.
pub fn refused(path: &str, contents: &[u8], parts: &[&str]) {
    match read(path, contents) {
        Ok(_) => panic!("{path} was accepted:\n{}", String::from_utf8_lossy(contents)),
        Err(message) => {
            for part in parts {
                assert!(
                    message.contains(part),
                    "expected {part:?} in: {message}\nof\n{}",
                    String::from_utf8_lossy(contents)
                );
            }
        }
    }
}
