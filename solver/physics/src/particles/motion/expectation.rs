//! What can be said of the particles before anything moves: for advice about a scene.

use stagger_coupling::{SolveError, math};

use super::{
    state_at::state_at_start,
    substep::{reference_speed, time_scales},
};
use crate::{
    common::Vec3,
    particles::{
        contact::normal::Normal as _,
        model::{Model, time_scales::TimeScales},
    },
};

/// What is to be expected of a scene's particles.
#[derive(Clone, Debug)]
pub struct Expectation {
    /// Positions of the centres at t = 0, in m.
    pub positions_m: Vec<[f64; 3]>,
    /// Radii of the same particles, in m.
    pub radii_m: Vec<f64>,
    /// Their masses, in kg.
    pub masses_kg: Vec<f64>,
    /// Speed that nothing exceeds under gravity, the electric field and the walls' motion, in m/s: the fastest particle of the
    /// start and of the dispensers after the deepest fall.
    pub speed_m_s: f64,
    /// Largest acceleration by gravity and the electric field, in m/s².
    pub acceleration_m_s2: f64,
    /// Duration of the shortest contact, of the smallest particle at that speed, in s; infinite where nothing moves.
    pub contact_s: f64,
    /// Substep of the Verlet integrator that resolves contact, damping, friction and drag, in s.
    pub substep_s: f64,
}

/// What is to be expected of them.
///
/// # Errors
/// The start configuration cannot be listed.
pub fn expectation(model: &Model) -> Result<Expectation, SolveError> {
    let state = state_at_start(model)?;
    let speed_m_s = reference_speed(model, &state);
    let TimeScales { contact_s, substep_s } = time_scales(model, speed_m_s);
    let (bodies, motion) = &model.start;
    let driven = bodies.radii.iter().zip(&bodies.masses);
    let driven = driven.map(|(&radius, &mass)| model.fields.electric_m_s2(model.fields.body(radius, mass)).norm());
    Ok(Expectation {
        positions_m: motion.positions.iter().map(|position: &Vec3| (*position).into()).collect(),
        radii_m: bodies.radii.clone(),
        masses_kg: bodies.masses.clone(),
        speed_m_s,
        acceleration_m_s2: model.gravity.norm() + driven.fold(0.0, f64::max),
        contact_s,
        substep_s,
    })
}

/// Overlap in m and contact area in m² of a sphere that a steady force presses against a wall: the small overlap's law
/// F = c E δ^{q−1} solved for δ, at most the radius. `temperature_k` softens the first material.
#[must_use]
pub fn steady_contact(model: &Model, radius_m: f64, force_n: f64, temperature_k: f64) -> (f64, f64) {
    let (c, q) = model.contact.law.small_wall(radius_m);
    let stiffness = c * model.modulus(0, temperature_k);
    let overlap_m =
        if stiffness > 0.0 && force_n > 0.0 { math::powf(force_n / stiffness, 1.0 / (q - 1.0)) } else { 0.0 };
    let overlap_m = overlap_m.min(radius_m);
    (overlap_m, if overlap_m > 0.0 { model.contact.law.wall(overlap_m, radius_m).area_m2 } else { 0.0 })
}
