//! A scene: one TOML text from which everything a run depends on is read, checked, and shown.
//!
//! A bare number is in SI units; a text carries its unit. [`Scene::parse`] reports every mistake at once, each with
//! file, line, key, what was expected and what was found. The keys are data ([`Scene::reference`]), from which
//! `docs/scene.md` and `docs/scene.schema.json` are made.
//!
//! [`run_in_process`] runs a scene in this process: the same numbers as `stagger run`, without files and without Zenoh.
//!
//! ```
//! use std::ops::ControlFlow;
//! use stagger_scene::{Scene, run_in_process};
//!
//! let text = r#"
//!     duration = "2 ms"
//!     [particles]
//!     count  = 20
//!     radius = "25 um"
//!     start  = { box = ["0.3 mm", "0.3 mm", "0.3 mm"] }
//!     [walls.floor]
//!     plane  = { normal = [0, 0, 1] }
//!     [coupling]
//!     dt     = "20 us"
//! "#;
//! let scene = Scene::parse(text, "fall.toml", &[])?;
//! let run = run_in_process(&scene, |step| {
//!     println!("{:.2} ms: {} fields", 1e3 * step.t_s, step.fields().len());
//!     ControlFlow::Continue(())
//! })?;
//! assert!(run.completed && run.fields["positions"].rows() == 20);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Numbers that are recorded, hashed or decided upon are the same on every processor: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod acceleration;
pub mod advice;
pub mod built_in;
mod coupling;
mod in_process;
mod nodes;
mod participants;
mod recovery;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, LazyLock},
};

pub use stagger_config::{
    Fallback, Files, Key, Kind, Problem, Problems, Range, ReadFile, STANDARD, Section, Value, units,
};
use stagger_config::{
    files, presets,
    problems::{Mistake, Place},
    reader::{Log, Table},
    tree::{self, Entry, Item, Node},
};
use stagger_coupling::Settings as CouplingSettings;
use stagger_messages::Measure;
use stagger_physics::{
    Configured, PhysicsKind, Settings, Surroundings,
    common::{
        Tables, Wall,
        keys::{grids, materials, walls},
    },
};

use built_in::BUILT_IN;
pub use in_process::{Run, RunError, Step, run_in_process};
pub use participants::ParticipantError;

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
    /// Settings of each physics whose table is in the scene, by its name.
    pub physics: BTreeMap<&'static str, Arc<dyn Configured>>,
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
#[derive(Clone, Debug)]
pub struct NodeSettings {
    /// The built-in physics it runs, one of [`built_in::BUILT_IN`].
    pub physics: Option<String>,
    /// The program that runs instead, and its arguments.
    pub command: Option<Vec<String>>,
    /// Settings of its own; the scene's table of the same physics is then not its.
    pub own: Option<Arc<dyn Configured>>,
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
static GRIDS: Key =
    Key::new("grids", Kind::Named(&grids::SECTION), "Grids of cells that physics compute on.").or_from("none");
static WALLS: Key = Key::new("walls", Kind::Named(&walls::SECTION), "Walls.").or_from("none");
static COUPLING: Key = Key::new("coupling", Kind::Table(&coupling::SECTION), "How the physics are coupled.");
static RECORD: Key = Key::new("record", Kind::Table(&nodes::RECORD), "The recording.").or_from("everything");

static RECOVERY: Key =
    Key::new("recovery", Kind::Table(&recovery::SECTION), "What happens when a node dies.").or_from("it is restarted");

static TRADEOFF: Key =
    Key::new("tradeoff", Kind::Table(&presets::TRADEOFF), "What its errors are measured by.").or_from("by its fields");

/// The top of a scene: its own keys and the table of each physics.
static ROOT: LazyLock<&'static Section> = LazyLock::new(|| {
    let (of_bodies, others): (Vec<_>, Vec<_>) = BUILT_IN.iter().copied().partition(|kind| kind.bodies.is_some());
    let tables = |kinds: Vec<&'static PhysicsKind>| kinds.into_iter().map(|kind| table_of(kind));
    let keys: Vec<&'static Key> = [&TITLE, &DURATION, &SEED, &MATERIALS]
        .into_iter()
        .chain(tables(of_bodies))
        .chain([&WALLS, &GRIDS])
        .chain(tables(others))
        .chain([*NODES, &COUPLING, &RECORD, &RECOVERY, &presets::PRESET, &presets::PRESETS, &TRADEOFF])
        .collect();
    leaked(Section {
        path: "",
        doc: "What is simulated, and for how long. A physics whose table is there runs; one that is not costs nothing.",
        example: "",
        shorthand: None,
        keys: leaked(keys),
    })
});

/// The key of each physics' table, by its name.
static TABLES: LazyLock<BTreeMap<&'static str, &'static Key>> = LazyLock::new(|| {
    let key =
        |kind: &PhysicsKind| leaked(Key::new(kind.name, Kind::Table(kind.section), kind.doc).or_from(kind.absent));
    BUILT_IN.iter().copied().map(|kind| (kind.name, key(kind))).collect()
});

static NODES: LazyLock<&'static Key> =
    LazyLock::new(|| leaked(Key::new("nodes", Kind::Named(*nodes::SECTION), "Nodes of your own.").or_from("none")));

fn table_of(kind: &PhysicsKind) -> &'static Key {
    TABLES[kind.name]
}

/// Made once from the list of physics, for as long as the program runs, as the keys are that stand in the code.
fn leaked<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

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
        let root = Table::root(&log, *ROOT, &entries);
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

    /// The settings of a physics, where the scene has its table.
    #[must_use]
    pub fn settings<S: Settings>(&self) -> Option<&S> {
        self.physics.values().find_map(|settings| settings.as_any().downcast_ref())
    }

    /// What a node runs of a built-in physics: its own settings, or those of the scene's table.
    #[must_use]
    pub fn settings_of(&self, node: &str, kind: &str) -> Option<&Arc<dyn Configured>> {
        let own = self.nodes.get(node).and_then(|settings| settings.own.as_ref());
        own.or_else(|| self.physics.get(kind))
    }

    /// The settings of all physics, for those that know their types.
    #[must_use]
    pub fn tables(&self) -> Tables<'_> {
        let own = self.nodes.iter().filter_map(|(name, node)| Some((format!("nodes.{name}"), node.own.as_ref()?)));
        let all = self.physics.iter().map(|(name, settings)| ((*name).to_owned(), settings)).chain(own);
        Tables(all.map(|(table, settings)| (table, settings.as_any())).collect())
    }

    /// The fields that built-in physics of the scene write.
    #[must_use]
    pub fn written(&self) -> BTreeSet<String> {
        let own = self.nodes.values().filter_map(|node| node.own.as_ref());
        let ports = self.physics.values().chain(own).map(|settings| settings.ports());
        ports.flat_map(|ports| ports.writes).map(|port| port.field).collect()
    }

    /// The built-in physics that nodes run, by the node's name: each table under its own name, unless a `[nodes]` table
    /// runs it under another or a program of that name takes its place, and those that `[nodes]` tables name.
    #[must_use]
    pub fn built_in_nodes(&self) -> BTreeMap<String, &'static PhysicsKind> {
        let mut nodes = BTreeMap::new();
        for kind in BUILT_IN.iter().copied().filter(|kind| self.physics.contains_key(kind.name)) {
            let replaced = self.nodes.get(kind.name).is_some_and(|node| node.command.is_some());
            if !replaced && !is_renamed(kind.name, &self.nodes) {
                nodes.insert(kind.name.to_owned(), kind);
            }
        }
        for (name, settings) in self.nodes.iter().filter(|(_, settings)| settings.command.is_none()) {
            nodes.extend(settings.physics.as_deref().and_then(built_in::kind).map(|kind| (name.clone(), kind)));
        }
        nodes
    }

    /// Every section and key a scene may have, from the top down.
    #[must_use]
    pub fn reference() -> &'static Section {
        *ROOT
    }

    /// `None` only where a mistake was reported.
    fn read(root: &Table<'_>, file: &str) -> Option<Self> {
        let title = root.optional_text(&TITLE).unwrap_or_else(|| file.rsplit('/').next().unwrap_or(file).into());
        let (duration_s, seed) = (root.number(&DURATION), root.whole(&SEED));
        let materials = materials::read(root, &MATERIALS);
        let open = |kind: &PhysicsKind| root.optional_table(table_of(kind));
        let (of_bodies, others): (Vec<_>, Vec<_>) = BUILT_IN.iter().copied().partition(|kind| kind.bodies.is_some());
        // One physics says what the bodies are.
        let body_kind = *of_bodies.first()?;
        let body_table = open(body_kind);
        let walls = walls::read(root, &WALLS, &materials);
        let grids = grids::read(root, &GRIDS);
        let tables: Vec<_> = others.into_iter().filter_map(|kind| Some((kind, open(kind)?))).collect();
        let bodies_run = body_table.is_some().then_some(body_kind);
        let runs: Vec<&str> =
            bodies_run.into_iter().chain(tables.iter().map(|(kind, _)| *kind)).map(|kind| kind.name).collect();
        let bodies = (body_kind.bodies?)(body_table, &materials, &walls, seed);

        let mut ports = Vec::new();
        let alone = Surroundings {
            bodies: &bodies,
            walls: &walls,
            materials: &materials,
            grids: &grids,
            seed,
            others: &[],
            on_substrate: None,
            solid: None,
        };
        let nodes = nodes::read(root, &NODES, &alone, |physics| runs.contains(&physics));
        ports.extend(nodes.values().filter_map(|node| node.own.as_ref()).map(|own| own.ports()));
        let mut physics: BTreeMap<&'static str, Arc<dyn Configured>> = BTreeMap::new();
        let mut solid = None;
        for (kind, table) in tables {
            let settings = (kind.read)(table, &Surroundings { others: &ports, solid: solid.as_ref(), ..alone });
            solid = solid.or_else(|| settings.as_ref()?.solid_surface());
            ports.extend(settings.iter().map(|settings| settings.ports()));
            physics.extend(settings.map(|settings| (kind.name, settings)));
        }
        let on_substrate = physics.values().find_map(|settings| settings.on_substrate());
        // Last, as what moves them and what is told of them depends on the others.
        if let Some(table) = bodies.table.take() {
            let settings =
                (body_kind.read)(table, &Surroundings { others: &ports, on_substrate, solid: solid.as_ref(), ..alone });
            ports.extend(settings.iter().map(|settings| settings.ports()));
            physics.extend(settings.map(|settings| (body_kind.name, settings)));
        }

        let mut names: Vec<&str> = runs.iter().copied().filter(|name| !is_renamed(name, &nodes)).collect();
        names.extend(nodes.keys().map(String::as_str).filter(|name| !runs.contains(name)));
        let written = ports.iter().flat_map(|ports| &ports.writes);
        let measured: BTreeSet<&str> =
            written.filter(|port| port.measure() != Measure::None).map(|port| port.field.as_str()).collect();
        let measured: Vec<&str> = measured.into_iter().collect();
        let commands = nodes.values().any(|node| node.command.is_some());
        let names = coupling::Names { nodes: &names, fields: (!commands).then_some(measured.as_slice()) };
        let mut coupling = root.optional_table(&COUPLING).and_then(|table| coupling::read(table, &names));
        if let Some(coupling) = &mut coupling {
            for (field, absolute) in physics.values().flat_map(|settings| settings.absolute_tolerances(&bodies)) {
                coupling.fields.entry(field.into()).or_default().absolute.get_or_insert(absolute);
            }
            let mut kinds = BUILT_IN.to_vec();
            kinds.sort_by_key(|kind| kind.rank);
            coupling.default_sequence = kinds.iter().map(|kind| kind.name.to_owned()).collect();
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
            physics,
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

/// Whether a node runs the table of a physics under another name. One with settings of its own runs beside its namesake, not
/// instead of it.
fn is_renamed(kind: &str, nodes: &BTreeMap<String, NodeSettings>) -> bool {
    nodes.values().any(|node| node.physics.as_deref() == Some(kind) && node.own.is_none())
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
