//! `[particles.contact]`, `[particles.friction]` and `[particles.drag]`: the forces on a particle.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{AREA_DAMPING, AREA_STIFFNESS, NUMBER, PRESSURE, SPEED, SPRING_STIFFNESS, TEMPERATURE, VISCOSITY},
};

use super::groups::MATERIAL;
use crate::common::{keys::materials::Material, property};
use crate::particles::settings::{Contact, ContactLaw, Drag, Friction, OverlapBond, Rolling};
use stagger_messages::Shown;

static LAW: Key = Key::new(
    "law",
    Kind::Choice(&[
        ("overlap", "K |E|^p A from the overlap strain E and the contact area A (Zohdi 2018, eq. 6.7)"),
        ("hertz", "4/3 √R* E* δ^{3/2} (eq. 6.58), 1/E* the sum of (1 − ν²)/E of both particles, of the particle's alone at a wall"),
        ("linear", "a linear spring k δ (Cundall & Strack 1979)"),
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
static SPRING: Key = Key::new(
    "spring",
    Kind::Number(&SPRING_STIFFNESS, Range::POSITIVE),
    "Stiffness k of the spring at the reference temperature.",
)
.when("law", &["linear"]);
static RESTITUTION: Key = Key::new(
    "restitution",
    Kind::Number(&NUMBER, Range::above(0.0, 1.0)),
    "Restitution coefficient that normal damping gives at any speed of impact; with a tangential spring it damps that too.",
)
.or_from("none; damping is by `damping`");
static DAMPING: Key = Key::new(
    "damping",
    Kind::Number(&AREA_DAMPING, Range::NOT_NEGATIVE),
    "Normal damping per contact area c_cd (eq. 6.10).",
)
.or("0");
static SOFTENING: Key =
    Key::new("softening", Kind::Table(&SOFTENING_SECTION), "Softening with temperature.").or_from("none");

pub(crate) static CONTACT: Section = Section {
    path: "particles.contact",
    doc: "Normal contact between particles, and between particles and walls. Walls are rigid: at a wall E* is E/(1 − ν²) of the \
          particle, twice that of two particles of one material. A program whose walls are of the particles' material (LAMMPS, \
          LIGGGHTS) gives the same wall contact with half of E there.",
    example: "{ law = \"hertz\", young = \"193 GPa\", poisson = 0.3 }",
    shorthand: Some(&LAW),
    keys: &[&LAW, &STIFFNESS, &EXPONENT, &YOUNG, &POISSON, &SPRING, &DAMPING, &RESTITUTION, &SOFTENING],
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
        ("spring", "a spring that each contact remembers, sliding after Coulomb (Cundall & Strack 1979): holds a pile"),
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
static STIFFNESS_RATIO: Key = Key::new(
    "stiffness-ratio",
    Kind::Number(&NUMBER, Range::above(0.0, 10.0)),
    "Tangential stiffness over normal stiffness.",
)
.or_from("2(1−ν)/(2−ν) after Mindlin with Hertz's law, else 2/7")
.when("law", &["spring"]);
static DAMPING_RATIO: Key = Key::new(
    "damping-ratio",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Damping ratio of the tangential spring.",
)
.or_from("that of the contact's restitution")
.when("law", &["spring"]);
static STATIC: Key = Key::new(
    "static",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Static coefficient μ_s: sliding begins above it.",
)
.or("0.4")
.when("law", &["regularised", "spring"]);
static DYNAMIC: Key = Key::new(
    "dynamic",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Dynamic coefficient μ_d; at most the static one.",
)
.or("0.3")
.when("law", &["regularised", "spring"]);

pub(crate) static FRICTION: Section = Section {
    path: "particles.friction",
    doc: "Friction at contacts.",
    example: "{ stiffness = \"1e12 N/m^3\", static = 0.4, dynamic = 0.3 }",
    shorthand: Some(&FRICTION_LAW),
    keys: &[&FRICTION_LAW, &FRICTION_STIFFNESS, &STIFFNESS_RATIO, &DAMPING_RATIO, &STATIC, &DYNAMIC],
};

static ROLLING_COEFFICIENT: Key = Key::new(
    "rolling",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Coefficient μ_r of the moment μ_r a ‖Ψ‖ against rolling, a the contact radius (eq. 6.18).",
)
.or("0");
static TORSION: Key = Key::new(
    "torsion",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Coefficient of the same moment against spin about the contact normal.",
)
.or("0");

pub(crate) static ROLLING: Section = Section {
    path: "particles.rolling",
    doc: "Resistance to rolling and torsion; it acts where particles spin.",
    example: "{ rolling = 0.1, torsion = 0.05 }",
    shorthand: Some(&ROLLING_COEFFICIENT),
    keys: &[&ROLLING_COEFFICIENT, &TORSION],
};

static BOND_STIFFNESS: Key =
    Key::new("stiffness", Kind::Number(&PRESSURE, Range::NOT_NEGATIVE), "Normal stiffness K_nb.");
static BOND_EXPONENT: Key =
    Key::new("exponent", Kind::Number(&NUMBER, Range::within(0.5, 10.0)), "Exponent p_b of the overlap strain.")
        .or("2");
static BOND_SHEAR: Key = Key::new(
    "shear-stiffness",
    Kind::Number(&AREA_STIFFNESS, Range::NOT_NEGATIVE),
    "Tangential stiffness K_rb against sliding.",
)
.or("0");
static BOND_STRAIN: Key =
    Key::new("strain", Kind::Number(&NUMBER, Range::within(0.0, 1.0)), "Overlap strain E* from which the bond acts.");

pub(crate) static OVERLAP_BOND: Section = Section {
    path: "particles.overlap-bond",
    doc: "The monograph's bond of overlapping particles (eqs. 6.16–6.17): an attraction that forms and breaks with the overlap. \
          With the contact's own exponent it only softens the contact; it does not hold in tension.",
    example: "{ stiffness = \"1e6 Pa\", strain = 0.02, shear-stiffness = \"1e3 N/m^3\" }",
    shorthand: None,
    keys: &[&BOND_STIFFNESS, &BOND_EXPONENT, &BOND_SHEAR, &BOND_STRAIN],
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

pub(crate) static DRAG: Section = Section {
    path: "particles.drag",
    doc: "Drag of a resting or streaming gas.",
    example: "{ viscosity = \"2.2e-5 Pa s\" }",
    shorthand: Some(&DRAG_LAW),
    keys: &[&DRAG_LAW, &VISCOSITY_KEY, &VELOCITY],
};

/// Reads `contact` of the particles' table; says whether its elasticity is each material's own.
pub(crate) fn contact(
    particles: &Table<'_>,
    key: &'static Key,
    material: &(String, Material),
) -> Option<(Contact, bool)> {
    let table = particles.table(key)?;
    let chosen = table.choice(&LAW);
    let (law, stiffness_pa) = if chosen == "linear" {
        let stiffness_n_m = table.number(&SPRING);
        (ContactLaw::Linear { stiffness_n_m }, stiffness_n_m)
    } else if chosen == "hertz" {
        let own = |key: &'static Key, value, name| {
            table.number_or(key, || property(particles, &MATERIAL, material, name, value))
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
        restitution: table.optional_number(&RESTITUTION),
    };
    if let Some(softening) = table.optional_table(&SOFTENING) {
        contact.softening_rate = softening.number(&RATE);
        contact.softening_reference_k = softening.number(&REFERENCE);
        contact.softening_floor_pa = softening.number_or(&FLOOR, || stiffness_pa / 10.0);
        if contact.softening_floor_pa > stiffness_pa {
            softening.reject(&FLOOR, format!("expected at most the stiffness itself, {:e} Pa", Shown(stiffness_pa)));
        }
        softening.finish();
    }
    let of_material = chosen == "hertz" && !table.is_given(&YOUNG) && !table.is_given(&POISSON);
    table.finish();
    Some((contact, of_material))
}

/// Reads `friction` of the particles' table.
pub(crate) fn friction(particles: &Table<'_>, key: &'static Key) -> Option<Friction> {
    let table = particles.optional_table(key)?;
    let law = table.choice(&FRICTION_LAW);
    let coefficients = || {
        let (static_coefficient, dynamic_coefficient) = (table.number(&STATIC), table.number(&DYNAMIC));
        if dynamic_coefficient > static_coefficient {
            table.reject(&DYNAMIC, format!("expected at most the static coefficient, {static_coefficient}"));
        }
        (static_coefficient, dynamic_coefficient)
    };
    let friction = match law {
        "regularised" => {
            let stiffness_n_m3 = table.number(&FRICTION_STIFFNESS);
            let (static_coefficient, dynamic_coefficient) = coefficients();
            Some(Friction::Regularised { stiffness_n_m3, static_coefficient, dynamic_coefficient })
        }
        "spring" => {
            let stiffness_ratio = table.optional_number(&STIFFNESS_RATIO);
            let damping_ratio = table.optional_number(&DAMPING_RATIO);
            let (static_coefficient, dynamic_coefficient) = coefficients();
            Some(Friction::Spring { stiffness_ratio, damping_ratio, static_coefficient, dynamic_coefficient })
        }
        _ => None,
    };
    table.finish();
    friction
}

/// Reads `rolling` of the particles' table.
pub(crate) fn rolling(particles: &Table<'_>, key: &'static Key) -> Option<Rolling> {
    let table = particles.optional_table(key)?;
    let rolling = Rolling { rolling: table.number(&ROLLING_COEFFICIENT), torsion: table.number(&TORSION) };
    table.finish();
    Some(rolling)
}

/// Reads `overlap-bond` of the particles' table.
pub(crate) fn overlap_bond(particles: &Table<'_>, key: &'static Key) -> Option<OverlapBond> {
    let table = particles.optional_table(key)?;
    let bond = OverlapBond {
        stiffness_pa: table.number(&BOND_STIFFNESS),
        exponent: table.number(&BOND_EXPONENT),
        shear_stiffness_n_m3: table.number(&BOND_SHEAR),
        strain: table.number(&BOND_STRAIN),
    };
    table.finish();
    Some(bond)
}

/// Reads `drag` of the particles' table.
pub(crate) fn drag(particles: &Table<'_>, key: &'static Key) -> Option<Drag> {
    let table = particles.optional_table(key)?;
    let drag = (table.choice(&DRAG_LAW) != "none")
        .then(|| Drag { viscosity_pa_s: table.number(&VISCOSITY_KEY), velocity_m_s: table.vector(&VELOCITY) });
    table.finish();
    drag
}
