//! Advice on the motion of the particles, and what they are to others' advice.

mod contact_duration;
mod flight;
mod spin;
mod stokes;

use std::f64::consts::PI;

use stagger_coupling::{SolveError, math};

pub use self::stokes::{drag_coefficient, drag_over_stokes, relaxation_s};
use super::{
    motion::expectation::{Expectation, expectation, steady_contact},
    settings::{Pour, Radius, Settings, Start},
    start,
};
use crate::common::{
    Shape, Wall,
    advice::{Advisor, Body, BodyFacts, Facts, Room},
    walls::Motion,
};
use flight::has_unknown_work;

/// What the particles contribute to advice.
pub static ADVISOR: Advisor =
    Advisor { tell, numbers: &[&contact_duration::CONTACT_DURATION, &stokes::STOKES, &spin::SPIN] };

/// Tells where the particles start and what is to be expected of them.
///
/// # Errors
/// They cannot be placed.
fn tell(facts: &mut Facts<'_>) -> Result<(), SolveError> {
    let Some(settings) = facts.tables.main::<Settings>() else { return Ok(()) };
    // Settling can take minutes, and needs the run's own engine.
    let model = start::model(settings.clone().without_settling())?;
    let expectation = expectation(&model)?;
    let placed = expectation.radii_m.iter().zip(&expectation.masses_kg);
    let mut each: Vec<Body> = placed.map(|(&radius_m, &mass_kg)| Body { radius_m, mass_kg, number: 1.0 }).collect();
    each.extend(poured(settings, facts.duration_s));
    let mut speed_m_s = expectation.speed_m_s;
    if let (Start::Settle { until, .. }, false) = (&settings.start, each.is_empty()) {
        // They begin at rest but for `until` of m g R.
        let largest_m = each.iter().map(|body| body.radius_m).fold(0.0, f64::max);
        let any_time = [f64::NEG_INFINITY, f64::INFINITY];
        let walls = facts.walls.iter().map(|wall| wall.motion.speed_m_s(any_time)).fold(0.0, f64::max);
        speed_m_s = (2.0 * until * expectation.acceleration_m_s2 * largest_m).sqrt().max(walls);
    }
    facts.bodies = BodyFacts {
        each,
        room: room(facts.walls, &expectation, settings),
        temperature_k: settings.temperature_k,
        gravity_m_s2: settings.gravity_m_s2,
        materials: settings.materials.iter().map(|material| material.name.clone()).collect(),
        speed_m_s,
        acceleration_m_s2: expectation.acceleration_m_s2,
        contact_s: expectation.contact_s,
        substep_s: expectation.substep_s,
        pressed: Box::new(|_, _| None),
    };
    if let Some(press_n) = press_n(facts, settings) {
        let largest_m = facts.bodies.largest_m();
        facts.bodies.pressed = Box::new(move |contacts, temperature_k| {
            Some(steady_contact(&model, largest_m, press_n / contacts.max(1.0), temperature_k))
        });
    }
    Ok(())
}

/// Bound of the force that presses particles together, as the mean over the run of all that they push on a floor, in N:
/// their momentum at first and at last and what their weight adds, over the duration. `None` where something else
/// presses: a moving wall, sound, attraction.
fn press_n(facts: &Facts<'_>, settings: &Settings) -> Option<f64> {
    let other = facts.walls.iter().any(|wall| wall.motion != Motion::Fixed)
        || has_unknown_work(facts, settings)
        || settings.bond.is_some()
        || settings.bonds.is_some();
    let push = facts.bodies.acceleration_m_s2 + 2.0 * facts.bodies.speed_m_s / facts.duration_s;
    (!other).then(|| facts.bodies.mass_kg() * push)
}

/// What the dispensers pour, each as particles of its mean size.
fn poured(settings: &Settings, duration_s: f64) -> Vec<Body> {
    let of = |pour: &Pour| {
        let open_s = (pour.until_s.min(duration_s) - pour.from_s).max(0.0);
        let number = (pour.rate_1_s * open_s).ceil().min(pour.limit.map_or(f64::INFINITY, |limit| limit as f64));
        let radius_m = match pour.radius {
            // The mean of R³ is that of a particle of this size.
            Radius::Uniform { mean_m, spread_m } => math::cbrt(mean_m * (mean_m * mean_m + spread_m * spread_m)),
            Radius::LogNormal { mean_m, .. } => mean_m,
        };
        let density = settings.materials.get(usize::from(pour.material)).map_or(0.0, |own| own.density_kg_m3);
        Body { radius_m, mass_kg: density * 4.0 / 3.0 * PI * math::powi(radius_m, 3), number }
    };
    settings.pours.iter().map(of).filter(|body| body.number > 0.0).collect()
}

/// The box about the start and the dispensers, widened to the walls that hold the particles sideways.
fn room(walls: &[Wall], expectation: &Expectation, settings: &Settings) -> Room {
    let mut lower_m = [f64::INFINITY; 3];
    let mut upper_m = [f64::NEG_INFINITY; 3];
    let mut reach = |place: [f64; 3], radius_m: f64| {
        for axis in 0..3 {
            lower_m[axis] = lower_m[axis].min(place[axis] - radius_m);
            upper_m[axis] = upper_m[axis].max(place[axis] + radius_m);
        }
    };
    for (place, &radius_m) in expectation.positions_m.iter().zip(&expectation.radii_m) {
        reach(*place, radius_m);
    }
    for pour in &settings.pours {
        for corner in pour.region.corners_m() {
            reach(corner.into(), 0.0);
        }
    }
    let gravity = settings.gravity_m_s2;
    let down = (0..3).fold(0, |most, axis| if gravity[axis].abs() > gravity[most].abs() { axis } else { most });
    let mut confined = false;
    for wall in walls {
        match &wall.shape {
            Shape::Box { lower_m: from, upper_m: to, .. } => {
                for axis in (0..3).filter(|axis| *axis != down) {
                    (lower_m[axis], upper_m[axis]) = (from[axis], to[axis]);
                }
                confined = true;
            }
            Shape::Cylinder(cylinder) if cylinder.length_m.is_none() => {
                for axis in (0..3).filter(|axis| *axis != down) {
                    lower_m[axis] = cylinder.through_m[axis] - cylinder.radius_m;
                    upper_m[axis] = cylinder.through_m[axis] + cylinder.radius_m;
                }
                confined = true;
            }
            _ => {}
        }
    }
    // Without gravity or anything to push them apart, particles stay where they are.
    Room { lower_m, upper_m, confined }
}
