//! Removal of particles that leave the domain.

use crate::common::Vec3;

/// One particle, as far as its removal is booked.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// m in kg.
    pub mass_kg: f64,
    /// I = 2/5 m R², in kg m².
    pub inertia_kg_m2: f64,
    /// r in m.
    pub position_m: Vec3,
    /// v in m/s.
    pub velocity_m_s: Vec3,
    /// ω in rad/s.
    pub spin_1_s: Vec3,
}

/// What particles that came or went took with them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moved {
    /// Number of particles.
    pub count: u64,
    /// Their mass, in kg.
    pub mass_kg: f64,
    /// ½ m v², in J.
    pub kinetic_j: f64,
    /// ½ I ω², in J.
    pub rotational_j: f64,
    /// −m g·r, in J.
    pub potential_j: f64,
}

impl Moved {
    /// Sums over `bodies` in their order, under the gravity g in m/s².
    pub fn of(bodies: impl IntoIterator<Item = Body>, gravity_m_s2: &Vec3) -> Self {
        bodies.into_iter().fold(Self::default(), |sum, body| Self {
            count: sum.count + 1,
            mass_kg: sum.mass_kg + body.mass_kg,
            kinetic_j: sum.kinetic_j + 0.5 * body.mass_kg * body.velocity_m_s.norm_squared(),
            rotational_j: sum.rotational_j + 0.5 * body.inertia_kg_m2 * body.spin_1_s.norm_squared(),
            potential_j: sum.potential_j - body.mass_kg * gravity_m_s2.dot(&body.position_m),
        })
    }

    /// All energy, in J.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.kinetic_j + self.rotational_j + self.potential_j
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_removed_is_booked_with_its_mass_and_energy() {
        let body = Body {
            mass_kg: 2.0,
            inertia_kg_m2: 0.5,
            position_m: Vec3::new(1.0, 0.0, 3.0),
            velocity_m_s: Vec3::new(3.0, 0.0, 4.0),
            spin_1_s: Vec3::new(0.0, 2.0, 0.0),
        };
        let moved = Moved::of([body, body], &Vec3::new(0.0, 0.0, -10.0));
        // Small integers: exact.
        let expected = Moved { count: 2, mass_kg: 4.0, kinetic_j: 50.0, rotational_j: 2.0, potential_j: 120.0 };
        assert_eq!(moved, expected);
        assert_eq!(moved.energy_j(), 172.0);
    }
}
