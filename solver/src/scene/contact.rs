//! `[particles.contact]`, `[particles.friction]` and `[particles.drag]`: the forces on a particle.

use super::{
    key::{Key, Kind, Range, Section},
    materials::Material,
    particles,
    reader::Table,
    units::{AREA_DAMPING, AREA_STIFFNESS, NUMBER, PRESSURE, SPEED, TEMPERATURE, VISCOSITY},
};
use crate::physics::particles::{Contact, ContactLaw, Drag, Friction};

static LAW: Key = Key::new(
    "law",
    Kind::Choice(&[
        ("overlap", "K |E|^p A from the overlap strain E and the contact area A (Zohdi 2018, eq. 6.7)"),
        ("hertz", "4/3 √R* E* δ^{3/2} (eq. 6.58)"),
    ]),
    "Normal force.",
)
.or("\"overlap\"");
static STIFFNESS: Key = Key::new(
    "stiffness",
    Kind::Number(&PRESSURE, Range::POSITIVE),
    "Stiffness K at the reference temperature. The metal's own would make contacts too short to resolve; a softer one \
     keeps the motion as long as overlaps stay small.",
)
.or("\"1e9 Pa\"")
.when("law", &["overlap"]);
static EXPONENT: Key =
    Key::new("exponent", Kind::Number(&NUMBER, Range::within(0.5, 10.0)), "Exponent p of the overlap strain.")
        .or("2")
        .when("law", &["overlap"]);
static YOUNG: Key = Key::new(
    "young",
    Kind::Number(&PRESSURE, Range::POSITIVE),
    "Young's modulus E at the reference temperature; a lower one than the material's makes contacts longer.",
)
.or_from("the material's")
.when("law", &["hertz"]);
static POISSON: Key = Key::new("poisson", Kind::Number(&NUMBER, Range::within(0.0, 0.5)), "Poisson's ratio ν.")
    .or_from("the material's")
    .when("law", &["hertz"]);
static DAMPING: Key = Key::new(
    "damping",
    Kind::Number(&AREA_DAMPING, Range::NOT_NEGATIVE),
    "Normal damping per contact area c_cd (eq. 6.10).",
)
.or("0");
static SOFTENING: Key =
    Key::new("softening", Kind::Table(&SOFTENING_SECTION), "Softening with temperature.").or_from("none");

pub(super) static CONTACT: Section = Section {
    path: "particles.contact",
    doc: "Normal contact between particles, and between particles and walls.",
    example: "{ law = \"hertz\", young = \"193 GPa\", poisson = 0.3 }",
    shorthand: Some(&LAW),
    keys: &[&LAW, &STIFFNESS, &EXPONENT, &YOUNG, &POISSON, &DAMPING, &SOFTENING],
};

static RATE: Key = Key::new(
    "rate",
    Kind::Number(&NUMBER, Range::within(0.0, 1e3)),
    "Rate a of softening: the stiffness is multiplied by exp(−a (θ/θ* − 1)) (eq. 6.33). With a rate above 0 and \
     [thermal], the particles follow the computed temperature.",
)
.or("0");
static REFERENCE: Key =
    Key::new("reference", Kind::Number(&TEMPERATURE, Range::POSITIVE), "Reference temperature θ*.").or("\"300 K\"");
static FLOOR: Key =
    Key::new("floor", Kind::Number(&PRESSURE, Range::POSITIVE), "Stiffness below which it does not soften.")
        .or_from("a tenth of the stiffness");

static SOFTENING_SECTION: Section = Section {
    path: "particles.contact.softening",
    doc: "Softening of the stiffness (of Young's modulus for Hertz) with temperature.",
    example: "{ rate = 1.0, reference = \"300 K\", floor = \"1e8 Pa\" }",
    shorthand: None,
    keys: &[&RATE, &REFERENCE, &FLOOR],
};

static FRICTION_LAW: Key = Key::new(
    "law",
    Kind::Choice(&[
        ("regularised", "sticking like a spring over one step, sliding after Coulomb (eqs. 6.11–6.15)"),
        ("none", "frictionless"),
    ]),
    "Tangential force.",
)
.or("\"regularised\"");
static FRICTION_STIFFNESS: Key = Key::new(
    "stiffness",
    Kind::Number(&AREA_STIFFNESS, Range::POSITIVE),
    "Stiffness K_f against sliding while sticking.",
)
.when("law", &["regularised"]);
static STATIC: Key = Key::new(
    "static",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Static coefficient μ_s: sliding begins above it.",
)
.or("0.4")
.when("law", &["regularised"]);
static DYNAMIC: Key = Key::new(
    "dynamic",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Dynamic coefficient μ_d; at most the static one.",
)
.or("0.3")
.when("law", &["regularised"]);

pub(super) static FRICTION: Section = Section {
    path: "particles.friction",
    doc: "Friction at contacts.",
    example: "{ stiffness = \"1e12 N/m^3\", static = 0.4, dynamic = 0.3 }",
    shorthand: Some(&FRICTION_LAW),
    keys: &[&FRICTION_LAW, &FRICTION_STIFFNESS, &STATIC, &DYNAMIC],
};

static DRAG_LAW: Key = Key::new(
    "law",
    Kind::Choice(&[("stokes", "6π c R (v_gas − v) (eq. 6.22)"), ("none", "vacuum")]),
    "Drag of the gas on a particle.",
)
.or("\"stokes\"");
static VISCOSITY_KEY: Key =
    Key::new("viscosity", Kind::Number(&VISCOSITY, Range::POSITIVE), "Viscosity of the gas.").when("law", &["stokes"]);
static VELOCITY: Key =
    Key::new("velocity", Kind::Vector(&SPEED), "Velocity of the gas.").or("[0, 0, 0]").when("law", &["stokes"]);

pub(super) static DRAG: Section = Section {
    path: "particles.drag",
    doc: "Drag of a resting or streaming gas.",
    example: "{ viscosity = \"2.2e-5 Pa s\" }",
    shorthand: Some(&DRAG_LAW),
    keys: &[&DRAG_LAW, &VISCOSITY_KEY, &VELOCITY],
};

/// Reads `contact` of the particles' table.
pub(super) fn contact(particles: &Table<'_>, key: &'static Key, material: &(String, Material)) -> Option<Contact> {
    let table = particles.table(key)?;
    let (law, stiffness_pa) = if table.choice(&LAW) == "hertz" {
        let own = |key: &'static Key, value, property| {
            table.number_or(key, || particles::property(particles, material, property, value))
        };
        let young_pa = own(&YOUNG, material.1.young_pa, "young");
        (ContactLaw::Hertz { young_pa, poisson: own(&POISSON, material.1.poisson, "poisson") }, young_pa)
    } else {
        let stiffness_pa = table.number(&STIFFNESS);
        (ContactLaw::Overlap { stiffness_pa, exponent: table.number(&EXPONENT) }, stiffness_pa)
    };
    let mut contact = Contact {
        law,
        softening_rate: 0.0,
        softening_reference_k: 300.0,
        softening_floor_pa: stiffness_pa / 10.0,
        damping_n_s_m3: table.number(&DAMPING),
    };
    if let Some(softening) = table.optional_table(&SOFTENING) {
        contact.softening_rate = softening.number(&RATE);
        contact.softening_reference_k = softening.number(&REFERENCE);
        contact.softening_floor_pa = softening.number_or(&FLOOR, || stiffness_pa / 10.0);
        if contact.softening_floor_pa > stiffness_pa {
            softening.reject(&FLOOR, format!("expected at most the stiffness itself, {stiffness_pa:e} Pa"));
        }
        softening.finish();
    }
    table.finish();
    Some(contact)
}

/// Reads `friction` of the particles' table.
pub(super) fn friction(particles: &Table<'_>, key: &'static Key) -> Option<Friction> {
    let table = particles.optional_table(key)?;
    let friction = (table.choice(&FRICTION_LAW) != "none").then(|| Friction {
        stiffness_n_m3: table.number(&FRICTION_STIFFNESS),
        static_coefficient: table.number(&STATIC),
        dynamic_coefficient: table.number(&DYNAMIC),
    });
    if let Some(friction) = friction
        && friction.dynamic_coefficient > friction.static_coefficient
    {
        table.reject(&DYNAMIC, format!("expected at most the static coefficient, {}", friction.static_coefficient));
    }
    table.finish();
    friction
}

/// Reads `drag` of the particles' table.
pub(super) fn drag(particles: &Table<'_>, key: &'static Key) -> Option<Drag> {
    let table = particles.optional_table(key)?;
    let drag = (table.choice(&DRAG_LAW) != "none")
        .then(|| Drag { viscosity_pa_s: table.number(&VISCOSITY_KEY), velocity_m_s: table.vector(&VELOCITY) });
    table.finish();
    drag
}
