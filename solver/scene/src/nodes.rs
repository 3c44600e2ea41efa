//! `[nodes.NAME]` and `[record]`: who computes, and what is kept.

use std::{collections::BTreeMap, sync::LazyLock};

use stagger_config::{
    key::{Key, Kind, Section},
    reader::Table,
};
use stagger_physics::Surroundings;

use super::{
    NodeSettings, RecordSettings,
    built_in::{self, BUILT_IN},
    leaked,
};

static PHYSICS: LazyLock<&'static Key> = LazyLock::new(|| {
    let computes: Vec<_> = BUILT_IN.iter().copied().map(|kind| (kind.name, kind.computes)).collect();
    let doc = "Built-in physics that runs under this name.";
    leaked(Key::new("physics", Kind::Choice(leaked(computes)), doc).or_from("none; a node has a physics or a command"))
});
static COMMAND: Key = Key::new(
    "command",
    Kind::Texts,
    "Program and arguments of a node of your own. Under the name of a built-in physics it takes its place.",
)
.or_from("none; a node has a physics or a command");
/// Settings of a node's own, by the physics; the one that says what the bodies are has none.
static OWN: LazyLock<BTreeMap<&'static str, &'static Key>> = LazyLock::new(|| {
    let own = BUILT_IN.iter().copied().filter(|kind| kind.bodies.is_none());
    own.map(|kind| {
        let name = kind.name;
        let doc =
            leaked(format!("Settings of this node's own, beside the scene's [{name}]: a second one of its kind."));
        let absent = leaked(format!("those of the scene's [{name}], which then runs under this name"));
        let key = Key::new(name, Kind::Table(kind.section), doc).or_from(absent).when("physics", leaked([name]));
        (name, leaked(key))
    })
    .collect()
});

pub(super) static SECTION: LazyLock<&'static Section> = LazyLock::new(|| {
    let keys: Vec<&'static Key> = [*PHYSICS, &COMMAND].into_iter().chain(OWN.values().copied()).collect();
    leaked(Section {
        path: "nodes.NAME",
        doc: "A node that is not simply the built-in physics of the same name.",
        example: "{ command = [\"python3\", \"thermal.py\"] }",
        shorthand: None,
        keys: leaked(keys),
    })
});

static LEVEL: Key = Key::new(
    "level",
    Kind::Choice(&[
        ("all", "every exchange, so that any node can be run again alone"),
        ("accepted", "accepted states only"),
    ]),
    "What is recorded.",
)
.or("\"all\"");
static EVERY: Key =
    Key::new("every", Kind::Whole(1, 1_000_000_000), "Steps from one recorded step to the next; 1 is every step.")
        .or("1");
static FIELDS: Key = Key::new(
    "fields",
    Kind::Texts,
    "The fields to keep, by name: `[\"positions\", \"temperature\"]`. Messages of the others are left out of the recording, \
     and with them what `verify` needs; checkpoints stay whole.",
)
.or_from("all of them");
static FRAMES: Key = Key::new(
    "frames",
    Kind::Whole(0, 100_000),
    "Pictures of the particles, with scalars, for Foxglove and Rerun, evenly over the duration beside the exchanges \
     (docs/recordings.md); 0 leaves them out, and the log lines too.",
)
.or("100");
static BUFFER: Key = Key::new(
    "buffer",
    Kind::Whole(1, 65_536),
    "MiB that may wait to be written. Beyond, the coordinator waits for the disk before it asks for the next iteration.",
)
.or("256");

pub(super) static RECORD: Section = Section {
    path: "record",
    doc: "The recording of the run.",
    example: "[record]",
    shorthand: None,
    keys: &[&LEVEL, &EVERY, &FIELDS, &FRAMES, &BUFFER],
};

/// Reads all nodes; `runs` says whether the table of a built-in physics is there.
pub(super) fn read(
    root: &Table<'_>,
    key: &'static Key,
    surroundings: &Surroundings<'_, '_>,
    runs: impl Fn(&str) -> bool,
) -> BTreeMap<String, NodeSettings> {
    let mut nodes: BTreeMap<String, NodeSettings> = BTreeMap::new();
    for (name, table) in root.named(key) {
        let physics = table.optional_choice(*PHYSICS);
        let command = table.texts(&COMMAND);
        match (table.is_given(*PHYSICS), table.is_given(&COMMAND)) {
            (true, true) => table.reject(&COMMAND, "a node has a physics or a command, not both"),
            (false, false) => table.reject(*PHYSICS, "missing; expected a physics or a command"),
            _ => {}
        }
        if command.as_ref().is_some_and(|words| words.first().is_none_or(String::is_empty)) {
            table.reject(&COMMAND, "expected a program and its arguments, found no program");
        }
        let mut own = None;
        if let Some(kind) = physics.and_then(built_in::kind) {
            let own_key = OWN.get(kind.name).copied().filter(|key| table.is_given(key));
            if (own_key.is_some() || kind.name != name) && runs(&name) {
                table.reject(*PHYSICS, format!("[{name}] runs under this name"));
            }
            if let Some(key) = own_key {
                own = table.optional_table(key).and_then(|table| (kind.read)(table, surroundings));
            } else if !runs(kind.name) {
                table.reject(*PHYSICS, format!("this scene has no [{}]", kind.name));
            }
        }
        nodes.insert(name, NodeSettings { physics: physics.map(Into::into), command, own });
        table.finish();
    }
    nodes
}

/// Reads what is recorded.
pub(super) fn record(table: &Table<'_>) -> RecordSettings {
    let level = match table.choice(&LEVEL) {
        "accepted" => super::Level::Accepted,
        _ => super::Level::All,
    };
    RecordSettings {
        level,
        every: table.whole(&EVERY),
        fields: table.texts(&FIELDS),
        frames: table.whole(&FRAMES),
        buffer_bytes: table.whole(&BUFFER) << 20,
    }
}
