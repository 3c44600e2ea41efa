//! Force of a magnetic field on magnetisable particles, γ ∇(B·B) (Zohdi 2018, eq. 6.21).

use stagger_coupling::SolveError;

use super::{Body, region::finite};
use crate::{
    common::{
        Vec3,
        checks::{positive, setting},
    },
    particles::settings::{Magnetic, MagneticSource, Presence},
};

/// μ0/4π in T m/A (CODATA 2018; 1e-7 to ten digits).
const MU0_OVER_4PI: f64 = 1.000_000_000_55e-7;

/// A magnetic field that pulls magnetisable particles to where it is strongest.
#[derive(Clone, Copy, Debug)]
pub struct MagneticField {
    magnetisability_a2_n: f64,
    source: Source,
    presence: Presence,
}

#[derive(Clone, Copy, Debug)]
enum Source {
    Gradient { origin: Vec3, gradient: nalgebra::Matrix3<f64> },
    Dipole { at: Vec3, moment: Vec3, radius_m: f64 },
}

impl MagneticField {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`SolveError::Start`] names the setting that is out of its range.
    pub fn new(settings: Magnetic) -> Result<Self, SolveError> {
        let Magnetic { magnetisability_a2_n, source, presence } = settings;
        let number = magnetisability_a2_n.is_finite();
        setting("particles", "magnetisability", magnetisability_a2_n, number, "finite")?;
        let source = match source {
            MagneticSource::Gradient { origin_t, gradient_t_m } => {
                finite("magnetic field at the origin", &origin_t)?;
                gradient_t_m.iter().try_for_each(|row| finite("magnetic field gradient", row))?;
                let gradient = nalgebra::Matrix3::from_fn(|row, column| gradient_t_m[row][column]);
                Source::Gradient { origin: Vec3::from(origin_t), gradient }
            }
            MagneticSource::Dipole { at_m, moment_a_m2, radius_m } => {
                finite("magnet's centre", &at_m)?;
                finite("magnet's moment", &moment_a_m2)?;
                positive("particles", "the magnet's radius", radius_m)?;
                Source::Dipole { at: Vec3::from(at_m), moment: Vec3::from(moment_a_m2), radius_m }
            }
        };
        presence.check("magnetic field")?;
        Ok(Self { magnetisability_a2_n, source, presence })
    }

    /// Force in N.
    #[inline]
    #[must_use]
    pub fn force(&self, t_s: f64, position: &Vec3, body: Body) -> Vec3 {
        if !self.presence.is_on(t_s) || !self.presence.reaches(position) {
            return Vec3::zeros();
        }
        self.magnetisability_a2_n * body.volume_m3() * self.gradient_t2_m(position)
    }

    /// B in T.
    #[must_use]
    pub fn field_t(&self, position: &Vec3) -> Vec3 {
        match &self.source {
            Source::Gradient { origin, gradient } => origin + gradient * position,
            Source::Dipole { at, moment, radius_m } => {
                let from = position - at;
                let squared = from.norm_squared();
                if squared < radius_m * radius_m {
                    // 2/3 μ0 M with M the moment per volume (Jackson 1999, sec. 5.10).
                    return 2.0 * MU0_OVER_4PI / (radius_m * radius_m * radius_m) * moment;
                }
                let cubed = squared * squared.sqrt();
                MU0_OVER_4PI / cubed * (3.0 * moment.dot(&from) / squared * from - moment)
            }
        }
    }

    /// ∇(B·B) in T²/m.
    fn gradient_t2_m(&self, position: &Vec3) -> Vec3 {
        match &self.source {
            Source::Gradient { gradient, .. } => 2.0 * gradient.tr_mul(&self.field_t(position)),
            Source::Dipole { at, moment, radius_m } => {
                let from = position - at;
                let squared = from.norm_squared();
                if squared < radius_m * radius_m {
                    return Vec3::zeros();
                }
                // Of B·B = (μ0/4π)² (3 (m·r)²/r⁸ + m²/r⁶).
                let along = moment.dot(&from);
                let fourth = squared * squared;
                6.0 * (MU0_OVER_4PI * MU0_OVER_4PI) / (fourth * fourth)
                    * (along * moment - (4.0 * along * along / squared + moment.norm_squared()) * from)
            }
        }
    }

    /// Upper bound of the angular frequency in rad/s with which a particle swings in the field, √(|γ| V ‖∇∇B²‖/m).
    #[must_use]
    pub fn rate_1_s(&self, body: Body) -> f64 {
        let curvature = match &self.source {
            Source::Gradient { gradient, .. } => 2.0 * gradient.norm_squared(),
            // On the axis at the magnet's surface: B·B = (μ0/4π)² 4 m²/r⁶, whose second derivative is 42/r² of it.
            Source::Dipole { moment, radius_m, .. } => {
                let field = 2.0 * MU0_OVER_4PI * moment.norm() / (radius_m * radius_m * radius_m);
                42.0 * field * field / (radius_m * radius_m)
            }
        };
        (self.magnetisability_a2_n.abs() * body.volume_m3() * curvature / body.mass_kg).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Body = Body { radius_m: 1e-3, mass_kg: 3e-5, charge_c: 0.0 };

    fn field(source: MagneticSource) -> MagneticField {
        MagneticField::new(Magnetic { magnetisability_a2_n: 4e5, source, presence: Presence::default() }).unwrap()
    }

    fn sources() -> [MagneticField; 2] {
        [
            MagneticSource::Gradient {
                origin_t: [0.1, -0.2, 0.3],
                gradient_t_m: [[1.0, 0.5, 0.2], [0.5, -3.0, 0.4], [0.2, 0.4, 2.0]],
            },
            MagneticSource::Dipole { at_m: [0.01, 0.0, -0.02], moment_a_m2: [0.3, -1.2, 0.7], radius_m: 0.01 },
        ]
        .map(field)
    }

    #[test]
    fn the_force_is_the_gradient_of_the_field_squared() {
        for field in sources() {
            for place in [Vec3::new(0.05, 0.02, 0.01), Vec3::new(-0.03, 0.04, 0.06)] {
                let step = 1e-5;
                let wanted = Vec3::from_fn(|axis, _| {
                    let mut shift = Vec3::zeros();
                    shift[axis] = step;
                    let square = |place: Vec3| field.field_t(&place).norm_squared();
                    (square(place + shift) - square(place - shift)) / (2.0 * step)
                }) * (4e5 * BODY.volume_m3());
                let found = field.force(0.0, &place, BODY);
                // Central differences: (h/r)² ~ 1e-7 times a third derivative's factor of about 50.
                assert!((found - wanted).norm() < 1e-5 * wanted.norm(), "{found:?} {wanted:?}");
            }
        }
    }

    #[test]
    fn a_dipole_is_the_textbook_one_and_its_inside_pulls_nothing() {
        let field = field(MagneticSource::Dipole { at_m: [0.0; 3], moment_a_m2: [0.0, 0.0, 2.0], radius_m: 0.01 });
        // On the axis μ0 m/(2π z³), beside it half as much and against it.
        let axis = field.field_t(&Vec3::new(0.0, 0.0, 0.1));
        let beside = field.field_t(&Vec3::new(0.1, 0.0, 0.0));
        assert!((axis - Vec3::new(0.0, 0.0, 4e-4)).norm() < 1e-12 && (beside + 0.5 * axis).norm() < 1e-18);
        // The normal component is continuous through the surface.
        let (inside, outside) = (Vec3::new(0.0, 0.0, 0.01 - 1e-12), Vec3::new(0.0, 0.0, 0.01 + 1e-12));
        assert!((field.field_t(&inside) - field.field_t(&outside)).norm() < 1e-9);
        assert_eq!(field.force(0.0, &inside, BODY), Vec3::zeros());
        assert!(field.force(0.0, &Vec3::new(0.0, 0.0, 0.02), BODY).z < 0.0, "it pulls towards the magnet");
    }

    #[test]
    fn the_rate_bounds_that_of_the_steepest_place() {
        for (field, place) in sources().into_iter().zip([Vec3::zeros(), Vec3::new(0.01, -0.0101, -0.02)]) {
            let step = 1e-7;
            let bound = field.rate_1_s(BODY);
            for axis in 0..3 {
                let mut shift = Vec3::zeros();
                shift[axis] = step;
                let force = |place: Vec3| field.force(0.0, &place, BODY)[axis];
                let slope = (force(place + shift) - force(place - shift)) / (2.0 * step);
                let rate = (slope.abs() / BODY.mass_kg).sqrt();
                assert!(rate <= bound, "{rate} {bound}");
            }
        }
    }

    #[test]
    fn a_magnet_without_a_size_is_refused() {
        let source = MagneticSource::Dipole { at_m: [0.0; 3], moment_a_m2: [0.0; 3], radius_m: 0.0 };
        let settings = Magnetic { magnetisability_a2_n: 1.0, source, presence: Presence::default() };
        assert!(MagneticField::new(settings).unwrap_err().to_string().contains("radius"));
    }
}
