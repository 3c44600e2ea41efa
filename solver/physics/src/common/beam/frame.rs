//! The beam's own coordinates.

use nalgebra::Vector3;

/// The beam's own coordinates: two across it and the depth along it.
pub struct Frame {
    across: [Vector3<f64>; 2],
    along: Vector3<f64>,
}

impl Frame {
    /// Right-handed and orthonormal. The first direction across is that of axis × beam, with the coordinate axis that
    /// is furthest from the beam (the first of equals).
    pub fn new(direction: [f64; 3]) -> Self {
        let along = Vector3::from(direction).normalize();
        let axis = Vector3::ith_axis(along.iamin()).into_inner();
        let first = axis.cross(&along).normalize();
        Self { across: [first, along.cross(&first)], along }
    }

    /// Direction of the beam.
    pub fn along(&self) -> Vector3<f64> {
        self.along
    }

    /// The point at (across, across, depth) from `spot_m`, in m.
    pub fn point_m(&self, [u, v, depth]: [f64; 3], spot_m: Vector3<f64>) -> Vector3<f64> {
        spot_m + self.across[0] * u + self.across[1] * v + self.along * depth
    }

    /// The particles' centres as (across, across, depth) from `spot_m`, in m.
    pub fn centres_m(&self, positions_m: &[f64], spot_m: Vector3<f64>) -> Vec<[f64; 3]> {
        let centre = |position: &[f64]| {
            let from_spot = Vector3::new(position[0], position[1], position[2]) - spot_m;
            [self.across[0].dot(&from_spot), self.across[1].dot(&from_spot), self.along.dot(&from_spot)]
        };
        positions_m.chunks_exact(3).map(centre).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_is_orthonormal_and_right_handed_for_any_direction() {
        for direction in [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, 0.0, 0.8], [0.48, -0.6, 0.64]] {
            let Frame { across: [first, second], along } = Frame::new(direction);
            assert!((first.cross(&second) - along).norm() < 1e-15);
            assert!((first.norm() - 1.0).abs() < 1e-15 && first.dot(&along).abs() < 1e-15);
            let frame = Frame { across: [first, second], along };
            let spot = Vector3::new(1.0, 2.0, 3.0);
            let point = frame.point_m([4.0, 5.0, 6.0], spot);
            let back = frame.centres_m(point.as_slice(), spot);
            assert!((Vector3::from(back[0]) - Vector3::new(4.0, 5.0, 6.0)).norm() < 1e-14);
        }
    }
}
