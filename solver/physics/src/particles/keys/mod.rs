//! `[particles]`: what the particles are, where they start, how they move.

mod bonds;
mod contact;
mod fields;
mod groups;
mod pairs;
mod particle_file;
mod pour;
mod start;

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{ACCELERATION, NUMBER, TEMPERATURE, TIME},
};
use std::cell::RefCell;

use self::{
    groups::{COUNT, GROUPS, MATERIAL, RADIUS, Used},
    start::{START, Starting},
};
use super::{
    advice::ADVISOR,
    model::ports::VAPOURISED,
    settings::{Group, Integrator, LeverArm, Pour, Settings, Start},
    tradeoff::TRADEOFF,
};
use crate::{
    PhysicsKind, Surroundings,
    common::{
        Bodies, Given, Pictured, Wall,
        keys::materials::{self, Material, Materials},
        property,
        walls::Motion,
    },
    configured,
};

static TEMPERATURE_KEY: Key = Key::new(
    "temperature",
    Kind::Number(&TEMPERATURE, Range::POSITIVE),
    "Temperature at the start; it stays so where [thermal] does not run.",
)
.or("\"300 K\"");
static CONTACT: Key = Key::new("contact", Kind::Table(&contact::CONTACT), "Normal contact.").or_from("overlap");
static FRICTION: Key = Key::new("friction", Kind::Table(&contact::FRICTION), "Friction.").or_from("none");
static PAIRS: Key =
    Key::new("pairs", Kind::Named(&pairs::PAIR), "Contacts of pairs of materials.").or_from("all alike");
static ROLLING: Key =
    Key::new("rolling", Kind::Table(&contact::ROLLING), "Resistance to rolling and torsion.").or_from("none");
static OVERLAP_BOND: Key =
    Key::new("overlap-bond", Kind::Table(&contact::OVERLAP_BOND), "The monograph's bond.").or_from("none");
static DRAG: Key = Key::new("drag", Kind::Table(&contact::DRAG), "Drag of the gas.").or_from("none");
static GRAVITY: Key = Key::new("gravity", Kind::Vector(&ACCELERATION), "Gravity.").or("[0, 0, -9.81]");
static CONTACT_FORCES: Key = Key::new(
    "contact-forces",
    Kind::Flag,
    "Whether the elastic normal force of each contact is written too, for pictures and exports.",
)
.or("false");
static SPIN: Key = Key::new("spin", Kind::Flag, "Whether friction makes particles spin.").or("false");
static LEVER_ARM: Key = Key::new(
    "lever-arm",
    Kind::Choice(&[
        ("contact-point", "from the centre to the contact point, between the centres: angular momentum is kept"),
        ("radius", "the monograph's (eqs. 6.11–6.15): friction makes angular momentum, δ/(2R) of what it transfers"),
    ]),
    "Arm at which friction turns a particle that spins.",
)
.or("\"contact-point\"");
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

static SECTION: Section = Section {
    path: "particles",
    doc: "The particles and their motion.",
    example: "[particles]",
    shorthand: None,
    keys: &[
        &COUNT,
        &RADIUS,
        &MATERIAL,
        &GROUPS,
        &START,
        &TEMPERATURE_KEY,
        &CONTACT,
        &FRICTION,
        &ROLLING,
        &PAIRS,
        &OVERLAP_BOND,
        &bonds::BONDS,
        &DRAG,
        &fields::ELECTROMAGNETIC,
        &fields::NEAR_FIELD,
        &fields::MAGNETIC,
        &GRAVITY,
        &SPIN,
        &LEVER_ARM,
        &CONTACT_FORCES,
        &INTEGRATOR,
        &SKIN,
        &POUR,
        &DOMAIN,
    ],
};

static INTEGRATOR_KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        ("verlet", "velocity Verlet in substeps: the fast one"),
        ("trapezoidal", "the monograph's rule, iterated over the whole step (eqs. 6.23–6.27): the reference"),
        ("held", "none: particles stay where they start, at rest. For beds that hardly move while they are heated"),
    ]),
    "Method.",
)
.or("\"verlet\"");
static SUBSTEP: Key = Key::new(
    "substep",
    Kind::Number(&TIME, Range::POSITIVE),
    "Largest substep; shorter ones are taken where contacts or ways within the step ask for them.",
)
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
static ACCELERATION_METHOD: Key = Key::new(
    "acceleration",
    Kind::Choice(&[
        ("none", "the plain iteration, which contracts for steps up to the contacts' critical one"),
        ("anderson", "Anderson's mixing: fewer iterations, and beyond the critical step too (Walker and Ni 2011)"),
    ]),
    "Acceleration of the iteration.",
)
.or("\"none\"")
.when("kind", &["trapezoidal"]);
static DEPTH: Key = Key::new(
    "depth",
    Kind::Whole(1, 50),
    "Earlier iterations that are mixed; each costs the memory of two sets of velocities.",
)
.or("5")
.when("acceleration", &["anderson"]);
static INTEGRATOR_SECTION: Section = Section {
    path: "particles.integrator",
    doc: "Time integration of the motion inside a step.",
    example: "{ kind = \"trapezoidal\", phi = 0.5 }",
    shorthand: Some(&INTEGRATOR_KIND),
    keys: &[&INTEGRATOR_KIND, &SUBSTEP, &PHI, &TOLERANCE, &ITERATIONS, &ACCELERATION_METHOD, &DEPTH],
};

/// The particles as a scene names them.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "particles",
    computes: "the motion of [particles]",
    doc: "The particles.",
    absent: "none run",
    section: &SECTION,
    rank: 0,
    bodies: Some(bodies),
    read: |table, surroundings| configured(read(table, surroundings)),
    advice: Some(&ADVISOR),
    tradeoff: Some(&TRADEOFF),
    pictured: &[
        Pictured::new("velocities", "speed", "Particles"),
        Pictured {
            beside: true,
            ..Pictured::new("contact_normal_force", "normal force of contacts", "Contact forces")
        },
    ],
};

/// What of the table was read before the other physics, and concerns the motion alone.
struct Beginning {
    groups: Vec<Group>,
    used: Used,
    start: Option<Start>,
    pours: Vec<Pour>,
}

/// Reads what the particles are and where they start. Without `[particles]` there are none, of 316L and a usual size:
/// that nobody writes their positions is found when the ports are checked.
fn bodies<'d>(table: Option<Table<'d>>, materials: &Materials, walls: &[Wall], seed: u64) -> Bodies<'d> {
    let Some(table) = table else {
        let material = ("316L".to_owned(), materials.get("316L").cloned().unwrap_or_default());
        return Bodies {
            table: RefCell::default(),
            material_key: &MATERIAL,
            beginning: RefCell::default(),
            count: 0,
            radius_m: 25e-6,
            small_m: 25e-6,
            materials: vec![material.clone()],
            material,
            temperature_k: 300.0,
            given: None,
        };
    };
    let mut used = Used::default();
    let material = materials::choose(&table, &MATERIAL, materials);
    used.index(material.0.clone(), material.1.clone());
    let temperature_k = table.number(&TEMPERATURE_KEY);
    let (mut groups, mut count, mut radius_m, mut small_m) = (Vec::new(), 0, f64::NAN, f64::NAN);
    let mut given = None;
    let poured = table.is_given(&POUR);
    let start = match Starting::read(&table) {
        Some(starting) if starting.gives_all() => {
            let (start, heat) = starting.given(materials, &mut used).unzip();
            if let Some(Start::Given { radii_m, materials, .. }) = &start {
                let (radii_m, materials) = (radii_m.clone(), materials.clone());
                given = Some(Given { radii_m, materials, heat: heat.flatten() });
            }
            if let Some(Start::Given { radii_m, .. }) = &start {
                count = radii_m.len();
                radius_m = radii_m.iter().sum::<f64>() / count.max(1) as f64;
                let mut sorted_m = radii_m.clone();
                sorted_m.sort_by(f64::total_cmp);
                small_m = sorted_m.get(count / 20).copied().unwrap_or(f64::NAN);
            }
            start
        }
        starting => {
            groups = groups::read(&table, materials, &mut used, poured);
            let there = groups.iter().filter(|group| group.count > 0);
            let largest_m = there.map(|group| group.radius.largest_m()).fold(f64::NAN, f64::max);
            count = groups.iter().map(|group| group.count).fold(0, usize::saturating_add);
            radius_m = groups.iter().map(|group| group.radius.mean_m()).fold(f64::NAN, f64::min);
            small_m = groups.iter().map(|group| group.radius.small_m()).fold(f64::NAN, f64::min);
            match starting {
                Some(starting) => starting.place(largest_m, walls),
                // Particles that all come from dispensers start nowhere.
                None if poured && count == 0 => Some(Start::Given {
                    positions_m: Vec::new(),
                    velocities_m_s: Vec::new(),
                    radii_m: Vec::new(),
                    materials: Vec::new(),
                    spins_rad_s: Vec::new(),
                }),
                None => {
                    if !table.is_given(&START) {
                        table.missing(&START);
                    }
                    None
                }
            }
        }
    };
    let usual = pour::Usual { radius: groups.first().map(|group| group.radius), material: &material, seed };
    let pours = pour::pours(&table, &POUR, &usual, materials, &mut used);
    small_m = pours.iter().map(|pour| pour.radius.small_m()).fold(small_m, f64::min);
    Bodies {
        table: RefCell::new(Some(table)),
        material_key: &MATERIAL,
        materials: used.list.clone(),
        beginning: RefCell::new(Some(Box::new(Beginning { groups, used, start, pours }))),
        count,
        radius_m,
        small_m,
        material,
        temperature_k,
        given,
    }
}

/// Reads how the particles move.
fn read(table: Table<'_>, surroundings: &Surroundings<'_, '_>) -> Option<Settings> {
    let Surroundings { bodies, walls, seed, on_substrate: substrate, .. } = *surroundings;
    let (written, read) = (surroundings.written(), surroundings.read());
    let beginning = bodies.beginning.take()?.downcast::<Beginning>().ok()?;
    let Beginning { groups, used, start, pours } = *beginning;
    let (material, temperature_k) = (&bodies.material, bodies.temperature_k);
    let density = |used: &(String, Material)| property(&table, &MATERIAL, used, "density", used.1.density_kg_m3);
    let mut materials = used.settings(density);
    // Everything is read before anything is given up, so that every mistake is found.
    let contact = contact::contact(&table, &CONTACT, material);
    let friction = contact::friction(&table, &FRICTION);
    // A stiffness in the scene's contact holds for all materials.
    if !contact.as_ref().is_some_and(|(_, of_material)| *of_material) {
        for material in &mut materials {
            (material.stiffness, material.poisson) = (None, None);
        }
    }
    let contact = contact.map(|(contact, _)| contact);
    let pairs = pairs::read(&table, &PAIRS, &materials, walls);
    let rolling = contact::rolling(&table, &ROLLING);
    let bond = contact::overlap_bond(&table, &OVERLAP_BOND);
    let drag = contact::drag(&table, &DRAG);
    let bonds = bonds::read(&table);
    let fields = fields::read(&table);
    let writes_contact_forces = table.flag(&CONTACT_FORCES);
    let (gravity_m_s2, spin, skin) = (table.vector(&GRAVITY), table.flag(&SPIN), table.number(&SKIN));
    if bonds.is_some() && !spin {
        table.reject_with(&bonds::BONDS, "bonds need particles that spin", Some("add spin = true".into()));
    }
    if matches!(start, Some(Start::Settle { .. })) && gravity_m_s2 == [0.0; 3] {
        table.reject(&GRAVITY, "particles settle under gravity, and there is none");
    }
    let lever_arm = match table.choice(&LEVER_ARM) {
        "radius" => LeverArm::Radius,
        _ => LeverArm::ContactPoint,
    };
    let integrator = integrator(&table);
    let moving = walls.iter().any(|wall| wall.motion != Motion::Fixed);
    if integrator == Some(Integrator::Held)
        && (moving || !pours.is_empty() || substrate.is_some_and(|under| under.deflects))
    {
        let message =
            "particles that are held cannot follow what moves: a wall, a dispenser or a substrate that gives way";
        table.reject_with(&INTEGRATOR, message, Some("leave `integrator` out, or what moves".into()));
    }
    let domain = pour::domain(&table, &DOMAIN);
    table.finish();
    let contact = contact?;
    Some(Settings {
        groups,
        materials,
        start: start?,
        seed,
        temperature_k,
        writes_ids: written.contains(VAPOURISED),
        writes_contact_forces,
        writes_material: read.contains("material"),
        substrate,
        contact,
        friction,
        rolling,
        pairs,
        bond,
        bonds,
        drag,
        fields,
        gravity_m_s2,
        walls: walls.to_vec(),
        spin,
        lever_arm,
        integrator: integrator?,
        skin,
        pours,
        domain,
    })
}

fn integrator(particles: &Table<'_>) -> Option<Integrator> {
    let table = particles.table(&INTEGRATOR)?;
    let integrator = match table.choice(&INTEGRATOR_KIND) {
        "trapezoidal" => Integrator::Trapezoidal {
            phi: table.number(&PHI),
            tolerance: table.number(&TOLERANCE),
            iterations: table.whole_u32(&ITERATIONS),
            anderson_depth: match table.choice(&ACCELERATION_METHOD) {
                "anderson" => table.whole_u32(&DEPTH),
                _ => 0,
            },
        },
        "held" => Integrator::Held,
        _ => Integrator::Verlet { substep_s: table.optional_number(&SUBSTEP) },
    };
    table.finish();
    Some(integrator)
}
