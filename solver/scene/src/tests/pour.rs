//! Dispensers and the domain, as a scene names them.

use stagger_physics::{
    particles::{PourRegion, Radius, Settings},
    thermal,
};

use crate::Scene;

const SCENE: &str = r#"
    duration = "1 ms"
    seed = 5
    [particles]
    count = 0
    radius = "20 um"
    start = { box = ["1 mm", "1 mm", "1 mm"] }
    [particles.pour.hopper]
    disc = { centre = [0, 0, "3 mm"], radius = "0.5 mm" }
    mass-rate = "2 g/s"
    until = "3 ms"
    [particles.pour.second]
    box = { lower = [0, 0, "1 mm"], upper = ["1 mm", "1 mm", "2 mm"] }
    rate = "2 1/s"
    radius = { mean = "40 um", spread = "10 um" }
    limit = 12
    seed = 3
    [particles.domain]
    lower = ["-1 mm", "-1 mm", "-1 mm"]
    upper = ["1 mm", "1 mm", "4 mm"]
    [thermal]
    [coupling]
    dt = { start = "1 us", limit = "20 us" }
"#;

#[test]
fn dispensers_and_domain_are_read() {
    let scene = Scene::parse(SCENE, "pour.toml", &[]).unwrap();
    let particles = scene.settings::<Settings>().unwrap();
    let [hopper, second] = &particles.pours[..] else { panic!("{:?}", particles.pours) };
    assert_eq!((hopper.name.as_str(), hopper.seed, hopper.limit, hopper.until_s), ("hopper", 5, None, 3e-3));
    assert_eq!(hopper.region, PourRegion::Disc { centre_m: [0.0, 0.0, 3e-3], radius_m: 5e-4 });
    // 2 g/s of spheres of 20 µm: ρ 4/3 π R³ each.
    let mass_kg = particles.materials[0].density_kg_m3 * 4.0 / 3.0 * std::f64::consts::PI * 8e-15;
    assert!((hopper.rate_1_s * mass_kg / 2e-3 - 1.0).abs() < 1e-12, "{}", hopper.rate_1_s);
    assert_eq!((second.rate_1_s, second.limit, second.seed, second.material), (2.0, Some(12), 3, 0));
    assert_eq!(second.radius, Radius::Uniform { mean_m: 4e-5, spread_m: 1e-5 });
    assert_eq!(particles.domain.unwrap().upper_m, [1e-3, 1e-3, 4e-3]);
}

#[test]
fn where_a_dispenser_pours_all_particles_neither_their_count_nor_their_start_is_asked_for() {
    let poured = SCENE.replace("count = 0\n", "").replace("start = { box = [\"1 mm\", \"1 mm\", \"1 mm\"] }\n", "");
    let scene = Scene::parse(&poured, "pour.toml", &[]).unwrap();
    assert_eq!(
        (scene.settings::<Settings>().unwrap().count(), scene.settings::<thermal::Settings>().unwrap().count),
        (0, 0)
    );
    let some = poured.replace("[particles]", "[particles]\ncount = 1");
    let told = Scene::parse(&some, "pour.toml", &[]).unwrap_err().to_string();
    assert!(told.contains("particles.start: missing"), "{told}");
}

#[test]
fn a_dispenser_may_pour_another_material() {
    let scene = SCENE.replace("[thermal]", "").replace("limit = 12", "limit = 12\nmaterial = \"AlSi10Mg\"");
    let scene = Scene::parse(&scene, "pour.toml", &[]).unwrap();
    let particles = scene.settings::<Settings>().unwrap();
    let names: Vec<&str> = particles.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["316L", "AlSi10Mg"]);
    assert_eq!([0, 1].map(|pour: usize| particles.pours[pour].material), [0, 1]);
}

#[test]
fn every_mistake_of_a_dispenser_is_told() {
    let wrong = SCENE
        .replace("mass-rate = \"2 g/s\"", "mass-rate = \"2 g/s\"\nrate = \"1 1/s\"")
        .replace("until = \"3 ms\"", "from = \"4 ms\"\nuntil = \"3 ms\"")
        .replace("upper = [\"1 mm\", \"1 mm\", \"2 mm\"]", "upper = [\"1 mm\", \"1 mm\", \"1.05 mm\"]")
        .replace("upper = [\"1 mm\", \"1 mm\", \"4 mm\"]", "upper = [\"1 mm\", \"1 mm\", \"-1 mm\"]");
    let told = Scene::parse(&wrong, "pour.toml", &[]).unwrap_err().to_string();
    for said in [
        "a rate or a mass-rate, not both",
        "expected a time after it opens",
        "edges of at least the largest diameter, 1e-4 m",
        "above the lower corner along every axis",
    ] {
        assert!(told.contains(said), "{said}: {told}");
    }
    let none = SCENE.replace("disc = { centre = [0, 0, \"3 mm\"], radius = \"0.5 mm\" }", "");
    assert!(Scene::parse(&none, "pour.toml", &[]).unwrap_err().to_string().contains("expected a box or a disc"));
}
