//! `[thermal]`: the temperature of the particles.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{HEAT_TRANSFER, NUMBER, TEMPERATURE},
};

use super::{
    Ambient, Conductance, Enthalpy, Material, Overshoot, Settings, Solver, Start, advice::ADVISOR, tradeoff::TRADEOFF,
};
use crate::{
    PhysicsKind, Surroundings,
    common::{Bodies, PhaseBands as Bands, Pictured, Table as Property, keys::materials::Material as Named},
    configured,
};

static CONDUCTANCE: Key = Key::new(
    "conductance",
    Kind::Choice(&[
        ("monograph", "K A/d, from contact area and distance (Zohdi 2018, eq. 6.35), with the arithmetic mean of the two K"),
        (
            "constriction",
            "2 K a, of a small circular spot of radius a between half-spaces in series (Holm 1967), with the harmonic mean of the two K, \
             so that an insulator blocks; 4 K a to a wall",
        ),
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
static OVERSHOOT: Key = Key::new(
    "overshoot",
    Kind::Choice(&[
        ("implicit", "the step's end gets more weight than φ, as much as it takes, in that step"),
        ("smaller-step", "a smaller step is asked for"),
        ("refuse", "the run ends with an error"),
    ]),
    "What is done where the share 1 − φ of a step's start would carry a particle beyond all that it exchanges heat with, as it \
     can in steps longer than m C/(G (1 − φ)), G the sum of its conductances. The figure `windows of raised phi` tells how often.",
)
.or("\"implicit\"");
static TOLERANCE: Key = Key::new(
    "tolerance",
    Kind::Number(&NUMBER, Range::above(0.0, 0.1)),
    "Tolerance of its own iteration: largest change over the largest temperature. Well below that of [coupling].",
)
.or("1e-10");
static ITERATIONS: Key =
    Key::new("iterations", Kind::Whole(1, 10_000), "Iterations after which a smaller step is asked for.").or("100");

static SOLVER: Key = Key::new(
    "solver",
    Kind::Choice(&[
        ("fixed-point", "sweeps, each particle by its own balance: few where steps are short"),
        ("conjugate-gradient", "Newton's method with conjugate gradients: for steps far above the explicit limit"),
    ]),
    "How the implicit equations of a step are solved.",
)
.or("\"fixed-point\"");
static PHASES: Key =
    Key::new("phases", Kind::Table(&PHASES_SECTION), "Melting and boiling.").or_from("particles stay as they are");
static AMBIENT: Key = Key::new("ambient", Kind::Table(&AMBIENT_SECTION), "Convection and radiation.").or_from("none");

static SECTION: Section = Section {
    path: "thermal",
    doc: "Heat conduction between particles and to walls. Materials may differ from particle to particle.",
    example: "[thermal]",
    shorthand: None,
    keys: &[&CONDUCTANCE, &PHI, &OVERSHOOT, &TOLERANCE, &ITERATIONS, &SOLVER, &PHASES, &AMBIENT],
};

static MELTING_BAND: Key = Key::new(
    "melting-band",
    Kind::Number(&TEMPERATURE, Range::NOT_NEGATIVE),
    "Width over which the heat of melting is spread, from the solidus on; 0 melts at one temperature.",
)
.or_from("from the solidus to the liquidus");
static BOILING_BAND: Key = Key::new(
    "boiling-band",
    Kind::Number(&TEMPERATURE, Range::NOT_NEGATIVE),
    "Width over which the heat of boiling is spread, from the boiling point on; 0 boils at one temperature.",
)
.or("0");
static VAPOUR: Key =
    Key::new("vapour", Kind::Flag, "Whether particles boil; those that are vapour leave the run.").or("true");
static PHASES_SECTION: Section = Section {
    path: "thermal.phases",
    doc: "Changes of phase, by the data of the materials. Heat that enters is m (C Δθ + latent heat) to rounding, for any step \
          and in both directions. A particle that has boiled takes no more heat and gives none from that moment on, and gets no \
          hotter than where boiling ends; it leaves at the start of the next step. Its mass and heat are booked as `vapour`, light \
          and current that were still meant for it as `missed`. `melted` stays 1 while it boils.",
    example: "[thermal.phases]",
    shorthand: None,
    keys: &[&MELTING_BAND, &BOILING_BAND, &VAPOUR],
};

static AMBIENT_TEMPERATURE: Key =
    Key::new("temperature", Kind::Number(&TEMPERATURE, Range::NOT_NEGATIVE), "Temperature θ_∞ of the surroundings.")
        .or_from("that of the particles at the start");
static CONVECTION: Key =
    Key::new("convection", Kind::Number(&HEAT_TRANSFER, Range::NOT_NEGATIVE), "Coefficient h of convection.").or("0");
static EMISSIVITY: Key =
    Key::new("emissivity", Kind::Number(&NUMBER, Range::within(0.0, 1.0)), "Emissivity ε_r.").or("0");
static EXPOSED: Key = Key::new(
    "exposed",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "Share of each particle's surface that sees the surroundings; particles inside a bed see less than this.",
)
.or("1");
static AMBIENT_SECTION: Section = Section {
    path: "thermal.ambient",
    doc: "Heat exchanged with the surroundings: h A (θ_∞ − θ) + ε_r σ_SB A (θ_∞⁴ − θ⁴) into each particle, with the exposed \
          share A of its surface.",
    example: "{ convection = \"20 W/(m^2 K)\", emissivity = 0.3 }",
    shorthand: None,
    keys: &[&AMBIENT_TEMPERATURE, &CONVECTION, &EMISSIVITY, &EXPOSED],
};

/// Their temperature as a physics of a scene.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "thermal",
    computes: "the temperatures of [thermal]",
    doc: "Their temperature.",
    absent: "does not run",
    section: &SECTION,
    rank: 4,
    bodies: None,
    read: |table, surroundings| configured(Some(read(table, surroundings))),
    advice: Some(&ADVISOR),
    tradeoff: Some(&TRADEOFF),
    pictured: &[Pictured::new("temperature", "temperature", "Particles")],
};

/// Reads the table.
fn read(table: Table<'_>, surroundings: &Surroundings<'_, '_>) -> Settings {
    let Surroundings { bodies, walls, .. } = *surroundings;
    let bands = table.optional_table(&PHASES).map(|phases| {
        let (melting_k, boiling_k) = (phases.optional_number(&MELTING_BAND), phases.number(&BOILING_BAND));
        let bands = Bands { melting_k, boiling_k: phases.flag(&VAPOUR).then_some(boiling_k) };
        phases.finish();
        bands
    });
    let materials: Vec<Material> =
        bodies.materials.iter().map(|named| material(bodies, named, bands.as_ref())).collect();
    let ambient = table.optional_table(&AMBIENT).map(|ambient| {
        let settings = Ambient {
            temperature_k: ambient.number_or(&AMBIENT_TEMPERATURE, || bodies.temperature_k),
            convection_w_m2_k: ambient.number(&CONVECTION),
            emissivity: ambient.number(&EMISSIVITY),
            exposed: ambient.number(&EXPOSED),
        };
        ambient.finish();
        settings
    });
    let solver = match table.choice(&SOLVER) {
        "conjugate-gradient" => Solver::ConjugateGradient,
        _ => Solver::FixedPoint,
    };
    let constant = materials
        .iter()
        .all(|material| material.heat_capacity_j_kg_k.is_constant() && material.conductivity_w_m_k.is_constant());
    let temperature_form =
        constant && materials.len() == 1 && bands.is_none() && ambient.is_none() && solver == Solver::FixedPoint;
    // There is always one: that of [particles] itself.
    let at_start = |property: fn(&Material) -> &Property| {
        materials.first().map_or(f64::NAN, |first| property(first).at(bodies.temperature_k))
    };
    let settings = Settings {
        count: bodies.count,
        temperature_k: bodies.temperature_k,
        start: start(bodies),
        density_kg_m3: materials.first().map_or(f64::NAN, |first| first.density_kg_m3),
        heat_capacity_j_kg_k: at_start(|material| &material.heat_capacity_j_kg_k),
        conductivity_w_m_k: at_start(|material| &material.conductivity_w_m_k),
        conductance: match table.choice(&CONDUCTANCE) {
            "constriction" => Conductance::Constriction,
            _ => Conductance::Monograph,
        },
        walls: walls.to_vec(),
        solid: surroundings.solid.cloned(),
        phi: table.number(&PHI),
        overshoot: match table.choice(&OVERSHOOT) {
            "smaller-step" => Overshoot::SmallerStep,
            "refuse" => Overshoot::Refuse,
            _ => Overshoot::Implicit,
        },
        pour_temperature_k: None,
        tolerance: table.number(&TOLERANCE),
        iterations: table.whole_u32(&ITERATIONS),
        enthalpy: (!temperature_form).then_some(Enthalpy { materials, solver, ambient }),
    };
    table.finish();
    settings
}

/// What each particle has at the start, where a file tells it.
fn start(bodies: &Bodies<'_>) -> Option<Start> {
    let given = bodies.given.as_ref()?;
    let heat = given.heat.as_ref()?;
    Some(Start {
        temperatures_k: heat.temperatures_k.clone(),
        melted: heat.melted.clone().unwrap_or_default(),
        radii_m: given.radii_m.clone(),
        materials: given.materials.clone(),
    })
}

fn material(bodies: &Bodies<'_>, named: &(String, Named), bands: Option<&Bands>) -> Material {
    let number = |name: &str, value: Option<f64>| bodies.property_of(named, name, value, f64::NAN);
    let table = |name: &str, value: &Option<Property>| {
        bodies.property_of(named, name, value.clone(), Property::constant(f64::NAN))
    };
    Material::of(named, bands, number, table)
}
