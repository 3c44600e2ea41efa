//! Field forces on particles: what acts on one particle alone ([`Fields::force`]) and the near field between them.

mod drag;
mod lorentz;
mod magnetic;
mod near_field;
mod near_list;
mod region;

use std::f64::consts::PI;

pub use lorentz::{HalfTurn, Lorentz};
pub use magnetic::MagneticField;
pub use near_field::NearField;
pub use near_list::NearList;
use stagger_coupling::SolveError;

use crate::{
    common::Vec3,
    particles::settings::{Drag, FieldForces},
};

/// What a field acts on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Radius R in m.
    pub radius_m: f64,
    /// Mass in kg.
    pub mass_kg: f64,
    /// Charge q in C.
    pub charge_c: f64,
}

impl Body {
    /// Volume 4/3 π R³ in m³.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        4.0 / 3.0 * PI * (self.radius_m * self.radius_m * self.radius_m)
    }
}

/// Force of all fields on one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldForce {
    /// The force in N.
    pub force: Vec3,
    /// Power of the electric and magnetic force in W, positive where the particle gains it.
    pub gained_w: f64,
    /// Power lost to the drag in W; negative where a gas that streams drives the particle.
    pub drag_w: f64,
}

/// The field forces of a scene.
#[derive(Clone, Debug, Default)]
pub struct Fields {
    /// Near field between particles.
    pub near_field: Option<NearField>,
    lorentz: Option<Lorentz>,
    /// Whether v × B is left out of the forces, as the integrator turns velocities about the field itself.
    turns: bool,
    magnetic: Option<MagneticField>,
    drag: Option<Drag>,
}

impl Fields {
    /// Checks the settings of the fields; those of the drag are checked with the particles'. `turns` says that v × B is no
    /// force, but a rotation which the integrator takes from [`Self::gyrating`].
    ///
    /// # Errors
    /// [`SolveError::Start`] names the first setting that is out of its range.
    pub fn new(settings: &FieldForces, drag: Option<Drag>, turns: bool) -> Result<Self, SolveError> {
        Ok(Self {
            near_field: settings.near_field.map(NearField::new).transpose()?,
            lorentz: settings.electromagnetic.map(Lorentz::new).transpose()?,
            turns,
            magnetic: settings.magnetic.map(MagneticField::new).transpose()?,
            drag,
        })
    }

    /// The field about which the integrator turns velocities, where it does and there is one.
    #[must_use]
    pub fn gyrating(&self) -> Option<&Lorentz> {
        self.lorentz.as_ref().filter(|lorentz| self.turns && lorentz.is_magnetic())
    }

    /// A particle of this size with the charge that the scene gives it; none where it gives none.
    #[must_use]
    pub fn body(&self, radius_m: f64, mass_kg: f64) -> Body {
        let body = Body { radius_m, mass_kg, charge_c: 0.0 };
        let charge_c = self.lorentz.as_ref().map_or(0.0, |lorentz| lorentz.charge_c(body));
        Body { charge_c, ..body }
    }

    /// Whether [`Self::force`] is always zero.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lorentz.is_none() && self.magnetic.is_none() && self.drag.is_none()
    }

    /// Force on a particle at the time `t_s`: electric and magnetic fields and the drag of the gas.
    #[inline]
    #[must_use]
    pub fn force(&self, t_s: f64, position: &Vec3, velocity: &Vec3, body: Body) -> FieldForce {
        let mut sum = FieldForce { force: Vec3::zeros(), gained_w: 0.0, drag_w: 0.0 };
        if let Some(lorentz) = &self.lorentz {
            let (force, power_w) = if self.turns {
                lorentz.electric_force(t_s, position, velocity, body)
            } else {
                lorentz.force(t_s, position, velocity, body)
            };
            sum.force += force;
            sum.gained_w += power_w;
        }
        if let Some(magnetic) = &self.magnetic {
            let force = magnetic.force(t_s, position, body);
            sum.force += force;
            sum.gained_w += force.dot(velocity);
        }
        if let Some(drag) = &self.drag {
            let force = drag.force(body.radius_m, velocity);
            sum.force += force;
            sum.drag_w -= force.dot(velocity);
        }
        sum
    }

    /// Acceleration q E/m of a particle by the electric field where it acts, in m/s².
    #[must_use]
    pub fn electric_m_s2(&self, body: Body) -> Vec3 {
        self.lorentz.as_ref().map_or_else(Vec3::zeros, |lorentz| lorentz.electric_n(body) / body.mass_kg)
    }

    /// How much of a way of `length_m` from a place along a unit vector lies in the electric field's region, in m.
    #[must_use]
    pub fn electric_way_m(&self, from: &Vec3, along: &Vec3, length_m: f64) -> f64 {
        self.lorentz.as_ref().map_or(0.0, |lorentz| lorentz.way_m(from, along, length_m))
    }

    /// Fastest rate in 1/s at which these forces change a particle's motion: turning about the magnetic field, relaxing
    /// in the gas, swinging in the magnetic gradient. A substep resolves them where it is short against its inverse.
    #[must_use]
    pub fn rate_1_s(&self, body: Body) -> f64 {
        let lorentz = self.lorentz.as_ref().map_or(0.0, |lorentz| lorentz.cyclotron_1_s(body));
        let magnetic = self.magnetic.as_ref().map_or(0.0, |magnetic| magnetic.rate_1_s(body));
        let drag = self.drag.as_ref().map_or(0.0, |drag| drag.coefficient(body.radius_m) / body.mass_kg);
        lorentz.max(magnetic).max(drag)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::particles::settings::{Charge, Electromagnetic, Magnetic, MagneticSource, Presence};

    const BODY: Body = Body { radius_m: 0.5, mass_kg: 2.0, charge_c: 3.0 };

    #[test]
    fn a_bundle_sums_its_forces_and_books_their_powers() {
        let gradient_t_m = [[0.0, 0.0, 1.0], [0.0; 3], [1.0, 0.0, 0.0]];
        let settings = FieldForces {
            electromagnetic: Some(Electromagnetic {
                charge: Charge::PerMass(1.5),
                electric_v_m: [1.0, 0.0, 0.0],
                magnetic_t: [0.0, 0.0, 2.0],
                presence: Presence::default(),
            }),
            near_field: None,
            magnetic: Some(Magnetic {
                magnetisability_a2_n: 3.0 / PI,
                source: MagneticSource::Gradient { origin_t: [0.0, 0.0, 1.0], gradient_t_m },
                presence: Presence::default(),
            }),
        };
        let drag = Drag { viscosity_pa_s: 1.0 / (3.0 * PI), velocity_m_s: [0.0; 3] };
        let fields = Fields::new(&settings, Some(drag), false).unwrap();
        assert_eq!(fields.body(0.5, 2.0), BODY);
        let found = fields.force(0.0, &Vec3::zeros(), &Vec3::new(0.0, 1.0, 0.0), BODY);
        // q E + q v × B = (3 + 6, 0, 0); γ V ∇B² = 3/π · π/6 · 2 B_z ∂B_z/∂x = (1, 0, 0); drag = −v.
        assert!((found.force - Vec3::new(10.0, -1.0, 0.0)).norm() < 1e-14, "{found:?}");
        assert!(found.gained_w.abs() < 1e-14 && (found.drag_w - 1.0).abs() < 1e-14, "{found:?}");
        assert!(fields.gyrating().is_none());
        let turning = Fields::new(&settings, Some(drag), true).unwrap();
        let found = turning.force(0.0, &Vec3::zeros(), &Vec3::new(0.0, 1.0, 0.0), BODY);
        assert!((found.force - Vec3::new(4.0, -1.0, 0.0)).norm() < 1e-14 && turning.gyrating().is_some(), "{found:?}");
        // Cyclotron 3 · 2 / 2, drag 1/2, swinging √(γ V · 2 ‖G‖² / m) = 1.
        assert!((fields.rate_1_s(BODY) - 3.0).abs() < 1e-14);
        assert!(Fields::default().is_empty() && !fields.is_empty());
        assert!(Fields::default().force(0.0, &Vec3::zeros(), &Vec3::x(), BODY).force == Vec3::zeros());
    }
}
