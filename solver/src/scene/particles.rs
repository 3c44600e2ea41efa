//! `[particles]`: what the particles are, where they start, how they move.

use std::collections::BTreeMap;

use super::{
    contact,
    key::{Key, Kind, Range, Section},
    materials::{self, Material},
    pour,
    reader::Table,
    units::{ACCELERATION, LENGTH, NUMBER, SPEED, TEMPERATURE, TIME},
};
use crate::physics::{
    Wall,
    particles::{Integrator, Settings, Start},
};

static COUNT: Key = Key::new("count", Kind::Whole(0, 10_000_000), "Number of particles.");
static RADIUS: Key = Key::new("radius", Kind::Table(&RADIUS_SECTION), "Radius.");
static MATERIAL: Key = Key::new("material", Kind::Text, "Material, built in or from [materials.NAME].").or("\"316L\"");
static START: Key = Key::new("start", Kind::Table(&START_SECTION), "Where particles start.");
static TEMPERATURE_KEY: Key = Key::new(
    "temperature",
    Kind::Number(&TEMPERATURE, Range::POSITIVE),
    "Temperature at the start; it stays so where [thermal] does not run.",
)
.or("\"300 K\"");
static CONTACT: Key = Key::new("contact", Kind::Table(&contact::CONTACT), "Normal contact.").or_from("overlap");
static FRICTION: Key = Key::new("friction", Kind::Table(&contact::FRICTION), "Friction.").or_from("none");
static ROLLING: Key =
    Key::new("rolling", Kind::Table(&contact::ROLLING), "Resistance to rolling and torsion.").or_from("none");
static OVERLAP_BOND: Key =
    Key::new("overlap-bond", Kind::Table(&contact::OVERLAP_BOND), "The monograph's bond.").or_from("none");
static DRAG: Key = Key::new("drag", Kind::Table(&contact::DRAG), "Drag of the gas.").or_from("none");
static GRAVITY: Key = Key::new("gravity", Kind::Vector(&ACCELERATION), "Gravity.").or("[0, 0, -9.81]");
static SPIN: Key = Key::new("spin", Kind::Flag, "Whether friction makes particles spin.").or("false");
static INTEGRATOR: Key =
    Key::new("integrator", Kind::Table(&INTEGRATOR_SECTION), "Time integration inside a step.").or_from("verlet");
static SKIN: Key = Key::new(
    "skin",
    Kind::Number(&NUMBER, Range::within(0.0, 10.0)),
    "Skin of the neighbour list as a share of each radius. It changes the run's speed, its result only by rounding.",
)
.or("0.3");

static POUR: Key = Key::new("pour", Kind::Named(&pour::POUR), "Dispensers, by name.").or_from("none");
static DOMAIN: Key = Key::new("domain", Kind::Table(&pour::DOMAIN), "Where particles are kept.").or_from("everywhere");

pub(super) static SECTION: Section = Section {
    path: "particles",
    doc: "The particles and their motion.",
    example: "[particles]",
    shorthand: None,
    keys: &[
        &COUNT,
        &RADIUS,
        &MATERIAL,
        &START,
        &TEMPERATURE_KEY,
        &CONTACT,
        &FRICTION,
        &ROLLING,
        &OVERLAP_BOND,
        &DRAG,
        &GRAVITY,
        &SPIN,
        &INTEGRATOR,
        &SKIN,
        &POUR,
        &DOMAIN,
    ],
};

static MEAN: Key = Key::new("mean", Kind::Number(&LENGTH, Range::POSITIVE), "Mean radius.");
static SPREAD: Key = Key::new(
    "spread",
    Kind::Number(&LENGTH, Range::NOT_NEGATIVE),
    "Half width of the uniform distribution about the mean; less than the mean.",
)
.or("0");
static RADIUS_SECTION: Section = Section {
    path: "particles.radius",
    doc: "Distribution of radii.",
    example: "{ mean = \"25 um\", spread = \"5 um\" }",
    shorthand: Some(&MEAN),
    keys: &[&MEAN, &SPREAD],
};

static START_KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[("sequential-addition", "one after the other at random, none overlapping (Widom 1966)")]),
    "How places are chosen.",
)
.or("\"sequential-addition\"");
static BOX: Key = Key::new("box", Kind::Vector(&LENGTH), "Edges of the box that holds the particles.");
static AT: Key = Key::new("at", Kind::Vector(&LENGTH), "Lower corner of the box.")
    .or_from("centred over the origin, floor at z = 0");
static VELOCITY: Key = Key::new("velocity", Kind::Vector(&SPEED), "Velocity of every particle.").or("[0, 0, 0]");
static START_SECTION: Section = Section {
    path: "particles.start",
    doc: "Where particles start.",
    example: "{ box = [\"1 mm\", \"1 mm\", \"2 mm\"], velocity = [0, 0, \"-0.5 m/s\"] }",
    shorthand: None,
    keys: &[&START_KIND, &BOX, &AT, &VELOCITY],
};

static INTEGRATOR_KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        ("verlet", "velocity Verlet in substeps: the fast one"),
        ("trapezoidal", "the monograph's rule, iterated over the whole step (eqs. 6.23–6.27): the reference"),
    ]),
    "Method.",
)
.or("\"verlet\"");
static SUBSTEP: Key = Key::new("substep", Kind::Number(&TIME, Range::POSITIVE), "Largest substep.")
    .or_from("1/25 of the shortest contact")
    .when("kind", &["verlet"]);
static PHI: Key = Key::new(
    "phi",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "Weight φ of the step's end: 0 forward Euler, 1/2 midpoint, 1 backward Euler.",
)
.or("0.5")
.when("kind", &["trapezoidal"]);
static TOLERANCE: Key =
    Key::new("tolerance", Kind::Number(&NUMBER, Range::above(0.0, 0.1)), "Tolerance of the iteration, relative.")
        .or("1e-8")
        .when("kind", &["trapezoidal"]);
static ITERATIONS: Key =
    Key::new("iterations", Kind::Whole(1, 1000), "Iterations after which a smaller step is asked for.")
        .or("20")
        .when("kind", &["trapezoidal"]);
static INTEGRATOR_SECTION: Section = Section {
    path: "particles.integrator",
    doc: "Time integration of the motion inside a step.",
    example: "{ kind = \"trapezoidal\", phi = 0.5 }",
    shorthand: Some(&INTEGRATOR_KIND),
    keys: &[&INTEGRATOR_KIND, &SUBSTEP, &PHI, &TOLERANCE, &ITERATIONS],
};

/// What the other physics need to know of the particles.
pub(super) struct Bodies<'d> {
    table: Option<Table<'d>>,
    pub count: usize,
    pub radius_m: f64,
    pub spread_m: f64,
    pub material: (String, Material),
    pub temperature_k: f64,
    /// Whether particles may come and go during the run.
    pub come_and_go: bool,
}

/// A property of the particles' material, reported where it is missing.
pub(super) fn property(table: &Table<'_>, material: &(String, Material), name: &str, value: Option<f64>) -> f64 {
    value.unwrap_or_else(|| {
        let message = format!("the material {:?} has no `{name}`", material.0);
        table.reject_with(&MATERIAL, message, Some(format!("add `{name}` to [materials.{}]", material.0)));
        f64::NAN
    })
}

impl<'d> Bodies<'d> {
    /// Reads what the particles are. Without `[particles]` there are none, of 316L and a usual size: that nobody writes
    /// their positions is found when the ports are checked.
    pub fn read(table: Option<Table<'d>>, materials: &BTreeMap<String, Material>) -> Self {
        let Some(table) = table else {
            let material = materials.get("316L").copied().unwrap_or_default();
            let material = ("316L".into(), material);
            return Self {
                table: None,
                count: 0,
                radius_m: 25e-6,
                spread_m: 0.0,
                material,
                temperature_k: 300.0,
                come_and_go: false,
            };
        };
        let count = usize::try_from(table.whole(&COUNT)).unwrap_or(usize::MAX);
        let (mut radius_m, mut spread_m) = (f64::NAN, f64::NAN);
        if let Some(radius) = table.optional_table(&RADIUS) {
            (radius_m, spread_m) = (radius.number(&MEAN), radius.number(&SPREAD));
            if spread_m >= radius_m {
                radius.reject(&SPREAD, format!("expected less than the mean, {radius_m:e} m, found {spread_m:e} m"));
            }
            radius.finish();
        }
        let material = materials::choose(&table, &MATERIAL, materials);
        let temperature_k = table.number(&TEMPERATURE_KEY);
        let come_and_go = table.is_given(&POUR) || table.is_given(&DOMAIN);
        Self { count, radius_m, spread_m, material, temperature_k, come_and_go, table: Some(table) }
    }

    /// A property of the material, reported where it is missing.
    pub fn property(&self, name: &str, value: Option<f64>) -> f64 {
        match &self.table {
            Some(table) => property(table, &self.material, name, value),
            None => value.unwrap_or(f64::NAN),
        }
    }

    /// Reads how the particles start and move.
    pub fn settings(self, walls: &[Wall], seed: u64, thermal_runs: bool) -> Option<Settings> {
        let density_kg_m3 = self.property("density", self.material.1.density_kg_m3);
        let start = self.start(walls);
        let Self { table, count, radius_m, spread_m, material, temperature_k, .. } = self;
        let table = table?;
        // Everything is read before anything is given up, so that every mistake is found.
        let contact = contact::contact(&table, &CONTACT, &material);
        let friction = contact::friction(&table, &FRICTION);
        let rolling = contact::rolling(&table, &ROLLING);
        let bond = contact::overlap_bond(&table, &OVERLAP_BOND);
        let drag = contact::drag(&table, &DRAG);
        let (gravity_m_s2, spin, skin) = (table.vector(&GRAVITY), table.flag(&SPIN), table.number(&SKIN));
        let integrator = integrator(&table);
        let usual = pour::Usual { radius_m, spread_m, density_kg_m3, seed };
        let (pours, domain) = (pour::pours(&table, &POUR, &usual), pour::domain(&table, &DOMAIN));
        table.finish();
        let contact = contact?;
        Some(Settings {
            count,
            radius_m,
            radius_spread_m: spread_m,
            density_kg_m3,
            start: start?,
            seed,
            temperature_k,
            reads_temperature: thermal_runs && contact.softening_rate > 0.0,
            contact,
            friction,
            rolling,
            bond,
            drag,
            gravity_m_s2,
            walls: walls.to_vec(),
            spin,
            integrator: integrator?,
            skin,
            pours,
            domain,
        })
    }

    fn start(&self, walls: &[Wall]) -> Option<Start> {
        let table = self.table.as_ref()?.optional_table(&START)?;
        table.choice(&START_KIND);
        let edges = table.vector(&BOX);
        let largest = 2.0 * (self.radius_m + self.spread_m);
        if edges.iter().any(|edge| *edge < largest) {
            table.reject(&BOX, format!("expected edges of at least the largest particle's diameter, {largest:e} m"));
        }
        let lower_m = table.vector_or(&AT, [-edges[0] / 2.0, -edges[1] / 2.0, 0.0]);
        let upper_m = std::array::from_fn(|axis| lower_m[axis] + edges[axis]);
        for wall in walls {
            if wall.planes.iter().any(|plane| reach_behind(lower_m, upper_m, plane.through, plane.normal)) {
                let key = if table.is_given(&AT) { &AT } else { &BOX };
                table.reject(key, format!("the box reaches behind the wall `{}`", wall.name));
            }
        }
        let velocity_m_s = table.vector(&VELOCITY);
        table.finish();
        Some(Start::SequentialAddition { lower_m, upper_m, velocity_m_s })
    }
}

/// Whether a corner of a box lies behind a plane, by more than rounding.
fn reach_behind(lower: [f64; 3], upper: [f64; 3], through: [f64; 3], normal: [f64; 3]) -> bool {
    let corner = |axis: usize| if normal[axis] > 0.0 { lower[axis] } else { upper[axis] };
    let distance: f64 = (0..3).map(|axis| (corner(axis) - through[axis]) * normal[axis]).sum();
    let size: f64 = (0..3).map(|axis| (upper[axis] - lower[axis]).abs() + through[axis].abs()).sum();
    distance < -1e-9 * size
}

fn integrator(particles: &Table<'_>) -> Option<Integrator> {
    let table = particles.table(&INTEGRATOR)?;
    let integrator = match table.choice(&INTEGRATOR_KIND) {
        "trapezoidal" => Integrator::Trapezoidal {
            phi: table.number(&PHI),
            tolerance: table.number(&TOLERANCE),
            iterations: table.whole_u32(&ITERATIONS),
        },
        _ => Integrator::Verlet { substep_s: table.optional_number(&SUBSTEP) },
    };
    table.finish();
    Some(integrator)
}
