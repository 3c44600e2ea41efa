//! Keys of a beam, of light in `[optics]` or of sound in `[acoustics]`: its path, its pulses, when it is on.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{LENGTH, SPEED, TIME},
};
use stagger_messages::Shown;

use crate::common::beam::{Path, Pulses};

static PATH_KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        ("fixed", "stays at a point"),
        ("sweep", "runs from one point to another and back, again and again"),
    ]),
    "How it moves.",
);
static AT: Key = Key::new("at", Kind::Vector(&LENGTH), "The point.").when("kind", &["fixed"]);
static FROM: Key = Key::new("from", Kind::Vector(&LENGTH), "Where it starts.").when("kind", &["sweep"]);
static TO: Key = Key::new("to", Kind::Vector(&LENGTH), "Where it turns.").when("kind", &["sweep"]);
static SPEED_KEY: Key =
    Key::new("speed", Kind::Number(&SPEED, Range::POSITIVE), "Speed of the sweep.").when("kind", &["sweep"]);
pub(crate) static PATH_SECTION: Section = Section {
    path: "optics.path",
    doc: "Path of the beam's axis.",
    example: "{ kind = \"sweep\", from = [\"-0.4 mm\", 0, 0], to = [\"0.4 mm\", 0, 0], speed = \"0.5 m/s\" }",
    shorthand: None,
    keys: &[&PATH_KIND, &AT, &FROM, &TO, &SPEED_KEY],
};

static PERIOD: Key =
    Key::new("period", Kind::Number(&TIME, Range::POSITIVE), "Time from the start of one pulse to that of the next.");
static ON: Key = Key::new("on", Kind::Number(&TIME, Range::POSITIVE), "Length of a pulse; at most the period.");
pub(crate) static PULSES_SECTION: Section = Section {
    path: "optics.pulses",
    doc: "A train of pulses from the beam's start.",
    example: "{ period = \"100 us\", on = \"20 us\" }",
    shorthand: None,
    keys: &[&PERIOD, &ON],
};

/// When a beam is switched on and off, in s.
pub(crate) fn switched(table: &Table<'_>, starts: &'static Key, ends: &'static Key) -> (f64, f64) {
    let (starts_s, ends_s) = (table.number(starts), table.optional_number(ends).unwrap_or(f64::INFINITY));
    if ends_s <= starts_s {
        table.reject(ends, format!("expected a time after the beam starts, {:e} s", Shown(starts_s)));
    }
    (starts_s, ends_s)
}

/// The pulses of a beam.
pub(crate) fn pulses(table: &Table<'_>, key: &'static Key) -> Option<Pulses> {
    table.optional_table(key).map(|pulses| {
        let train = Pulses { period_s: pulses.number(&PERIOD), on_s: pulses.number(&ON) };
        if train.on_s > train.period_s {
            pulses.reject(&ON, format!("expected at most the period, {:e} s", Shown(train.period_s)));
        }
        pulses.finish();
        train
    })
}

/// The path of a beam's axis.
pub(crate) fn path(beam: &Table<'_>, key: &'static Key) -> Option<Path> {
    let table = beam.optional_table(key)?;
    let path = match table.optional_choice(&PATH_KIND)? {
        "fixed" => Path::Fixed { at_m: table.vector(&AT) },
        _ => {
            let (from_m, to_m) = (table.vector(&FROM), table.vector(&TO));
            if (0..3).all(|axis| from_m[axis] - to_m[axis] == 0.0) {
                table.reject(&TO, "expected another point than the one it starts from");
            }
            Path::Sweep { from_m, to_m, speed_m_s: table.number(&SPEED_KEY) }
        }
    };
    table.finish();
    Some(path)
}
