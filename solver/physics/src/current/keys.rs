//! `[current]`: electrical current through the particles.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{ELECTRIC_FIELD, NUMBER, PER_ELECTRIC_FIELD, PER_TEMPERATURE, TEMPERATURE, TIME},
};

use super::{Conductivity, Method, Model, Settings, Solver, Transition, advice::ADVISOR, tradeoff::TRADEOFF};
use crate::{
    PhysicsKind, Surroundings,
    common::{Conductance, Pictured, Wall},
    configured,
};
use stagger_messages::Shown;

static MODEL: Key = Key::new(
    "model",
    Kind::Choice(&[
        ("potential", "Kirchhoff's laws on the contacts; walls are given a `potential` or a `current`; conserves energy"),
        (
            "averaging",
            "each current density the mean of its neighbours' by contact area (Zohdi 2018, eqs. 8.13–8.14); walls are given a \
             `current-density`",
        ),
    ]),
    "How the current is computed.",
)
.or("\"potential\"");
static CONDUCTANCE: Key = Key::new(
    "conductance",
    Kind::Choice(&[
        ("monograph", "σ A/d, from contact area and distance, with the arithmetic mean of the two σ"),
        (
            "constriction",
            "2 σ a, of a small circular spot of radius a between half-spaces in series (Holm 1967), with the harmonic mean of the two σ, \
             so that an insulator blocks; 4 σ a to a wall",
        ),
    ]),
    "How a contact conducts. The two differ by an order of magnitude at small overlap.",
)
.or("\"monograph\"")
.when("model", &["potential"]);
static HEAT_SHARE: Key =
    Key::new("heat-share", Kind::Number(&NUMBER, Range::within(0.0, 1.0)), "Share a of a J² V/σ that heats (eq. 8.6).")
        .or("1")
        .when("model", &["averaging"]);
static BY_TEMPERATURE: Key =
    Key::new("by-temperature", Kind::Table(&BY_TEMPERATURE_SECTION), "Change of the conductivity with temperature.")
        .or_from("none");
static BY_FIELD: Key =
    Key::new("by-field", Kind::Table(&BY_FIELD_SECTION), "Change of the conductivity with the electric field.")
        .or_from("none");
static STARTS: Key =
    Key::new("starts", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When the walls are electrified.").or("0");
static ENDS: Key =
    Key::new("ends", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When they no longer are; after it starts.")
        .or_from("never");
static METHOD: Key = Key::new(
    "solver",
    Kind::Choice(&[
        ("conjugate-gradient", "conjugate gradients from the last step's solution"),
        ("jacobi", "the monograph's sweeps: far slower, for comparison; raise `iterations`"),
    ]),
    "How the equations are solved.",
)
.or("\"conjugate-gradient\"");
static TOLERANCE: Key = Key::new(
    "tolerance",
    Kind::Number(&NUMBER, Range::above(0.0, 0.1)),
    "Residual over right-hand side at which the equations are solved.",
)
.or("1e-12");
static ITERATIONS: Key =
    Key::new("iterations", Kind::Whole(1, 10_000_000), "Iterations after which the run ends with an error.")
        .or("10000");

static SECTION: Section = Section {
    path: "current",
    doc: "Electrical current from wall to wall through the particles; walls say what they are held at. Joule heat goes to [thermal].",
    example: "[current]",
    shorthand: None,
    keys: &[
        &MODEL,
        &CONDUCTANCE,
        &HEAT_SHARE,
        &BY_TEMPERATURE,
        &BY_FIELD,
        &STARTS,
        &ENDS,
        &METHOD,
        &TOLERANCE,
        &ITERATIONS,
    ],
};

static GAIN: Key = Key::new(
    "gain",
    Kind::Number(&NUMBER, Range::above(-1.0, 1e6)),
    "K in σ = σ_R [1 + K/(1 + e^(−γ(x − x_R)))] (eq. 8.17): at x_R half of it is added.",
);
static RATE_BY_TEMPERATURE: Key = Key::new("rate", Kind::Number(&PER_TEMPERATURE, Range::ANY), "Rate γ.");
static REFERENCE_TEMPERATURE: Key =
    Key::new("reference", Kind::Number(&TEMPERATURE, Range::POSITIVE), "Temperature x_R of the step.");
static BY_TEMPERATURE_SECTION: Section = Section {
    path: "current.by-temperature",
    doc: "A smooth step of the conductivity with temperature (eq. 8.17).",
    example: "{ gain = -0.5, rate = \"0.01 1/K\", reference = \"800 K\" }",
    shorthand: None,
    keys: &[&GAIN, &RATE_BY_TEMPERATURE, &REFERENCE_TEMPERATURE],
};
static RATE_BY_FIELD: Key = Key::new("rate", Kind::Number(&PER_ELECTRIC_FIELD, Range::ANY), "Rate γ.");
static REFERENCE_FIELD: Key =
    Key::new("reference", Kind::Number(&ELECTRIC_FIELD, Range::NOT_NEGATIVE), "Field x_R of the step.");
static BY_FIELD_SECTION: Section = Section {
    path: "current.by-field",
    doc: "A smooth step of the conductivity with the electric field (eq. 8.17).",
    example: "{ gain = 1, rate = \"1e-4 m/V\", reference = \"10 kV/m\" }",
    shorthand: None,
    keys: &[&GAIN, &RATE_BY_FIELD, &REFERENCE_FIELD],
};

/// Electrical current as a physics of a scene.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "current",
    computes: "the electrical current of [current]",
    doc: "Electrical current.",
    absent: "does not run",
    section: &SECTION,
    rank: 3,
    bodies: None,
    read: |table, surroundings| configured(Some(read(table, surroundings))),
    advice: Some(&ADVISOR),
    tradeoff: Some(&TRADEOFF),
    pictured: &[Pictured {
        beside: true,
        passing: true,
        ..Pictured::new("current_density", "current density", "Current")
    }],
};

/// Reads the table.
fn read(table: Table<'_>, surroundings: &Surroundings<'_, '_>) -> Settings {
    let Surroundings { bodies, walls, .. } = *surroundings;
    let model = match table.choice(&MODEL) {
        "averaging" => Model::Averaging { heat_share: table.number(&HEAT_SHARE) },
        _ => Model::Potential {
            conductance: match table.choice(&CONDUCTANCE) {
                "constriction" => Conductance::Constriction,
                _ => Conductance::Monograph,
            },
        },
    };
    let conductivity = Conductivity {
        reference_s_m: bodies.property("electrical-conductivity", bodies.material.1.electrical_conductivity_s_m),
        by_temperature: transition(table.optional_table(&BY_TEMPERATURE), &RATE_BY_TEMPERATURE, &REFERENCE_TEMPERATURE),
        by_field: transition(table.optional_table(&BY_FIELD), &RATE_BY_FIELD, &REFERENCE_FIELD),
    };
    let gains =
        [conductivity.by_temperature, conductivity.by_field].map(|step| step.map_or(0.0, |step| step.gain.min(0.0)));
    if gains[0] + gains[1] <= -1.0 {
        table.reject(&BY_FIELD, "together with the change by temperature it leaves no conductivity");
    }
    check_walls(&table, model, walls);
    let (starts_s, ends_s) = (table.number(&STARTS), table.optional_number(&ENDS).unwrap_or(f64::INFINITY));
    if ends_s <= starts_s {
        table.reject(&ENDS, format!("expected a time after it starts, {:e} s", Shown(starts_s)));
    }
    let solver = Solver {
        method: match table.choice(&METHOD) {
            "jacobi" => Method::Jacobi,
            _ => Method::ConjugateGradient,
        },
        tolerance: table.number(&TOLERANCE),
        iterations: table.whole_u32(&ITERATIONS),
    };
    table.finish();
    Settings {
        count: bodies.count,
        model,
        conductivity,
        temperature_k: bodies.temperature_k,
        walls: walls.to_vec(),
        starts_s,
        ends_s,
        solver,
    }
}

fn transition(table: Option<Table<'_>>, rate: &'static Key, reference: &'static Key) -> Option<Transition> {
    let table = table?;
    let transition =
        Transition { gain: table.number(&GAIN), rate: table.number(rate), reference: table.number(reference) };
    table.finish();
    Some(transition)
}

/// Reports walls that are not electrified as the model needs it.
fn check_walls(table: &Table<'_>, model: Model, walls: &[Wall]) {
    let any = |given: fn(&Wall) -> bool| walls.iter().any(given);
    if let Model::Averaging { .. } = model {
        if !any(|wall| wall.electrode.current_density_a_m2.is_some()) {
            let hint = Some("give the walls it flows from a `current-density`".into());
            table.reject_with(&MODEL, "no wall is held at a current density", hint);
        }
        return;
    }
    if let Some(wall) = walls.iter().find(|wall| wall.electrode.potential_v.and(wall.electrode.current_a).is_some()) {
        table.reject(&MODEL, format!("wall {:?} has a `potential` and a `current`; it can be given one", wall.name));
    } else if !any(|wall| wall.electrode.potential_v.is_some()) {
        let hint = Some("give one a `potential`, such as 0, and another a `potential` or a `current`".into());
        table.reject_with(&MODEL, "no wall is held at a potential", hint);
    }
}
