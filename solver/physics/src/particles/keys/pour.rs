//! `[particles.pour.NAME]` and `[particles.domain]`: particles that come and go.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{LENGTH, MASS_FLOW, RATE, SPEED, TIME},
};
use std::{collections::BTreeMap, f64::consts::PI};

use super::groups::{self, Used};
use crate::common::keys::materials::{self, Material};
use crate::particles::settings::{Domain, Pour, PourRegion, Radius};
use stagger_coupling::math;
use stagger_messages::Shown;

static BOX: Key = Key::new("box", Kind::Table(&BOX_SECTION), "Box in which particles appear.")
    .or_from("none; a dispenser has a box or a disc");
static DISC: Key = Key::new("disc", Kind::Table(&DISC_SECTION), "Horizontal disc on which particles appear.")
    .or_from("none; a dispenser has a box or a disc");
static RATE_KEY: Key = Key::new("rate", Kind::Number(&RATE, Range::POSITIVE), "Particles per time.")
    .or_from("none; a dispenser has a rate or a mass-rate");
static MASS_RATE: Key =
    Key::new("mass-rate", Kind::Number(&MASS_FLOW, Range::POSITIVE), "Mass per time, on average over the radii.")
        .or_from("none; a dispenser has a rate or a mass-rate");
static FROM: Key = Key::new("from", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it opens.").or("0");
static UNTIL: Key = Key::new("until", Kind::Number(&TIME, Range::POSITIVE), "When it closes.").or_from("never");
static LIMIT: Key = Key::new("limit", Kind::Whole(1, 4_000_000_000), "Most particles in all.").or_from("none");
static RADIUS: Key = Key::new("radius", Kind::Table(&groups::RADIUS_SECTION), "Radius.").or_from("that of [particles]");
static MATERIAL: Key =
    Key::new("material", Kind::Text, "Material, built in or from [materials.NAME].").or_from("that of [particles]");
static VELOCITY: Key = Key::new("velocity", Kind::Vector(&SPEED), "Velocity of every particle.").or("[0, 0, 0]");
static SEED: Key = Key::new("seed", Kind::Whole(0, i64::MAX as u64), "Seed of radii and places.")
    .or_from("the scene's; every dispenser draws other numbers from it");

pub(crate) static POUR: Section = Section {
    path: "particles.pour.NAME",
    doc: "A dispenser that pours particles during the run. They appear at the start \
          of a time step where they overlap nothing; one that finds no room waits for the next step.",
    example: "{ disc = { centre = [0, 0, \"3 mm\"], radius = \"0.5 mm\" }, rate = \"2e5 1/s\" }",
    shorthand: None,
    keys: &[&BOX, &DISC, &RATE_KEY, &MASS_RATE, &FROM, &UNTIL, &LIMIT, &RADIUS, &MATERIAL, &VELOCITY, &SEED],
};

static LOWER: Key = Key::new("lower", Kind::Vector(&LENGTH), "Lower corner.");
static UPPER: Key = Key::new("upper", Kind::Vector(&LENGTH), "Upper corner; above the lower one along every axis.");
static BOX_SECTION: Section = Section {
    path: "particles.pour.NAME.box",
    doc: "An axis-aligned box; particles lie wholly inside.",
    example: "{ lower = [0, 0, \"2 mm\"], upper = [\"1 mm\", \"1 mm\", \"3 mm\"] }",
    shorthand: None,
    keys: &[&LOWER, &UPPER],
};

static CENTRE: Key = Key::new("centre", Kind::Vector(&LENGTH), "Its centre.");
static DISC_RADIUS: Key = Key::new("radius", Kind::Number(&LENGTH, Range::POSITIVE), "Its radius.");
static DISC_SECTION: Section = Section {
    path: "particles.pour.NAME.disc",
    doc: "A horizontal disc, which the particles cross with their middles.",
    example: "{ centre = [0, 0, \"3 mm\"], radius = \"0.5 mm\" }",
    shorthand: None,
    keys: &[&CENTRE, &DISC_RADIUS],
};

pub(crate) static DOMAIN: Section = Section {
    path: "particles.domain",
    doc: "A box; a particle whose centre is outside at the start of a time step is taken out of the run, and its mass and \
          energy are booked as removed.",
    example: "{ lower = [0, 0, \"-1 mm\"], upper = [\"1 mm\", \"1 mm\", \"9 mm\"] }",
    shorthand: None,
    keys: &[&LOWER, &UPPER],
};

/// What dispensers take from the scene where they do not say otherwise.
pub(crate) struct Usual<'m> {
    /// `None` where a file gives the particles of the start.
    pub radius: Option<Radius>,
    pub material: &'m (String, Material),
    pub seed: u64,
}

/// Reads all dispensers, in the order of the file.
pub(crate) fn pours(
    particles: &Table<'_>,
    key: &'static Key,
    usual: &Usual<'_>,
    materials: &BTreeMap<String, Material>,
    used: &mut Used,
) -> Vec<Pour> {
    let mut pours = Vec::new();
    for (name, table) in particles.named(key) {
        let radius = match usual.radius {
            Some(radius) if !table.is_given(&RADIUS) => radius,
            _ => {
                if !table.is_given(&RADIUS) {
                    table.missing(&RADIUS);
                }
                groups::radius(&table, &RADIUS)
            }
        };
        let given = table.is_given(&MATERIAL).then(|| materials::choose(&table, &MATERIAL, materials));
        let (material_name, material) = given.unwrap_or_else(|| usual.material.clone());
        let density_kg_m3 = material.density_kg_m3.unwrap_or(f64::NAN);
        let material_index = used.index(material_name, material);
        let region = region(&table, radius.largest_m());
        let rate_1_s = rate(&table, mean_mass_kg(density_kg_m3, &radius));
        let (from_s, until_s) = (table.number(&FROM), table.optional_number(&UNTIL).unwrap_or(f64::INFINITY));
        if until_s <= from_s {
            table.reject(
                &UNTIL,
                format!("expected a time after it opens, {:e} s, found {:e} s", Shown(from_s), Shown(until_s)),
            );
        }
        let limit = table.is_given(&LIMIT).then(|| table.whole(&LIMIT));
        let velocity_m_s = table.vector(&VELOCITY);
        let seed = if table.is_given(&SEED) { table.whole(&SEED) } else { usual.seed };
        table.finish();
        // Where one is missing that has been reported, and the scene is not run.
        if let Some(region) = region {
            pours.push(Pour {
                name,
                region,
                rate_1_s,
                from_s,
                until_s,
                limit,
                radius,
                material: material_index,
                velocity_m_s,
                seed,
            });
        }
    }
    pours
}

/// Reads the domain.
pub(crate) fn domain(particles: &Table<'_>, key: &'static Key) -> Option<Domain> {
    let table = particles.optional_table(key)?;
    let [lower_m, upper_m] = corners(&table);
    table.finish();
    Some(Domain { lower_m, upper_m })
}

fn corners(table: &Table<'_>) -> [[f64; 3]; 2] {
    let (lower, upper) = (table.vector(&LOWER), table.vector(&UPPER));
    if (0..3).any(|axis| lower[axis] >= upper[axis]) {
        table.reject(&UPPER, "expected to lie above the lower corner along every axis");
    }
    [lower, upper]
}

/// Where particles of up to `largest_m` appear.
fn region(table: &Table<'_>, largest_m: f64) -> Option<PourRegion> {
    match (table.optional_table(&BOX), table.optional_table(&DISC)) {
        (Some(inside), None) => {
            let [lower_m, upper_m] = corners(&inside);
            if (0..3).any(|axis| upper_m[axis] - lower_m[axis] < 2.0 * largest_m) {
                let diameter_m = 2.0 * largest_m;
                inside.reject(
                    &UPPER,
                    format!("expected edges of at least the largest diameter, {:e} m", Shown(diameter_m)),
                );
            }
            inside.finish();
            Some(PourRegion::Box { lower_m, upper_m })
        }
        (None, Some(disc)) => {
            let (centre_m, radius_m) = (disc.vector(&CENTRE), disc.number(&DISC_RADIUS));
            if radius_m < largest_m {
                disc.reject(
                    &DISC_RADIUS,
                    format!("expected at least the largest radius poured, {:e} m", Shown(largest_m)),
                );
            }
            disc.finish();
            Some(PourRegion::Disc { centre_m, radius_m })
        }
        (Some(_), Some(_)) => {
            table.reject(&DISC, "a dispenser has a box or a disc, not both; give them two names");
            None
        }
        (None, None) => {
            // A box or disc that is no table has been reported already.
            if !table.is_given(&BOX) && !table.is_given(&DISC) {
                table.reject(&BOX, "missing; expected a box or a disc");
            }
            None
        }
    }
}

/// Particles per second.
fn rate(table: &Table<'_>, mean_mass_kg: f64) -> f64 {
    match (table.optional_number(&RATE_KEY), table.optional_number(&MASS_RATE)) {
        (Some(rate_1_s), None) => rate_1_s,
        (None, Some(rate_kg_s)) => rate_kg_s / mean_mass_kg,
        (Some(_), Some(_)) => {
            table.reject(&MASS_RATE, "a dispenser has a rate or a mass-rate, not both");
            f64::NAN
        }
        (None, None) => {
            if !table.is_given(&RATE_KEY) && !table.is_given(&MASS_RATE) {
                table.reject(&RATE_KEY, "missing; expected a rate or a mass-rate");
            }
            f64::NAN
        }
    }
}

/// ρ 4/3 π ⟨R³⟩ in kg: ⟨R³⟩ = R̄ (R̄² + s²) for R uniform in R̄ ± s, and R̄³ (1 + s²/R̄²)³ for a log-normal R of deviation s
/// (Johnson, Kotz & Balakrishnan 1994, ch. 14), before limits cut it.
fn mean_mass_kg(density_kg_m3: f64, radius: &Radius) -> f64 {
    let cube_m3 = match *radius {
        Radius::Uniform { mean_m, spread_m } => mean_m * (mean_m * mean_m + spread_m * spread_m),
        Radius::LogNormal { mean_m, deviation_m, .. } => {
            math::powi(mean_m * (1.0 + math::powi(deviation_m / mean_m, 2)), 3)
        }
    };
    density_kg_m3 * 4.0 / 3.0 * PI * cube_m3
}
