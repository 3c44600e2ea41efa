//! `[coupling.acceleration]` and `[coupling.fields]`: how the iteration is accelerated, and what single fields ask for.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::NUMBER,
};
use stagger_coupling::{Acceleration, FieldSettings};

static METHOD: Key = Key::new(
    "method",
    Kind::Choice(&[
        ("none", "the plain iteration"),
        ("constant", "a fixed share of each change: steadies an iteration that swings"),
        ("aitken", "a share that follows from the last two changes: for one dominant coupling, at next to no cost"),
        (
            "iqn-ils",
            "a quasi-Newton step from a least-squares model of earlier iterations: for strong coupling, also where the \
             plain iteration diverges",
        ),
    ]),
    "What is done to the fields that are fed back.",
)
.or("\"none\"");
static RELAXATION: Key = Key::new(
    "relaxation",
    Kind::Number(&NUMBER, Range::above(0.0, 1.99)),
    "Share of the change that is taken: always with constant, in the first iteration with aitken (which keeps later \
     steps' first one at most as large), where there is no model yet with iqn-ils.",
)
.or("0.5")
.when("method", &["constant", "aitken", "iqn-ils"]);
static REUSED_STEPS: Key =
    Key::new("reused-steps", Kind::Whole(0, 1000), "Accepted steps whose iterations the model goes on using.")
        .or("8")
        .when("method", &["iqn-ils"]);
static COLUMNS: Key = Key::new(
    "columns",
    Kind::Whole(1, 1000),
    "Most iterations in the model: its memory grows with their number, its cost with the square.",
)
.or("20")
.when("method", &["iqn-ils"]);
static FILTER: Key = Key::new(
    "filter",
    Kind::Number(&NUMBER, Range::above(0.0, 0.5)),
    "An iteration is left out of the model that is this nearly a combination of newer ones: 1e-6 suits linear \
     coupling, while curvature and noise need the default or more.",
)
.or("1e-2")
.when("method", &["iqn-ils"]);

pub(super) static SECTION: Section = Section {
    path: "coupling.acceleration",
    doc: "Acceleration of the iteration.",
    example: "{ method = \"iqn-ils\", reused-steps = 8 }",
    shorthand: Some(&METHOD),
    keys: &[&METHOD, &RELAXATION, &REUSED_STEPS, &COLUMNS, &FILTER],
};

static ABSOLUTE: Key = Key::new(
    "absolute",
    Kind::Number(&NUMBER, Range::POSITIVE),
    "Mean change of a row, in the field's SI unit, that suffices whatever the relative change.",
)
.or_from("the relative change alone decides");
static OWN: Key = Key::new(
    "acceleration",
    Kind::Table(&SECTION),
    "Acceleration of this field, by itself; the others are accelerated together.",
)
.or_from("together with the others");

pub(super) static FIELD: Section = Section {
    path: "coupling.fields.NAME",
    doc: "Convergence and acceleration of one field.",
    example: "{ absolute = 1e-3, acceleration = \"aitken\" }",
    shorthand: None,
    keys: &[&ABSOLUTE, &OWN],
};

/// Reads a method with its settings.
pub(super) fn read(table: Table<'_>) -> Acceleration {
    let acceleration = match table.choice(&METHOD) {
        "constant" => Acceleration::Constant { relaxation: table.number(&RELAXATION) },
        "aitken" => Acceleration::Aitken { relaxation: table.number(&RELAXATION) },
        "iqn-ils" => Acceleration::IqnIls {
            relaxation: table.number(&RELAXATION),
            reused_steps: table.whole_u32(&REUSED_STEPS),
            columns: table.whole_u32(&COLUMNS),
            filter: table.number(&FILTER),
        },
        _ => Acceleration::None,
    };
    table.finish();
    acceleration
}

/// Reads what one field asks for.
pub(super) fn field(table: Table<'_>) -> FieldSettings {
    let absolute = table.optional_number(&ABSOLUTE);
    let acceleration = table.optional_table(&OWN).map(read);
    table.finish();
    FieldSettings { absolute, acceleration }
}
