//! `[optics]`: the laser and how particles absorb it.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{LENGTH, NUMBER, PER_LENGTH, POWER, TIME},
};

use super::{Beam, Lines, Model, Profile, Settings, Surface, advice::ADVISOR, tradeoff::TRADEOFF};
use crate::{
    PhysicsKind, Surroundings,
    common::{
        Bodies, SolidSurface, Table as Property,
        keys::{beam, materials::Material, rays},
        rays::RefractiveIndex,
    },
    configured,
};

static FIDELITY: Key = Key::new(
    "fidelity",
    Kind::Choice(&[
        (
            "energy-balance",
            "all power, over the particles by m C, so that all heat alike: by mass where they are of one material (Zohdi 2018, \
             eq. 6.39): the cheapest",
        ),
        (
            "beer-lambert",
            "absorbed along lines through the bed, each particle shading those behind it; conserves energy",
        ),
        ("beer-lambert-monograph", "H = a I V with the irradiance at the particle's centre (eqs. 6.38, 6.42)"),
        ("rays", "rays that particles reflect and absorb by Fresnel's equations (ch. 10); conserves energy"),
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
.or_from(
    "a quarter of the mean radius, down to an eighth where particles are small: half of the radius that a twentieth of them are \
     below. For a narrow beam a twelfth of the radius within which half of its power lies, where that radius is below 5/4 of the \
     mean one",
);
static INDEX: Key = Key::new(
    "refractive-index",
    Kind::Number(&NUMBER, Range::POSITIVE),
    "Refractive index n of the particles over that of the gas. Used by rays only, as are the next five.",
)
.or_from("the material's");
static EXTINCTION: Key = Key::new(
    "extinction",
    Kind::Number(&NUMBER, Range::NOT_NEGATIVE),
    "Extinction k of the particles, for the complex index n + i k of a metal.",
)
.or_from("the material's, or 0");
static MOLTEN_INDEX: Key = Key::new(
    "molten-refractive-index",
    Kind::Number(&NUMBER, Range::POSITIVE),
    "Refractive index n of molten particles; the liquid share that thermal writes is then read.",
)
.or_from("as solid");
static MOLTEN_EXTINCTION: Key = Key::new(
    "molten-extinction",
    Kind::Number(&NUMBER, Range::NOT_NEGATIVE),
    "Extinction k of molten particles, where they have an index of their own.",
)
.or("0");
static PERMEABILITY: Key = Key::new(
    "permeability",
    Kind::Number(&NUMBER, Range::POSITIVE),
    "Magnetic permeability μ̂ of the particles over that of the gas.",
)
.or("1");
static RAYS: Key = Key::new("rays", Kind::Table(&rays::SECTION), "Rays that sample the beam.").or_from("1000 rays");
static PROFILE: Key = Key::new("profile", Kind::Table(&PROFILE_SECTION), "Irradiance over the beam's cross-section.");
static DIRECTION: Key =
    Key::new("direction", Kind::Vector(&NUMBER), "Direction of the light; of any length but zero.").or("[0, 0, -1]");
static PATH: Key = Key::new("path", Kind::Table(&beam::PATH_SECTION), "Where the beam's axis passes.");
static STARTS: Key = Key::new("starts", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched on.").or("0");
static ENDS: Key =
    Key::new("ends", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched off; after it starts.")
        .or_from("never");
static PULSES: Key = Key::new("pulses", Kind::Table(&beam::PULSES_SECTION), "Pulses.").or_from("continuous");

static SECTION: Section = Section {
    path: "optics",
    doc: "A laser beam and its absorption.",
    example: "[optics]",
    shorthand: None,
    keys: &[
        &FIDELITY,
        &POWER_KEY,
        &ABSORPTION,
        &SPACING,
        &INDEX,
        &EXTINCTION,
        &MOLTEN_INDEX,
        &MOLTEN_EXTINCTION,
        &PERMEABILITY,
        &RAYS,
        &PROFILE,
        &DIRECTION,
        &PATH,
        &STARTS,
        &ENDS,
        &PULSES,
    ],
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

/// A laser as a physics of a scene.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "optics",
    computes: "the laser of [optics]",
    doc: "A laser.",
    absent: "does not run",
    section: &SECTION,
    rank: 2,
    bodies: None,
    read: |table, surroundings| configured(read(table, surroundings)),
    advice: Some(&ADVISOR),
    tradeoff: Some(&TRADEOFF),
    pictured: &[],
};

/// Reads the table.
fn read(table: Table<'_>, surroundings: &Surroundings<'_, '_>) -> Option<Settings> {
    let Surroundings { bodies, walls, .. } = *surroundings;
    let profile = profile(&table);
    let model = model(&table, surroundings, profile.as_ref());
    let path = beam::path(&table, &PATH);
    let (starts_s, ends_s) = beam::switched(&table, &STARTS, &ENDS);
    let power_w = table.number(&POWER_KEY);
    let direction = table.direction(&DIRECTION);
    let pulses = beam::pulses(&table, &PULSES);
    let beam = Beam { power_w, profile: profile?, direction, path: path?, starts_s, ends_s, pulses };
    let (count, walls) = (bodies.count, rays::normals(walls));
    let model = model?;
    let capacities_j_m3_k = if model == Model::EnergyBalance { capacities_j_m3_k(bodies) } else { Vec::new() };
    let solid = surroundings.solid.cloned();
    if solid.is_some() && matches!(model, Model::EnergyBalance | Model::BeerLambertMonograph { .. }) {
        let hint = Some("set fidelity = \"beer-lambert\" or \"rays\"".into());
        table.reject_with(&FIDELITY, "it does not say where light goes that passes the particles, onto a solid", hint);
    }
    table.finish();
    Some(Settings { count, model, beam, walls, capacities_j_m3_k, solid })
}

/// Heat capacities ρ C of the materials where they start, in J/(m³ K), where there are several.
fn capacities_j_m3_k(bodies: &Bodies<'_>) -> Vec<f64> {
    let of = |named: &(String, Material)| {
        let (_, known) = named;
        let constant = |value: f64| Property::constant(value);
        let density_kg_m3 = bodies.property_of(named, "density", known.density_kg_m3, f64::NAN);
        let capacity =
            bodies.property_of(named, "heat-capacity", known.heat_capacity_j_kg_k.clone(), constant(f64::NAN));
        density_kg_m3 * capacity.at(bodies.temperature_k)
    };
    match &bodies.materials[..] {
        [_] => Vec::new(),
        several => several.iter().map(of).collect(),
    }
}

fn model(table: &Table<'_>, surroundings: &Surroundings<'_, '_>, profile: Option<&Profile>) -> Option<Model> {
    let Surroundings { bodies, seed, solid, .. } = *surroundings;
    let fidelity = table.choice(&FIDELITY);
    // What another fidelity uses may stay in the scene, so that only the fidelity changes between two runs.
    if !fidelity.starts_with("beer-lambert") {
        table.optional_number(&ABSORPTION);
    }
    if fidelity != "beer-lambert" {
        table.optional_number(&SPACING);
    }
    if fidelity != "rays" {
        for key in [&INDEX, &EXTINCTION, &MOLTEN_INDEX, &MOLTEN_EXTINCTION, &PERMEABILITY] {
            table.optional_number(key);
        }
        if table.is_given(&RAYS) {
            rays::read(table, &RAYS, seed);
        }
    }
    Some(match fidelity {
        "energy-balance" => Model::EnergyBalance,
        "beer-lambert-monograph" => {
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
        "rays" => Model::Rays { sampling: rays::read(table, &RAYS, seed)?, surface: surface(table, bodies) },
        _ => Model::BeerLambert {
            absorption_1_m: table
                .number_or(&ABSORPTION, || bodies.property("absorption", bodies.material.1.absorption_1_m)),
            spacing_m: table.number_or(&SPACING, || spacing_m(bodies, profile, solid)),
        },
    })
}

/// Distance between the lines where the scene gives none: both the particles and the beam are sampled.
fn spacing_m(bodies: &Bodies<'_>, profile: Option<&Profile>, solid: Option<&SolidSurface>) -> f64 {
    let of_mean_m = bodies.radius_m / 4.0;
    let Some(profile) = profile else { return of_mean_m };
    // Four times the lines at most are for small particles: what they take is little.
    let of_small_m = (bodies.small_m / 2.0).max(of_mean_m / 2.0);
    // A beam that is wide over them is sampled with them; lines over a narrow one are few.
    let narrow = profile.quantile_m(0.5) < 5.0 * of_mean_m;
    let of_beam_m = if narrow { profile.sampling_m() } else { f64::INFINITY };
    // On a solid the beam itself is to be seen, by lines that are no farther apart than its cells are wide.
    let of_solid_m = solid.map_or(f64::INFINITY, |solid| {
        let widths_m = [0, 1].into_iter().flat_map(|axis| solid.cells.widths_m(axis));
        widths_m.fold(2.0 * profile.sampling_m(), f64::min)
    });
    let of_particles_m = of_mean_m.min(of_small_m).min(of_beam_m);
    // None of this is a reason to refuse the scene.
    let finest_m = Lines::finest_m(profile);
    if !of_particles_m.is_finite() {
        return of_solid_m.max(finest_m);
    }
    of_particles_m.min(of_solid_m).max(of_mean_m.min(finest_m))
}

fn surface(table: &Table<'_>, bodies: &Bodies<'_>) -> Surface {
    let material = &bodies.material.1;
    let solid = RefractiveIndex {
        real: table.number_or(&INDEX, || bodies.property("refractive-index", material.refractive_index)),
        extinction: table.number_or(&EXTINCTION, || material.extinction.unwrap_or(0.0)),
    };
    let extinction = table.number(&MOLTEN_EXTINCTION);
    let molten = table.optional_number(&MOLTEN_INDEX).map(|real| RefractiveIndex { real, extinction });
    if molten.is_none() && table.is_given(&MOLTEN_EXTINCTION) {
        let hint = Some(format!("add {}, or leave this out", MOLTEN_INDEX.name));
        table.reject_with(&MOLTEN_EXTINCTION, "molten particles have no index of their own", hint);
    }
    Surface { solid, molten, permeability: table.number(&PERMEABILITY) }
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
