//! The settings that trade speed for accuracy, each with values around what a scene has: those of the coupling, which are here,
//! and those of each physics, which its folder holds.

pub use stagger_physics::common::tradeoff::{Point, Set, Setup};
use stagger_physics::common::tradeoff::{Tradeoff, plain, scaled, set};
use stagger_scene::{Scene, built_in::BUILT_IN};

/// A setting and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its name on the command line.
    pub name: String,
    /// Values to try.
    pub points: Vec<Point>,
}

/// Axes of the coupling.
const COUPLING: [&str; 8] = ["dt", "tolerance", "iterations", "order", "acceleration", "frozen", "reuse", "every"];
/// The axis of what is recorded.
pub const RECORDING: &str = "recording";

/// What each physics contributes.
pub fn contributions() -> impl Iterator<Item = &'static Tradeoff> {
    BUILT_IN.iter().filter_map(|kind| kind.tradeoff)
}

/// A scene as the physics see it, whose particles moved in substeps of `substep_s` when it ran as it stands.
#[must_use]
pub fn setup(scene: &Scene, substep_s: Option<f64>) -> Setup<'_> {
    Setup { values: &scene.effective, tables: scene.tables(), substep_s }
}

/// The step `factor` times as large as the scene's.
pub fn step(scene: &Scene, factor: f64) -> Set {
    let dt = &scene.coupling.dt;
    let limit = dt.limit_s * factor;
    let (start, minimum, growth) = (dt.start_s.min(limit), dt.minimum_s.min(limit), dt.growth);
    let [start, limit, minimum] = [start, limit, minimum].map(plain);
    vec![set(
        "coupling.dt",
        format!("{{ start = {start}, limit = {limit}, minimum = {minimum}, growth = {growth:?} }}"),
    )]
}

/// Every tolerance `factor` times as large, within what a tolerance may be.
pub fn tolerances(scene: &Scene, factor: f64) -> Set {
    let scaled = |tolerance: f64| plain((tolerance * factor).clamp(1e-14, 0.1));
    let named =
        scene.coupling.tolerance.iter().map(|(field, own)| (format!("coupling.tolerance.{field}"), scaled(*own)));
    named.chain([set("coupling.default-tolerance", scaled(scene.coupling.default_tolerance))]).collect()
}

/// The built-in axes that mean something for a scene, whose particles moved in substeps of `substep_s` when it ran as it
/// stands. Points that the scene already has are left out.
#[must_use]
pub fn all(scene: &Scene, substep_s: Option<f64>) -> Vec<Axis> {
    let setup = setup(scene, substep_s);
    let axis = |name: &str, points| Axis { name: name.into(), points };
    let coupling = COUPLING.into_iter().map(|name| axis(name, of_coupling(name, scene, &setup)));
    let physics = contributions().flat_map(|own| own.axes).map(|own| axis(own.name, (own.points)(&setup)));
    let mut axes: Vec<Axis> = coupling.chain(physics).chain([axis(RECORDING, recordings())]).collect();
    axes.retain(|axis| !axis.points.is_empty());
    axes
}

fn of_coupling(axis: &str, scene: &Scene, setup: &Setup<'_>) -> Vec<Point> {
    // Where a single physics runs, there is nothing to iterate on.
    let coupled = scene.built_in_nodes().len() > 1;
    match axis {
        "dt" => scaled(&[0.25, 0.5, 2.0, 4.0, 8.0], "dt", |factor| step(scene, factor)),
        "tolerance" if coupled => scaled(&[1e-2, 1e2, 1e4], "tolerance", |factor| tolerances(scene, factor)),
        "iterations" if coupled => setup.numbers("coupling.iterations", "iterations", &[3.0, 5.0, 8.0, 12.0]),
        "order" if coupled => setup.words("coupling.order", &["gauss-seidel", "jacobi"]),
        "acceleration" if coupled => setup.words("coupling.acceleration", &["none", "aitken", "iqn-ils"]),
        "frozen" if coupled => setup.words("coupling.frozen", &["interpolated", "held"]),
        "reuse" if coupled => setup.numbers("coupling.reuse", "reuse", &[0.0, 0.1, 1.0]),
        "every" => every(scene),
        _ => Vec::new(),
    }
}

/// Slower turns of each physics but that of the bodies, whose motion sets the pace, where the scene says nothing of its node.
fn every(scene: &Scene) -> Vec<Point> {
    let mut slower: Vec<_> = BUILT_IN.iter().filter(|kind| kind.bodies.is_none()).collect();
    slower.sort_by_key(|kind| kind.rank);
    let names = slower.into_iter().map(|kind| kind.name).filter(|name| {
        let said = scene.nodes.contains_key(*name) || scene.coupling.every.contains_key(*name);
        scene.physics.contains_key(name) && !said
    });
    names.map(|name| Point::of(format!("{name} every 10"), &format!("coupling.every.{name}"), 10)).collect()
}

fn recordings() -> Vec<Point> {
    let with = |label: &str, level: &str, every: u32| {
        let level = format!("\"{level}\"");
        let set = vec![set("record.level", level), set("record.every", every), set("record.frames", 100)];
        Point { label: format!("recording {label}"), set }
    };
    vec![with("all", "all", 1), with("accepted", "accepted", 1), with("every 10th", "accepted", 10)]
}

/// Settings far tighter than the scene's, `tighter` times for steps, within what the program can do: what errors are measured
/// against.
#[must_use]
pub fn tight(scene: &Scene, substep_s: Option<f64>, tighter: f64) -> Set {
    let mut all = step(scene, 1.0 / tighter);
    all.extend(tolerances(scene, 0.04 / tighter));
    all.push(set("coupling.iterations", (2 * scene.coupling.iterations).clamp(20, 100)));
    all.push(set("coupling.reuse", 0));
    let setup = setup(scene, substep_s);
    all.extend(contributions().flat_map(|own| (own.tighter)(&setup, tighter)));
    all
}

#[cfg(test)]
mod tests {
    use stagger_physics::{
        optics,
        particles::{self, Integrator},
    };

    use super::*;

    /// All axes, in their order.
    const NAMES: [&str; 19] = [
        "dt",
        "tolerance",
        "iterations",
        "order",
        "acceleration",
        "frozen",
        "reuse",
        "every",
        "integrator",
        "substep",
        "spin",
        "skin",
        "cut-off",
        "phi",
        "heat-solver",
        "fidelity",
        "light",
        "substrate",
        "recording",
    ];

    fn scene() -> Scene {
        let text = "duration = 1\n[particles]\ncount = 1\nradius = 1e-5\nfriction = \"spring\"\nstart = { box = [1e-3, 1e-3, 1e-3] }\n\
            near-field = { attraction = 1, repulsion = 1 }\n[thermal]\n[optics]\nabsorption = 1e4\npower = 1\n\
            profile = { radius = 1e-4 }\npath = { kind = \"fixed\", at = [0, 0, 0] }\n\
            [substrate]\nwall = \"plate\"\npoints = [[0, 0, -1e-5]]\n[walls.plate]\nplane = { normal = [0, 0, 1] }\n\
            [coupling]\ndt = { start = 1e-6, limit = 2e-5 }\ntolerance = { positions = 1e-7 }";
        Scene::parse(text, "a.toml", &[]).unwrap()
    }

    #[test]
    fn every_axis_of_a_scene_with_all_physics_has_values_the_scene_can_take_and_has_not() {
        let scene = scene();
        let axes = all(&scene, Some(1e-7));
        let names: Vec<&str> = axes.iter().map(|axis| axis.name.as_str()).collect();
        assert_eq!(names, NAMES);
        for Point { label, set } in axes.iter().flat_map(|axis| &axis.points) {
            match Scene::parse(&scene.text, "a.toml", set) {
                Ok(other) => assert_ne!(other.effective, scene.effective, "{label}"),
                // The material has no refractive index.
                Err(problems) => assert!(label == "fidelity rays", "{label}: {problems}"),
            }
        }
    }

    #[test]
    fn the_reference_is_tighter_in_every_way() {
        let scene = scene();
        let tight = Scene::parse(&scene.text, "a.toml", &tight(&scene, Some(1e-7), 4.0)).unwrap();
        assert_eq!((tight.coupling.dt.limit_s, tight.coupling.dt.start_s), (5e-6, 1e-6));
        assert_eq!((tight.coupling.tolerance_of("positions"), tight.coupling.tolerance_of("a")), (1e-9, 1e-8));
        assert_eq!((tight.coupling.iterations, tight.coupling.reuse), (20, 0.0));
        let Some(Integrator::Verlet { substep_s }) =
            tight.settings::<particles::Settings>().map(|particles| particles.integrator)
        else {
            panic!()
        };
        assert_eq!(substep_s, Some(2.5e-8));
        let Some(optics::Model::BeerLambert { spacing_m, .. }) =
            tight.settings::<optics::Settings>().map(|optics| optics.model)
        else {
            panic!()
        };
        assert_eq!(spacing_m, 1.25e-6);
    }
}
