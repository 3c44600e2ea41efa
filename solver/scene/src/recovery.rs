//! `[recovery]`: what happens when a node dies.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::TIME,
};

use super::RecoverySettings;

static CHECKPOINT: Key = Key::new(
    "checkpoint",
    Kind::Whole(0, 1_000_000_000),
    "Accepted steps from one checkpoint to the next; 0 takes none, and a node that dies then ends the run.",
)
.or("50");
static RESTARTS: Key =
    Key::new("restarts", Kind::Whole(0, 1000), "Times that nodes are started again in one run.").or("3");
static HANG: Key = Key::new(
    "hang",
    Kind::Number(&TIME, Range::POSITIVE),
    "How long a node may work on one answer before it is taken for dead.",
)
.or("\"10 min\"");
static START: Key = Key::new(
    "start",
    Kind::Number(&TIME, Range::POSITIVE),
    "How long nodes have to announce themselves; one that has not is named, and the run ends.",
)
.or("\"30 s\"");

pub(super) static SECTION: Section = Section {
    path: "recovery",
    doc: "What happens when a node dies or hangs. Times are those of the clock on the wall.",
    example: "{ checkpoint = 20 }",
    shorthand: None,
    keys: &[&CHECKPOINT, &RESTARTS, &HANG, &START],
};

/// Reads what happens when a node dies.
pub(super) fn read(table: Table<'_>) -> RecoverySettings {
    let settings = RecoverySettings {
        checkpoint_steps: table.whole(&CHECKPOINT),
        restarts: table.whole_u32(&RESTARTS),
        hang_s: table.number(&HANG),
        start_s: table.number(&START),
    };
    table.finish();
    settings
}
