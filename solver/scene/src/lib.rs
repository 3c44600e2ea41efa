//! A scene: one TOML text from which everything a run depends on is read, checked, and shown.
//!
//! A bare number is in SI units; a text carries its unit. [`Scene::parse`] reports every mistake at once, each with
//! file, line, key, what was expected and what was found. The keys are data ([`Scene::reference`]), from which
//! `docs/scene.md` and `docs/scene.schema.json` are made.

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod acceleration;
mod acoustics;
pub mod advice;
mod bonds;
mod contact;
mod coupling;
mod current;
mod fields;
mod groups;
mod materials;
mod nodes;
mod optics;
mod pairs;
mod particle_file;
mod particles;
mod pour;
mod rays;
mod recovery;
mod start;
mod substrate;
mod thermal;
mod walls;

use std::{borrow::Cow, collections::BTreeMap};

pub use stagger_config::Value;
pub use stagger_config::files::{Files, ReadFile};
pub use stagger_config::key::{Fallback, Key, Kind, Range, Section};
pub use stagger_config::presets::STANDARD;
use stagger_config::problems::{Mistake, Place};
pub use stagger_config::problems::{Problem, Problems};
use stagger_config::reader::{Log, Table};
use stagger_config::tree::{Entry, Item, Node};
pub use stagger_config::units;
use stagger_config::{files, presets, tree};

use stagger_coupling::Settings as CouplingSettings;
use stagger_physics::{
    acoustics::Settings as AcousticsSettings,
    common::Wall,
    current::Settings as CurrentSettings,
    optics::Settings as OpticsSettings,
    particles::{Settings as ParticlesSettings, Start},
    substrate::Settings as SubstrateSettings,
    thermal::Settings as ThermalSettings,
};

/// Everything a run depends on. SI units.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Title; the file's name where the scene gives none.
    pub title: String,
    /// Simulated time, in s.
    pub duration_s: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// Walls, in the order of the scene.
    pub walls: Vec<Wall>,
    /// The particles, where the scene names them.
    pub particles: Option<ParticlesSettings>,
    /// Their temperature, where the scene names it.
    pub thermal: Option<ThermalSettings>,
    /// The laser, where the scene names it.
    pub optics: Option<OpticsSettings>,
    /// The electrical current, where the scene names it.
    pub current: Option<CurrentSettings>,
    /// Stress in the solid under a wall, where the scene names it.
    pub substrate: Option<SubstrateSettings>,
    /// The sound, where the scene names it.
    pub acoustics: Option<AcousticsSettings>,
    /// Where the materials begin to melt, in K, by name, where it is known.
    pub solidus_k: BTreeMap<String, f64>,
    /// Nodes that are not simply a built-in physics, by name.
    pub nodes: BTreeMap<String, NodeSettings>,
    /// How the physics are coupled.
    pub coupling: CouplingSettings,
    /// What is recorded.
    pub record: RecordSettings,
    /// What happens when a node dies.
    pub recovery: RecoverySettings,
    /// Names of its presets; [`STANDARD`] is always among them.
    pub presets: Vec<String>,
    /// What errors of the scene are measured by, in the words of `[tradeoff]`; empty where it leaves that to the program.
    pub quantities: Vec<String>,
    /// The files the scene names, by their paths as it writes them.
    pub files: Files,
    /// Hash of every value in force and of the files: what names the scene in a manifest and a recording.
    pub hash: u64,
    /// The text, without the overrides.
    pub text: String,
    /// The overrides `--set key=value`, in their order.
    pub overrides: Vec<(String, String)>,
    /// Every value in effect, given or default, section by section.
    pub effective: Vec<Value>,
}

/// A node of the user's own, or a built-in physics under another name; exactly one of the two is there.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeSettings {
    /// The built-in physics it runs: `particles`, `thermal`, `optics`, `current`, `substrate` or `acoustics`.
    pub physics: Option<String>,
    /// The program that runs instead, and its arguments.
    pub command: Option<Vec<String>>,
    /// Settings of its own, for a node with the physics `optics`: the scene's [`Scene::optics`] is then not its.
    pub optics: Option<OpticsSettings>,
}

/// What is recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordSettings {
    /// Which states.
    pub level: Level,
    /// Steps from one recorded step to the next; at least 1.
    pub every: u64,
    /// The fields to keep; `None` keeps all.
    pub fields: Option<Vec<String>>,
    /// Pictures for other programs' viewers over the duration; 0 takes none.
    pub frames: u64,
    /// Bytes that may wait to be written before the coordinator waits.
    pub buffer_bytes: u64,
}

/// What happens when a node dies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecoverySettings {
    /// Accepted steps from one checkpoint to the next; 0 takes none, and a node that dies then ends the run.
    pub checkpoint_steps: u64,
    /// Times that nodes may be started again in one run.
    pub restarts: u32,
    /// How long a node may work on one answer before it is taken for dead, in s.
    pub hang_s: f64,
    /// How long nodes have to announce themselves, in s.
    pub start_s: f64,
}

impl Default for RecoverySettings {
    fn default() -> Self {
        Self { checkpoint_steps: 50, restarts: 3, hang_s: 600.0, start_s: 30.0 }
    }
}

/// Which states are recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Every exchange of every iteration.
    All,
    /// Accepted states only.
    Accepted,
}

static TITLE: Key = Key::new("title", Kind::Text, "What the run shows.").or_from("the file's name");
static DURATION: Key = Key::new("duration", Kind::Number(&units::TIME, Range::POSITIVE), "Simulated time.");
static SEED: Key = Key::new("seed", Kind::Whole(0, i64::MAX as u64), "Seed of everything random.").or("1");
static MATERIALS: Key =
    Key::new("materials", Kind::Named(&materials::SECTION), "Materials beside the built-in ones.").or_from("none");
static PARTICLES: Key = Key::new("particles", Kind::Table(&particles::SECTION), "The particles.").or_from("none run");
static WALLS: Key = Key::new("walls", Kind::Named(&walls::SECTION), "Walls.").or_from("none");
static THERMAL: Key = Key::new("thermal", Kind::Table(&thermal::SECTION), "Their temperature.").or_from("does not run");
static OPTICS: Key = Key::new("optics", Kind::Table(&optics::SECTION), "A laser.").or_from("does not run");
static CURRENT: Key =
    Key::new("current", Kind::Table(&current::SECTION), "Electrical current.").or_from("does not run");
static SUBSTRATE: Key = Key::new("substrate", Kind::Table(&substrate::SECTION), "Stress in the solid under a wall.")
    .or_from("does not run");
static ACOUSTICS: Key = Key::new("acoustics", Kind::Table(&acoustics::SECTION), "Sound.").or_from("does not run");
static NODES: Key = Key::new("nodes", Kind::Named(&nodes::SECTION), "Nodes of your own.").or_from("none");
static COUPLING: Key = Key::new("coupling", Kind::Table(&coupling::SECTION), "How the physics are coupled.");
static RECORD: Key = Key::new("record", Kind::Table(&nodes::RECORD), "The recording.").or_from("everything");

static RECOVERY: Key =
    Key::new("recovery", Kind::Table(&recovery::SECTION), "What happens when a node dies.").or_from("it is restarted");

static TRADEOFF: Key =
    Key::new("tradeoff", Kind::Table(&presets::TRADEOFF), "What its errors are measured by.").or_from("by its fields");

static ROOT: Section = Section {
    path: "",
    doc: "What is simulated, and for how long. A physics whose table is there runs; one that is not costs nothing.",
    example: "",
    shorthand: None,
    keys: &[
        &TITLE,
        &DURATION,
        &SEED,
        &MATERIALS,
        &PARTICLES,
        &WALLS,
        &THERMAL,
        &OPTICS,
        &CURRENT,
        &SUBSTRATE,
        &ACOUSTICS,
        &NODES,
        &COUPLING,
        &RECORD,
        &RECOVERY,
        &presets::PRESET,
        &presets::PRESETS,
        &TRADEOFF,
    ],
};

/// Fields with a tolerance that the built-in physics write.
const MEASURED: [(&str, &str); 6] = [
    ("particles", "positions"),
    ("thermal", "temperature"),
    ("optics", "absorbed_power"),
    ("current", "joule_power"),
    ("substrate", "wall_deflection"),
    ("acoustics", "acoustic_force"),
];

impl Scene {
    /// Reads a scene; `file` names it in messages, `overrides` are `--set key.path=value` in their order.
    ///
    /// A value of an override is TOML, or a text where it is not. A scene that names files needs
    /// [`Self::parse_with_files`].
    ///
    /// # Errors
    /// Every mistake in the scene and the overrides.
    pub fn parse(text: &str, file: &str, overrides: &[(String, String)]) -> Result<Self, Problems> {
        Self::parse_with_files(text, file, overrides, &files::none)
    }

    /// As [`Self::parse`]; `read` gives the contents of a file at a path as the scene writes it, relative to wherever the
    /// caller keeps the scene.
    ///
    /// # Errors
    /// Every mistake in the scene and the overrides; a file that cannot be read is one of them.
    pub fn parse_with_files(
        text: &str,
        file: &str,
        overrides: &[(String, String)],
        read: ReadFile<'_>,
    ) -> Result<Self, Problems> {
        let fail = |mistakes| Problems::new(file, overrides, mistakes);
        let mut entries = tree::parse(text).map_err(fail)?;
        let log = Log::new(read);
        // Overrides choose a preset, which goes under all of them.
        let _ = apply(&mut entries, overrides);
        log.mistakes.borrow_mut().extend(presets::merge(&mut entries));
        log.mistakes.borrow_mut().extend(apply(&mut entries, overrides));
        let root = Table::root(&log, &ROOT, &entries);
        let scene = Self::read(&root, file);
        root.finish();
        let mistakes = log.mistakes.take();
        match scene {
            Some(scene) if mistakes.is_empty() => {
                let mut effective = log.values.take();
                let first = |value: &Value| value.path.split('.').next().map(str::to_owned);
                effective
                    .sort_by_key(|value| ROOT.keys.iter().position(|key| Some(key.name) == first(value).as_deref()));
                let (text, overrides, files) = (text.to_owned(), overrides.to_vec(), log.files.take());
                let presets = presets::names(&entries);
                let hash = hash(log.identity.take(), &files);
                Ok(Self { hash, text, overrides, files, effective, presets, ..scene })
            }
            _ => Err(fail(mistakes)),
        }
    }

    /// The scene with particles that start where they would fall from instead of settling first: the same nodes with the same
    /// ports, known at once.
    #[must_use]
    pub fn without_settling(&self) -> Cow<'_, Self> {
        match &self.particles {
            Some(particles @ ParticlesSettings { start: Start::Settle { .. }, .. }) => {
                let particles = Some(particles.clone().without_settling());
                Cow::Owned(Self { particles, ..self.clone() })
            }
            _ => Cow::Borrowed(self),
        }
    }

    /// Every section and key a scene may have, from the top down.
    #[must_use]
    pub fn reference() -> &'static Section {
        &ROOT
    }

    /// `None` only where a mistake was reported.
    fn read(root: &Table<'_>, file: &str) -> Option<Self> {
        let title = root.optional_text(&TITLE).unwrap_or_else(|| file.rsplit('/').next().unwrap_or(file).into());
        let (duration_s, seed) = (root.number(&DURATION), root.whole(&SEED));
        let materials = materials::read(root, &MATERIALS);
        let particles = root.optional_table(&PARTICLES);
        let walls = walls::read(root, &WALLS, &materials);
        let thermal = root.optional_table(&THERMAL);
        let optics = root.optional_table(&OPTICS);
        let current = root.optional_table(&CURRENT);
        let substrate = root.optional_table(&SUBSTRATE);
        let acoustics = root.optional_table(&ACOUSTICS);
        let built_in: Vec<&str> = [
            ("particles", particles.is_some()),
            ("thermal", thermal.is_some()),
            ("optics", optics.is_some()),
            ("current", current.is_some()),
            ("substrate", substrate.is_some()),
            ("acoustics", acoustics.is_some()),
        ]
        .into_iter()
        .filter_map(|(name, runs)| runs.then_some(name))
        .collect();
        let mut bodies = particles::Bodies::read(particles, &materials, &walls, seed);
        // Vapour leaves.
        bodies.come_and_go |= thermal.as_ref().is_some_and(thermal::changes_phase);
        let nodes = nodes::read(root, &NODES, (&bodies, &walls, seed), |physics| built_in.contains(&physics));
        let second_laser = nodes.values().any(|node| node.optics.is_some());
        // A program under the name of a built-in physics writes what that one would.
        let runs = |name: &str| {
            let by_command = nodes.get(name).is_some_and(|node| node.command.is_some());
            built_in.contains(&name) || by_command || (name == "optics" && second_laser)
        };

        let thermal = thermal.map(|table| thermal::read(table, &bodies, &walls, runs));
        let optics = optics.and_then(|table| optics::read(table, &bodies, &walls, seed));
        let current = current.map(|table| current::read(table, &bodies, &walls, runs("thermal")));
        let acoustics = acoustics.and_then(|table| acoustics::read(table, &bodies, &walls, seed));
        let substrate = substrate.and_then(|table| substrate::read(table, &walls, bodies.count));
        let on_substrate = substrate.as_ref().map(substrate::under_particles);
        let radius_m = bodies.radius_m;
        let mut particles = bodies.settings(&walls, seed, runs("thermal"), thermal.as_ref(), on_substrate);
        if let Some(particles) = &mut particles {
            particles.fields.reads_acoustic_force = runs("acoustics");
            let lasers = optics.iter().chain(nodes.values().filter_map(|node| node.optics.as_ref()));
            particles.writes_material |= lasers.into_iter().any(OpticsSettings::reads_material);
        }

        let renamed =
            |name: &&str| nodes.values().any(|node| node.physics.as_deref() == Some(*name) && node.optics.is_none());
        let mut names: Vec<&str> = built_in.iter().copied().filter(|name| !renamed(name)).collect();
        names.extend(nodes.keys().map(String::as_str).filter(|name| !built_in.contains(name)));
        // A surface that stays plane is not part of the iteration.
        let measures =
            |physics: &str| runs(physics) && (physics != "substrate" || on_substrate.is_some_and(|it| it.deflects));
        let measured: Vec<&str> =
            MEASURED.into_iter().filter_map(|(physics, field)| measures(physics).then_some(field)).collect();
        let own = nodes.values().any(|node| node.command.is_some());
        let names = coupling::Names { nodes: &names, fields: (!own).then_some(measured.as_slice()) };
        let mut coupling = root.optional_table(&COUPLING).and_then(|table| coupling::read(table, &names));
        if let Some(coupling) = coupling.as_mut().filter(|_| on_substrate.is_some_and(|it| it.deflects)) {
            // A deflection that comes and goes with a single contact has no size to be measured by.
            let absolute = &mut coupling.fields.entry("wall_deflection".into()).or_default().absolute;
            absolute.get_or_insert(1e-9 * radius_m);
        }
        let record = root.table(&RECORD).map(|table| {
            let record = nodes::record(&table);
            table.finish();
            record
        });
        let recovery = root.table(&RECOVERY).map(recovery::read);
        root.optional_text(&presets::PRESET);
        root.scenes(&presets::PRESETS);
        let quantities = root.optional_table(&TRADEOFF).map(presets::quantities).unwrap_or_default();
        Some(Self {
            title,
            duration_s,
            seed,
            walls,
            particles,
            thermal,
            optics,
            current,
            substrate,
            acoustics,
            solidus_k: materials.iter().filter_map(|(name, own)| Some((name.clone(), own.solidus_k?))).collect(),
            nodes,
            coupling: coupling?,
            record: record?,
            recovery: recovery?,
            presets: Vec::new(),
            quantities,
            files: Files::new(),
            hash: 0,
            text: String::new(),
            overrides: Vec::new(),
            effective: Vec::new(),
        })
    }
}

/// Puts the overrides into the tree; returns those that do not fit.
fn apply(entries: &mut Vec<Entry>, overrides: &[(String, String)]) -> Vec<Mistake> {
    let mut mistakes = Vec::new();
    for (index, (key, value)) in overrides.iter().enumerate() {
        let place = Place::Set(index);
        let mut mistake = |message: String, hint: Option<String>| {
            mistakes.push(Mistake { place, key: key.clone(), message, hint });
        };
        let path: Vec<&str> = key.split('.').map(str::trim).collect();
        if path.iter().any(|name| stagger_messages::keys::check_name(name).is_err()) {
            mistake("expected a key such as particles.radius.mean".into(), None);
            continue;
        }
        let text = || Node { place, item: Item::Text(value.clone()) };
        let node = tree::parse_value(value.trim(), place).unwrap_or_else(text);
        if let Err(part) = tree::set(entries, &path, node) {
            let hint = format!("set {part} as a whole, to a table such as {}", example_of(&part));
            mistake(format!("{part} is a plain value in the scene, which has no keys"), Some(hint));
        }
    }
    mistakes
}

/// An example of the table at a path, for a hint.
fn example_of(path: &str) -> &'static str {
    let section = ROOT.tree().into_iter().find(|section| section.path == path && !section.example.is_empty());
    section.map_or("{ key = value }", |section| section.example)
}

/// Hash of all that was read and of the files: of what a scene says, not of how it is written. A default that is written
/// down, another unit or a comment makes no other scene.
fn hash(identity: Vec<u8>, files: &Files) -> u64 {
    let mut bytes = identity;
    for (path, contents) in files {
        bytes.push(0xfe);
        bytes.extend_from_slice(path.as_bytes());
        bytes.push(0xfe);
        bytes.extend_from_slice(&stagger_messages::codec::hash(contents).to_le_bytes());
    }
    stagger_messages::codec::hash(&bytes)
}

#[cfg(test)]
mod tests;
