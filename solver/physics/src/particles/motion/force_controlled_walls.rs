//! Walls that a set force presses: their motion within a step.

use crate::{
    common::{
        Vec3,
        walls::{Motion, Pressed, WallState, Work},
    },
    particles::model::Model,
};

/// The pressed walls of a scene on their way through a window.
pub struct ForceControlledWalls<'a> {
    pub model: &'a Model,
    /// How far each wall has moved.
    pub walls: Vec<WallState>,
    /// Lost in dampers and at stops, less the work of what drives them, in J.
    pub lost_j: f64,
}

impl ForceControlledWalls<'_> {
    /// The first half kick of a step from `t_s` under the forces on the walls there, and the drift.
    pub fn drift(&mut self, t_s: f64, step_s: f64, on_walls: &[Vec3]) {
        self.kick(t_s, 0.5 * step_s, on_walls);
        self.each(|piston, state, _| Work { damped_j: piston.drift(step_s, state), ..Work::default() }, on_walls);
    }

    /// A half kick by the forces on the walls at `t_s`.
    pub fn kick(&mut self, t_s: f64, half_s: f64, on_walls: &[Vec3]) {
        self.each(|piston, state, force_n| piston.kick(t_s, half_s, force_n, state), on_walls);
    }

    /// Speed of the fastest, in m/s.
    pub fn fastest_m_s(&self) -> f64 {
        self.walls.iter().map(|moved| moved.speed_m_s.abs()).fold(0.0, f64::max)
    }

    fn each(&mut self, mut act: impl FnMut(&Pressed, &mut WallState, f64) -> Work, on_walls: &[Vec3]) {
        for ((wall, state), force) in self.model.settings.walls.iter().zip(&mut self.walls).zip(on_walls) {
            if let Motion::Pressed(piston) = &wall.motion {
                let work = act(piston, state, force.dot(&Vec3::from(piston.direction)));
                self.lost_j += work.damped_j - work.drive_j;
            }
        }
    }
}
