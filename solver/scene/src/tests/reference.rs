//! The keys as data, against the keys that are read.

use std::collections::BTreeSet;

use super::{super::*, FULL, parse};

/// The reference's path of a value: a name the user chose becomes NAME.
fn reference_path(path: &str) -> String {
    let parts: Vec<&str> = path.split('.').collect();
    match parts.as_slice() {
        ["nodes", _, "optics", rest @ ..] => {
            std::iter::once("optics").chain(rest.iter().copied()).collect::<Vec<_>>().join(".")
        }
        ["acoustics", shared @ ("path" | "pulses" | "rays"), rest @ ..] => {
            format!("optics.{shared}.{}", rest.join("."))
        }
        ["particles", _, "region", rest @ ..] => format!("particles.FIELD.region.{}", rest.join(".")),
        ["coupling", "fields", _, "acceleration", rest @ ..] => format!("coupling.acceleration.{}", rest.join(".")),
        ["coupling", "fields", _, rest @ ..] => format!("coupling.fields.NAME.{}", rest.join(".")),
        ["particles", "pour", _, "radius", rest @ ..] => format!("particles.radius.{}", rest.join(".")),
        ["particles", "pour", _, rest @ ..] => format!("particles.pour.NAME.{}", rest.join(".")),
        ["substrate", "grids", _, rest @ ..] => format!("substrate.grids.NAME.{}", rest.join(".")),
        ["coupling", "every", ..] => "coupling.every".into(),
        ["solid", "bottom" | "sides" | "left" | "right" | "front" | "back", rest @ ..] => {
            format!("solid.top.{}", rest.join("."))
        }
        [named @ ("walls" | "materials" | "nodes" | "grids"), _, rest @ ..] => {
            std::iter::once(*named).chain(["NAME"]).chain(rest.iter().copied()).collect::<Vec<_>>().join(".")
        }
        ["particles", "pairs", _, rest @ ..] => format!("particles.pairs.NAME.{}", rest.join(".")),
        ["particles", "groups", _, "radius", rest @ ..] => format!("particles.radius.{}", rest.join(".")),
        ["particles", "groups", _, rest @ ..] => format!("particles.groups.NAME.{}", rest.join(".")),
        ["coupling", "tolerance", ..] => "coupling.tolerance".into(),
        _ => path.into(),
    }
}

#[test]
fn every_key_of_the_reference_is_read_and_every_value_read_is_in_it() {
    let pour = "{ a = { disc = { centre = [0, 0, 1], radius = 1 }, mass-rate = 1, material = \"copper\", \
                from = 1, until = 2, limit = 1, seed = 1 }, \
                b = { box = { lower = [0, 0, 0], upper = [1, 1, 1] }, rate = 1, radius = \"1 um\" } }";
    let substrate = "{ wall = \"base\", poisson = 0.2, young = 1e9, deflection = true, points = [[0, 0, -1]], \
                     far-field = { method = \"grouped\", tolerance = 0.1 }, \
                     grids = { top = { lower = [0, 0, -1], upper = [1, 1, -1], spacing = \"1 mm\" } } }";
    let others: &[&[(&str, &str)]] = &[
        &[("walls.base", "{ plane = { normal = [0, 0, 1] } }"), ("substrate", substrate)],
        &[],
        &[("particles.pour", pour), ("particles.domain", "{ lower = [0, 0, 0], upper = [1, 1, 1] }")],
        &[
            ("particles.electromagnetic.charge", "\"1 C/kg\""),
            (
                "particles.magnetic",
                "{ magnetisability = 1, dipole = { at = [0, 0, 0], moment = [0, 0, 1], radius = 1 } }",
            ),
        ],
        &[
            ("particles.electromagnetic.charge", "{ per-area = 1 }"),
            ("particles.bonds", "{ stiffness = \"per-area\", normal-stiffness = 1, shear-stiffness = 1 }"),
        ],
        &[("particles.electromagnetic.charge", "{ per-volume = 1 }")],
        &[
            ("particles.contact", "{ law = \"hertz\", young = \"1 GPa\", poisson = 0.2 }"),
            ("nodes.heat", "{ command = [\"x\"] }"),
        ],
        &[
            ("particles.integrator", "{ substep = \"1 ns\" }"),
            ("optics.profile", "{ kind = \"exponential\", decay = 1e4 }"),
        ],
        &[("optics.path", "{ kind = \"fixed\", at = [0, 0, 0] }")],
        &[
            ("thermal.phases", "{ melting-band = 3, boiling-band = 5, vapour = true }"),
            ("thermal.ambient", "{ convection = 20, emissivity = 0.3, exposed = 0.5 }"),
        ],
        &[
            ("optics.fidelity", "rays"),
            ("optics.refractive-index", "2"),
            ("optics.molten-refractive-index", "1.5"),
            ("materials.copper.refractive-index", "0.3"),
            ("materials.copper.extinction", "7"),
            (
                "acoustics",
                "{ intensity = 1, radius = 1, sound-speed = 1, ends = 2, path = { kind = \"fixed\", at = [0, 0, 0] } }",
            ),
        ],
        &[
            ("particles.contact", "{ law = \"linear\", spring = \"1e5 N/m\", restitution = 0.5 }"),
            ("particles.friction", "{ law = \"spring\", stiffness-ratio = 0.3, damping-ratio = 0.1 }"),
            ("particles.rolling", "{ rolling = 0.1, torsion = 0.1 }"),
            (
                "particles.pairs.own",
                "{ between = [\"copper\", \"copper\"], damping = 1, restitution = 0.5, static = 0.3, dynamic = 0.2, \
                 rolling = 0.1, torsion = 0.1 }",
            ),
            ("particles.overlap-bond", "{ stiffness = \"1e6 Pa\", strain = 0.02 }"),
        ],
        &[
            ("materials.copper.electrical-conductivity", "\"58 MS/m\""),
            ("walls.lid.potential", "0"),
            ("walls.tool.current", "\"1 A\""),
            (
                "current",
                "{ conductance = \"constriction\", by-temperature = { gain = -0.4, rate = 0.01, reference = 800 }, \
                 by-field = { gain = 1, rate = 1e-4, reference = 1e4 }, starts = 0, ends = 1 }",
            ),
        ],
        &[
            ("materials.copper.electrical-conductivity", "1"),
            ("walls.drum.current-density", "\"1e5 A/m^2\""),
            ("current", "{ model = \"averaging\", heat-share = 0.5 }"),
        ],
        &[
            ("materials.copper.relative-atomic-mass", "63.5"),
            (
                "grids.plate",
                "{ lower = [0, 0, -1e-3], upper = [1e-3, 1e-3, 0], cell = 1e-4, fine = { lower = [2e-4, 2e-4, -2e-4], \
                 upper = [4e-4, 4e-4, 0], growth = 1.2 } }",
            ),
            ("optics.fidelity", "\"beer-lambert\""),
            (
                "solid",
                "{ grid = \"plate\", material = \"316L\", wall = \"lid\", melting = true, boiling = true, evaporation = true, \
                 light = { absorptivity = 0.4, absorption = 1e5 }, track = { cooling = [1400, 1200] }, \
                 top = { kind = \"ambient\" }, left = { kind = \"flux\", flux = 1 }, right = { kind = \"held\" } }",
            ),
        ],
        &[
            ("grids.plate", "{ lower = [0, 0, -1e-3], upper = [1e-3, 1e-3, 0], cell = 1e-4 }"),
            ("optics.fidelity", "\"beer-lambert\""),
            ("solid", "{ grid = \"plate\", level = \"explicit\" }"),
        ],
        &[("particles.start", "{ kind = \"lattice\", sphere = \"1 mm\" }")],
        &[("particles.start", "{ kind = \"settle\", box = [2e-4, 2e-4, 2e-4], longest = 1 }")],
        &[("particles.start", "{ cylinder = { radius = \"1 mm\", height = \"1 mm\", axis = \"x\" } }")],
        &[
            (
                "particles",
                "{ start = { kind = \"file\", path = \"bed.csv\", unit = \"mm\", materials = [\"copper\", \"copper\"], \
                 columns = [\"material\"] } }",
            ),
            ("particles.material", "copper"),
        ],
    ];
    let read: BTreeSet<String> = others
        .iter()
        .flat_map(|overrides| parse(FULL, overrides).effective)
        .map(|value| reference_path(&value.path))
        .collect();
    let mut documented = BTreeSet::new();
    for section in Scene::reference().tree() {
        for key in section.keys {
            if !matches!(key.kind, Kind::Table(_) | Kind::Named(_) | Kind::Scenes) {
                documented.insert([section.path, key.name].join(".").trim_start_matches('.').to_owned());
            }
        }
    }
    assert_eq!(read, documented);
}

#[test]
fn conditions_name_keys_and_words_that_exist() {
    for section in Scene::reference().tree() {
        for key in section.keys {
            let Some((other, values)) = key.when else { continue };
            let other = section.keys.iter().find(|key| key.name == other).unwrap();
            let Kind::Choice(words) = other.kind else { panic!("{} is no choice", other.name) };
            assert!(values.iter().all(|value| words.iter().any(|(word, _)| word == value)), "{}", key.name);
        }
    }
}

#[test]
fn every_default_is_a_value_as_it_would_be_written() {
    for section in Scene::reference().tree() {
        for key in section.keys {
            if let Fallback::Is(text) = key.default {
                let value = tree::parse_value(text, Place::Line(1));
                assert!(value.is_some(), "{}.{}: {text}", section.path, key.name);
            }
        }
    }
}
