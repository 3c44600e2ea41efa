//! Rays and the spheres they meet.

use super::Vec3;

/// A ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, in m.
    pub origin: Vec3,
    /// Unit vector it goes along.
    pub direction: Vec3,
}

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, in m.
    pub centre: Vec3,
    /// Radius in m; positive.
    pub radius: f64,
}

impl Sphere {
    /// Way in m along the ray to where it enters the sphere; `None` where it does not, or leaves it.
    ///
    /// A ray that starts inside, as one does by rounding where two spheres overlap, enters at once if it goes towards the
    /// centre, and not at all if it goes away from it. The half chord is taken from the distance between centre and ray,
    /// which keeps its digits however far the ray starts (Haines et al. 2019, Ray Tracing Gems, ch. 7).
    #[inline]
    #[must_use]
    pub fn entry(&self, ray: &Ray) -> Option<f64> {
        let to_centre = self.centre - ray.origin;
        let along = to_centre.dot(&ray.direction);
        if along <= 0.0 {
            return None;
        }
        let across = to_centre - ray.direction * along;
        let half_chord_squared = self.radius * self.radius - across.norm_squared();
        (half_chord_squared > 0.0).then(|| (along - half_chord_squared.sqrt()).max(0.0))
    }
}

/// Spheres from the values of the fields `positions` and `radii`.
#[must_use]
pub fn spheres(positions_m: &[f64], radii_m: &[f64]) -> Vec<Sphere> {
    let centres = positions_m.as_chunks::<3>().0.iter();
    centres.zip(radii_m).map(|(centre, &radius)| Sphere { centre: Vec3::from(*centre), radius }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_enters_where_it_meets_the_surface_first() {
        let sphere = Sphere { centre: Vec3::new(0.0, 0.0, 5.0), radius: 1.0 };
        let from = |x: f64, z: f64, upwards: f64| {
            let ray = Ray { origin: Vec3::new(x, 0.0, z), direction: Vec3::new(0.0, 0.0, upwards) };
            sphere.entry(&ray)
        };
        assert_eq!(from(0.0, 0.0, 1.0), Some(4.0));
        // (3/5, 4/5, 1): the surface is 4/5 below the centre.
        assert!((from(0.6, 0.0, 1.0).unwrap() - 4.2).abs() < 1e-15);
        assert_eq!(from(0.0, 0.0, -1.0), None, "it goes away");
        assert_eq!(from(1.0, 0.0, 1.0), None, "it only touches");
        assert_eq!(from(0.0, 4.5, 1.0), Some(0.0), "inside, inwards");
        assert_eq!(from(0.0, 4.5, -1.0), None, "inside, outwards");
        // A million diameters away the surface is as sharp as the origin's own rounding, 1e-10.
        assert!((from(0.6, -2e6, 1.0).unwrap() - 2_000_004.2).abs() < 1e-9);
    }
}
