//! Where a wall is at an instant.

use nalgebra::Rotation3;

use super::Vec3;

/// Rigid motion of a wall from its own frame to the scene's, and how fast it goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// `None` where the wall only shifts.
    rotation: Option<Rotation3<f64>>,
    /// The point it turns about, in its own frame, in m.
    centre: Vec3,
    translation: Vec3,
    velocity: Vec3,
    spin: Vec3,
}

impl Pose {
    /// A wall that has not moved and does not.
    #[must_use]
    pub fn at_rest() -> Self {
        Self::shifted(Vec3::zeros(), Vec3::zeros())
    }

    /// A wall shifted by `translation`, in m, with a velocity in m/s.
    #[must_use]
    pub fn shifted(translation: Vec3, velocity: Vec3) -> Self {
        Self { rotation: None, centre: Vec3::zeros(), translation, velocity, spin: Vec3::zeros() }
    }

    /// A wall turned about a point, in m, with an angular velocity in rad/s.
    #[must_use]
    pub fn turned(rotation: Rotation3<f64>, centre: Vec3, spin: Vec3) -> Self {
        let still = Vec3::zeros();
        Self { rotation: Some(rotation), centre, translation: still, velocity: still, spin }
    }

    /// A position of the scene in the wall's own frame; both in m.
    #[inline]
    #[must_use]
    pub fn to_wall(&self, position: &Vec3) -> Vec3 {
        let shifted = position - self.translation;
        match &self.rotation {
            Some(rotation) => rotation.inverse_transform_vector(&(shifted - self.centre)) + self.centre,
            None => shifted,
        }
    }

    /// A position of the wall's own frame in the scene; both in m.
    #[inline]
    #[must_use]
    pub fn to_world(&self, position: &Vec3) -> Vec3 {
        let turned = match &self.rotation {
            Some(rotation) => rotation * (position - self.centre) + self.centre,
            None => *position,
        };
        turned + self.translation
    }

    /// A direction of the wall's own frame in the scene.
    #[inline]
    #[must_use]
    pub fn to_world_direction(&self, direction: &Vec3) -> Vec3 {
        self.rotation.as_ref().map_or(*direction, |rotation| rotation * direction)
    }

    /// Where the wall's own frame is in the scene: its origin, in m, and its three axes.
    #[must_use]
    pub fn frame(&self) -> ([f64; 3], [[f64; 3]; 3]) {
        let axis = |axis| self.to_world_direction(&Vec3::ith(axis, 1.0)).into();
        (self.to_world(&Vec3::zeros()).into(), [axis(0), axis(1), axis(2)])
    }

    /// Velocity in m/s of the wall's material at a position of the scene, in m.
    #[inline]
    #[must_use]
    pub fn velocity_at(&self, position: &Vec3) -> Vec3 {
        if self.rotation.is_none() {
            return self.velocity;
        }
        self.velocity + self.spin.cross(&(position - self.centre - self.translation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_nothing_changes_to_the_last_bit() {
        let position = Vec3::new(0.1, -1e-300, -0.0);
        let pose = Pose::at_rest();
        for same in [pose.to_wall(&position), pose.to_world_direction(&position)] {
            assert_eq!(same.map(f64::to_bits), position.map(f64::to_bits));
        }
        assert_eq!(pose.velocity_at(&position), Vec3::zeros());
    }

    #[test]
    fn the_way_to_the_wall_and_back_is_none() {
        let rotation = Rotation3::new(Vec3::new(0.3, -1.0, 2.0));
        let (centre, spin) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, 0.0, 2.0));
        for pose in [Pose::turned(rotation, centre, spin), Pose::shifted(centre, spin)] {
            let position = Vec3::new(0.7, -0.4, 5.0);
            assert!((pose.to_world(&pose.to_wall(&position)) - position).norm() < 1e-14);
            // A direction is the difference of two positions.
            let ahead = pose.to_world(&Vec3::x()) - pose.to_world(&Vec3::zeros());
            assert!((pose.to_world_direction(&Vec3::x()) - ahead).norm() < 1e-14);
        }
        let turned = Pose::turned(rotation, centre, spin);
        assert!(turned.velocity_at(&centre).norm() < 1e-15);
        assert!((turned.velocity_at(&(centre + Vec3::x())) - Vec3::y() * 2.0).norm() < 1e-15);
    }
}
