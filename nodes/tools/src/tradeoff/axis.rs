//! The settings that trade speed for accuracy, each with values around what a scene has.

use stagger_physics::{
    optics,
    particles::{self, Integrator},
    substrate,
};
use stagger_scene::Scene;

/// Overrides `--set key=value`.
pub type Set = Vec<(String, String)>;

/// A setting and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its name on the command line.
    pub name: String,
    /// Values to try.
    pub points: Vec<Point>,
}

/// A value of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// What it is called in tables.
    pub label: String,
    /// What it sets.
    pub set: Set,
}

/// Names of all built-in axes.
pub const NAMES: [&str; 19] = [
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

fn set(key: &str, value: impl ToString) -> (String, String) {
    (key.into(), value.to_string())
}

/// A number without the last digits, where scaling has left rounding.
fn plain(value: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    format!("{rounded:e}")
}

fn times(factor: f64) -> String {
    if factor >= 1.0 { format!("x {factor}") } else { format!("/ {}", (1.0 / factor).round()) }
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

/// Velocity Verlet in substeps of at most this.
pub fn verlet(substep_s: f64) -> Set {
    vec![set("particles.integrator", format!("{{ kind = \"verlet\", substep = {} }}", plain(substep_s)))]
}

/// Whether a scene's particles move in substeps of their own.
pub fn has_substeps(scene: &Scene) -> bool {
    let moved = scene.settings::<particles::Settings>().map(|particles| &particles.integrator);
    matches!(moved, Some(Integrator::Verlet { .. }))
}

/// Sampling of the light, `factor` times as fine.
pub fn light(scene: &Scene, factor: f64) -> Set {
    match scene.settings::<optics::Settings>().map(|optics| &optics.model) {
        Some(optics::Model::BeerLambert { spacing_m, .. }) => {
            vec![set("optics.spacing", plain(spacing_m / factor))]
        }
        // As many times more rays as there would be lines.
        Some(optics::Model::Rays { sampling, .. }) => {
            let count = (sampling.count as f64 * factor * factor).round().clamp(1.0, 16_777_216.0);
            vec![set("optics.rays.count", count as u64)]
        }
        _ => Vec::new(),
    }
}

/// The built-in axes that mean something for a scene, whose particles moved in substeps of `substep_s` when it ran as it
/// stands. Points that the scene already has are left out.
pub fn all(scene: &Scene, substep_s: Option<f64>) -> Vec<Axis> {
    let mut axes: Vec<Axis> =
        NAMES.into_iter().map(|name| Axis { name: name.into(), points: points(name, scene, substep_s) }).collect();
    axes.retain(|axis| !axis.points.is_empty());
    axes
}

fn points(axis: &str, scene: &Scene, substep_s: Option<f64>) -> Vec<Point> {
    let point = |label: String, set: Set| Point { label, set };
    let scaled = |factors: &[f64], name: &str, set: &dyn Fn(f64) -> Set| -> Vec<Point> {
        factors.iter().map(|factor| point(format!("{name} {}", times(*factor)), set(*factor))).collect()
    };
    let choice = |key: &str, words: &[&str]| -> Vec<Point> {
        let name = key.rsplit('.').next().unwrap_or(key);
        let mut points: Vec<Point> =
            words.iter().map(|word| point(format!("{name} {word}"), vec![set(key, format!("\"{word}\""))])).collect();
        points.retain(|point| !stands(scene, &point.set));
        points
    };
    let numbers = |key: &str, name: &str, values: &[f64]| -> Vec<Point> {
        let mut points: Vec<Point> =
            values.iter().map(|value| point(format!("{name} {value}"), vec![set(key, value)])).collect();
        points.retain(|point| !stands(scene, &point.set));
        points
    };
    // Where a single physics runs, there is nothing to iterate on.
    let coupled = scene.built_in_nodes().len() > 1;
    let particles = scene.settings::<particles::Settings>();
    let moving = particles.filter(|particles| particles.integrator != Integrator::Held);
    match axis {
        "dt" => scaled(&[0.25, 0.5, 2.0, 4.0, 8.0], "dt", &|factor| step(scene, factor)),
        "tolerance" if coupled => scaled(&[1e-2, 1e2, 1e4], "tolerance", &|factor| tolerances(scene, factor)),
        "iterations" if coupled => numbers("coupling.iterations", "iterations", &[3.0, 5.0, 8.0, 12.0]),
        "order" if coupled => choice("coupling.order", &["gauss-seidel", "jacobi"]),
        "acceleration" if coupled => choice("coupling.acceleration", &["none", "aitken", "iqn-ils"]),
        "frozen" if coupled => choice("coupling.frozen", &["interpolated", "held"]),
        "reuse" if coupled => numbers("coupling.reuse", "reuse", &[0.0, 0.1, 1.0]),
        "every" => {
            let slower = [
                ("optics", scene.physics.contains_key("optics")),
                ("current", scene.physics.contains_key("current")),
                ("acoustics", scene.physics.contains_key("acoustics")),
                ("substrate", scene.physics.contains_key("substrate")),
                ("thermal", scene.physics.contains_key("thermal")),
            ];
            let named = |node: &str| !scene.nodes.contains_key(node) && !scene.coupling.every.contains_key(node);
            slower
                .into_iter()
                .filter(|(node, runs)| *runs && named(node))
                .map(|(node, _)| point(format!("{node} every 10"), vec![set(&format!("coupling.every.{node}"), 10)]))
                .collect()
        }
        "integrator" if has_substeps(scene) => ["0.5", "1"]
            .map(|phi| {
                let value = format!("{{ kind = \"trapezoidal\", phi = {phi} }}");
                point(format!("trapezoidal phi {phi}"), vec![set("particles.integrator", value)])
            })
            .into(),
        "substep" => match substep_s.filter(|_| has_substeps(scene)) {
            Some(own) => scaled(&[0.25, 0.5, 2.0, 3.0], "substep", &|factor| verlet(own * factor)),
            None => Vec::new(),
        },
        "spin" if moving.is_some_and(|particles| particles.friction.is_some()) => {
            let other = particles.is_some_and(|particles| !particles.spin);
            vec![point(format!("spin {other}"), vec![set("particles.spin", other)])]
        }
        "skin" if moving.is_some() => numbers("particles.skin", "skin", &[0.1, 0.3, 0.6, 1.0]),
        "cut-off" => cut_offs(scene),
        "phi" if scene.physics.contains_key("thermal") => numbers("thermal.phi", "phi", &[0.0, 0.5, 1.0]),
        "heat-solver" if scene.physics.contains_key("thermal") => {
            choice("thermal.solver", &["fixed-point", "conjugate-gradient"])
        }
        "fidelity" if scene.physics.contains_key("optics") => {
            choice("optics.fidelity", &["energy-balance", "beer-lambert", "beer-lambert-monograph", "rays"])
        }
        "light" => {
            let mut points = scaled(&[0.25, 0.5, 2.0], "light", &|factor| light(scene, factor));
            points.retain(|point| !point.set.is_empty());
            points
        }
        "substrate" => match scene.settings::<substrate::Settings>() {
            Some(substrate) if substrate.far_field_tolerance.is_none() => [1e-3, 1e-2, 1e-1]
                .map(|tolerance| {
                    let value = format!("{{ method = \"grouped\", tolerance = {tolerance:e} }}");
                    point(format!("far field {tolerance:e}"), vec![set("substrate.far-field", value)])
                })
                .into(),
            Some(_) => vec![point("far field none".into(), vec![set("substrate.far-field", "{ method = \"none\" }")])],
            None => Vec::new(),
        },
        "recording" => {
            let with = |label: &str, level: &str, every: u32| {
                let level = format!("\"{level}\"");
                let set = vec![set("record.level", level), set("record.every", every), set("record.frames", 100)];
                point(format!("recording {label}"), set)
            };
            vec![with("all", "all", 1), with("accepted", "accepted", 1), with("every 10th", "accepted", 10)]
        }
        _ => Vec::new(),
    }
}

/// Cut-offs of the near field: about the scene's own, or, where all pairs are summed, by the largest mean diameter.
fn cut_offs(scene: &Scene) -> Vec<Point> {
    let Some((particles, near)) = scene
        .settings::<particles::Settings>()
        .and_then(|particles| Some((particles, particles.fields.near_field.as_ref()?)))
    else {
        return Vec::new();
    };
    let radius_m = particles.groups.iter().map(|group| group.radius.mean_m()).fold(0.0, f64::max);
    let cut_off = |label: String, cut_off_m: f64| Point {
        label: format!("cut-off {label}"),
        set: vec![set("particles.near-field.cut-off", plain(cut_off_m))],
    };
    match near.cutoff_m {
        Some(own_m) => [0.5, 2.0].map(|factor| cut_off(times(factor), own_m * factor)).into(),
        None if radius_m > 0.0 => [2.0, 4.0, 8.0]
            .map(|diameters| cut_off(format!("{diameters} diameters"), 2.0 * diameters * radius_m))
            .into(),
        None => Vec::new(),
    }
}

/// Whether a scene has these values already.
fn stands(scene: &Scene, set: &Set) -> bool {
    set.iter().all(|(key, value)| {
        let bare = value.trim_matches('"');
        scene.effective.iter().any(|own| {
            let of_key = own.path == *key
                || own.path.strip_prefix(key.as_str()).is_some_and(|rest| matches!(rest, ".method" | ".kind"));
            of_key
                && (own.value == bare
                    || (!own.si.is_empty() && bare.parse().is_ok_and(|number: f64| own.si == [number])))
        })
    })
}

/// Settings far tighter than the scene's, `tighter` times for steps, within what the program can do: what errors are measured
/// against.
pub fn tight(scene: &Scene, substep_s: Option<f64>, tighter: f64) -> Set {
    let mut all = step(scene, 1.0 / tighter);
    all.extend(tolerances(scene, 0.04 / tighter));
    all.push(set("coupling.iterations", (2 * scene.coupling.iterations).clamp(20, 100)));
    all.push(set("coupling.reuse", 0));
    if let Some(own) = substep_s.filter(|_| has_substeps(scene)) {
        all.extend(verlet(own / tighter));
    }
    all.extend(light(scene, tighter.sqrt()));
    if scene.settings::<substrate::Settings>().is_some_and(|substrate| substrate.far_field_tolerance.is_some()) {
        all.push(set("substrate.far-field", "{ method = \"none\" }"));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

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
