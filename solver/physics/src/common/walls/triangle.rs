//! The triangle: its point nearest to another.

use super::Vec3;

/// A triangle with its unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triangle {
    /// Corners, in m.
    pub corners: [Vec3; 3],
    /// Unit normal by the right-hand rule.
    pub normal: Vec3,
}

/// Where the point of a triangle nearest to a position lies: at the position − `normal` × `distance`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Unit normal from that point to the position.
    pub normal: Vec3,
    /// Distance in m.
    pub distance: f64,
}

impl Triangle {
    /// `None` where the corners lie on a line.
    pub fn new(corners: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let (ab, ac) = (b - a, c - a);
        let twice_area = ab.cross(&ac);
        let longest = ab.norm().max(ac.norm());
        // Thinner than rounding of the corners lets a normal be told.
        let flat = twice_area.norm() <= 4.0 * f64::EPSILON * longest * longest;
        (!flat).then(|| Self { corners, normal: twice_area.normalize() })
    }

    /// Signed distance from its plane, in m.
    #[inline]
    pub fn height(&self, position: &Vec3) -> f64 {
        (position - self.corners[0]).dot(&self.normal)
    }

    /// Its point nearest to a position (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
    ///
    /// Above its face, normal and distance are those of its plane.
    pub fn nearest(&self, position: &Vec3) -> Nearest {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let [ap, bp, cp] = [a, b, c].map(|corner| position - corner);
        let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return self.towards(a, position);
        }
        let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
        if d3 >= 0.0 && d4 <= d3 {
            return self.towards(b, position);
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            // Were both zero, a and b would be one point, and the triangle flat.
            return self.towards(a + ab * (d1 / (d1 - d3)), position);
        }
        let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
        if d6 >= 0.0 && d5 <= d6 {
            return self.towards(c, position);
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return self.towards(a + ac * (d2 / (d2 - d6)), position);
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let (from_b, from_c) = (d4 - d3, d5 - d6);
            return self.towards(b + (c - b) * (from_b / (from_b + from_c)), position);
        }
        let height = self.height(position);
        let normal = if height < 0.0 { -self.normal } else { self.normal };
        Nearest { normal, distance: height.abs() }
    }

    fn towards(&self, point: Vec3, position: &Vec3) -> Nearest {
        let between = position - point;
        let distance = between.norm();
        // A position on the edge itself is parted from it along the face's normal.
        let normal = if distance > 0.0 { between / distance } else { self.normal };
        Nearest { normal, distance }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        [-1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0].prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn no_sampled_point_is_nearer_and_one_is_near(
            corners in [vector(), vector(), vector()], position in vector(),
        ) {
            let Some(triangle) = Triangle::new(corners) else { return Ok(()) };
            let nearest = triangle.nearest(&position);
            let [a, b, c] = corners;
            let pieces = 100;
            let mut sampled = f64::INFINITY;
            for i in 0..=pieces {
                for j in 0..=pieces - i {
                    let [u, v] = [i, j].map(|part| f64::from(part) / f64::from(pieces));
                    sampled = sampled.min((position - (a + (b - a) * u + (c - a) * v)).norm());
                }
            }
            // Every point of the triangle is within a hundredth of its longest edge of a sample.
            let longest = (b - a).norm().max((c - a).norm()).max((c - b).norm());
            // A thin triangle's normal is told by a small difference: 1e-12 leaves it 4 digits to lose.
            prop_assert!(nearest.distance <= sampled + 1e-12);
            prop_assert!(sampled <= nearest.distance + 0.01 * longest);
            prop_assert!((nearest.normal.norm() - 1.0).abs() < 1e-14);
            // The point lies on the triangle: it is its own nearest.
            let point = position - nearest.normal * nearest.distance;
            prop_assert!(triangle.nearest(&point).distance < 1e-12);
        }
    }

    #[test]
    fn every_region_has_its_nearest_point() {
        let triangle = Triangle::new([Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)]).unwrap();
        for (position, point) in [
            ([0.5, 0.5, 3.0], [0.5, 0.5, 0.0]),
            ([0.5, 0.5, -3.0], [0.5, 0.5, 0.0]),
            ([-1.0, -1.0, 1.0], [0.0, 0.0, 0.0]),
            ([3.0, -1.0, 0.0], [2.0, 0.0, 0.0]),
            ([-1.0, 4.0, 0.0], [0.0, 2.0, 0.0]),
            ([1.0, -1.0, 1.0], [1.0, 0.0, 0.0]),
            ([-1.0, 1.0, 1.0], [0.0, 1.0, 0.0]),
            ([2.0, 2.0, 1.0], [1.0, 1.0, 0.0]),
        ] {
            let (position, point) = (Vec3::from(position), Vec3::from(point));
            let nearest = triangle.nearest(&position);
            // All coordinates are small whole numbers and halves.
            let found = position - nearest.normal * nearest.distance;
            assert!((found - point).norm() < 1e-14, "{position}: {found}");
            assert!((nearest.distance - (position - point).norm()).abs() < 1e-15);
        }
    }

    #[test]
    fn a_position_on_the_triangle_has_a_normal() {
        let triangle = Triangle::new([Vec3::zeros(), Vec3::x(), Vec3::y()]).unwrap();
        for position in [Vec3::zeros(), Vec3::x(), Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.25, 0.25, 0.0)] {
            let nearest = triangle.nearest(&position);
            assert_eq!((nearest.distance.to_bits(), nearest.normal), (0, Vec3::z()));
        }
    }

    #[test]
    fn corners_on_a_line_make_no_triangle() {
        assert_eq!(Triangle::new([Vec3::zeros(), Vec3::x(), Vec3::x() * 3.0]), None);
        assert_eq!(Triangle::new([Vec3::x(), Vec3::x(), Vec3::x()]), None);
        let third = Vec3::new(0.1, 0.2, 0.3);
        assert_eq!(Triangle::new([third, third * 3.0, third * 7.0]), None);
    }
}
