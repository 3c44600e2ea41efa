//! `[particles.electromagnetic]`, `[particles.near-field]` and `[particles.magnetic]`: forces of fields.

use crate::particles::settings::{
    Base, Charge, Electromagnetic, FieldForces, FieldRegion, Magnetic, MagneticSource, NearFieldSettings, Presence,
};
use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{
        CHARGE, CHARGE_PER_AREA, CHARGE_PER_MASS, CHARGE_PER_VOLUME, ELECTRIC_FIELD, LENGTH, MAGNETIC_FIELD,
        MAGNETIC_GRADIENT, MAGNETIC_MOMENT, MAGNETISABILITY, NUMBER, TIME,
    },
};
use stagger_messages::Shown;

pub(crate) static ELECTROMAGNETIC: Key = Key::new(
    "electromagnetic",
    Kind::Table(&ELECTROMAGNETIC_SECTION),
    "Electric and magnetic field on charged particles.",
)
.or_from("none");
pub(crate) static NEAR_FIELD: Key =
    Key::new("near-field", Kind::Table(&NEAR_FIELD_SECTION), "Attraction and repulsion at a distance.").or_from("none");
pub(crate) static MAGNETIC: Key =
    Key::new("magnetic", Kind::Table(&MAGNETIC_SECTION), "Magnetic field on magnetisable particles.").or_from("none");

static REGION: Key =
    Key::new("region", Kind::Table(&REGION_SECTION), "Where the field acts; of a pair, both must be there.")
        .or_from("everywhere");
static STARTS: Key = Key::new("starts", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched on.").or("0");
static ENDS: Key =
    Key::new("ends", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched off; after it starts.")
        .or_from("never");

static REGION_KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        ("everywhere", "all of space"),
        ("half-space", "the side of a plane that its normal points to"),
        ("box", "inside an axis-aligned box"),
    ]),
    "Shape.",
);
static THROUGH: Key =
    Key::new("through", Kind::Vector(&LENGTH), "A point on the plane.").or("[0, 0, 0]").when("kind", &["half-space"]);
static NORMAL: Key = Key::new("normal", Kind::Vector(&NUMBER), "Direction into the field; of any length but zero.")
    .when("kind", &["half-space"]);
static LOWER: Key = Key::new("lower", Kind::Vector(&LENGTH), "Lower corner.").when("kind", &["box"]);
static UPPER: Key = Key::new("upper", Kind::Vector(&LENGTH), "Upper corner; above the lower one along every axis.")
    .when("kind", &["box"]);
static REGION_SECTION: Section = Section {
    path: "particles.FIELD.region",
    doc: "Where a field acts; FIELD is `electromagnetic`, `near-field` or `magnetic`.",
    example: "{ kind = \"half-space\", through = [2, 0, 0], normal = [-1, 0, 0] }",
    shorthand: Some(&REGION_KIND),
    keys: &[&REGION_KIND, &THROUGH, &NORMAL, &LOWER, &UPPER],
};

static ELECTRIC: Key = Key::new("electric", Kind::Vector(&ELECTRIC_FIELD), "Electric field E.").or("[0, 0, 0]");
static MAGNETIC_FLUX: Key =
    Key::new("magnetic", Kind::Vector(&MAGNETIC_FIELD), "Magnetic flux density B.").or("[0, 0, 0]");
static CHARGE_KEY: Key = Key::new("charge", Kind::Table(&CHARGE_SECTION), "Charge of a particle.");
static ELECTROMAGNETIC_SECTION: Section = Section {
    path: "particles.electromagnetic",
    doc: "Uniform fields on charged particles, with the force q (E + v × B) (Zohdi 2018, eq. 6.19).",
    example: "{ electric = [-100, 0, 0], charge = \"100 C/kg\" }",
    shorthand: None,
    keys: &[&ELECTRIC, &MAGNETIC_FLUX, &CHARGE_KEY, &REGION, &STARTS, &ENDS],
};

static PER_MASS: Key = Key::new("per-mass", Kind::Number(&CHARGE_PER_MASS, Range::ANY), "In proportion to its mass.")
    .or_from("not so; exactly one is given");
static PER_PARTICLE: Key =
    Key::new("per-particle", Kind::Number(&CHARGE, Range::ANY), "The same on every one.").or_from("not so");
static PER_AREA: Key =
    Key::new("per-area", Kind::Number(&CHARGE_PER_AREA, Range::ANY), "In proportion to its surface.").or_from("not so");
static PER_VOLUME: Key =
    Key::new("per-volume", Kind::Number(&CHARGE_PER_VOLUME, Range::ANY), "In proportion to its volume.")
        .or_from("not so");
static CHARGE_SECTION: Section = Section {
    path: "particles.electromagnetic.charge",
    doc: "Charge of a particle, in one of four measures.",
    example: "{ per-particle = \"1e-12 C\" }",
    shorthand: Some(&PER_MASS),
    keys: &[&PER_MASS, &PER_PARTICLE, &PER_AREA, &PER_VOLUME],
};

static IONISED: Key = Key::new("ionised", Kind::Flag, "Whether the near field acts at all.").or("true");
static BASE: Key = Key::new(
    "base",
    Kind::Choice(&[
        ("mass", "the particles' masses in kg"),
        ("area", "their surfaces in m²"),
        ("volume", "their volumes in m³"),
        ("charge", "their charges in C, from [particles.electromagnetic]"),
    ]),
    "What b is.",
)
.or("\"mass\"");
static SIGNS: Key = Key::new(
    "signs",
    Kind::Choice(&[("equal", "all +1"), ("alternating", "+1 and −1 from one particle to the next, by number")]),
    "Signs c; unlike ones turn attraction and repulsion about.",
)
.or("\"equal\"");
static ATTRACTION: Key = Key::new(
    "attraction",
    Kind::Number(&NUMBER, Range::NOT_NEGATIVE),
    "ᾱ1, in SI units: N m^β1 over the square of the base's unit.",
);
static ATTRACTION_EXPONENT: Key =
    Key::new("attraction-exponent", Kind::Number(&NUMBER, Range::above(0.0, 16.0)), "β1; whole numbers are faster.")
        .or("1");
static REPULSION: Key = Key::new(
    "repulsion",
    Kind::Number(&NUMBER, Range::NOT_NEGATIVE),
    "ᾱ2, in SI units: N m^β2 over the square of the base's unit.",
);
static REPULSION_EXPONENT: Key =
    Key::new("repulsion-exponent", Kind::Number(&NUMBER, Range::above(0.0, 16.0)), "β2; whole numbers are faster.")
        .or("2");
static CUTOFF: Key = Key::new(
    "cut-off",
    Kind::Number(&LENGTH, Range::POSITIVE),
    "Distance of centres beyond which a pair is left out, whose force ends there with a step. All pairs cost the \
     square of their number.",
)
.or_from("none: all pairs are summed");
static SKIN: Key = Key::new(
    "skin",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Skin of the list of pairs as a share of the cut-off. It changes the run's speed, not its result.",
)
.or("0.1");
static CLOSEST: Key = Key::new(
    "closest",
    Kind::Number(&NUMBER, Range::above(0.0, 1.0)),
    "Share of the sum of two radii below which the force falls in proportion to the distance: the law itself has no \
     bound there.",
)
.or("1e-3");
static NEAR_FIELD_SECTION: Section = Section {
    path: "particles.near-field",
    doc: "Near field between particles: a pair at distance d attracts with α1 d^−β1 − α2 d^−β2, α = ᾱ b b' c c' (Zohdi \
          2018, eq. 6.20).",
    example: "{ attraction = 0.5, repulsion = 0.01 }",
    shorthand: None,
    keys: &[
        &IONISED,
        &BASE,
        &SIGNS,
        &ATTRACTION,
        &ATTRACTION_EXPONENT,
        &REPULSION,
        &REPULSION_EXPONENT,
        &CUTOFF,
        &SKIN,
        &CLOSEST,
        &REGION,
        &STARTS,
        &ENDS,
    ],
};

static MAGNETISABILITY_KEY: Key = Key::new(
    "magnetisability",
    Kind::Number(&MAGNETISABILITY, Range::ANY),
    "γ per volume; below 0 for diamagnetic particles. A sphere of susceptibility χ has 3χ/(2μ0 (3 + χ)), which is \
     1.19e6 A^2/N for a large χ.",
);
static UNIFORM: Key =
    Key::new("uniform-gradient", Kind::Table(&UNIFORM_SECTION), "A field that grows linearly, B0 + G r.")
        .or_from("none; a field is one of the two");
static DIPOLE: Key =
    Key::new("dipole", Kind::Table(&DIPOLE_SECTION), "A magnet.").or_from("none; a field is one of the two");
static MAGNETIC_SECTION: Section = Section {
    path: "particles.magnetic",
    doc: "Magnetic field on magnetisable particles, with the force γ ∇(B·B) (Zohdi 2018, eq. 6.21). Particles do not \
          change the field.",
    example: "{ magnetisability = 1e6, dipole = { at = [0, 0, \"-1 cm\"], moment = [0, 0, 1.2], radius = \"5 mm\" } }",
    shorthand: None,
    keys: &[&MAGNETISABILITY_KEY, &UNIFORM, &DIPOLE, &REGION, &STARTS, &ENDS],
};

static ORIGIN: Key = Key::new("origin", Kind::Vector(&MAGNETIC_FIELD), "B0 at the origin.").or("[0, 0, 0]");
static GRADIENT_X: Key = Key::new("x", Kind::Vector(&MAGNETIC_GRADIENT), "Gradient of B_x.").or("[0, 0, 0]");
static GRADIENT_Y: Key = Key::new("y", Kind::Vector(&MAGNETIC_GRADIENT), "Gradient of B_y.").or("[0, 0, 0]");
static GRADIENT_Z: Key = Key::new("z", Kind::Vector(&MAGNETIC_GRADIENT), "Gradient of B_z.").or("[0, 0, 0]");
static UNIFORM_SECTION: Section = Section {
    path: "particles.magnetic.uniform-gradient",
    doc: "B0 + G r. A field without currents in it has a symmetric G whose diagonal sums to zero.",
    example: "{ origin = [0, 0, 0.1], x = [-1, 0, 0], y = [0, -1, 0], z = [0, 0, 2] }",
    shorthand: None,
    keys: &[&ORIGIN, &GRADIENT_X, &GRADIENT_Y, &GRADIENT_Z],
};

static AT: Key = Key::new("at", Kind::Vector(&LENGTH), "Its centre.");
static MOMENT: Key = Key::new("moment", Kind::Vector(&MAGNETIC_MOMENT), "Its moment.");
static RADIUS: Key =
    Key::new("radius", Kind::Number(&LENGTH, Range::POSITIVE), "Its radius; inside, nothing is pulled.");
static DIPOLE_SECTION: Section = Section {
    path: "particles.magnetic.dipole",
    doc: "A uniformly magnetised ball, whose field outside is that of a point dipole.",
    example: "{ at = [0, 0, \"-1 cm\"], moment = [0, 0, 1.2], radius = \"5 mm\" }",
    shorthand: None,
    keys: &[&AT, &MOMENT, &RADIUS],
};

/// Reads the fields of the particles' table.
pub(crate) fn read(particles: &Table<'_>) -> FieldForces {
    let electromagnetic = particles.optional_table(&ELECTROMAGNETIC).and_then(electromagnetic);
    let near_field = particles.optional_table(&NEAR_FIELD).and_then(near_field);
    let magnetic = particles.optional_table(&MAGNETIC).and_then(magnetic);
    if near_field.is_some_and(|near_field| near_field.base == Base::Charge) && !particles.is_given(&ELECTROMAGNETIC) {
        let hint = "add electromagnetic = { charge = ... }; its fields may be zero".into();
        particles.reject_with(&NEAR_FIELD, "the base is the charge, but the particles carry none", Some(hint));
    }
    FieldForces { electromagnetic, near_field, magnetic }
}

fn electromagnetic(table: Table<'_>) -> Option<Electromagnetic> {
    let (electric_v_m, magnetic_t) = (table.vector(&ELECTRIC), table.vector(&MAGNETIC_FLUX));
    let charge = table.optional_table(&CHARGE_KEY).and_then(charge);
    let presence = presence(&table);
    table.finish();
    Some(Electromagnetic { charge: charge?, electric_v_m, magnetic_t, presence })
}

fn charge(table: Table<'_>) -> Option<Charge> {
    let given = [
        table.optional_number(&PER_MASS).map(Charge::PerMass),
        table.optional_number(&PER_PARTICLE).map(Charge::PerParticle),
        table.optional_number(&PER_AREA).map(Charge::PerArea),
        table.optional_number(&PER_VOLUME).map(Charge::PerVolume),
    ];
    let keys = [&PER_MASS, &PER_PARTICLE, &PER_AREA, &PER_VOLUME];
    let named: Vec<&Key> = keys.into_iter().filter(|key| table.is_given(key)).collect();
    if let [first, second, ..] = named[..] {
        table.reject(second, format!("`{}` is given already; a charge has one measure", first.name));
    } else if named.is_empty() {
        table.reject(&PER_MASS, "missing; expected one of per-mass, per-particle, per-area, per-volume");
    }
    table.finish();
    given.into_iter().flatten().next()
}

fn near_field(table: Table<'_>) -> Option<NearFieldSettings> {
    let ionised = table.flag(&IONISED);
    let base = match table.choice(&BASE) {
        "area" => Base::Area,
        "volume" => Base::Volume,
        "charge" => Base::Charge,
        _ => Base::Mass,
    };
    let settings = NearFieldSettings {
        attraction: table.number(&ATTRACTION),
        attraction_exponent: table.number(&ATTRACTION_EXPONENT),
        repulsion: table.number(&REPULSION),
        repulsion_exponent: table.number(&REPULSION_EXPONENT),
        base,
        alternating: table.choice(&SIGNS) == "alternating",
        cutoff_m: table.optional_number(&CUTOFF),
        skin: table.number(&SKIN),
        closest: table.number(&CLOSEST),
        presence: presence(&table),
    };
    table.finish();
    ionised.then_some(settings)
}

fn magnetic(table: Table<'_>) -> Option<Magnetic> {
    let magnetisability_a2_n = table.number(&MAGNETISABILITY_KEY);
    let presence = presence(&table);
    let source = match (table.optional_table(&UNIFORM), table.optional_table(&DIPOLE)) {
        (Some(uniform), None) => {
            let origin_t = uniform.vector(&ORIGIN);
            let gradient_t_m = [&GRADIENT_X, &GRADIENT_Y, &GRADIENT_Z].map(|key| uniform.vector(key));
            uniform.finish();
            Some(MagneticSource::Gradient { origin_t, gradient_t_m })
        }
        (None, Some(dipole)) => {
            let (at_m, moment_a_m2) = (dipole.vector(&AT), dipole.vector(&MOMENT));
            let radius_m = dipole.number(&RADIUS);
            dipole.finish();
            Some(MagneticSource::Dipole { at_m, moment_a_m2, radius_m })
        }
        (Some(_), Some(_)) => {
            table.reject(&DIPOLE, "the field is a uniform gradient or a dipole, not both");
            None
        }
        (None, None) => {
            // What is no table has been reported already.
            if !table.is_given(&UNIFORM) && !table.is_given(&DIPOLE) {
                table.reject(&UNIFORM, "missing; expected a uniform-gradient or a dipole");
            }
            None
        }
    };
    table.finish();
    Some(Magnetic { magnetisability_a2_n, source: source?, presence })
}

fn presence(table: &Table<'_>) -> Presence {
    let region = table.optional_table(&REGION).map_or(FieldRegion::Everywhere, region);
    let (starts_s, ends_s) = (table.number(&STARTS), table.optional_number(&ENDS).unwrap_or(f64::INFINITY));
    if ends_s <= starts_s {
        table.reject(&ENDS, format!("expected a time after it starts, {:e} s", Shown(starts_s)));
    }
    Presence { region, starts_s, ends_s }
}

fn region(table: Table<'_>) -> FieldRegion {
    let region = match table.choice(&REGION_KIND) {
        "half-space" => FieldRegion::HalfSpace { through_m: table.vector(&THROUGH), normal: table.direction(&NORMAL) },
        "box" => {
            let (lower_m, upper_m) = (table.vector(&LOWER), table.vector(&UPPER));
            if (0..3).any(|axis| lower_m[axis] >= upper_m[axis]) {
                table.reject(&UPPER, "expected to lie above the lower corner along every axis");
            }
            FieldRegion::Box { lower_m, upper_m }
        }
        _ => FieldRegion::Everywhere,
    };
    table.finish();
    region
}
