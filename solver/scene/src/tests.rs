//! Whole scenes: what they give, and the mistakes that are named.

// Values are read here, not computed: they are equal to the last bit.
#![allow(clippy::float_cmp)]

use proptest::prelude::*;

mod advice;
mod current;
mod pour;
mod presets;
mod reference;
mod thermal;
use stagger_coupling::{Acceleration, FieldSettings};
use stagger_physics::{
    common::walls::{Cylinder, During, Motion, Pressed, Series, Shape, Side, Withdrawal},
    optics::{Model, Path, Profile},
    particles::{
        Base, BondSettings, BondStiffness, Charge, ContactLaw, Electromagnetic, FieldForces, FieldRegion, Friction,
        Group, Integrator, Lattice, Magnetic, MagneticSource, NearFieldSettings, Presence, Radius, Start, StartRegion,
    },
    thermal::Conductance,
};

use super::*;

/// A scene that says as much as one scene can.
const FULL: &str = r#"
title = "all keys"
duration = "1 ms"
seed = 3

[materials.copper]
density = "8.96 g/cm^3"
heat-capacity = "385 J/kg/K"
conductivity = 400
young = "110 GPa"
poisson = 0.34
absorption = "1e8 1/m"
solidus = 1357
liquidus = 1358
melting-heat = "205 kJ/kg"
boiling = 2835
boiling-heat = 4.7e6

[particles]
count = 10
radius = { mean = "25 um", spread = "5 um" }
material = "copper"
start = { kind = "sequential-addition", box = ["1 mm", "1 mm", "2 mm"], at = [0, 0, "1 um"], velocity = ["0", 0, "-0.5 m/s"] }
temperature = 310
contact = { law = "overlap", stiffness = "2e9 Pa", exponent = 1.5, damping = 10.0, softening = { rate = 1, reference = "290 K", floor = "1e8 Pa" } }
friction = { law = "regularised", stiffness = 1e12, static = 0.5, dynamic = 0.2 }
drag = { law = "stokes", viscosity = "2.2e-5 Pa s", velocity = [1, 0, 0] }
gravity = [0, 0, -1.62]
spin = true
integrator = { kind = "trapezoidal", phi = 1, tolerance = 1e-9, iterations = 7, acceleration = "anderson", depth = 4 }
skin = 0.2

[particles.bonds]
stiffness = "beam"
young = "2 GPa"
ratio = 3
radius = 0.5
at-start = false
gap = 0.1
strain = 0.02
tensile-strength = "1 MPa"
shear-strength = "2 MPa"
damping = 0.1

[particles.electromagnetic]
electric = ["-100 N/C", 0, 0]
magnetic = [0, 0, "20 mT"]
charge = { per-particle = "3 pC" }
region = { kind = "half-space", through = [2, 0, 0], normal = [-2, 0, 0] }
starts = "1 us"
ends = "2 us"

[particles.near-field]
ionised = true
base = "charge"
signs = "alternating"
attraction = 0.5
attraction-exponent = 1.5
repulsion = 0.01
repulsion-exponent = 3
cut-off = "1 mm"
skin = 0.2
closest = 0.01
region = { kind = "box", lower = [0, 0, 0], upper = [1, 2, 3] }
ends = 7

[particles.magnetic]
magnetisability = 1e6
uniform-gradient = { origin = [0, 0, 0.1], x = [-1, 0, 0], y = [0, -1, 0], z = [0, 0, 2] }
ends = 7

[particles.groups.coarse]
count = 7
radius = { distribution = "log-normal", mean = "50 um", deviation = "10 um", minimum = "30 um", maximum = "90 um" }
material = "copper"

[walls.z-plate]
plane = { through = [0, 0, 0], normal = [0, 0, 2] }
temperature = "320 K"

[walls.a-box]
box = { lower = ["-1 mm", "-1 mm", "-1 mm"], upper = ["3 mm", "3 mm", "3 mm"], open = ["+z", "-x"] }
motion = { kind = "path", times = [0, "1 ms"], displacements = [[0, 0, 0], ["1 um", 0, 0]] }
material = "copper"

[walls.drum]
cylinder = { through = [0, 0, "1 mm"], axis = [0, 2, 0], radius = "9 mm", particles = "inside" }
motion = { kind = "rotation", through = [0, 0, "1 mm"], axis = [0, 1, 0], frequency = "2 Hz", from = "1 ms", until = "2 ms" }

[walls.tube]
cylinder = { axis = [0, 0, 1], radius = "9 mm", length = "20 mm" }
motion = { kind = "constant", velocity = [0, 0, "1 m/s"], from = "0.1 ms" }

[walls.tool]
mesh = { file = "tool.stl", unit = "1 mm", at = [0, 0, "-20 mm"] }
motion = { kind = "oscillation", amplitude = [0, 0, "1 um"], frequency = "50 Hz", phase = 0.5 }

[walls.lid]
plane = { through = [0, 0, "9 mm"], normal = [0, 0, -1] }

[walls.lid.motion]
kind = "pressed"
direction = [0, 0, -2]
mass = "1 g"
damping = "0.1 N s/m"
times = [0, "1 ms"]
force = [0, "5 N"]
withdrawal = { from = "2 ms", speed = "0.1 m/s" }
stops = { backward = 0, forward = "8 mm" }

[thermal]
conductance = "constriction"
phi = 1
tolerance = 1e-11
iterations = 50

[optics]
fidelity = "beer-lambert"
power = "40 W"
absorption = "1e4 1/m"
spacing = "5 um"
profile = { kind = "top-hat", radius = "60 um" }
direction = [0, 0, -3]
path = { kind = "sweep", from = [0, 0, 0], to = ["1 mm", 0, 0], speed = "0.5 m/s" }
starts = "0.1 ms"
ends = "0.9 ms"
pulses = { period = "100 us", on = "20 us" }

[nodes.heat]
physics = "thermal"

[nodes.second]
physics = "optics"
optics = { power = "10 W", profile = { radius = "20 um" }, path = { kind = "fixed", at = [0, 0, 0] } }

[coupling]
order = "jacobi"
sequence = ["heat", "particles"]
acceleration = { method = "iqn-ils", relaxation = 0.4, reused-steps = 3, columns = 30, filter = 1e-3 }
fields.temperature = { absolute = 1e-3, acceleration = "aitken" }
fields.positions.absolute = 1e-9
every = { heat = 2, second = 5 }
tolerance = { positions = 1e-5 }
default-tolerance = 1e-7
iterations = 9
frozen = "held"
dt = { start = "1 us", limit = "20 us", minimum = "1 ns", growth = 2 }

[record]
level = "accepted"
every = 4
fields = ["positions", "temperature"]
frames = 50
buffer = 64

[recovery]
checkpoint = 20
restarts = 7
hang = "1 min"
start = "5 s"

[tradeoff]
quantities = ["mean temperature", "porosity"]

[presets.draft]
coupling.dt.limit = "40 us"
"#;

/// The least a scene with all physics says.
const SHORT: &str = r#"
duration = 1e-3
[particles]
count = 10
radius = "25 um"
start = { box = ["1 mm", "1 mm", "2 mm"] }
[thermal]
[optics]
power = 40
profile = { radius = "60 um" }
path = { kind = "fixed", at = [0, 0, 0] }
[coupling]
dt = "1 us"
"#;

/// The one file that the scenes here name.
const BED: &str = "x,y,z,radius,material\n0,0,1,0.5,copper\n0,0,2.5,0.5,1\n";

fn set(key: &str, value: &str) -> (String, String) {
    (key.into(), value.into())
}

/// The files the scenes name: a triangle with edges of 1, and a bed.
fn read_file(path: &str) -> Result<Vec<u8>, String> {
    let corners = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n";
    let text = format!("solid\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid\n");
    match path {
        "tool.stl" => Ok(text.into_bytes()),
        "bed.csv" => Ok(BED.into()),
        _ => Err("no such file".into()),
    }
}

fn parse(text: &str, overrides: &[(&str, &str)]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| set(key, value)).collect();
    Scene::parse_with_files(text, "x.toml", &overrides, &read_file).unwrap_or_else(|problems| panic!("{problems}"))
}

/// Whether the particles read a field that another physics of the scene writes.
fn particles_read(scene: &Scene, field: &str) -> bool {
    let reads = scene.physics["particles"].ports().reads;
    scene.written().contains(field) && reads.iter().any(|port| port.field == field)
}

#[test]
fn every_value_of_a_scene_reaches_its_setting() {
    let scene = parse(FULL, &[]);
    assert_eq!((scene.title.as_str(), scene.duration_s, scene.seed), ("all keys", 1e-3, 3));
    let particles = scene.settings::<stagger_physics::particles::Settings>().unwrap().clone();
    assert_eq!((particles.count(), particles.groups.len()), (17, 2));
    assert_eq!(particles.groups[0].radius, Radius::Uniform { mean_m: 2.5e-5, spread_m: 5e-6 });
    let coarse = Radius::LogNormal { mean_m: 5e-5, deviation_m: 1e-5, minimum_m: 3e-5, maximum_m: 9e-5 };
    assert_eq!(particles.groups[1], Group { name: "coarse".into(), count: 7, radius: coarse, material: 0 });
    assert_eq!((particles.materials[0].name.as_str(), particles.materials[0].density_kg_m3), ("copper", 8960.0));
    assert_eq!((particles.temperature_k, particles.seed), (310.0, 3));
    let Start::SequentialAddition { region, velocity_m_s } = particles.start else { panic!("sequential") };
    let bounds = ([0.0, 0.0, 1e-6], [1e-3, 1e-3, 1e-6 + 2e-3]);
    assert_eq!((region.bounds(), velocity_m_s), (bounds, [0.0, 0.0, -0.5]));
    let contact = particles.contact;
    assert_eq!(contact.law, ContactLaw::Overlap { stiffness_pa: 2e9, exponent: 1.5 });
    assert_eq!((contact.softening_rate, contact.softening_reference_k), (1.0, 290.0));
    assert_eq!((contact.softening_floor_pa, contact.damping_n_s_m3), (1e8, 10.0));
    let friction = particles.friction.unwrap();
    let expected = Friction::Regularised { stiffness_n_m3: 1e12, static_coefficient: 0.5, dynamic_coefficient: 0.2 };
    assert_eq!(friction, expected);
    assert_eq!(particles.drag.unwrap().velocity_m_s, [1.0, 0.0, 0.0]);
    assert_eq!((particles.gravity_m_s2, particles.spin, particles.skin), ([0.0, 0.0, -1.62], true, 0.2));
    assert_eq!(
        particles.integrator,
        Integrator::Trapezoidal { phi: 1.0, tolerance: 1e-9, iterations: 7, anderson_depth: 4 }
    );
    let bonds = BondSettings {
        stiffness: BondStiffness::Beam { young_pa: 2e9, ratio: 3.0 },
        radius_share: 0.5,
        gap_share: None,
        strain: Some(0.02),
        tensile_strength_pa: Some(1e6),
        shear_strength_pa: Some(2e6),
        damping: 0.1,
    };
    assert_eq!(particles.bonds, Some(bonds));
    let fields = particles.fields;
    let region = FieldRegion::HalfSpace { through_m: [2.0, 0.0, 0.0], normal: [-1.0, 0.0, 0.0] };
    let electromagnetic = Electromagnetic {
        charge: Charge::PerParticle(3e-12),
        electric_v_m: [-100.0, 0.0, 0.0],
        magnetic_t: [0.0, 0.0, 0.02],
        presence: Presence { region, starts_s: 1e-6, ends_s: 2e-6 },
    };
    assert_eq!(fields.electromagnetic, Some(electromagnetic));
    let region = FieldRegion::Box { lower_m: [0.0; 3], upper_m: [1.0, 2.0, 3.0] };
    let near_field = NearFieldSettings {
        attraction: 0.5,
        attraction_exponent: 1.5,
        repulsion: 0.01,
        repulsion_exponent: 3.0,
        base: Base::Charge,
        alternating: true,
        cutoff_m: Some(1e-3),
        skin: 0.2,
        closest: 0.01,
        presence: Presence { region, starts_s: 0.0, ends_s: 7.0 },
    };
    assert_eq!(fields.near_field, Some(near_field));
    let gradient_t_m = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 2.0]];
    let source = MagneticSource::Gradient { origin_t: [0.0, 0.0, 0.1], gradient_t_m };
    let magnetic =
        Magnetic { magnetisability_a2_n: 1e6, source, presence: Presence { ends_s: 7.0, ..Presence::default() } };
    assert_eq!(fields.magnetic, Some(magnetic));
    assert!(particles_read(&scene, "temperature"));

    // Walls keep the order of the file, which is not that of their names; normals are unit vectors.
    let names: Vec<&str> = scene.walls.iter().map(|wall| wall.name.as_str()).collect();
    assert_eq!(names, ["z-plate", "a-box", "drum", "tube", "tool", "lid"]);
    assert_eq!(scene.walls[0].shape.planes()[0].normal, [0.0, 0.0, 1.0]);
    assert_eq!((scene.walls[0].temperature_k, scene.walls[1].temperature_k), (Some(320.0), None));
    assert_eq!(scene.walls[1].shape.planes().len(), 4);
    assert!(scene.walls[1].shape.planes().iter().all(|plane| {
        // The box's centre is inside.
        (0..3).map(|axis| (1e-3 - plane.through[axis]) * plane.normal[axis]).sum::<f64>() > 0.0
    }));
    walls_reach_their_settings(&scene.walls);

    let thermal = scene.settings::<stagger_physics::thermal::Settings>().unwrap().clone();
    assert_eq!((thermal.heat_capacity_j_kg_k, thermal.conductivity_w_m_k), (385.0, 400.0));
    assert_eq!((thermal.conductance, thermal.phi, thermal.iterations), (Conductance::Constriction, 1.0, 50));
    assert_eq!(thermal.walls, scene.walls);
    let optics = scene.settings::<stagger_physics::optics::Settings>().unwrap().clone();
    assert_eq!(optics.model, Model::BeerLambert { absorption_1_m: 1e4, spacing_m: 5e-6 });
    assert_eq!(optics.beam.profile, Profile::TopHat { radius_m: 6e-5 });
    assert_eq!((optics.beam.direction, optics.beam.power_w), ([0.0, 0.0, -1.0], 40.0));
    assert!(matches!(optics.beam.path, Path::Sweep { speed_m_s: 0.5, .. }));
    assert_eq!((optics.beam.starts_s, optics.beam.ends_s), (1e-4, 9e-4));
    assert_eq!(optics.beam.pulses.unwrap().on_s, 2e-5);
    assert_eq!(scene.nodes["heat"].physics.as_deref(), Some("thermal"));
    let coupling = scene.coupling.clone();
    assert_eq!(coupling.tolerance["positions"], 1e-5);
    assert_eq!((coupling.default_tolerance, coupling.iterations, coupling.interpolate), (1e-7, 9, false));
    assert_eq!((coupling.dt.start_s, coupling.dt.limit_s), (1e-6, 2e-5));
    assert_eq!((coupling.dt.minimum_s, coupling.dt.growth), (1e-9, 2.0));
    let fields = Some(vec!["positions".to_owned(), "temperature".to_owned()]);
    let record = RecordSettings { level: Level::Accepted, every: 4, fields, frames: 50, buffer_bytes: 64 << 20 };
    assert_eq!(scene.record, record);
    let expected = Acceleration::IqnIls { relaxation: 0.4, reused_steps: 3, columns: 30, filter: 1e-3 };
    assert_eq!(coupling.acceleration, expected);
    let aitken = Some(Acceleration::Aitken { relaxation: 0.5 });
    let temperature = FieldSettings { absolute: Some(1e-3), acceleration: aitken };
    let positions = FieldSettings { absolute: Some(1e-9), acceleration: None };
    let fields = [("positions".to_owned(), positions), ("temperature".to_owned(), temperature)];
    assert_eq!(coupling.fields, BTreeMap::from(fields));
    assert_eq!(coupling.every, BTreeMap::from([("heat".to_owned(), 2), ("second".to_owned(), 5)]));
    let recovery = RecoverySettings { checkpoint_steps: 20, restarts: 7, hang_s: 60.0, start_s: 5.0 };
    assert_eq!(scene.recovery, recovery);
    let tables = scene.tables();
    let mut lasers = tables.each::<stagger_physics::optics::Settings>();
    let (_, second) = lasers.find(|(table, _)| *table == "nodes.second").unwrap();
    assert_eq!((second.beam.power_w, second.count), (10.0, 17));
    assert_eq!(second.beam.profile, Profile::Gaussian { radius_m: 2e-5 });
}

fn walls_reach_their_settings(walls: &[Wall]) {
    let materials: Vec<_> = walls.iter().filter_map(|wall| wall.material.as_deref()).collect();
    assert_eq!((walls[0].motion.clone(), materials), (Motion::Fixed, vec!["copper"]));
    let displacements = Series { times_s: vec![0.0, 1e-3], values: vec![[0.0; 3], [1e-6, 0.0, 0.0]] };
    assert_eq!(walls[1].motion, Motion::Path(displacements));
    let drum = Cylinder {
        through_m: [0.0, 0.0, 1e-3],
        axis: [0.0, 1.0, 0.0],
        radius_m: 9e-3,
        particles: Side::Inside,
        length_m: None,
    };
    assert_eq!(walls[2].shape, Shape::Cylinder(drum));
    let during = During { from_s: 1e-3, until_s: 2e-3 };
    let speed_rad_s = 4.0 * std::f64::consts::PI;
    let turning = Motion::Rotation { through_m: [0.0, 0.0, 1e-3], axis: [0.0, 1.0, 0.0], speed_rad_s, during };
    assert_eq!(walls[2].motion, turning);
    let tube = Cylinder { through_m: [0.0; 3], axis: [0.0, 0.0, 1.0], length_m: Some(20e-3), ..drum };
    assert_eq!(walls[3].shape, Shape::Cylinder(tube));
    let during = During { from_s: 1e-4, until_s: f64::INFINITY };
    assert_eq!(walls[3].motion, Motion::Constant { velocity_m_s: [0.0, 0.0, 1.0], during });
    let Shape::Mesh(mesh) = &walls[4].shape else { panic!("a mesh") };
    assert_eq!(mesh.bounds(), [[0.0, 0.0, -20e-3], [1e-3, 1e-3, -20e-3]]);
    let swing = Motion::Oscillation { amplitude_m: [0.0, 0.0, 1e-6], frequency_hz: 50.0, phase_rad: 0.5 };
    assert_eq!(walls[4].motion, swing);
    let pressed = Pressed {
        direction: [0.0, 0.0, -1.0],
        mass_kg: 1e-3,
        damping_n_s_m: 0.1,
        force_n: Series { times_s: vec![0.0, 1e-3], values: vec![0.0, 5.0] },
        withdrawal: Some(Withdrawal { from_s: 2e-3, speed_m_s: 0.1 }),
        limits_m: [0.0, 8e-3],
    };
    assert_eq!(walls[5].motion, Motion::Pressed(pressed));
    walls.iter().for_each(|wall| wall.check().unwrap());
}

#[test]
fn one_force_without_times_is_a_constant_one() {
    let pressed = "{ kind = \"pressed\", direction = [0, 0, -1], mass = 1, force = \"2 N\" }";
    let plane = "{ normal = [0, 0, 1] }";
    let scene = parse(SHORT, &[("walls.lid.plane", plane), ("walls.lid.motion", pressed)]);
    let Motion::Pressed(pressed) = &scene.walls[0].motion else { panic!("pressed") };
    assert_eq!(pressed.force_n, Series::constant(2.0));
    assert_eq!((pressed.damping_n_s_m, pressed.withdrawal), (0.0, None));
    assert_eq!(pressed.limits_m, [f64::NEG_INFINITY, f64::INFINITY]);
    let shown = scene.effective.iter().find(|value| value.path == "walls.lid.motion.force").unwrap();
    assert_eq!((shown.value.as_str(), shown.si.as_slice()), ("2 N", [2.0].as_slice()));
}

#[test]
fn defaults_are_those_of_the_reference_and_are_shown() {
    let scene = parse(SHORT, &[]);
    assert_eq!(scene.title, "x.toml");
    let particles = scene.settings::<stagger_physics::particles::Settings>().unwrap().clone();
    assert_eq!(particles.materials[0].density_kg_m3, 7950.0);
    assert_eq!(particles.groups[0].radius, Radius::Uniform { mean_m: 2.5e-5, spread_m: 0.0 });
    let Start::SequentialAddition { region, .. } = particles.start else { panic!("sequential") };
    assert_eq!(region.bounds().0, [-5e-4, -5e-4, 0.0]);
    assert_eq!((particles.gravity_m_s2, particles.spin), ([0.0, 0.0, -9.81], false));
    assert_eq!(particles.fields, FieldForces::default());
    assert!(!particles_read(&scene, "temperature") && particles.friction.is_none() && particles.drag.is_none());
    assert_eq!(
        scene.settings::<stagger_physics::optics::Settings>().unwrap().clone().model,
        Model::BeerLambert { absorption_1_m: 5e7, spacing_m: 2.5e-5 / 4.0 }
    );
    assert_eq!((scene.coupling.dt.limit_s, scene.coupling.dt.minimum_s), (1e-6, 1e-6 / 1000.0));
    assert_eq!((scene.coupling.acceleration, scene.recovery), (Acceleration::None, RecoverySettings::default()));
    let shown = |path: &str| scene.effective.iter().find(|value| value.path == path).unwrap();
    assert_eq!(shown("particles.radius.mean").value, "25 um");
    assert!(!shown("particles.radius.mean").is_default);
    assert_eq!(shown("optics.spacing").value, "6.25e-6 m");
    assert!(shown("optics.spacing").is_default);
    assert_eq!(shown("particles.gravity").value, "[0, 0, -9.81] m/s^2");
}

#[test]
fn particles_of_which_nothing_else_is_said_are_those_of_the_solver() {
    let least = "duration = 1\n[materials.m]\ndensity = 1\n[particles]\ncount = 1\nradius = 1\nmaterial = \"m\"\n\
        start = { box = [3, 3, 3] }\n[coupling]\ndt = 1";
    for law in ["overlap", "{ law = \"hertz\", young = 1, poisson = 0 }", "{ law = \"linear\", spring = 1 }"] {
        let read = parse(least, &[("particles.contact", law)])
            .settings::<stagger_physics::particles::Settings>()
            .unwrap()
            .clone();
        let (start, material) = (read.start.clone(), read.materials[0].clone());
        let new = stagger_physics::particles::Settings::new(start, material, read.contact.law);
        assert_eq!((new.groups.len(), read.groups.len()), (0, 1));
        assert_eq!(read, stagger_physics::particles::Settings { groups: read.groups.clone(), ..new });
    }
}

#[test]
fn a_physics_that_is_not_named_does_not_run_and_nobody_reads_it() {
    let cold = SHORT.replace("[thermal]\n", "").replace("count = 10\n", "count = 10\ncontact.softening.rate = 1\n");
    assert!(!particles_read(&parse(&cold, &[]), "temperature"));
    assert!(particles_read(&parse(&cold, &[("thermal.phi", "0.5")]), "temperature"));
    let scene = parse("duration = 1\n[coupling]\ndt = 1", &[]);
    assert!(scene.physics.is_empty());
    // Light is read where somebody writes it, whoever that is.
    let heat_only = parse("duration = 1\n[thermal]\n[coupling]\ndt = 1", &[]);
    let reads = heat_only.physics["thermal"].ports().reads;
    assert!(reads.iter().any(|port| port.field == "absorbed_power" && port.optional && port.adds_up));
}

#[test]
fn a_physics_may_run_twice_and_a_laser_with_settings_of_its_own() {
    let laser = "{ power = 1, profile = { radius = 1e-5 }, path = { kind = \"fixed\", at = [0, 0, 0] } }";
    let twice = [("nodes.left.physics", "optics"), ("nodes.right.physics", "optics")];
    let scene = parse(SHORT, &twice);
    assert!(scene.nodes.values().all(|node| node.physics.as_deref() == Some("optics") && node.own.is_none()));
    // The scene's own then runs under those names only.
    let sequence = ("coupling.sequence", "[\"optics\"]");
    assert!(Scene::parse(SHORT, "x.toml", &[set(twice[0].0, twice[0].1), set(sequence.0, sequence.1)]).is_err());
    let second = [("nodes.right", &*format!("{{ physics = \"optics\", optics = {laser} }}")), sequence];
    let scene = parse(SHORT, &second);
    assert_eq!(scene.settings::<stagger_physics::optics::Settings>().unwrap().clone().beam.power_w, 40.0);
    let tables = scene.tables();
    let all = tables.each::<stagger_physics::optics::Settings>().map(|(table, own)| (table, own.beam.power_w));
    assert_eq!(all.collect::<Vec<_>>(), [("optics", 40.0), ("nodes.right", 1.0)]);
    // It is enough of a laser for its field to have a tolerance.
    let alone = SHORT.split("[optics]").next().unwrap().to_owned() + "[coupling]\ndt = \"1 us\"\n";
    let tolerance = ("coupling.tolerance", "{ absorbed_power = 1e-3 }");
    let scene = parse(&alone, &[second[0], tolerance]);
    assert!(!scene.physics.contains_key("optics"));
}

#[test]
fn overrides_replace_values_and_change_the_hash() {
    let plain = parse(SHORT, &[]);
    let scene = parse(
        SHORT,
        &[
            ("particles.count", "20"),
            ("particles.radius", "30 um"),
            ("coupling.dt", "{ start = \"2 us\", limit = \"4 us\" }"),
            ("particles.contact", "hertz"),
            ("walls.floor.plane.normal", "[0, 0, 1]"),
            ("optics.fidelity", "energy-balance"),
        ],
    );
    let particles = scene.settings::<stagger_physics::particles::Settings>().unwrap().clone();
    assert_eq!((particles.count(), particles.groups[0].radius.mean_m()), (20, 3e-5));
    assert_eq!(particles.contact.law, ContactLaw::Hertz { young_pa: 193e9, poisson: 0.3 });
    assert_eq!(scene.coupling.dt.limit_s, 4e-6);
    assert_eq!(scene.walls[0].name, "floor");
    assert_eq!(scene.settings::<stagger_physics::optics::Settings>().unwrap().clone().model, Model::EnergyBalance);
    assert_ne!(scene.hash, plain.hash);
    // What it says makes a scene, not how it is written: defaults, units, comments, the order of overrides.
    let same = |overrides: &[(&str, &str)]| assert_eq!(parse(SHORT, overrides).hash, plain.hash, "{overrides:?}");
    same(&[("coupling.iterations", "8"), ("coupling.reuse", "0.1")]);
    same(&[("coupling.reuse", "0.1"), ("coupling.iterations", "8")]);
    same(&[("record.level", "all"), ("coupling.order", "gauss-seidel"), ("particles.integrator", "verlet")]);
    assert_eq!(parse(&format!("# The same.\n{SHORT}"), &[]).hash, plain.hash);
    let [metres, micrometres] = ["2e-6", "2 um"].map(|radius| parse(SHORT, &[("optics.profile.radius", radius)]).hash);
    assert_eq!(metres, micrometres);
    let others =
        [("coupling.iterations", "9"), ("seed", "2"), ("coupling.every.optics", "2"), ("thermal.ambient", "{}")];
    for (key, value) in others {
        assert_ne!(parse(SHORT, &[(key, value)]).hash, plain.hash, "{key}");
    }
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in ".{0,200}") {
        let _ = Scene::parse(&text, "x.toml", &[]);
    }

    #[test]
    fn no_override_makes_it_panic(key in "[a-z.-]{0,20}|particles\\.(radius|start|contact)", value in ".{0,20}") {
        let _ = Scene::parse(FULL, "x.toml", &[set(&key, &value)]);
    }

    #[test]
    fn no_cut_of_a_scene_makes_it_panic(end in 0..FULL.len()) {
        // The text is ASCII, so every cut is a text.
        let _ = Scene::parse(&FULL[..end], "x.toml", &[]);
    }
}

#[test]
fn every_kind_of_start_reaches_its_setting() {
    let start = |text: &str| {
        parse(SHORT, &[("particles.start", text)])
            .settings::<stagger_physics::particles::Settings>()
            .unwrap()
            .clone()
            .start
    };
    let lattice = start("{ kind = \"lattice\", lattice = \"hcp\", spacing = 1.5, jitter = 0.5, sphere = \"1 mm\" }");
    let region = StartRegion::Sphere { centre_m: [0.0, 0.0, 1e-3], radius_m: 1e-3 };
    let (lattice_kind, velocity_m_s) = (Lattice::HexagonalClosePacked, [0.0; 3]);
    let expected = Start::Lattice { region, lattice: lattice_kind, spacing: 1.5, jitter: 0.5, velocity_m_s };
    assert_eq!(lattice, expected);
    let growth = start("{ kind = \"growth\", box = [1, 2, 3], at = [4, 5, 6] }");
    assert_eq!(growth, Start::Growth { lower_m: [4.0, 5.0, 6.0], upper_m: [5.0, 7.0, 9.0], velocity_m_s });
    let text = "{ kind = \"settle\", box = [1, 2, 3], at = [4, 5, 6], until = 1e-3, damping = 1, longest = 7 }";
    let floor = ("walls.floor.plane.normal", "[0, 0, 1]");
    let settle = parse(SHORT, &[("particles.start", text), floor])
        .settings::<stagger_physics::particles::Settings>()
        .unwrap()
        .clone()
        .start;
    let region = StartRegion::Box { lower_m: [4.0, 5.0, 6.0], upper_m: [5.0, 7.0, 9.0] };
    assert_eq!(settle, Start::Settle { region, until: 1e-3, damping: 1.0, longest_s: Some(7.0) });
    let lying = start("{ cylinder = { radius = 0.5, height = 2, axis = \"x\" } }");
    let region = StartRegion::Cylinder { base_m: [0.0, 0.0, 0.5], axis: 0, radius_m: 0.5, height_m: 2.0 };
    assert_eq!(lying, Start::SequentialAddition { region, velocity_m_s });
    assert_eq!(region.bounds(), ([0.0, -0.5, 0.0], [2.0, 0.5, 1.0]));
}

#[test]
fn the_particles_of_a_file_come_with_their_materials_and_its_contents_belong_to_the_scene() {
    let short = "duration = 1\n[materials.copper]\ndensity = 8960\n[particles]\n[coupling]\ndt = 1\n";
    let file = |more: &str| format!("{{ kind = \"file\", path = \"bed.csv\", {more} }}");
    let text = file("unit = \"mm\", materials = [\"316L\", \"AlSi10Mg\"], velocity = [0, 0, -1]");
    let scene = parse(short, &[("particles.start", &text)]);
    let particles = scene.settings::<stagger_physics::particles::Settings>().unwrap().clone();
    let expected = Start::Given {
        positions_m: vec![[0.0, 0.0, 1e-3], [0.0, 0.0, 2.5e-3]],
        velocities_m_s: vec![[0.0, 0.0, -1.0]; 2],
        radii_m: vec![5e-4; 2],
        materials: vec![1, 2],
        spins_rad_s: Vec::new(),
    };
    assert_eq!((particles.start, particles.groups.len()), (expected, 0));
    let names: Vec<&str> = particles.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["316L", "copper", "AlSi10Mg"]);
    assert_eq!(&*scene.files["bed.csv"], BED.as_bytes());
    // Other contents under the same name make another scene.
    let overrides = [set("particles.start", &text)];
    let other = |_: &str| Ok(BED.replace("2.5", "2.6").into_bytes());
    let other = Scene::parse_with_files(short, "x.toml", &overrides, &other).unwrap();
    assert_ne!(other.hash, scene.hash);
    // Without a reader there is a mistake instead.
    let message = Scene::parse(short, "x.toml", &overrides).unwrap_err().to_string();
    assert!(message.contains("cannot read \"bed.csv\": this scene is read without"), "{message}");
}
