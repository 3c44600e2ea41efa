//! Runs the shortened scenes of `tests/scenes/hashes.txt` with the solver alone, in one process, and compares the hashes of
//! their final fields with those of the file: small enough for an emulated processor.
//!
//!     cargo run --release -p stagger-scene --example scene_hash -- tests/scenes/hashes.txt scenes [SCENE]

// An example's results go to its standard output.
#![allow(clippy::print_stdout)]

use std::{collections::BTreeMap, env, error::Error, fs, path::Path, process::ExitCode};

use stagger_coupling::{CouplingController, InProcess, Listener, Outcome};
use stagger_messages::{Decision, Ready, codec};
use stagger_scene::Scene;

struct Silent;

impl Listener for Silent {
    fn started(&mut self, _ready: &[(String, Ready)]) {}

    fn decided(&mut self, _decision: &Decision, _outcomes: &[Outcome]) -> bool {
        true
    }
}

/// The hash that the summary of `stagger run` shows.
fn hash(scene: &Scene) -> Result<String, Box<dyn Error>> {
    let mut ensemble = InProcess::new(scene.participants()?);
    let ports = ensemble.ports();
    let plan = stagger_coupling::plan(&ports, &scene.coupling)?;
    let mut controller =
        CouplingController::new(&scene.coupling, &plan, &stagger_coupling::measured(&ports, &plan), scene.duration_s);
    stagger_coupling::run_loop(&mut ensemble, &plan, &mut controller, 0, &mut Silent)?;
    let mut hashes = BTreeMap::new();
    for (node, fields) in ensemble.committed() {
        for field in fields.values() {
            let name = field.name();
            let name = if hashes.contains_key(name) { format!("{node}/{name}") } else { name.to_owned() };
            hashes.insert(name, field.hash());
        }
    }
    let bytes = hashes.iter().flat_map(|(name, hash)| [name.as_bytes(), &hash.to_le_bytes()].concat());
    Ok(format!("{:016x}", codec::hash(&bytes.collect::<Vec<u8>>())))
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [table, folder, only @ ..] = &arguments[..] else {
        return Err("expected the file of hashes, the folder of the scenes and, if not all, names of scenes".into());
    };
    if let Ok(width) = env::var("STAGGER_SIMD") {
        stagger_physics::common::width::set(&width)?;
    }
    let mut different = false;
    for line in fs::read_to_string(table)?.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [name, set, expected] = words[..] else { return Err(format!("{table}: {line}").into()) };
        if !only.is_empty() && !only.iter().any(|only| only == name) {
            continue;
        }
        let (key, value) = set.split_once('=').ok_or_else(|| format!("{table}: {set} is no override"))?;
        let read = |path: &str| fs::read(Path::new(folder).join(path)).map_err(|error| error.to_string());
        let text = fs::read_to_string(Path::new(folder).join(name))?;
        let scene = Scene::parse_with_files(&text, name, &[(key.into(), value.into())], &read)?;
        let found = hash(&scene)?;
        different |= found != expected;
        println!("{name} {set} {found}{}", if found == expected { "" } else { " DIFFERS" });
    }
    Ok(if different { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
