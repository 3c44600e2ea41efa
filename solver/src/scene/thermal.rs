//! `[thermal]`: the temperature of the particles.

use super::{
    key::{Key, Kind, Range, Section},
    particles::Bodies,
    reader::Table,
    units::NUMBER,
};
use crate::physics::{
    Wall,
    thermal::{Conductance, Settings},
};

static CONDUCTANCE: Key = Key::new(
    "conductance",
    Kind::Choice(&[
        ("monograph", "K A/d, from contact area and distance (Zohdi 2018, eq. 6.35)"),
        ("constriction", "2 K a, of a small circular spot of radius a between half-spaces (Holm 1967)"),
    ]),
    "How a contact conducts. The two differ by an order of magnitude at small overlap.",
)
.or("\"monograph\"");
static PHI: Key = Key::new(
    "phi",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "Weight φ of the step's end: 0 forward Euler, 1/2 midpoint, 1 backward Euler (eqs. 6.44, 10.30).",
)
.or("0.5");
static TOLERANCE: Key = Key::new(
    "tolerance",
    Kind::Number(&NUMBER, Range::above(0.0, 0.1)),
    "Tolerance of its own iteration: largest change over the largest temperature. Well below that of [coupling].",
)
.or("1e-10");
static ITERATIONS: Key =
    Key::new("iterations", Kind::Whole(1, 10_000), "Iterations after which a smaller step is asked for.").or("100");

pub(super) static SECTION: Section = Section {
    path: "thermal",
    doc: "Heat conduction between particles and to walls.",
    example: "[thermal]",
    shorthand: None,
    keys: &[&CONDUCTANCE, &PHI, &TOLERANCE, &ITERATIONS],
};

/// Reads the settings of the particles' temperature.
pub(super) fn read(table: Table<'_>, bodies: &Bodies<'_>, walls: &[Wall], runs: impl Fn(&str) -> bool) -> Settings {
    let material = &bodies.material.1;
    let settings = Settings {
        count: bodies.count,
        temperature_k: bodies.temperature_k,
        density_kg_m3: bodies.property("density", material.density_kg_m3),
        heat_capacity_j_kg_k: bodies.property("heat-capacity", material.heat_capacity_j_kg_k),
        conductivity_w_m_k: bodies.property("conductivity", material.conductivity_w_m_k),
        conductance: match table.choice(&CONDUCTANCE) {
            "constriction" => Conductance::Constriction,
            _ => Conductance::Monograph,
        },
        walls: walls.to_vec(),
        phi: table.number(&PHI),
        reads_absorbed_power: runs("optics"),
        reads_joule_power: runs("current"),
        reads_ids: bodies.come_and_go,
        pour_temperature_k: None,
        tolerance: table.number(&TOLERANCE),
        iterations: table.whole_u32(&ITERATIONS),
    };
    table.finish();
    settings
}
