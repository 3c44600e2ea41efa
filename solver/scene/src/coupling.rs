//! `[coupling]`: how the physics are coupled, and the adaptive step.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    problems::{nearest, quoted},
    reader::Table,
    units::{NUMBER, TIME},
};
use std::collections::BTreeMap;

use super::acceleration;
use stagger_coupling::{Order, Settings, StepSize};
use stagger_messages::Shown;

static ORDER: Key = Key::new(
    "order",
    Kind::Choice(&[
        ("gauss-seidel", "one after the other, each with the newest fields of those before it"),
        ("jacobi", "all at the same time, with the fields of the iteration before"),
    ]),
    "Order of the iteration.",
)
.or("\"gauss-seidel\"");
static SEQUENCE: Key = Key::new(
    "sequence",
    Kind::Texts,
    "Names of nodes in the order in which they solve; of those not named each follows on what it reads, and those that nobody reads come last.",
)
.or("[]");
static ACCELERATION: Key =
    Key::new("acceleration", Kind::Table(&acceleration::SECTION), "Acceleration of the iteration.")
        .or_from("the plain iteration");
static FIELDS: Key =
    Key::new("fields", Kind::Named(&acceleration::FIELD), "Convergence and acceleration of single fields.")
        .or_from("as the others");
static EVERY: Key = Key::new(
    "every",
    Kind::Wholes(1, 1_000_000_000),
    "Accepted steps from one solve of a node to the next, by its name: for one that only reads, or is slow.",
)
.or_from("every node takes part in every step");
static TOLERANCE: Key = Key::new(
    "tolerance",
    Kind::Numbers(&NUMBER, Range::above(0.0, 0.1)),
    "Tolerance of each field by name: its relative change in the last iteration of a step.",
)
.or_from("default-tolerance for every field");
static DEFAULT_TOLERANCE: Key =
    Key::new("default-tolerance", Kind::Number(&NUMBER, Range::above(0.0, 0.1)), "Tolerance of the fields not named.")
        .or("1e-6");
static ITERATIONS: Key = Key::new(
    "iterations",
    Kind::Whole(1, 100),
    "Iterations K_d within which a step must converge; 5 to 10 is usual. The step grows and shrinks to need about so many.",
)
.or("8");
static FROZEN: Key = Key::new(
    "frozen",
    Kind::Choice(&[
        ("interpolated", "linear from the step's start to the newest values at its end"),
        ("held", "the newest values at the step's end throughout"),
    ]),
    "What a physics sees of the others inside a step.",
)
.or("\"interpolated\"");
static REUSE: Key = Key::new(
    "reuse",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "A physics whose frozen fields changed by less than this share of their tolerances gives its last reply again.",
)
.or("0.1");
static REJECTIONS: Key = Key::new(
    "rejections",
    Kind::Whole(1, 1_000_000),
    "Attempts at one step that may be rejected, one after the other: the run then ends and says why, as it does where the step \
     falls under its minimum. A fifth of that number is told as a warning.",
)
.or("50");
static DT: Key = Key::new("dt", Kind::Table(&DT_SECTION), "Size of the step.");

pub(super) static SECTION: Section = Section {
    path: "coupling",
    doc: "The staggered iteration between the physics, and its step.",
    example: "[coupling]",
    shorthand: None,
    keys: &[
        &ORDER,
        &SEQUENCE,
        &ACCELERATION,
        &TOLERANCE,
        &DEFAULT_TOLERANCE,
        &FIELDS,
        &ITERATIONS,
        &EVERY,
        &FROZEN,
        &REUSE,
        &REJECTIONS,
        &DT,
    ],
};

static START: Key = Key::new("start", Kind::Number(&TIME, Range::POSITIVE), "First step.");
static LIMIT: Key = Key::new(
    "limit",
    Kind::Number(&TIME, Range::POSITIVE),
    "Largest step: it bounds the error of the time discretisation, which the iteration does not see.",
)
.or_from("the first step");
static MINIMUM: Key = Key::new(
    "minimum",
    Kind::Number(&TIME, Range::POSITIVE),
    "Smallest step: the run stops where it would be smaller.",
)
.or_from("a thousandth of the first step");
static GROWTH: Key =
    Key::new("growth", Kind::Number(&NUMBER, Range::above(1.0, 100.0)), "Largest factor from one step to the next.")
        .or("1.5");
static DT_SECTION: Section = Section {
    path: "coupling.dt",
    doc: "Size of the step; a single time is a step that does not grow.",
    example: "{ start = \"1 us\", limit = \"20 us\" }",
    shorthand: Some(&START),
    keys: &[&START, &LIMIT, &MINIMUM, &GROWTH],
};

/// What a scene's coupling may name.
pub(super) struct Names<'n> {
    /// Nodes that run.
    pub nodes: &'n [&'n str],
    /// Fields with a tolerance; `None` where nodes of the user's own may write others.
    pub fields: Option<&'n [&'n str]>,
}

impl Names<'_> {
    /// What is wrong with the name of a node, and what it may be meant to be.
    fn unknown_node(&self, name: &str) -> Option<(String, String)> {
        if self.nodes.contains(&name) {
            return None;
        }
        let known = format!("nodes of this scene are {}", self.nodes.join(", "));
        let hint = nearest(name, self.nodes.iter().copied()).map_or(known, |near| format!("did you mean \"{near}\"?"));
        Some((format!("no node is called {}", quoted(name)), hint))
    }

    /// Reports a field that none of the scene's nodes writes.
    fn check_field(&self, table: &Table<'_>, key: &Key, field: &str) {
        let Some(fields) = self.fields.filter(|fields| !fields.contains(&field)) else { return };
        let known = format!("fields with a tolerance are {}", fields.join(", "));
        let hint = nearest(field, fields.iter().copied()).map_or(known, |near| format!("did you mean `{near}`?"));
        table.reject_name(key, field, format!("no field is called `{field}`"), Some(hint));
    }
}

/// Reads the settings of the coupling.
pub(super) fn read(table: Table<'_>, names: &Names<'_>) -> Option<Settings> {
    let order = match table.choice(&ORDER) {
        "jacobi" => Order::Jacobi,
        _ => Order::GaussSeidel,
    };
    let sequence = table.texts(&SEQUENCE).unwrap_or_default();
    for (index, name) in sequence.iter().enumerate() {
        if sequence[..index].contains(name) {
            table.reject(&SEQUENCE, format!("names {} twice", quoted(name)));
        } else if let Some((message, hint)) = names.unknown_node(name) {
            table.reject_with(&SEQUENCE, message, Some(hint));
        }
    }
    let acceleration = table.table(&ACCELERATION).map(acceleration::read);
    let tolerance = table.numbers(&TOLERANCE);
    for field in tolerance.keys() {
        names.check_field(&table, &TOLERANCE, field);
    }
    let mut fields = BTreeMap::new();
    for (field, settings) in table.named(&FIELDS) {
        names.check_field(&table, &FIELDS, &field);
        fields.insert(field, acceleration::field(settings));
    }
    let every = table.wholes(&EVERY);
    for node in every.keys() {
        if let Some((message, hint)) = names.unknown_node(node) {
            table.reject_name(&EVERY, node, message, Some(hint));
        }
    }
    let (default_tolerance, iterations) = (table.number(&DEFAULT_TOLERANCE), table.whole_u32(&ITERATIONS));
    let interpolate = table.choice(&FROZEN) != "held";
    let reuse = table.number(&REUSE);
    let rejections = table.whole_u32(&REJECTIONS);
    let dt = step_size(&table);
    table.finish();
    Some(Settings {
        default_sequence: Vec::new(),
        order,
        sequence,
        acceleration: acceleration?,
        fields,
        every,
        tolerance,
        default_tolerance,
        iterations,
        dt: dt?,
        interpolate,
        reuse,
        rejections,
    })
}

fn step_size(coupling: &Table<'_>) -> Option<StepSize> {
    let table = coupling.optional_table(&DT)?;
    let start_s = table.number(&START);
    let size = StepSize {
        start_s,
        limit_s: table.number_or(&LIMIT, || start_s),
        minimum_s: table.number_or(&MINIMUM, || start_s / 1000.0),
        growth: table.number(&GROWTH),
    };
    if size.limit_s < start_s {
        table.reject(&LIMIT, format!("expected at least the first step, {:e} s", Shown(start_s)));
    }
    if size.minimum_s > start_s {
        table.reject(&MINIMUM, format!("expected at most the first step, {:e} s", Shown(start_s)));
    }
    table.finish();
    Some(size)
}
