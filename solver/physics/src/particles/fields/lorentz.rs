//! Force of uniform electric and magnetic fields on charged particles (Zohdi 2018, eq. 6.19).

use std::f64::consts::PI;

use stagger_coupling::SolveError;

use super::{Body, region::finite};
use crate::{
    common::{Vec3, checks::setting},
    particles::settings::{Charge, Electromagnetic, Presence},
};

/// q (E + v × B) inside a region, while the field is on.
#[derive(Clone, Copy, Debug)]
pub struct Lorentz {
    charge: Charge,
    electric: Vec3,
    magnetic: Vec3,
    presence: Presence,
}

impl Lorentz {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`SolveError::Start`] names the setting that is not finite.
    pub fn new(settings: Electromagnetic) -> Result<Self, SolveError> {
        let Electromagnetic { charge, electric_v_m, magnetic_t, presence } = settings;
        let (Charge::PerMass(value) | Charge::PerParticle(value) | Charge::PerArea(value) | Charge::PerVolume(value)) =
            charge;
        setting("particles", "charge", value, value.is_finite(), "finite")?;
        finite("electric field", &electric_v_m)?;
        finite("magnetic field", &magnetic_t)?;
        presence.check("electromagnetic field")?;
        Ok(Self { charge, electric: Vec3::from(electric_v_m), magnetic: Vec3::from(magnetic_t), presence })
    }

    /// Charge of a particle of this size and mass, in C.
    #[must_use]
    pub fn charge_c(&self, body: Body) -> f64 {
        match self.charge {
            Charge::PerMass(value) => value * body.mass_kg,
            Charge::PerParticle(value) => value,
            Charge::PerArea(value) => value * 4.0 * PI * body.radius_m * body.radius_m,
            Charge::PerVolume(value) => value * body.volume_m3(),
        }
    }

    /// Whether there is a magnetic field.
    #[must_use]
    pub fn is_magnetic(&self) -> bool {
        self.magnetic != Vec3::zeros()
    }

    /// Whether the field acts at a place and a time.
    #[inline]
    #[must_use]
    pub fn acts(&self, t_s: f64, position: &Vec3) -> bool {
        self.presence.is_on(t_s) && self.presence.reaches(position)
    }

    /// Force in N, and its power in W; the magnetic part has none.
    #[inline]
    #[must_use]
    pub fn force(&self, t_s: f64, position: &Vec3, velocity: &Vec3, body: Body) -> (Vec3, f64) {
        if !self.acts(t_s, position) {
            return (Vec3::zeros(), 0.0);
        }
        let electric = self.electric_n(body);
        (electric + body.charge_c * velocity.cross(&self.magnetic), electric.dot(velocity))
    }

    /// The electric part of [`Self::force`] alone, for an integrator that turns the velocity itself.
    #[inline]
    #[must_use]
    pub fn electric_force(&self, t_s: f64, position: &Vec3, velocity: &Vec3, body: Body) -> (Vec3, f64) {
        if !self.acts(t_s, position) {
            return (Vec3::zeros(), 0.0);
        }
        let electric = self.electric_n(body);
        (electric, electric.dot(velocity))
    }

    /// Half of Boris' turn of a substep Δt = `step_s`, in s.
    ///
    /// Boris (1970) turns a velocity by 2 atan(θ/2), θ = q B Δt/m, which keeps its length, and with half kicks of the
    /// electric field on both sides makes its drift E × B/B² exact for any step (Birdsall & Langdon 1985, sec. 4-3). Half of
    /// that angle at the start of a substep and half at its end give the velocity at the same instants as the positions.
    #[must_use]
    pub fn half_turn(&self, step_s: f64, body: Body) -> HalfTurn {
        let half_angle = self.magnetic * (0.5 * step_s * body.charge_c / body.mass_kg);
        let tangent = half_angle.norm();
        // tan(atan(x)/2) = x/(1 + √(1 + x²)); a square too large to be a number belongs to half a turn.
        let root = if tangent < 1e8 { (1.0 + tangent * tangent).sqrt() } else { tangent };
        let tangent = half_angle / (1.0 + root);
        HalfTurn { tangent, sine: tangent * (2.0 / (1.0 + tangent.norm_squared())) }
    }

    /// The electric part q E of the force, in N.
    #[must_use]
    pub fn electric_n(&self, body: Body) -> Vec3 {
        body.charge_c * self.electric
    }

    /// How much of a way of `length_m` from a place along a unit vector lies in the field's region, in m.
    #[must_use]
    pub fn way_m(&self, from: &Vec3, along: &Vec3, length_m: f64) -> f64 {
        self.presence.way_m(from, along, length_m)
    }

    /// Angular frequency |q| B/m about the magnetic field, in rad/s.
    #[must_use]
    pub fn cyclotron_1_s(&self, body: Body) -> f64 {
        body.charge_c.abs() * self.magnetic.norm() / body.mass_kg
    }
}

/// A rotation of velocities about the magnetic field.
#[derive(Clone, Copy, Debug)]
pub struct HalfTurn {
    /// Axis times the tangent of half the angle, clockwise.
    tangent: Vec3,
    /// Axis times the sine of the angle.
    sine: Vec3,
}

impl HalfTurn {
    /// A velocity, turned.
    #[inline]
    #[must_use]
    pub fn turn(&self, velocity: &Vec3) -> Vec3 {
        velocity + (velocity + velocity.cross(&self.tangent)).cross(&self.sine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::settings::FieldRegion;

    const BODY: Body = Body { radius_m: 0.5, mass_kg: 2.0, charge_c: 3.0 };

    fn field(electric_v_m: [f64; 3], magnetic_t: [f64; 3], presence: Presence) -> Lorentz {
        Lorentz::new(Electromagnetic { charge: Charge::PerMass(1.5), electric_v_m, magnetic_t, presence }).unwrap()
    }

    /// Velocity Verlet with Boris' rotation, as the integrator of substeps has it.
    fn integrate(field: &Lorentz, mut r: Vec3, mut v: Vec3, end_s: f64, steps: u32) -> (Vec3, Vec3) {
        let dt = end_s / f64::from(steps);
        let half = field.half_turn(dt, BODY);
        for step in 0..steps {
            let kick = |step: u32, r: &Vec3| {
                let (force, _) = field.electric_force(f64::from(step) * dt, r, &Vec3::zeros(), BODY);
                0.5 * dt / BODY.mass_kg * force
            };
            v = half.turn(&v) + kick(step, &r);
            r += dt * v;
            v = half.turn(&(v + kick(step + 1, &r)));
        }
        (r, v)
    }

    /// Errors with 500 and with 1000 steps, and the order they show.
    fn order(field: &Lorentz, v: Vec3, end_s: f64, exact: Vec3) -> (f64, f64) {
        let error = |steps| (integrate(field, Vec3::zeros(), v, end_s, steps).0 - exact).norm();
        (error(1000), (error(500) / error(1000)).log2())
    }

    #[test]
    fn a_magnetic_field_alone_makes_a_helix() {
        let field = field([0.0; 3], [0.0, 0.0, 2.0], Presence::default());
        let turn = field.cyclotron_1_s(BODY);
        assert!((turn - 3.0).abs() < 1e-15);
        // v × B turns a positive charge clockwise about B.
        let t = 2.0;
        let exact = Vec3::new((turn * t).sin() / turn, ((turn * t).cos() - 1.0) / turn, 0.25 * t);
        let (error, order) = order(&field, Vec3::new(1.0, 0.0, 0.25), t, exact);
        // Phase error ~ (ω Δt)² ω t / 12 = 2e-5 rad of a radius of 1/3 m.
        assert!(error < 1e-4 && (order - 2.0).abs() < 0.05, "error {error}, order {order}");
        // The field does no work, however long the step: half a radian, and more than half a turn.
        for steps in [12, 1] {
            let (_, v) = integrate(&field, Vec3::zeros(), Vec3::new(1.0, 0.0, 0.25), t, steps);
            assert!((v.norm() / 1.0625f64.sqrt() - 1.0).abs() < 1e-15, "{steps}: {}", v.norm());
            assert!((v.z - 0.25).abs() < 1e-15);
        }
    }

    #[test]
    fn a_drift_in_crossed_fields_is_exact_for_any_step() {
        let field = field([0.5, 0.0, 0.0], [0.0, 0.0, 2.0], Presence::default());
        // What the kicks leave of the drift velocity at the middle of a turn is not turned: it stays.
        for steps in [40, 4] {
            let dt = 2.0 / f64::from(steps);
            // The velocity in the middle of the turn is half a kick ahead along the field, turned back by half.
            let start = Vec3::new(0.0, -0.25, 0.0);
            let kick = 0.5 * dt / BODY.mass_kg * field.electric_n(BODY);
            let v = field.half_turn(dt, BODY).turn(&(start + kick));
            let (r, _) = integrate(&field, Vec3::zeros(), v, 2.0, steps);
            assert!((r - start * 2.0).norm() < 1e-14, "{steps}: {r:?}");
        }
    }

    #[test]
    fn a_turn_too_fast_for_numbers_is_a_half_turn() {
        let field = field([0.0; 3], [0.0, 0.0, 1e100], Presence::default());
        let half = field.half_turn(1.0, BODY);
        let twice = half.turn(&half.turn(&Vec3::x()));
        assert!((twice + Vec3::x()).norm() < 1e-15, "{twice:?}");
    }

    #[test]
    fn crossed_fields_make_a_drift() {
        let field = field([0.5, 0.0, 0.0], [0.0, 0.0, 2.0], Presence::default());
        // From rest: a cycloid of drift E×B/B² = (0, −1/4, 0) m/s.
        let (turn, drift, t) = (3.0, 0.25, 2.0);
        let angle: f64 = turn * t;
        let exact = drift / turn * Vec3::new(1.0 - angle.cos(), angle.sin() - angle, 0.0);
        let (error, order) = order(&field, Vec3::zeros(), t, exact);
        assert!(error < 1e-4 && (order - 2.0).abs() < 0.05, "error {error}, order {order}");
        // After whole turns only the drift is left.
        let whole = 2.0 * PI / turn * 3.0;
        let (r, _) = integrate(&field, Vec3::zeros(), Vec3::zeros(), whole, 20_000);
        assert!((r - Vec3::new(0.0, -drift * whole, 0.0)).norm() < 1e-5, "{r:?}");
    }

    #[test]
    fn a_field_acts_where_and_while_it_is_on() {
        let at = |region| Presence { region, starts_s: 1.0, ends_s: 2.0 };
        let half = FieldRegion::HalfSpace { through_m: [2.0, 0.0, 0.0], normal: [-5.0, 0.0, 0.0] };
        let inside = FieldRegion::Box { lower_m: [0.0; 3], upper_m: [1.0, 2.0, 3.0] };
        for (region, place, acts) in [
            (FieldRegion::Everywhere, [1e9, 0.0, 0.0], true),
            (half, [1.9, 7.0, -7.0], true),
            (half, [2.1, 0.0, 0.0], false),
            (inside, [1.0, 2.0, 3.0], true),
            (inside, [0.5, 2.1, 0.5], false),
        ] {
            let field = field([-100.0, 0.0, 0.0], [0.0; 3], at(region));
            let force = |t_s| field.force(t_s, &Vec3::from(place), &Vec3::x(), BODY);
            let on = if acts { (Vec3::new(-300.0, 0.0, 0.0), -300.0) } else { (Vec3::zeros(), 0.0) };
            assert_eq!(force(1.0), on, "{region:?} {place:?}");
            assert_eq!([force(0.999), force(2.0)], [(Vec3::zeros(), 0.0); 2], "{region:?}");
        }
    }

    #[test]
    fn charge_goes_with_mass_surface_volume_or_number() {
        let charge = |charge| {
            let settings =
                Electromagnetic { charge, electric_v_m: [0.0; 3], magnetic_t: [0.0; 3], presence: Presence::default() };
            Lorentz::new(settings).unwrap().charge_c(BODY)
        };
        let kinds = [Charge::PerMass(2.0), Charge::PerParticle(2.0), Charge::PerArea(2.0), Charge::PerVolume(2.0)];
        for (found, wanted) in kinds.map(charge).into_iter().zip([4.0, 2.0, 2.0 * PI, PI / 3.0]) {
            assert!((found - wanted).abs() < 1e-15, "{found} {wanted}");
        }
    }

    #[test]
    fn a_setting_that_is_no_number_is_named() {
        let wrong = |electric_v_m, ends_s| {
            let presence = Presence { ends_s, ..Presence::default() };
            let settings =
                Electromagnetic { charge: Charge::PerMass(1.0), electric_v_m, magnetic_t: [0.0; 3], presence };
            Lorentz::new(settings).unwrap_err().to_string()
        };
        assert!(wrong([0.0, f64::NAN, 0.0], 1.0).contains("electric field"));
        assert!(wrong([0.0; 3], 0.0).contains("end"));
    }
}
