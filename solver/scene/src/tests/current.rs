//! `[current]` and the electrical keys of walls and materials.

use super::{super::*, SHORT, parse};
use stagger_physics::{
    common::{Conductance, walls::Electrode},
    current::{Method, Model, Transition},
};

const PLATES: [(&str, &str); 2] = [
    ("walls.below", "{ plane = { normal = [0, 0, 1] }, potential = 0, current-density = \"1e5 A/m^2\" }"),
    ("walls.above", "{ plane = { through = [0, 0, 1], normal = [0, 0, -1] }, current = \"2 A\" }"),
];

fn with(current: &str) -> Scene {
    parse(SHORT, &[&PLATES[..], &[("current", current)]].concat())
}

#[test]
fn what_the_scene_says_reaches_the_current() {
    let scene = with(
        "{ conductance = \"constriction\", by-temperature = { gain = -0.4, rate = \"0.01 1/K\", reference = \"800 K\" }, \
         starts = \"1 ms\", ends = \"2 ms\", solver = \"jacobi\", tolerance = 1e-9, iterations = 77 }",
    );
    let current = scene.settings::<stagger_physics::current::Settings>().unwrap().clone();
    assert_eq!(current.model, Model::Potential { conductance: Conductance::Constriction });
    assert_eq!((current.starts_s, current.ends_s), (1e-3, 2e-3));
    assert_eq!(
        (current.solver.method, current.solver.tolerance, current.solver.iterations),
        (Method::Jacobi, 1e-9, 77)
    );
    assert_eq!(current.conductivity.reference_s_m, 1.33e6, "316L");
    let step = Transition { gain: -0.4, rate: 0.01, reference: 800.0 };
    assert_eq!((current.conductivity.by_temperature, current.conductivity.by_field), (Some(step), None));
    let reads = |scene: &Scene| scene.physics["current"].ports().reads.iter().any(|port| port.field == "temperature");
    assert!(reads(&scene) && !reads(&with("{}")));
    let held = current.walls.iter().map(|wall| wall.electrode).collect::<Vec<_>>();
    let below = Electrode { potential_v: Some(0.0), current_density_a_m2: Some(1e5), current_a: None };
    assert_eq!(held, [below, Electrode { current_a: Some(2.0), ..Electrode::default() }]);
}

#[test]
fn without_a_table_nothing_is_electric_and_defaults_conserve_energy() {
    let scene = parse(SHORT, &PLATES);
    assert!(!scene.physics.contains_key("current"));
    let current = with("{}").settings::<stagger_physics::current::Settings>().unwrap().clone();
    assert_eq!(current.model, Model::Potential { conductance: Conductance::Monograph });
    assert_eq!((current.starts_s, current.ends_s), (0.0, f64::INFINITY));
    assert_eq!((current.solver.method, current.solver.tolerance), (Method::ConjugateGradient, 1e-12));
    let averaging = with("{ model = \"averaging\" }").settings::<stagger_physics::current::Settings>().unwrap().clone();
    assert_eq!(averaging.model, Model::Averaging { heat_share: 1.0 });
}
