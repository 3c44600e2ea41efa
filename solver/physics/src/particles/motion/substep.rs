//! The automatic substep: a share of the shortest contact time at a speed; and the speeds that the start's energy allows.

use crate::{
    common::Vec3,
    particles::{
        contact::normal::{Normal as _, NormalStiffness},
        model::{
            Model,
            bodies::sphere_mass,
            state::{Motion, State},
            time_scales::{Hardest, Impact, TimeScales},
        },
        settings::{Friction, Pour, Settings},
    },
};

/// Substeps to the shortest contact; the peak force of a Verlet collision is then good to about a per mille.
const SUBSTEPS_PER_CONTACT: f64 = 25.0;

/// Substeps to the shortest time in which damping, drag or friction stops a particle.
const SUBSTEPS_PER_RELAXATION: f64 = 5.0;

/// The hardest impacts of the start configuration; `None` without particles.
pub fn hardest(model: &Model, state: &State) -> Option<Hardest> {
    let poured = poured_bodies(model);
    let bodies = || state.bodies.radii.iter().copied().zip(state.bodies.masses.iter().copied());
    let all = || bodies().chain(poured.iter().copied());
    let radius = all().map(|(radius, _)| radius).reduce(f64::min)?;
    let mass = all().map(|(_, mass)| mass).fold(f64::INFINITY, f64::min);
    let modulus = largest_modulus(model, state);
    let mut fields_s = f64::INFINITY;
    let mut resolve = |rate_1_s: f64| {
        if rate_1_s > 0.0 {
            fields_s = fields_s.min(1.0 / (SUBSTEPS_PER_RELAXATION * rate_1_s));
        }
    };
    resolve(model.fields.rate_1_s(model.fields.body(radius, mass)));
    if let Some(near) = &model.fields.near_field {
        // The fastest pair in contact: the strongest of all particles as large as the smallest one.
        let strongest = all()
            .map(|(radius, mass)| near.source(model.fields.body(radius, mass), 0).abs() / mass)
            .fold(0.0f64, f64::max);
        let source = strongest * mass;
        resolve((2.0 * near.stiffness_n_m(2.0 * radius, source, source) / mass).sqrt());
    }
    let impact = |(c, q): (f64, f64), modulus: f64| Impact::new(c * modulus, q);
    let partners = state.bodies.len() > 1 || !poured.is_empty();
    Some(Hardest {
        radius_m: radius,
        mass_kg: mass,
        pair: partners.then(|| {
            impact(model.contact.law.small_pair(radius, radius), model.contact.law.pair_modulus(modulus, modulus))
        }),
        wall: (!model.walls.surfaces.is_empty()).then(|| impact(model.contact.law.small_wall(radius), modulus)),
        fields_s,
    })
}

/// Largest modulus of a particle, of the start or of a dispenser.
fn largest_modulus(model: &Model, state: &State) -> f64 {
    let of_pours = model.settings.pours.iter().map(|pour| model.modulus(pour.material, model.settings.temperature_k));
    state.moduli.iter().copied().chain(of_pours).fold(0.0, f64::max)
}

/// Time scales of the hardest impacts where a particle meets another at twice a speed in m/s, or a wall at it.
pub fn time_scales(model: &Model, speed_m_s: f64) -> TimeScales {
    let Some(Hardest { radius_m, mass_kg, pair, wall, fields_s }) = model.scales.hardest else {
        return TimeScales::NONE;
    };
    // Nothing moves: the law of an empty overlap has no secant.
    let area = |depth: f64, touch: &dyn Fn() -> NormalStiffness<f64>| if depth > 0.0 { touch().area_m2 } else { 0.0 };
    let mut contact_s = f64::INFINITY;
    // Area over reduced mass: what damping and friction act through.
    let mut area_per_kg = 0.0f64;
    if let Some(pair) = pair {
        let (pair_s, overlap) = pair.of(0.5 * mass_kg, 2.0 * speed_m_s);
        contact_s = contact_s.min(pair_s);
        let depth = overlap.min(radius_m);
        let touch = || model.contact.law.pair(depth, 2.0 * radius_m - depth, radius_m, radius_m);
        area_per_kg = area_per_kg.max(area(depth, &touch) / (0.5 * mass_kg));
    }
    if let Some(wall) = wall {
        let (wall_s, overlap) = wall.of(mass_kg, speed_m_s);
        contact_s = contact_s.min(wall_s);
        let depth = overlap.min(radius_m);
        area_per_kg = area_per_kg.max(area(depth, &|| model.contact.law.wall(depth, radius_m)) / mass_kg);
    }

    let mut substep_s = (contact_s / SUBSTEPS_PER_CONTACT).min(fields_s);
    let mut resolve = |rate_1_s: f64| {
        if rate_1_s > 0.0 {
            substep_s = substep_s.min(1.0 / (SUBSTEPS_PER_RELAXATION * rate_1_s));
        }
    };
    let damping_n_s_m3 = model.contact.table.laws().iter().fold(0.0f64, |most, pair| most.max(pair.damping_n_s_m3));
    resolve(damping_n_s_m3 * area_per_kg);
    match model.settings.friction {
        Some(Friction::Regularised { stiffness_n_m3, .. }) => {
            // Sticking slows the contact point at the rate K_f A Δt (1/m + R²/I) = 7/2 K_f A Δt/m, itself ∝ Δt.
            let rate_per_s = 3.5 * stiffness_n_m3 * area_per_kg;
            resolve((rate_per_s / SUBSTEPS_PER_RELAXATION).sqrt());
        }
        Some(Friction::Spring { .. }) => {
            // A spinning particle's tangential vibration is faster than its normal one by the root of their stiffness.
            let faster = (stiffness_factor(model) / (model.contact.law.power() - 1.0)).sqrt();
            substep_s = substep_s.min(contact_s / (SUBSTEPS_PER_CONTACT * faster));
        }
        None => {}
    }
    TimeScales { contact_s, substep_s }
}

/// Largest stiffness of a contact to pressing, or to sliding where a particle's spin makes it yield more, over its elastic
/// force over overlap.
pub fn stiffness_factor(model: &Model) -> f64 {
    let tangential = model.contact.table.laws().iter().fold(0.0f64, |most, pair| most.max(pair.tangential));
    let spins = if model.contact.surface.spin { 3.5 } else { 1.0 };
    (model.contact.law.power() - 1.0).max(spins * tangential)
}

/// Radius in m and mass in kg of the smallest and the largest particle that each dispenser pours.
pub fn poured_bodies(model: &Model) -> Vec<(f64, f64)> {
    let Settings { pours, materials, .. } = &model.settings;
    let of_pour = |pour: &Pour| {
        let density_kg_m3 = materials[usize::from(pour.material)].density_kg_m3;
        let sizes = [pour.radius.smallest_m(), pour.radius.largest_m()];
        sizes.map(|radius| (radius, sphere_mass(radius, density_kg_m3)))
    };
    pours.iter().flat_map(of_pour).collect()
}

/// √(v² + 2 g H + 2 a L + 2 U/m) in m/s, or the speed of the gas or of a wall: the fastest particle of the start and of the
/// dispensers after the deepest fall, the longest way along the acceleration a of the electric field, and the release of
/// the most compressed contact.
pub fn reference_speed(model: &Model, state: &State) -> f64 {
    let poured = poured_bodies(model);
    let bodies = state.bodies.radii.iter().copied().zip(state.bodies.masses.iter().copied());
    let all: Vec<(f64, f64)> = bodies.chain(poured).collect();
    let mass = all.iter().map(|(_, mass)| *mass).fold(f64::INFINITY, f64::min);
    let driven = all.iter().map(|&(radius, mass)| model.fields.electric_m_s2(model.fields.body(radius, mass)));
    let driven = driven.fold(Vec3::zeros(), |most, own| if own.norm() > most.norm() { own } else { most });
    // Largest elastic energy of one contact, over its modulus.
    let stored_per_modulus = (state.contacts.energy_per_modulus.iter())
        .chain(&state.wall_contacts.energy_per_modulus)
        .fold(0.0f64, |largest, &energy| largest.max(energy));
    let stored_per_kg = stored_per_modulus * largest_modulus(model, state) / mass;
    let Motion { positions, velocities, .. } = &state.motion;
    let pours = &model.settings.pours;
    let poured = pours.iter().map(|pour| Vec3::from(pour.velocity_m_s).norm_squared());
    let initial = velocities.iter().map(Vec3::norm_squared).chain(poured).fold(0.0, f64::max);
    let mut places = positions.clone();
    places.extend(pours.iter().flat_map(|pour| pour.region.corners_m()));
    // An acceleration times the longest way along it.
    let work = |acceleration: Vec3, within: &dyn Fn(&Vec3, &Vec3, f64) -> f64| {
        let size = acceleration.norm();
        if size > 0.0 { size * fall(model, &places, &(acceleration / size), within) } else { 0.0 }
    };
    let falling = work(model.gravity, &|_, _, way| way);
    let driving = work(driven, &|from, along, way| model.fields.electric_way_m(from, along, way));
    let gas = model.settings.drag.map_or(0.0, |drag| Vec3::from(drag.velocity_m_s).norm());
    let walls = walls_m_s(model, state, [f64::NEG_INFINITY, f64::INFINITY], 0.0);
    (initial + 2.0 * (falling + driving + stored_per_kg)).sqrt().max(gas).max(walls)
}

/// Bound of the speeds in m/s at which walls meet particles between two instants, in which no particle goes farther than
/// `way_m`. A pressed wall's is that of the window's start.
pub fn walls_m_s(model: &Model, state: &State, during: [f64; 2], way_m: f64) -> f64 {
    let farthest_m = |through_m: &Vec3, axis: &Vec3| {
        let pours = model.settings.pours.iter().flat_map(|pour| pour.region.corners_m());
        let centres = state.motion.positions.iter().zip(&state.bodies.radii);
        let of = |position: &Vec3, radius: f64| axis.cross(&(position - through_m)).norm() + radius + way_m;
        let farthest = centres.map(|(position, radius)| of(position, *radius)).fold(0.0, f64::max);
        pours.map(|corner| of(&corner, 0.0)).fold(farthest, f64::max)
    };
    let walls = model.settings.walls.iter().zip(&state.walls).zip(&model.walls.reaches_m);
    let fastest = walls.map(|((wall, moved), reach_m)| wall.fastest_m_s(during, moved, *reach_m, farthest_m));
    fastest.fold(0.0, f64::max)
}

/// Largest way in m along `down` to a wall, or through the cloud where no wall is below; of each particle's way counts
/// what `within` says.
fn fall(model: &Model, positions: &[Vec3], down: &Vec3, within: &dyn Fn(&Vec3, &Vec3, f64) -> f64) -> f64 {
    let planes: Vec<_> = model.settings.walls.iter().flat_map(|wall| wall.shape.planes()).collect();
    let through = |position: &Vec3| {
        let ways = planes.iter().filter_map(|plane| {
            let normal = Vec3::from(plane.normal);
            let descent = -normal.dot(down);
            // A wall nearly parallel to gravity is not what a particle lands on.
            (descent > 1e-3).then(|| (position - Vec3::from(plane.through)).dot(&normal).max(0.0) / descent)
        });
        ways.reduce(f64::min)
    };
    let heights = || positions.iter().map(|position| position.dot(down));
    let extent = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    let way = |position: &Vec3| within(position, down, through(position).unwrap_or(extent));
    positions.iter().map(way).fold(0.0, f64::max)
}
