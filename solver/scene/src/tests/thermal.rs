//! `[thermal]` beyond one material of constant properties.

use super::{super::*, parse, particles_read};
use stagger_physics::thermal::{PhaseChange, Solver, Table};

const BED: &str = r#"
    duration = "1 ms"
    [materials.ink]
    density = 1000
    heat-capacity = [[300, 1000], ["350 K", "1.2 kJ/(kg K)"]]
    conductivity = 0.2
    young = 1e9
    poisson = 0.3
    [particles]
    count = 2
    radius = "20 um"
    start = { box = ["1 mm", "1 mm", "1 mm"] }
    [thermal]
    [coupling]
    dt = "1 us"
"#;

fn told(scene: &str, overrides: &[(&str, &str)]) -> String {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    Scene::parse(scene, "heat.toml", &overrides).unwrap_err().to_string()
}

#[test]
fn a_plain_scene_keeps_the_temperature_form() {
    let scene = parse(BED, &[]);
    let (thermal, particles) = (
        scene.settings::<stagger_physics::thermal::Settings>().unwrap().clone(),
        scene.settings::<stagger_physics::particles::Settings>().unwrap().clone(),
    );
    assert!(thermal.enthalpy.is_none());
    assert!(!particles.come_and_go() && !particles.writes_material);
    assert_eq!(
        (thermal.density_kg_m3, thermal.heat_capacity_j_kg_k, thermal.conductivity_w_m_k),
        (7950.0, 500.0, 15.0)
    );
}

#[test]
fn phases_come_from_the_material_and_vapour_leaves() {
    let scene = parse(BED, &[("thermal.phases", "{ boiling-band = 2 }"), ("thermal.solver", "conjugate-gradient")]);
    let (thermal, particles) = (
        scene.settings::<stagger_physics::thermal::Settings>().unwrap().clone(),
        scene.settings::<stagger_physics::particles::Settings>().unwrap().clone(),
    );
    assert!(particles.come_and_go() && particles_read(&scene, "vapourised") && !particles.writes_material);
    let enthalpy = thermal.enthalpy.unwrap();
    assert_eq!(enthalpy.solver, Solver::ConjugateGradient);
    let phases = enthalpy.materials[0].phases.unwrap();
    assert_eq!(phases.melting.unwrap(), PhaseChange { from_k: 1658.0, width_k: 65.0, latent_j_kg: 2.6e5 });
    assert_eq!(phases.boiling.unwrap(), PhaseChange { from_k: 3134.0, width_k: 2.0, latent_j_kg: 6.1e6 });
    let sharp = parse(BED, &[("thermal.phases", "{ melting-band = 0, vapour = false }")])
        .settings::<stagger_physics::thermal::Settings>()
        .unwrap()
        .clone();
    let phases = sharp.enthalpy.unwrap().materials[0].phases.unwrap();
    assert_eq!((phases.melting.unwrap().width_k, phases.boiling), (0.0, None));
}

#[test]
fn properties_may_be_tables_and_materials_several() {
    let ink =
        parse(BED, &[("particles.material", "ink")]).settings::<stagger_physics::thermal::Settings>().unwrap().clone();
    assert_eq!(ink.heat_capacity_j_kg_k, 1000.0);
    let materials = ink.enthalpy.unwrap().materials;
    assert_eq!(materials[0].heat_capacity_j_kg_k, Table { points: vec![[300.0, 1000.0], [350.0, 1200.0]] });
    assert_eq!(materials[0].conductivity_w_m_k, Table::constant(0.2));

    let group = ("particles.groups.drops", "{ count = 3, radius = \"30 um\", material = \"ink\" }");
    let scene = parse(BED, &[group]);
    let names = |materials: &[stagger_physics::thermal::Material]| -> Vec<String> {
        materials.iter().map(|material| material.name.clone()).collect()
    };
    assert_eq!(
        names(&scene.settings::<stagger_physics::thermal::Settings>().unwrap().clone().enthalpy.unwrap().materials),
        ["316L", "ink"]
    );
    assert!(scene.settings::<stagger_physics::particles::Settings>().unwrap().clone().writes_material);
    let ambient = parse(BED, &[("thermal.ambient.emissivity", "0.3"), ("particles.temperature", "310")]);
    let ambient =
        ambient.settings::<stagger_physics::thermal::Settings>().unwrap().enthalpy.clone().unwrap().ambient.unwrap();
    assert_eq!((ambient.temperature_k, ambient.emissivity, ambient.exposed), (310.0, 0.3, 1.0));
}

#[test]
fn what_is_missing_or_cannot_be_is_told() {
    let ink = told(BED, &[("particles.material", "ink"), ("thermal.phases", "{}")]);
    for name in ["solidus", "liquidus", "melting-heat", "boiling", "boiling-heat"] {
        assert!(ink.contains(&format!("the material \"ink\" has no `{name}`")), "{name}: {ink}");
    }
    let order = told(BED, &[("materials.316L", "{ solidus = 1800, boiling = 1700 }")]);
    assert!(order.contains("materials.316L.liquidus: expected at least the solidus, 1800 K, found 1723 K"), "{order}");
    assert!(
        order.contains("materials.316L.boiling: expected above the end of melting, 1723 K, found 1700 K"),
        "{order}"
    );
    for (table, said) in [
        ("[[300, 1], [300, 2]]", "found 300 K, which does not rise, in pair 2"),
        ("[[300, 1], 2]", "found 2 in pair 2"),
        ("[[300, 1, 2]]", "found a list of 3 in pair 1"),
        ("[[300, 0]]", "found 0 in pair 1"),
        ("[]", "found an empty list"),
    ] {
        let told = told(BED, &[("materials.ink.heat-capacity", table)]);
        assert!(told.contains(said), "{table}: {told}");
    }
    let light = "{ power = 1, profile = { radius = 1e-5 }, path = { kind = \"fixed\", at = [0, 0, 0] } }";
    let group = ("particles.groups.drops", "{ count = 3, radius = \"30 um\", material = \"ink\" }");
    let two = told(BED, &[group, ("optics", light)]);
    assert!(
        two.contains("the particles are of 316L, ink, but the physics that need their `absorption` take one material"),
        "{two}"
    );
}
