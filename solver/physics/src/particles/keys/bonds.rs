//! `[particles.bonds]`: bonds with a state of their own.

use crate::particles::settings::{BondSettings, BondStiffness};
use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{AREA_STIFFNESS, NUMBER, PRESSURE},
};

pub(crate) static BONDS: Key = Key::new(
    "bonds",
    Kind::Table(&SECTION),
    "Bonds that hold in tension, beside the contacts, and break at their strength; particles must spin.",
)
.or_from("none");

static STIFFNESS: Key = Key::new(
    "stiffness",
    Kind::Choice(&[
        ("beam", "that of a beam from centre to centre, Young's modulus over its length"),
        ("per-area", "the same for every bond"),
    ]),
    "What the stiffness per area of a bond's cross-section is.",
)
.or("\"beam\"");
static YOUNG: Key = Key::new("young", Kind::Number(&PRESSURE, Range::POSITIVE), "Young's modulus of the bond.")
    .when("stiffness", &["beam"]);
static RATIO: Key =
    Key::new("ratio", Kind::Number(&NUMBER, Range::above(0.0, 1e3)), "Stiffness against stretching over sliding.")
        .or("2.5")
        .when("stiffness", &["beam"]);
static NORMAL: Key = Key::new(
    "normal-stiffness",
    Kind::Number(&AREA_STIFFNESS, Range::POSITIVE),
    "Against stretching and bending, per area.",
)
.when("stiffness", &["per-area"]);
static SHEAR: Key = Key::new(
    "shear-stiffness",
    Kind::Number(&AREA_STIFFNESS, Range::POSITIVE),
    "Against sliding and torsion, per area.",
)
.when("stiffness", &["per-area"]);
static RADIUS: Key = Key::new(
    "radius",
    Kind::Number(&NUMBER, Range::above(0.0, 1.0)),
    "Radius of a bond as a share of the smaller particle's.",
)
.or("1");
static AT_START: Key = Key::new("at-start", Kind::Flag, "Whether near particles are bonded at the start.").or("true");
static GAP: Key = Key::new(
    "gap",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "Gap up to which particles are bonded at the start, as a share of the smaller radius.",
)
.or("0.05");
static STRAIN: Key = Key::new(
    "strain",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "Overlap strain E* from which particles are bonded during the run; once broken, a pair is not bonded again.",
)
.or_from("none are");
static TENSILE: Key = Key::new(
    "tensile-strength",
    Kind::Number(&PRESSURE, Range::POSITIVE),
    "Tensile stress, of tension and bending, at which a bond breaks.",
)
.or_from("never");
static SHEAR_STRENGTH: Key = Key::new(
    "shear-strength",
    Kind::Number(&PRESSURE, Range::POSITIVE),
    "Shear stress, of sliding and torsion, at which a bond breaks.",
)
.or_from("never");
static DAMPING: Key = Key::new(
    "damping",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Damping of a bond's motions as a share of their critical damping.",
)
.or("0");
static SECTION: Section = Section {
    path: "particles.bonds",
    doc: "Bonds between particles with a state of their own: short beams that carry tension, shear, bending and torsion \
          (Potyondy & Cundall 2004).",
    example: "{ young = \"1 GPa\", tensile-strength = \"10 MPa\" }",
    shorthand: None,
    keys: &[
        &STIFFNESS,
        &YOUNG,
        &RATIO,
        &NORMAL,
        &SHEAR,
        &RADIUS,
        &AT_START,
        &GAP,
        &STRAIN,
        &TENSILE,
        &SHEAR_STRENGTH,
        &DAMPING,
    ],
};

/// Reads `bonds` of the particles' table.
pub(crate) fn read(particles: &Table<'_>) -> Option<BondSettings> {
    let table = particles.optional_table(&BONDS)?;
    let stiffness = match table.choice(&STIFFNESS) {
        "per-area" => BondStiffness::PerArea { normal_n_m3: table.number(&NORMAL), shear_n_m3: table.number(&SHEAR) },
        _ => BondStiffness::Beam { young_pa: table.number(&YOUNG), ratio: table.number(&RATIO) },
    };
    let (at_start, gap_share) = (table.flag(&AT_START), table.number(&GAP));
    let settings = BondSettings {
        stiffness,
        radius_share: table.number(&RADIUS),
        gap_share: at_start.then_some(gap_share),
        strain: table.optional_number(&STRAIN),
        tensile_strength_pa: table.optional_number(&TENSILE),
        shear_strength_pa: table.optional_number(&SHEAR_STRENGTH),
        damping: table.number(&DAMPING),
    };
    table.finish();
    Some(settings)
}
