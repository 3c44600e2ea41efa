//! `[optics]`: the laser and how particles absorb it.

use super::{
    key::{Key, Kind, Range, Section},
    particles::Bodies,
    reader::Table,
    units::{LENGTH, NUMBER, PER_LENGTH, POWER, SPEED, TIME},
};
use crate::physics::optics::{Beam, Model, Path, Profile, Pulses, Settings};

static FIDELITY: Key = Key::new(
    "fidelity",
    Kind::Choice(&[
        ("energy-balance", "all power, over the particles by mass (Zohdi 2018, eq. 6.39): the cheapest"),
        (
            "beer-lambert",
            "absorbed along lines through the bed, each particle shading those behind it; conserves energy",
        ),
        ("beer-lambert-monograph", "H = a I V with the irradiance at the particle's centre (eqs. 6.38, 6.42)"),
    ]),
    "How absorption is computed.",
)
.or("\"beer-lambert\"");
static POWER_KEY: Key =
    Key::new("power", Kind::Number(&POWER, Range::NOT_NEGATIVE), "Power of the beam while it is on.");
static ABSORPTION: Key = Key::new(
    "absorption",
    Kind::Number(&PER_LENGTH, Range::NOT_NEGATIVE),
    "Absorption coefficient a. A metal's own makes particles opaque; a lower one lets light through, as a stand-in for \
     what they reflect. Not used by energy-balance.",
)
.or_from("the material's; beer-lambert-monograph must be given one");
static SPACING: Key = Key::new(
    "spacing",
    Kind::Number(&LENGTH, Range::POSITIVE),
    "Distance between the lines that sample the beam. Used by beer-lambert only.",
)
.or_from("a quarter of the mean radius");
static PROFILE: Key = Key::new("profile", Kind::Table(&PROFILE_SECTION), "Irradiance over the beam's cross-section.");
static DIRECTION: Key =
    Key::new("direction", Kind::Vector(&NUMBER), "Direction of the light; of any length but zero.").or("[0, 0, -1]");
static PATH: Key = Key::new("path", Kind::Table(&PATH_SECTION), "Where the beam's axis passes.");
static STARTS: Key = Key::new("starts", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched on.").or("0");
static ENDS: Key =
    Key::new("ends", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched off; after it starts.")
        .or_from("never");
static PULSES: Key = Key::new("pulses", Kind::Table(&PULSES_SECTION), "Pulses.").or_from("continuous");

pub(super) static SECTION: Section = Section {
    path: "optics",
    doc: "A laser beam and its absorption.",
    example: "[optics]",
    shorthand: None,
    keys: &[&FIDELITY, &POWER_KEY, &ABSORPTION, &SPACING, &PROFILE, &DIRECTION, &PATH, &STARTS, &ENDS, &PULSES],
};

static PROFILE_KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        ("top-hat", "constant within the radius"),
        ("gaussian", "I₀ e^{−2 d²/w²}; the radius w is where it falls to 1/e²"),
        ("exponential", "I₀ e^{−b d} (eq. 6.43); the decay is b"),
    ]),
    "Irradiance as a function of the distance d from the axis; its integral is the power.",
)
.or("\"gaussian\"");
static RADIUS: Key = Key::new("radius", Kind::Number(&LENGTH, Range::POSITIVE), "Radius of the beam.")
    .when("kind", &["top-hat", "gaussian"]);
static DECAY: Key = Key::new("decay", Kind::Number(&PER_LENGTH, Range::POSITIVE), "Decay b of the profile.")
    .when("kind", &["exponential"]);
static PROFILE_SECTION: Section = Section {
    path: "optics.profile",
    doc: "Irradiance over the beam's cross-section.",
    example: "{ kind = \"gaussian\", radius = \"60 um\" }",
    shorthand: None,
    keys: &[&PROFILE_KIND, &RADIUS, &DECAY],
};

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
static PATH_SECTION: Section = Section {
    path: "optics.path",
    doc: "Path of the beam's axis.",
    example: "{ kind = \"sweep\", from = [\"-0.4 mm\", 0, 0], to = [\"0.4 mm\", 0, 0], speed = \"0.5 m/s\" }",
    shorthand: None,
    keys: &[&PATH_KIND, &AT, &FROM, &TO, &SPEED_KEY],
};

static PERIOD: Key =
    Key::new("period", Kind::Number(&TIME, Range::POSITIVE), "Time from the start of one pulse to that of the next.");
static ON: Key = Key::new("on", Kind::Number(&TIME, Range::POSITIVE), "Length of a pulse; at most the period.");
static PULSES_SECTION: Section = Section {
    path: "optics.pulses",
    doc: "A train of pulses from the beam's start.",
    example: "{ period = \"100 us\", on = \"20 us\" }",
    shorthand: None,
    keys: &[&PERIOD, &ON],
};

/// Reads the settings of the laser.
pub(super) fn read(table: Table<'_>, bodies: &Bodies<'_>) -> Option<Settings> {
    let model = model(&table, bodies);
    let profile = profile(&table);
    let path = path(&table);
    let (starts_s, ends_s) = (table.number(&STARTS), table.optional_number(&ENDS).unwrap_or(f64::INFINITY));
    if ends_s <= starts_s {
        table.reject(&ENDS, format!("expected a time after the beam starts, {starts_s:e} s"));
    }
    let power_w = table.number(&POWER_KEY);
    let direction = table.direction(&DIRECTION);
    let pulses = table.optional_table(&PULSES).map(|pulses| {
        let train = Pulses { period_s: pulses.number(&PERIOD), on_s: pulses.number(&ON) };
        if train.on_s > train.period_s {
            pulses.reject(&ON, format!("expected at most the period, {:e} s", train.period_s));
        }
        pulses.finish();
        train
    });
    table.finish();
    let beam = Beam { power_w, profile: profile?, direction, path: path?, starts_s, ends_s, pulses };
    Some(Settings { count: bodies.count, model, beam })
}

fn model(table: &Table<'_>, bodies: &Bodies<'_>) -> Model {
    match table.choice(&FIDELITY) {
        "energy-balance" => {
            // They may stay in the scene, so that only the fidelity changes between two runs.
            table.optional_number(&ABSORPTION);
            table.optional_number(&SPACING);
            Model::EnergyBalance
        }
        "beer-lambert-monograph" => {
            table.optional_number(&SPACING);
            let absorption_1_m = table.optional_number(&ABSORPTION).unwrap_or(f64::NAN);
            if !table.is_given(&ABSORPTION) {
                let bound = 0.75 / bodies.radius_m;
                let message = format!("missing; expected {}", ABSORPTION.kind.expected());
                let hint = format!(
                    "this form absorbs more than the light that falls on a particle above {bound:.0} 1/m, and a metal's \
                     own coefficient is far above"
                );
                table.reject_with(&ABSORPTION, message, Some(hint));
            }
            Model::BeerLambertMonograph { absorption_1_m }
        }
        _ => Model::BeerLambert {
            absorption_1_m: table
                .number_or(&ABSORPTION, || bodies.property("absorption", bodies.material.1.absorption_1_m)),
            spacing_m: table.number_or(&SPACING, || bodies.radius_m / 4.0),
        },
    }
}

fn profile(optics: &Table<'_>) -> Option<Profile> {
    let table = optics.optional_table(&PROFILE)?;
    let profile = match table.choice(&PROFILE_KIND) {
        "exponential" => Profile::Exponential { decay_1_m: table.number(&DECAY) },
        "top-hat" => Profile::TopHat { radius_m: table.number(&RADIUS) },
        _ => Profile::Gaussian { radius_m: table.number(&RADIUS) },
    };
    table.finish();
    Some(profile)
}

fn path(optics: &Table<'_>) -> Option<Path> {
    let table = optics.optional_table(&PATH)?;
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
