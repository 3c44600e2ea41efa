//! Lasers and their fidelity.

use serde_json::json;

use super::{
    heat::{BED, LIGHT},
    truth::{Case, holds, matters},
};

#[test]
fn a_laser_that_warms_nothing_is_left_out() {
    let faint = LIGHT.replace("1 W", "1 mW");
    let text = format!("{BED}\n");
    let case = Case::new(&text, &[&faint, "coupling.tolerance={ temperature = 1e-7, absorbed_power = 1e-6 }"]);
    let advice = case.advice("optics", "energy of the light");
    assert_eq!(advice["verdict"], "drop");
    // All of its energy goes, of course: its share is 1.
    holds(
        &case.edited(&json!([{ "set": { "key": "coupling.tolerance", "value": "{ temperature = 1e-7 }" } }])),
        "optics",
        "energy of the light",
        "drop",
        1.01,
    );
}

#[test]
fn a_laser_that_warms_is_kept() {
    let without = json!([{ "delete": { "key": "optics" } }]);
    matters(&Case::new(BED, &[LIGHT]), "optics", "energy of the light", "drop", &without, "mean-temperature", 0.01);
}

/// A deep bed that fills its box, and a beam in its middle.
const DEEP: [&str; 5] = [
    "particles.count=640",
    "particles.start.box=[\"0.201 mm\", \"0.201 mm\", \"2.001 mm\"]",
    "walls.sides.box={ lower = [\"-0.1005 mm\", \"-0.1005 mm\", \"-1 mm\"], upper = [\"0.1005 mm\", \"0.1005 mm\", \"3 mm\"] }",
    "particles.start.lattice=\"fcc\"",
    "optics={ power = \"1 W\", absorption = \"1e6 1/m\", profile = { kind = \"top-hat\", radius = \"80 um\" }, \
     path = { kind = \"fixed\", at = [0, 0, 0] } }",
];

#[test]
fn energy_balance_suffices_for_the_mean_of_a_deep_opaque_bed() {
    holds(&Case::new(BED, &DEEP), "optics.fidelity", "optical depth", "suffices", 0.01);
}

#[test]
fn energy_balance_does_not_suffice_for_a_thin_layer() {
    let thin = [LIGHT, "particles.count=5", "optics.profile.radius=\"80 um\""];
    let cheap = json!([{ "set": { "key": "optics.fidelity", "value": "energy-balance" } }]);
    let number = ("optics.fidelity", "optical depth");
    matters(&Case::new(BED, &thin), number.0, number.1, "suffices", &cheap, "mean-temperature", 0.01);
    let rough = [&thin[..], &["optics.fidelity=energy-balance"]].concat();
    let case = Case::new(BED, &rough);
    let advice = case.advice(number.0, number.1);
    assert_eq!(advice["verdict"], "refine", "{advice:#}");
    let finer = case.edited(&advice["edits"]).run();
    assert!(finer.of("absorbed-energy") < 0.9 * case.run().of("absorbed-energy"));
}

#[test]
fn the_monographs_form_is_told_where_it_gives_more_than_there_is() {
    let (weak, strong) = (LIGHT.replace("1e5", "1e3"), LIGHT.to_owned());
    let number = ("optics.fidelity", "optical depth");
    for (light, verdict) in [(weak, "suffices"), (strong, "refine")] {
        let case = Case::new(BED, &[&light, "optics.fidelity=beer-lambert-monograph", "particles.count=16"]);
        let advice = case.advice(number.0, number.1);
        assert_eq!(advice["verdict"], verdict, "{advice:#}");
        let conserving = json!([{ "set": { "key": number.0, "value": "beer-lambert" } }]);
        let (as_printed, conserving) = (case.run(), case.edited(&conserving).run());
        let ratio = as_printed.of("absorbed-energy") / conserving.of("absorbed-energy");
        // 10 % is what it lets pass; the lines sample a sphere within a few percent.
        if verdict == "refine" {
            assert!(ratio > 1.5, "{ratio}")
        } else {
            assert!((ratio - 1.0).abs() < 0.15, "{ratio}")
        }
    }
}

#[test]
fn too_few_rays_are_told() {
    let rays = "optics={ fidelity = \"rays\", power = \"1 W\", refractive-index = 2, rays = { count = 40, pattern = \"random\" }, \
                profile = { kind = \"top-hat\", radius = \"0.1 mm\" }, path = { kind = \"fixed\", at = [0, 0, 0] } }";
    let case = Case::new(BED, &[rays]);
    let advice = case.advice("optics.fidelity", "optical depth");
    assert_eq!(advice["verdict"], "refine", "{advice:#}");
    let (few, enough) = (case.run(), case.edited(&advice["edits"]));
    let many = json!([{ "set": { "key": "optics.rays.count", "value": "40000" } }]);
    let many = case.edited(&many).run();
    let error = |run: &super::truth::Outcome| (run.of("peak-temperature") / many.of("peak-temperature") - 1.0).abs();
    assert!(error(&few) > 0.05, "{}", error(&few));
    assert!(error(&enough.run()) < error(&few));
    let quiet = Case::new(BED, &[rays, "optics.rays.count=2000"]).advice("optics.fidelity", "optical depth");
    assert_eq!(quiet["verdict"], "keep");
}

#[test]
fn light_without_a_temperature_is_told() {
    let case = Case::new(BED, &[LIGHT]).edited(&json!([
        { "delete": { "key": "thermal" } },
        { "delete": { "key": "coupling.tolerance" } },
    ]));
    let advice = case.advice("thermal", "readers of the heat");
    assert_eq!(advice["verdict"], "add");
    assert!(case.edited(&advice["edits"]).run().of("mean-temperature") > 301.0);
}

#[test]
fn rays_are_told_to_be_too_coarse_for_particles_of_a_wavelength() {
    let number = ("optics.fidelity", "size parameter");
    assert_eq!(Case::new(BED, &[LIGHT]).advice(number.0, number.1)["verdict"], "suffices");
    let small = ["particles.radius=\"1 um\"", LIGHT];
    assert_eq!(Case::new(BED, &small).advice(number.0, number.1)["verdict"], "beyond");
}
