//! `[particles.radius]` and `[particles.groups.NAME]`: how many particles of which size and material.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::LENGTH,
};
use std::collections::BTreeMap;

use crate::common::keys::materials::{self, Material};
use crate::particles::settings::{self, Group, Radius};
use stagger_messages::Shown;

pub(crate) static COUNT: Key = Key::new("count", Kind::Whole(0, 10_000_000), "Number of particles.")
    .or_from("**required**, unless a file or dispensers give the particles");
pub(crate) static RADIUS: Key = Key::new("radius", Kind::Table(&RADIUS_SECTION), "Radius.")
    .or_from("**required**, unless a file gives the particles");
pub(crate) static MATERIAL: Key =
    Key::new("material", Kind::Text, "Material, built in or from [materials.NAME].").or("\"316L\"");
pub(crate) static GROUPS: Key =
    Key::new("groups", Kind::Named(&GROUP_SECTION), "More particles, of other sizes or materials.").or_from("none");

static GROUP_COUNT: Key = Key::new("count", Kind::Whole(0, 10_000_000), "Number of particles.");
static GROUP_RADIUS: Key = Key::new("radius", Kind::Table(&RADIUS_SECTION), "Radius.");
static GROUP_MATERIAL: Key =
    Key::new("material", Kind::Text, "Material, built in or from [materials.NAME].").or_from("that of [particles]");
static GROUP_SECTION: Section = Section {
    path: "particles.groups.NAME",
    doc: "Particles beside those that [particles] itself describes. All are placed together, largest first.",
    example: "{ count = 100, radius = \"60 um\", material = \"AlSi10Mg\" }",
    shorthand: None,
    keys: &[&GROUP_COUNT, &GROUP_RADIUS, &GROUP_MATERIAL],
};

static DISTRIBUTION: Key = Key::new(
    "distribution",
    Kind::Choice(&[
        ("uniform", "every radius from mean − spread to mean + spread is as likely"),
        ("log-normal", "the logarithm is normally distributed; what falls outside the limits is drawn again"),
    ]),
    "Distribution of radii by number.",
)
.or("\"uniform\"");
static MEAN: Key = Key::new("mean", Kind::Number(&LENGTH, Range::POSITIVE), "Mean radius, before limits cut it.");
static SPREAD: Key = Key::new(
    "spread",
    Kind::Number(&LENGTH, Range::NOT_NEGATIVE),
    "Half width of the uniform distribution about the mean; less than the mean.",
)
.or("0")
.when("distribution", &["uniform"]);
static DEVIATION: Key =
    Key::new("deviation", Kind::Number(&LENGTH, Range::NOT_NEGATIVE), "Standard deviation, before limits cut it.")
        .when("distribution", &["log-normal"]);
static MINIMUM: Key = Key::new("minimum", Kind::Number(&LENGTH, Range::POSITIVE), "Smallest radius; at most the mean.")
    .when("distribution", &["log-normal"]);
static MAXIMUM: Key = Key::new("maximum", Kind::Number(&LENGTH, Range::POSITIVE), "Largest radius; at least the mean.")
    .when("distribution", &["log-normal"]);
pub(crate) static RADIUS_SECTION: Section = Section {
    path: "particles.radius",
    doc: "Distribution of radii.",
    example: "{ mean = \"25 um\", spread = \"5 um\" }",
    shorthand: Some(&MEAN),
    keys: &[&DISTRIBUTION, &MEAN, &SPREAD, &DEVIATION, &MINIMUM, &MAXIMUM],
};

/// The materials that particles are made of, each once, in the order of their first use.
#[derive(Default)]
pub(crate) struct Used {
    pub list: Vec<(String, Material)>,
}

impl Used {
    /// The index of a material, which is added where it is new.
    pub fn index(&mut self, name: String, material: Material) -> u16 {
        let known = self.list.iter().position(|(other, _)| *other == name).unwrap_or_else(|| {
            self.list.push((name, material));
            self.list.len() - 1
        });
        // A scene with more materials than that does not fit into memory.
        u16::try_from(known).unwrap_or(u16::MAX)
    }

    /// The materials with what the particles' motion needs of them.
    pub fn settings(&self, density: impl Fn(&(String, Material)) -> f64) -> Vec<settings::Material> {
        let settings = |used: &(String, Material)| settings::Material {
            name: used_name(used),
            density_kg_m3: density(used),
            stiffness: used.1.young_pa,
            poisson: used.1.poisson,
        };
        self.list.iter().map(settings).collect()
    }
}

fn used_name((name, _): &(String, Material)) -> String {
    name.clone()
}

/// Reads the groups of particles, that of `[particles]` itself first; `poured` says whether dispensers bring more.
pub(crate) fn read(
    table: &Table<'_>,
    materials: &BTreeMap<String, Material>,
    used: &mut Used,
    poured: bool,
) -> Vec<Group> {
    let count = |value| usize::try_from(value).unwrap_or(usize::MAX);
    if !table.is_given(&COUNT) && !poured {
        table.missing(&COUNT);
    }
    if !table.is_given(&RADIUS) {
        table.missing(&RADIUS);
    }
    let mut groups = vec![Group {
        name: "particles".into(),
        count: if table.is_given(&COUNT) { count(table.whole(&COUNT)) } else { 0 },
        radius: radius(table, &RADIUS),
        material: 0,
    }];
    for (name, group) in table.named(&GROUPS) {
        let material = if group.is_given(&GROUP_MATERIAL) {
            let (name, material) = materials::choose(&group, &GROUP_MATERIAL, materials);
            used.index(name, material)
        } else {
            0
        };
        groups.push(Group {
            name,
            count: count(group.whole(&GROUP_COUNT)),
            radius: radius(&group, &GROUP_RADIUS),
            material,
        });
        group.finish();
    }
    groups
}

/// Reads a distribution of radii.
pub(crate) fn radius(table: &Table<'_>, key: &'static Key) -> Radius {
    let Some(radius) = table.optional_table(key) else { return Radius::Uniform { mean_m: f64::NAN, spread_m: 0.0 } };
    let mean_m = radius.number(&MEAN);
    let distribution = match radius.choice(&DISTRIBUTION) {
        "log-normal" => {
            let (minimum_m, maximum_m) = (radius.number(&MINIMUM), radius.number(&MAXIMUM));
            if minimum_m > mean_m {
                radius.reject(
                    &MINIMUM,
                    format!("expected at most the mean, {:e} m, found {:e} m", Shown(mean_m), Shown(minimum_m)),
                );
            }
            if maximum_m < mean_m {
                radius.reject(
                    &MAXIMUM,
                    format!("expected at least the mean, {:e} m, found {:e} m", Shown(mean_m), Shown(maximum_m)),
                );
            }
            Radius::LogNormal { mean_m, deviation_m: radius.number(&DEVIATION), minimum_m, maximum_m }
        }
        _ => {
            let spread_m = radius.number(&SPREAD);
            if spread_m >= mean_m {
                radius.reject(
                    &SPREAD,
                    format!("expected less than the mean, {:e} m, found {:e} m", Shown(mean_m), Shown(spread_m)),
                );
            }
            Radius::Uniform { mean_m, spread_m }
        }
    };
    radius.finish();
    distribution
}
