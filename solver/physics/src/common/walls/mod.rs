//! Walls: their shapes, where they touch a sphere, and how they move.
//!
//! A shape stands in the wall's own frame, which is the scene's at rest; a [`Motion`] says where that frame is at an
//! instant ([`Pose`]). Contact search knows shapes, the pose carries its answers into the scene's frame.

mod cylinder;
mod mesh;
mod motion;
mod pose;
mod pressed;
mod series;
mod shape;
mod stl;
mod surface;
mod triangle;

use serde::Serialize;
use stagger_coupling::SolveError;

pub use self::{
    cylinder::{Cylinder, Side},
    mesh::{Mesh, MeshError},
    motion::{During, Motion, WallState},
    pose::Pose,
    pressed::{Pressed, Withdrawal, Work},
    series::Series,
    shape::{Face, Plane, Shape},
    surface::{Surface, Touch},
};
use super::checks;

type Vec3 = nalgebra::Vector3<f64>;

/// A wall; its rows in wall-contact fields carry its index in the scene's order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wall {
    /// Name in the scene.
    pub name: String,
    /// Its surface, in its own frame.
    pub shape: Shape,
    /// How its frame moves.
    pub motion: Motion,
    /// Material, for the table of friction and restitution between pairs; `None` takes what holds for all contacts.
    pub material: Option<String>,
    /// Temperature in K; `None` is an insulated wall.
    pub temperature_k: Option<f64>,
    /// What it is held at electrically.
    pub electrode: Electrode,
}

/// What an electrified wall is held at; a wall with none of them is insulated. Which one counts is the current model's choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Electrode {
    /// Potential in V.
    pub potential_v: Option<f64>,
    /// Current into the particles in A.
    pub current_a: Option<f64>,
    /// Current density in A/m².
    pub current_density_a_m2: Option<f64>,
}

impl Wall {
    /// A wall at rest, of no material of its own.
    #[must_use]
    pub fn fixed(name: &str, shape: Shape, temperature_k: Option<f64>) -> Self {
        Self {
            name: name.into(),
            shape,
            motion: Motion::Fixed,
            material: None,
            temperature_k,
            electrode: Electrode::default(),
        }
    }

    /// Name of the figure that says how far a force has moved it, in m.
    #[must_use]
    pub fn displacement_figure(&self) -> String {
        format!("displacement of {} [m]", self.name)
    }

    /// Farthest distance in m of its surface from the axis it turns about: infinite where the shape has no end, zero where it
    /// turns into itself or does not turn.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        match &self.motion {
            Motion::Rotation { through_m, axis, .. } => self.shape.reach_m(&(*through_m).into(), &(*axis).into()),
            _ => 0.0,
        }
    }

    /// Bound of the speed in m/s at which its surface may meet particles between two instants in s, as it moves or turns into
    /// them; a surface that slides along itself meets nobody. Of a pressed wall it is the speed it has.
    ///
    /// `reach_m` is [`Self::reach_m`]; `farthest_m` gives the farthest distance in m of a particle's surface from an axis through a
    /// point.
    #[must_use]
    pub fn fastest_m_s(
        &self,
        during: [f64; 2],
        state: &WallState,
        reach_m: f64,
        farthest_m: impl Fn(&Vec3, &Vec3) -> f64,
    ) -> f64 {
        match &self.motion {
            Motion::Rotation { through_m, axis, speed_rad_s, during: turns } if turns.overlaps(during) => {
                let (through, axis) = (Vec3::from(*through_m), Vec3::from(*axis));
                if reach_m > 0.0 { speed_rad_s.abs() * reach_m.min(farthest_m(&through, &axis)) } else { 0.0 }
            }
            Motion::Pressed(_) => state.speed_m_s.abs(),
            motion => motion.speed_m_s(during),
        }
    }

    /// Checks that its shape and motion are in their ranges.
    ///
    /// # Errors
    /// [`SolveError::Start`] names the wall and the first setting that is not.
    pub fn check(&self) -> Result<(), SolveError> {
        let wall = format!("wall `{}`", self.name);
        self.shape.check(&wall)?;
        self.motion.check(&wall)?;
        self.temperature_k.map_or(Ok(()), |temperature_k| checks::positive(&wall, "its temperature", temperature_k))
    }
}

/// Refuses a setting of a wall with a component that is not finite.
fn finite(wall: &str, what: &str, values: &[f64]) -> Result<(), SolveError> {
    let wrong = values.iter().find(|value| !value.is_finite());
    wrong.map_or(Ok(()), |&wrong| checks::setting(wall, what, wrong, false, "finite"))
}

/// Refuses a direction that is no unit vector.
fn unit(wall: &str, what: &str, direction: &[f64; 3]) -> Result<(), SolveError> {
    let length = Vec3::from(*direction).norm();
    // Rounding of a direction given in decimals is forgiven.
    checks::setting(wall, what, length, (length - 1.0).abs() < 1e-6, "1")
}
