//! Every scene users start from, run whole, with its counts and norms pinned.
//!
//! Counts are exact: they change only when the method does. Norms hold to 1e-6 of their value; to the last bit, the hashes of
//! shortened runs are held by `hashes`.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod hashes;
mod pile;
mod piston;
mod presets;
mod same_end;
mod sintering;

use std::{path::Path, process::Command};

use serde_json::Value;

struct Pinned {
    scene: &'static str,
    /// Accepted steps, rejected attempts, iterations.
    counts: [u64; 3],
    /// Final fields with their means.
    means: &'static [(&'static str, f64)],
    /// Largest share of the energy turned over that the energy of a node may be off.
    imbalance: &'static [(&'static str, f64)],
}

fn run(pinned: &Pinned) -> Value {
    run_with(pinned, &[])
}

/// Runs a scene with `--set` for each of `overrides`.
fn run_with(pinned: &Pinned, overrides: &[&str]) -> Value {
    let sets: Vec<_> = overrides.iter().flat_map(|set| ["--set", *set]).collect();
    let summary = summary_of(pinned.scene, &[&["--no-record"], &sets[..]].concat());
    pinned.check(&summary);
    summary
}

fn summary_of(scene: &str, arguments: &[&str]) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(scene);
    let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
    let output = command.arg("run").arg(&path).arg("--json").args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

impl Pinned {
    fn check(&self, summary: &Value) {
        let steps = &summary["steps"];
        let counts = ["accepted", "rejected", "iterations"].map(|name| steps[name].as_u64().unwrap());
        assert_eq!(counts, self.counts, "steps, rejections, iterations of {}", self.scene);
        for (field, expected) in self.means {
            let mean = field_of(summary, field)["mean"].as_f64().unwrap();
            assert!((mean - expected).abs() <= 1e-6 * expected.abs(), "mean {field} of {}: {mean}", self.scene);
        }
        for (name, bound) in self.imbalance {
            let share = summary["imbalance"][name].as_f64().unwrap().abs();
            assert!(share <= *bound, "imbalance of {name} in {}: {share:e}", self.scene);
        }
    }
}

fn field_of<'a>(summary: &'a Value, name: &str) -> &'a Value {
    let fields = summary["fields"].as_array().unwrap();
    fields.iter().find(|field| field["field"] == name).unwrap()
}

/// Heat and light balance to rounding: sums of some thousand terms over some hundred windows.
const ROUNDING: f64 = 1e-12;

#[test]
fn quick() {
    run(&Pinned {
        scene: "quick.toml",
        counts: [56, 0, 150],
        means: &[("temperature", 398.6883208933165), ("contact_area", 1.00530478422878e-11)],
        // The motion's energy is off by the integrator's error, second order in the substep.
        imbalance: &[("particles", 5e-3), ("thermal", ROUNDING), ("optics", ROUNDING)],
    });
}

#[test]
fn falling_powder_is_one_physics_that_settles() {
    let summary = run(&Pinned {
        scene: "falling-powder.toml",
        counts: [206, 0, 412],
        means: &[("positions", 3.056628101287578e-05), ("contact_area", 4.950549873204537e-12)],
        imbalance: &[("particles", 5e-3)],
    });
    // It fell at 0.5 m/s, and lies on the plate now: within its overlap, no centre is lower than its radius.
    let velocities = field_of(&summary, "velocities");
    assert!(velocities["max"].as_f64().unwrap() < 0.1 && velocities["min"].as_f64().unwrap() > -0.1);
    assert!(field_of(&summary, "wall_contact_pairs")["rows"].as_u64().unwrap() > 100);
}

#[test]
fn a_track_on_a_bare_plate_is_as_wide_as_was_measured() {
    let summary = run(&Pinned {
        scene: "plate-track.toml",
        counts: [100, 0, 189],
        means: &[],
        imbalance: &[("solid", 1e-9), ("optics", ROUNDING)],
    });
    let length_m = |name: &str| field_of(&summary, name)["mean"].as_f64().unwrap();
    // Measured: 133 µm wide and 91 µm deep (AMB2018-02). Conduction alone is right in the width within 15 %; in the depth it
    // falls short by more than half, as the liquid's flow and the keyhole are absent (docs/solid.md).
    let [width_m, depth_m] = ["track_width", "track_depth"].map(length_m);
    assert!((width_m / 133e-6 - 1.0).abs() < 0.15, "{width_m} m wide");
    assert!((0.4..0.5).contains(&(depth_m / 91e-6)), "{depth_m} m deep");
}

#[test]
fn mixed_powder_starts_dense_and_settles() {
    let summary = run(&Pinned {
        scene: "mixed-powder.toml",
        counts: [106, 0, 212],
        means: &[("radii", 2.6923492129170585e-05), ("positions", 6.678535563188049e-05)],
        imbalance: &[("particles", 5e-3)],
    });
    // Fine grains and coarse ones, each within its limits; they hardly move, as there was no room to fall into.
    let radii = field_of(&summary, "radii");
    assert!(radii["min"].as_f64().unwrap() >= 15e-6 && radii["max"].as_f64().unwrap() > 50e-6);
    assert_eq!(radii["rows"], 440);
    assert!(field_of(&summary, "velocities")["min"].as_f64().unwrap() > -0.05);
}

#[test]
fn three_lasers_on_five_nodes_share_one_bed() {
    let summary = run(&Pinned {
        scene: "three-lasers.toml",
        counts: [56, 0, 165],
        means: &[("temperature", 445.5000268381913), ("contact_area", 1.0384806515162067e-11)],
        imbalance: &[
            ("particles", 5e-3),
            ("thermal", ROUNDING),
            ("third-laser", ROUNDING),
            ("absorbed: optics and second-laser and third-laser to thermal", ROUNDING),
        ],
    });
    assert_eq!(summary["nodes"].as_object().unwrap().len(), 5);
}

#[test]
fn deposition_warms_by_less_than_a_kelvin() {
    let summary = run(&Pinned {
        scene: "deposition.toml",
        counts: [208, 0, 487],
        means: &[("temperature", 300.3957790458809), ("contact_area", 5.3402342921421725e-12)],
        // Second order in the substep: 6.2e-3 at 0.4 us, 1e-3 at 0.16 us.
        imbalance: &[("particles", 8e-3), ("thermal", ROUNDING)],
    });
    let temperature = field_of(&summary, "temperature");
    // Zohdi 2018, section 6.5, scenario 1: about one kelvin from the warm plate alone.
    assert!((0.1..1.0).contains(&(temperature["mean"].as_f64().unwrap() - 300.0)));
    assert!(temperature["max"].as_f64().unwrap() < 320.0, "nothing is hotter than the plate");
}

#[test]
fn deposition_laser_heats_by_several_hundred_kelvin() {
    let summary = run(&Pinned {
        scene: "deposition-laser.toml",
        counts: [208, 0, 567],
        means: &[("temperature", 588.7823545642326), ("contact_area", 7.097017572814196e-12)],
        imbalance: &[
            ("particles", 8e-3),
            ("thermal", ROUNDING),
            ("optics", ROUNDING),
            ("absorbed: optics to thermal", ROUNDING),
        ],
    });
    let temperature = field_of(&summary, "temperature");
    // Scenario 2: several hundred kelvin.
    assert!((200.0..600.0).contains(&(temperature["mean"].as_f64().unwrap() - 300.0)));
}

#[test]
fn laser_rays_boil_the_less_the_better_a_bed_conducts() {
    let summary = run(&Pinned {
        scene: "laser-rays.toml",
        counts: [203, 0, 455],
        means: &[("temperature", 1105.506997695136), ("contact_area", 1.2789058067709406e-11)],
        // The optics' power is iterated to 1e-6 of its change; all else is to rounding.
        imbalance: &[
            ("particles", 0.0),
            ("thermal", ROUNDING),
            ("optics", ROUNDING),
            ("absorbed: optics to thermal", 1e-9),
        ],
    });
    // 20 pulses of 5 us at 6000 W, absorbed, passed to the plate or reflected into the open.
    let optics = &summary["ledger"]["optics"];
    let joule = |side: &str, name: &str| optics[side][name].as_f64().unwrap();
    assert!((joule("gained", "laser") - 0.6).abs() < 1e-12);
    assert!((0.9..1.0).contains(&(joule("lost", "absorbed") / 0.6)));
    assert!(joule("lost", "escaped") > 1e-3 && joule("lost", "residual") < 1e-6);
    // The trend of table 10.1.
    let vapourised = |summary: &Value| summary["nodes"]["thermal"]["figures"]["vapourised particles"].as_f64().unwrap();
    assert_eq!(vapourised(&summary), 72.0);
    let better = summary_of("laser-rays.toml", &["--no-record", "--set", "materials.powder.conductivity=400"]);
    assert_eq!(vapourised(&better), 32.0);
}

#[test]
fn the_first_pulse_of_sound_pushes_an_agglomerate_and_all_of_it_is_booked() {
    // Late reflections amplify rounding: what depends on them is not pinned to digits.
    let pinned = Pinned {
        scene: "acoustic-pulse.toml",
        counts: [1607, 0, 3214],
        means: &[("radii", 0.05)],
        imbalance: &[("particles", 2e-4), ("acoustics", ROUNDING)],
    };
    let summary = run_with(&pinned, &["duration=0.4"]);
    let acoustics = &summary["ledger"]["acoustics"];
    let joule = |side: &str, name: &str| acoustics[side][name].as_f64().unwrap();
    // 20 ms of 3e5 W/m^2 over a radius of 0.5 m.
    assert!((joule("gained", "sound") / 4712.388980384685 - 1.0).abs() < 1e-12);
    assert!((100.0..300.0).contains(&joule("lost", "transmitted")));
    let velocities = field_of(&summary, "velocities");
    assert!(velocities["min"].as_f64().unwrap() < -2.0, "it flies apart, most of it along the beam");
}

/// Zohdi 2018, section 7.3: a shortened example of electric-deposition.toml.
fn electric_deposition(field: bool, ionised: bool, duration: &str, accepted: u64, imbalance: f64) -> Value {
    let mut overrides = vec![duration];
    if !field {
        overrides.push("particles.electromagnetic.electric=[0,0,0]");
    }
    if !ionised {
        overrides.push("particles.near-field.ionised=false");
    }
    let pinned =
        Pinned { scene: "electric-deposition.toml", counts: [accepted, 0, 2 * accepted], means: &[], imbalance: &[] };
    let summary = run_with(&pinned, &overrides);
    let share = summary["imbalance"]["particles"].as_f64().unwrap().abs();
    assert!(share <= imbalance, "imbalance of {overrides:?}: {share:e}");
    let step_s = |name: &str| summary["steps"][name].as_f64().unwrap();
    assert!((step_s("dt_min_s") - 2.5e-6).abs() < 1e-15, "the first step");
    assert!((step_s("dt_max_s") - 2.5e-4).abs() < 1e-13, "it grows to its limit");
    summary
}

#[test]
fn stress_under_a_stream_is_localised_at_the_top_and_smeared_below() {
    let summary = run(&Pinned {
        scene: "substrate.toml",
        counts: [106, 0, 212],
        means: &[
            ("von_mises_stress", 826.5755677359152),
            ("pressure", 255.81058681827375),
            ("wall_contact_force", -1.1742051662770063e-06),
        ],
        imbalance: &[("particles", 5e-3)],
    });
    let figures = &summary["nodes"]["substrate"]["figures"];
    let of = |grid: &str, what: &str| figures[format!("{grid}: {what} norm of σ' [Pa]")].as_f64().unwrap();
    let largest = ["top", "a-25um", "b-100um", "c-400um"].map(|grid| of(grid, "largest"));
    assert!(largest.is_sorted_by(|upper, lower| *upper > 1.5 * lower), "{largest:?}");
    // Peaks over the mean: single contacts at the top, one smooth hill below.
    let peaks = ["top", "a-25um", "b-100um", "c-400um"].map(|grid| of(grid, "largest") / of(grid, "mean"));
    assert!(peaks.is_sorted_by(|upper, lower| *upper > *lower), "{peaks:?}");
    assert!(figures["normal load [N]"].as_f64().unwrap() > 0.0);
}

fn rows(summary: &Value, field: &str) -> u64 {
    field_of(summary, field)["rows"].as_u64().unwrap()
}

#[test]
fn an_ionised_stream_draws_together_into_droplets() {
    let duration = "duration=0.1";
    // Contacts of 2000 particles: none while they only fall; two a particle and more within droplets.
    assert_eq!(rows(&electric_deposition(false, false, duration, 410, 1e-12), "contact_pairs"), 0);
    assert!(rows(&electric_deposition(false, true, duration, 410, 5e-4), "contact_pairs") > 2000);
    let pairs =
        [false, true].map(|ionised| rows(&electric_deposition(true, ionised, duration, 410, 5e-3), "contact_pairs"));
    assert!(pairs[1] > 2 * pairs[0], "{pairs:?}");
}

#[test]
fn an_electric_field_makes_the_impact_harder() {
    // Just after the first contacts; the fastest one is the next to arrive. Without the field v0 + g t bounds the speed, with it
    // sqrt(v0^2 + 2 (g + 1e4 m/s^2) 4 m) = 283 m/s.
    let speed = |summary: &Value| -field_of(summary, "velocities")["min"].as_f64().unwrap();
    let falls = electric_deposition(false, false, "duration=0.48", 1930, 1e-4);
    let pulled = electric_deposition(true, false, "duration=0.02", 90, 5e-3);
    assert!(rows(&falls, "wall_contact_pairs") > 0 && rows(&pulled, "wall_contact_pairs") > 0);
    assert!((speed(&falls) - (1.0 + 9.81 * 0.48)).abs() < 0.01, "{}", speed(&falls));
    assert!((100.0..283.0).contains(&speed(&pulled)), "{}", speed(&pulled));
}
