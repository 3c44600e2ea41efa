//! Fault: the lines that sample a beam did not follow its width, so that one line carried nearly all of a narrow one.
//!
//! A black sphere of 50 um takes all light that falls on its disc; the right share is an integral over the beam.

use std::f64::consts::PI;

use super::program;

const SCENE: &str = r#"
duration = "1 ms"
[particles]
count = 1
radius = "50 um"
start = { kind = "lattice", box = ["0.1 mm", "0.1 mm", "0.1 mm"], at = ["-50 um", "-50 um", 0] }
integrator = "held"
gravity = [0, 0, 0]
[thermal]
[optics]
power = "10 W"
absorption = "1e9 1/m"
path = { kind = "fixed", at = ["50 um", 0, "1 mm"] }
profile = { kind = "gaussian", radius = "10 um" }
[coupling]
dt = "0.5 ms"
"#;

/// Share of a beam's power on a disc of `disc_um` whose centre is `away_um` from the axis; `density` is the power between two
/// circles about the axis over their distance, in 1/um, dark beyond `cut_um`.
fn share(density: impl Fn(f64) -> f64, cut_um: f64, disc_um: f64, away_um: f64) -> f64 {
    // Midpoint rule; the angle's slope is infinite where a circle touches the disc's edge: an error of n^(-3/2).
    let n = 200_000;
    let step = cut_um / f64::from(n);
    let ring = |k| {
        let r = (f64::from(k) + 0.5) * step;
        let cosine = (r * r + away_um * away_um - disc_um * disc_um) / (2.0 * r * away_um);
        density(r) * cosine.clamp(-1.0, 1.0).acos() / PI * step
    };
    (0..n).map(ring).sum()
}

fn absorbed_mj(folder: &std::path::Path, sets: &[&str]) -> f64 {
    let summary = program::summary(folder, "scene.toml", sets);
    1e3 * summary["ledger"]["thermal"]["gained"]["absorbed"].as_f64().unwrap()
}

#[test]
fn a_beam_narrower_than_a_particle_is_sampled_by_default() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    let (w, cut) = (10.0f64, 60.0);
    let gaussian = |r: f64| 4.0 * r / (w * w) * (-2.0 * (r / w).powi(2)).exp();
    // Less than half where the axis meets the edge, as that is curved.
    assert!((10.0 * share(gaussian, cut, 50.0, 50.0) - 4.800).abs() < 1e-3);
    for away_um in [42.0, 45.0, 48.0, 50.0, 51.0, 55.0, 58.0] {
        let found = absorbed_mj(folder.path(), &[&format!("optics.path.at=[\"{away_um} um\", 0, \"1 mm\"]")]);
        let expected = 10.0 * share(gaussian, cut, 50.0, away_um);
        // Half a percent of the power.
        assert!((found - expected).abs() < 0.05, "{away_um} um: {found} mJ, expected {expected}");
    }
    // Edges along the other axis, and none of the two.
    for at in ["[0, \"50 um\", \"1 mm\"]", "[\"30 um\", \"40 um\", \"1 mm\"]"] {
        let found = absorbed_mj(folder.path(), &[&format!("optics.path.at={at}")]);
        assert!((found - 4.800).abs() < 0.05, "{at}: {found} mJ");
    }
}

#[test]
fn every_profile_and_every_laser_of_a_scene_is_sampled() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    let (radius, decay) = (10.0f64, 0.1f64);
    let top_hat = |r: f64| 2.0 * r / (radius * radius);
    let exponential = |r: f64| decay * decay * r * (-decay * r).exp();
    for away_um in [46.0, 50.0, 53.0] {
        let at = format!("optics.path.at=[\"{away_um} um\", 0, \"1 mm\"]");
        let found = absorbed_mj(folder.path(), &[&at, "optics.profile.kind=top-hat"]);
        let expected = 10.0 * share(top_hat, radius, 50.0, away_um);
        assert!((found - expected).abs() < 0.1, "top hat, {away_um} um: {found} mJ, expected {expected}");
        let profile = "optics.profile={ kind = \"exponential\", decay = \"0.1 1/um\" }";
        let found = absorbed_mj(folder.path(), &[&at, profile]);
        let expected = 10.0 * share(exponential, 300.0, 50.0, away_um);
        assert!((found - expected).abs() < 0.05, "exponential, {away_um} um: {found} mJ, expected {expected}");
    }
    let second = "nodes.second={ physics = \"optics\", optics = { power = 10, absorption = 1e9, profile.radius = \"10 um\", \
                  path = { kind = \"fixed\", at = [\"50 um\", 0, \"1 mm\"] } } }";
    let both = absorbed_mj(folder.path(), &[second]);
    assert!((both - 2.0 * 4.800).abs() < 0.1, "{both} mJ of two lasers");
}

#[test]
fn advice_tells_a_spacing_that_is_too_coarse_and_a_spot_that_outruns_the_step() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    let advice = |sets: &[&str]| -> Vec<serde_json::Value> {
        let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", *set]).collect();
        let output =
            program::stagger(folder.path(), &[&["check", "scene.toml", "--advise", "--json"], &sets[..]].concat());
        assert!(output.status.success(), "{}", program::stderr(&output));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        report["advice"].as_array().unwrap().clone()
    };
    let verdict = |all: &[serde_json::Value], number: &str| {
        let one = all.iter().find(|advice| advice["number"] == number);
        one.map_or("none", |advice| advice["verdict"].as_str().unwrap()).to_owned()
    };
    assert_eq!(verdict(&advice(&[]), "lines to the beam"), "suffices");
    let coarse = advice(&["optics.spacing=12.5 um"]);
    assert_eq!(verdict(&coarse, "lines to the beam"), "refine");
    // What it says to set is enough.
    let edit = coarse.iter().find(|advice| advice["number"] == "lines to the beam").unwrap()["edits"][0]["set"].clone();
    assert_eq!(edit["key"], "optics.spacing");
    let set = format!("optics.spacing={}", edit["value"].as_str().unwrap());
    assert_eq!(verdict(&advice(&[&set]), "lines to the beam"), "suffices");

    let number = "way of the spot over its radius";
    assert_eq!(verdict(&advice(&[]), number), "none");
    let sweep =
        "optics.path={ kind = \"sweep\", from = [\"-0.1 mm\", 0, 0], to = [\"0.1 mm\", 0, 0], speed = \"1 m/s\" }";
    let fast = advice(&[sweep, "coupling.dt=10 us"]);
    assert_eq!(verdict(&fast, number), "refine");
    let edit = fast.iter().find(|advice| advice["number"] == number).unwrap()["edits"][0]["set"].clone();
    let set = format!("{}={}", edit["key"].as_str().unwrap(), edit["value"].as_str().unwrap());
    assert_eq!(verdict(&advice(&[sweep, &set]), number), "suffices");
    let pulses = "optics.pulses={ period = \"100 us\", on = \"20 us\" }";
    assert_eq!(verdict(&advice(&[pulses, "coupling.dt=50 us"]), "step over pulse"), "refine");
    assert_eq!(verdict(&advice(&[pulses, "coupling.dt=5 us"]), "step over pulse"), "none");
}
