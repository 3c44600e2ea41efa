//! How a wall moves.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{DAMPING, FORCE, FREQUENCY, LENGTH, MASS, NUMBER, SPEED, TIME},
};
use std::f64::consts::TAU;

use crate::common::walls::{During, Motion, Pressed, Series, Withdrawal};
use stagger_messages::Shown;

static KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        ("fixed", "it does not move"),
        ("path", "by displacements at given times, straight and with one speed between them"),
        ("constant", "with one velocity"),
        ("rotation", "about an axis"),
        ("oscillation", "displaced by A sin(2π f t + φ)"),
        ("pressed", "a piston: free along one direction, pressed by a set force, held by the particles"),
    ]),
    "How it moves. Displacements count from where its shape says.",
);
static TIMES: Key = Key::new("times", Kind::Series(&TIME, Range::ANY), "Times of the displacements or forces; rising.")
    .or_from("none: a constant force; a path must be given them")
    .when("kind", &["path", "pressed"]);
static DISPLACEMENTS: Key = Key::new(
    "displacements",
    Kind::Vectors(&LENGTH),
    "Displacement at each of `times`; the first holds before them, the last after.",
)
.when("kind", &["path"]);
static VELOCITY: Key = Key::new("velocity", Kind::Vector(&SPEED), "Velocity.").when("kind", &["constant"]);
static THROUGH: Key = Key::new("through", Kind::Vector(&LENGTH), "A point on the axis it turns about.")
    .or("[0, 0, 0]")
    .when("kind", &["rotation"]);
static AXIS: Key =
    Key::new("axis", Kind::Vector(&NUMBER), "Direction of that axis; it turns by the right-hand rule about it.")
        .when("kind", &["rotation"]);
static FREQUENCY_KEY: Key =
    Key::new("frequency", Kind::Number(&FREQUENCY, Range::POSITIVE), "Turns or swings per time.")
        .when("kind", &["rotation", "oscillation"]);
static FROM: Key = Key::new("from", Kind::Number(&TIME, Range::ANY), "When it begins to move.")
    .or("0")
    .when("kind", &["constant", "rotation"]);
static UNTIL: Key = Key::new("until", Kind::Number(&TIME, Range::ANY), "When it stops.")
    .or_from("never")
    .when("kind", &["constant", "rotation"]);
static AMPLITUDE: Key = Key::new("amplitude", Kind::Vector(&LENGTH), "A.").when("kind", &["oscillation"]);
static PHASE: Key =
    Key::new("phase", Kind::Number(&NUMBER, Range::ANY), "φ, in radians.").or("0").when("kind", &["oscillation"]);
static DIRECTION: Key = Key::new("direction", Kind::Vector(&NUMBER), "The way it is pressed; of any length but zero.")
    .when("kind", &["pressed"]);
static FORCE_KEY: Key = Key::new(
    "force",
    Kind::Series(&FORCE, Range::ANY),
    "Force it is pressed by, its weight included: a constant one, or one at each of `times`, linear between them and \
     held beyond.",
)
.when("kind", &["pressed"]);
static MASS_KEY: Key = Key::new(
    "mass",
    Kind::Number(&MASS, Range::POSITIVE),
    "Its mass: about that of the bed or more, as a light one asks for short substeps.",
)
.when("kind", &["pressed"]);
static DAMPING_KEY: Key =
    Key::new("damping", Kind::Number(&DAMPING, Range::NOT_NEGATIVE), "Damping of its motion, a force per speed.")
        .or("0")
        .when("kind", &["pressed"]);
static WITHDRAWAL: Key = Key::new("withdrawal", Kind::Table(&WITHDRAWAL_SECTION), "When and how it is withdrawn.")
    .or_from("never")
    .when("kind", &["pressed"]);
static STOPS: Key =
    Key::new("stops", Kind::Table(&STOPS_SECTION), "Where its way ends.").or_from("nowhere").when("kind", &["pressed"]);

pub(crate) static SECTION: Section = Section {
    path: "walls.NAME.motion",
    doc: "How a wall moves.",
    example: "{ kind = \"oscillation\", amplitude = [0, 0, \"10 um\"], frequency = \"50 Hz\" }",
    shorthand: None,
    keys: &[
        &KIND,
        &TIMES,
        &DISPLACEMENTS,
        &VELOCITY,
        &THROUGH,
        &AXIS,
        &FREQUENCY_KEY,
        &FROM,
        &UNTIL,
        &AMPLITUDE,
        &PHASE,
        &DIRECTION,
        &FORCE_KEY,
        &MASS_KEY,
        &DAMPING_KEY,
        &WITHDRAWAL,
        &STOPS,
    ],
};

static WITHDRAWN_FROM: Key = Key::new("from", Kind::Number(&TIME, Range::ANY), "When it begins to go back.");
static WITHDRAWN_SPEED: Key =
    Key::new("speed", Kind::Number(&SPEED, Range::POSITIVE), "Its speed, whatever force that takes.");
static WITHDRAWAL_SECTION: Section = Section {
    path: "walls.NAME.motion.withdrawal",
    doc: "The way back of a piston.",
    example: "{ from = \"10 ms\", speed = \"0.1 m/s\" }",
    shorthand: None,
    keys: &[&WITHDRAWN_FROM, &WITHDRAWN_SPEED],
};

static BACKWARD: Key = Key::new(
    "backward",
    Kind::Number(&LENGTH, Range::NOT_NEGATIVE),
    "How far it can go against its direction from where it starts.",
)
.or_from("any way");
static FORWARD: Key =
    Key::new("forward", Kind::Number(&LENGTH, Range::NOT_NEGATIVE), "How far it can go along its direction.")
        .or_from("any way");
static STOPS_SECTION: Section = Section {
    path: "walls.NAME.motion.stops",
    doc: "Where the way of a piston ends; it does not bounce.",
    example: "{ forward = \"1 mm\" }",
    shorthand: None,
    keys: &[&BACKWARD, &FORWARD],
};

/// Reads a motion; `None` only where a mistake was reported.
pub(crate) fn read(table: Table<'_>) -> Option<Motion> {
    let motion = match table.optional_choice(&KIND)? {
        "path" => path(&table).map(Motion::Path),
        "constant" => Some(Motion::Constant { velocity_m_s: table.vector(&VELOCITY), during: during(&table) }),
        "rotation" => Some(Motion::Rotation {
            through_m: table.vector(&THROUGH),
            axis: table.direction(&AXIS),
            speed_rad_s: TAU * table.number(&FREQUENCY_KEY),
            during: during(&table),
        }),
        "oscillation" => Some(Motion::Oscillation {
            amplitude_m: table.vector(&AMPLITUDE),
            frequency_hz: table.number(&FREQUENCY_KEY),
            phase_rad: table.number(&PHASE),
        }),
        "pressed" => pressed(&table).map(Motion::Pressed),
        _ => Some(Motion::Fixed),
    };
    table.finish();
    motion
}

fn path(table: &Table<'_>) -> Option<Series<[f64; 3]>> {
    if !table.is_given(&TIMES) {
        table.reject(&TIMES, format!("missing; expected {}", TIMES.kind.expected()));
    }
    let (times_s, values) = (table.series(&TIMES), table.vectors(&DISPLACEMENTS));
    series(table, times_s?, values?)
}

fn during(table: &Table<'_>) -> During {
    let during =
        During { from_s: table.number(&FROM), until_s: table.optional_number(&UNTIL).unwrap_or(f64::INFINITY) };
    if during.until_s <= during.from_s {
        table.reject(&UNTIL, format!("expected a time after it begins to move, {:e} s", Shown(during.from_s)));
    }
    during
}

fn pressed(table: &Table<'_>) -> Option<Pressed> {
    let (times_s, forces_n) = (table.series(&TIMES), table.series(&FORCE_KEY));
    let withdrawal = table.optional_table(&WITHDRAWAL).map(|table| {
        let withdrawal =
            Withdrawal { from_s: table.number(&WITHDRAWN_FROM), speed_m_s: table.number(&WITHDRAWN_SPEED) };
        table.finish();
        withdrawal
    });
    let limits_m = table.optional_table(&STOPS).map(|table| {
        let way = |key| table.optional_number(key).unwrap_or(f64::INFINITY);
        let limits_m = [-way(&BACKWARD), way(&FORWARD)];
        table.finish();
        limits_m
    });
    let direction = table.direction(&DIRECTION);
    let (mass_kg, damping_n_s_m) = (table.number(&MASS_KEY), table.number(&DAMPING_KEY));
    let times_s = if table.is_given(&TIMES) { times_s? } else { vec![0.0] };
    let force_n = series(table, times_s, forces_n?)?;
    let limits_m = limits_m.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    Some(Pressed { direction, mass_kg, damping_n_s_m, force_n, withdrawal, limits_m })
}

/// Times and their values, which must be as many; times must rise.
fn series<T>(table: &Table<'_>, times_s: Vec<f64>, values: Vec<T>) -> Option<Series<T>> {
    let (times, count) = (times_s.len(), values.len());
    if times != count || count == 0 {
        table.reject(&TIMES, format!("expected one time for each of the {count} values (at least one), found {times}"));
        return None;
    }
    if let Some(pair) = times_s.windows(2).find(|pair| pair[0] >= pair[1]) {
        table.reject(
            &TIMES,
            format!("expected rising times, found {:e} s after {:e} s", Shown(pair[1]), Shown(pair[0])),
        );
        return None;
    }
    Some(Series { times_s, values })
}
