//! Charged particles turn about a magnetic field: Boris' rotation within velocity Verlet.

use rayon::prelude::*;

use crate::{
    common::Vec3,
    particles::{
        fields::{HalfTurn, Lorentz},
        model::{Model, bodies::Bodies},
        search::blocks::PARALLEL_PARTICLES,
    },
};

/// The rotations of all particles in half a substep.
pub struct Gyration<'a> {
    field: &'a Lorentz,
    turns: Vec<HalfTurn>,
}

impl<'a> Gyration<'a> {
    /// The rotations of `bodies` with substeps of `step_s`; `None` where nothing turns them.
    pub fn new(model: &'a Model, bodies: &Bodies, step_s: f64) -> Option<Self> {
        let field = model.fields.gyrating()?;
        let of = |(&radius, &mass): (&f64, &f64)| field.half_turn(step_s, model.fields.body(radius, mass));
        Some(Self { field, turns: bodies.radii.iter().zip(&bodies.masses).map(of).collect() })
    }

    /// Turns the velocities of particles that are at `positions` at the time `t_s`, where the field acts.
    pub fn turn(&self, t_s: f64, positions: &[Vec3], velocities: &mut [Vec3]) {
        let turn = |((velocity, position), turn): ((&mut Vec3, &Vec3), &HalfTurn)| {
            if self.field.acts(t_s, position) {
                *velocity = turn.turn(velocity);
            }
        };
        if velocities.len() > PARALLEL_PARTICLES {
            velocities.par_iter_mut().zip(positions).zip(&self.turns).for_each(turn);
        } else {
            velocities.iter_mut().zip(positions).zip(&self.turns).for_each(turn);
        }
    }
}
