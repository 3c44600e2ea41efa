//! The three phases of sintering.toml: filled, pressed, released.

use std::{path::Path, process::Command};

use stagger_recordings::{Recording, Steps};

use super::{Pinned, ROUNDING, field_of, run};

#[test]
fn electrified_walls_press_a_bed_and_heat_it() {
    let summary = run(&Pinned {
        scene: "sintering.toml",
        counts: [200, 0, 460],
        means: &[("temperature", 900.0921535123089), ("contact_area", 0.0005866201795951149)],
        imbalance: &[
            // The motion's energy is off by the integrator's error, second order in the substep.
            ("particles", 5e-3),
            ("thermal", ROUNDING),
            ("current", ROUNDING),
            ("joule: current to thermal", ROUNDING),
        ],
    });
    // a J² V/σ for 0.3 s, over all spheres, but for the two windows in which it is switched: 1000 sums of 60 windows.
    let expected_j = 0.5 * 1e10 / 12.5 * 0.3 * 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.05f64.powi(3);
    let joule = summary["ledger"]["current"]["lost"]["joule"].as_f64().unwrap();
    assert!((joule / expected_j - 1.0).abs() < 5e-3, "{joule} J of {expected_j} J");
    // Hotter by what they were given, and a little by the walls.
    let (mean, given) = (field_of(&summary, "temperature")["mean"].as_f64().unwrap(), joule / 1000.0 / 104.72);
    assert!((mean - 300.0 - given).abs() < 2.0, "{mean} K");
}

/// Volume fractions when filled, pressed and released, and the final mean temperature in K. The fraction is the spheres'
/// volume over a section of 1 m² times twice the mean height of their centres; overlaps count twice.
fn phases(heat: f64, pressed_s: f64) -> [f64; 4] {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let released_s = 0.7 + pressed_s;
    let sets = [
        format!("duration={}", released_s + 0.25),
        format!("materials.grain.electrical-conductivity={}", 12.5 / heat),
        format!("current.ends={released_s}"),
        format!("walls.upper.motion.times=[0, 0.45, 0.7, {released_s}, {}]", released_s + 0.25),
        "record.level=accepted".into(),
    ];
    let output = Command::new(env!("CARGO_BIN_EXE_stagger"))
        .arg("run")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sintering.toml"))
        .args(["--in-process", "--record"])
        .arg(&path)
        .args(sets.iter().flat_map(|set| ["--set", set]))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut steps = Steps::default();
    let mut fractions = Vec::new();
    let mut temperature_k = 0.0;
    for message in Recording::open(&path).unwrap().messages().unwrap() {
        let Some(step) = steps.take(message.unwrap()).step else { continue };
        let positions = step.fields["positions"].f64().unwrap();
        let count = (positions.len() / 3) as f64;
        let height_m = 2.0 * positions.iter().skip(2).step_by(3).sum::<f64>() / count;
        let volume_m3 = count * 4.0 / 3.0 * std::f64::consts::PI * 0.05f64.powi(3);
        fractions.push((step.t_s, volume_m3 / height_m));
        temperature_k = step.fields["temperature"].f64().unwrap().iter().sum::<f64>() / count;
    }
    let at = |t_s: f64| fractions.iter().min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs())).unwrap().1;
    [at(0.45), at(released_s), at(released_s + 0.25), temperature_k]
}

#[test]
fn a_hotter_or_longer_pressed_bed_springs_back_less() {
    // Trends of Zohdi 2018, fig. 8.7. Heat is given over the time pressed; a longer one at the same temperature takes less a
    // second. 0.05 s is the scene's own time.
    let runs = [("printed way", 1.0, 0.05), ("half the heat", 0.5, 0.05), ("longer", 1.0, 0.2)];
    let table = runs.map(|(what, heat, pressed_s)| {
        let [filled, pressed, released, temperature_k] = phases(heat, pressed_s);
        println!("{what}: {filled:.3} {pressed:.3} {released:.3}, {temperature_k:.0} K");
        assert!((0.5..0.6).contains(&filled), "{what}: filled to {filled}");
        assert!((0.95..1.05).contains(&pressed), "{what}: pressed to {pressed}");
        assert!(released > filled + 0.03 && released < pressed - 0.1, "{what}: released, {released}");
        pressed - released
    });
    assert!(table[1] > table[0] + 0.02, "colder springs back more: {table:?}");
    assert!(table[2] < table[0] - 0.02, "longer springs back less: {table:?}");
}
