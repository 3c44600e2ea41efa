//! The box that particles stay in.

use serde::Serialize;

use crate::common::Vec3;

/// An axis-aligned box: a particle whose centre is outside leaves the run at the start of the next window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Domain {
    /// Lower corner, in m.
    pub lower_m: [f64; 3],
    /// Upper corner, in m.
    pub upper_m: [f64; 3],
}

impl Domain {
    /// The rows of the particles outside, in rising order; a position that is no number is outside.
    #[must_use]
    pub fn outside(&self, positions_m: &[Vec3]) -> Vec<usize> {
        let inside =
            |position: &Vec3| (0..3).all(|axis| (self.lower_m[axis]..=self.upper_m[axis]).contains(&position[axis]));
        (0..).zip(positions_m).filter(|(_, position)| !inside(position)).map(|(row, _)| row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centre_on_the_border_is_inside_and_one_that_is_no_number_is_not() {
        let domain = Domain { lower_m: [0.0, 0.0, -1.0], upper_m: [1.0, 2.0, 3.0] };
        let at = |x, y, z| Vec3::new(x, y, z);
        let positions =
            [at(0.0, 2.0, 3.0), at(0.5, 0.5, -1.1), at(0.5, 0.5, 0.5), at(f64::NAN, 0.5, 0.5), at(1.1, 0.0, 0.0)];
        assert_eq!(domain.outside(&positions), [1, 3, 4]);
        assert!(domain.outside(&[]).is_empty());
    }
}
