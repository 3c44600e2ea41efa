//! What a contact does, whichever laws its forces follow.

use super::{
    damping::touch_share,
    kinematics::ContactKinematics,
    monograph_bond::MonographBond,
    pair_table::PairLaw,
    rolling::resist,
    tangential::{Slip, Tangential},
};
use crate::common::simd::{Real, Triple};

/// What all contacts of a scene have in common beside their laws.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Whether spin moves the contact point.
    pub spin: bool,
    /// Whether friction's arms are the radii, the monograph's choice, and not those to the contact point.
    pub arms_by_radius: bool,
    /// Whether some pair resists rolling or torsion.
    pub rolls: bool,
    /// The monograph's bond.
    pub bond: Option<MonographBond>,
    /// q of the force ∝ δ^{q−1} that the law tends to at small overlap.
    pub power: f64,
}

/// Force, moments and dissipation of one contact.
#[derive(Clone, Copy, Debug)]
pub struct ContactForce<R> {
    /// Force on particle i, in N; the partner feels the opposite.
    pub force: Triple<R>,
    /// n × tangential force, in N: the moment on either particle is this times its arm.
    pub couple: Triple<R>,
    /// Moment against rolling and torsion on particle i, in N m; the partner feels the opposite.
    pub resistance: Triple<R>,
    /// The tangential spring that is left, in m.
    pub spring: Triple<R>,
    /// Power lost to normal damping, in W.
    pub damping_w: R,
    /// Power that goes into the tangential force, in W: lost to friction, or held in its spring.
    pub friction_w: R,
    /// Power lost to rolling and torsion, in W.
    pub rolling_w: R,
    /// Elastic force over overlap and reduced mass, in 1/s².
    pub rate_1_s2: R,
}

impl Surface {
    /// The contact of a particle i with a partner.
    ///
    /// Normal damping is c_cd A (v_nj − v_ni) (Zohdi 2018, eq. 6.10) plus, where a restitution is set, ζ√(2q) √(m* F/δ)
    /// times the same velocity, which gives every impact speed that restitution (Antypov & Elliott 2011 for Hertz).
    /// `rolling` is L_i ω_i + L_j ω_j: the contact points move at v ± ω × (L n), so their relative velocity is that of the
    /// centres less `rolling` × n.
    #[inline(always)]
    pub fn contact_force<R: Real, T: Tangential>(
        &self,
        tangential: T,
        law: &PairLaw<R>,
        kinematics: &ContactKinematics<R>,
    ) -> ContactForce<R> {
        let ContactKinematics { normal, stiffness, velocity, .. } = *kinematics;
        let zero = kinematics.overlap.all(0.0);
        let secant_n_m = kinematics.modulus * stiffness.secant;
        let elastic_n = secant_n_m * kinematics.overlap;
        let opening = velocity.dot(normal);
        let impedance_kg_s = if law.has_impedance {
            let whole_kg_s = (kinematics.reduced_mass * secant_n_m).sqrt();
            whole_kg_s * touch_share(self.power, kinematics, law.restitution * whole_kg_s, opening)
        } else {
            zero
        };
        let damping_n = (law.damping_n_s_m3 * stiffness.area_m2 + law.restitution * impedance_kg_s) * opening;
        let nothing = Triple::zero(zero);
        let mut contact = ContactForce {
            force: normal * (damping_n - elastic_n),
            couple: nothing,
            resistance: nothing,
            spring: kinematics.spring,
            damping_w: damping_n * opening,
            friction_w: zero,
            rolling_w: zero,
            rate_1_s2: secant_n_m / kinematics.reduced_mass,
        };
        if T::ACTS || self.bond.is_some() {
            let mut sliding = velocity - normal * opening;
            if self.spin {
                sliding = sliding - kinematics.rolling.cross(normal);
            }
            let slip = Slip {
                velocity: sliding,
                normal,
                area_m2: stiffness.area_m2,
                elastic_n,
                pressing_n: (elastic_n - damping_n).most(zero),
                secant_n_m,
                impedance_kg_s,
                step_s: kinematics.step_s,
            };
            let (mut along, spring) = tangential.force(law, &slip, kinematics.spring);
            contact.spring = spring;
            if let Some(bond) = &self.bond {
                let (attraction_n, shear) = bond.force(kinematics.overlap / kinematics.length, &slip);
                contact.force += normal * attraction_n;
                along += shear;
            }
            contact.force += along;
            contact.couple = normal.cross(along);
            contact.friction_w = along.dot(sliding);
        }
        if self.rolls {
            contact.resistance = resist(law, kinematics, elastic_n);
            contact.rolling_w = contact.resistance.dot(kinematics.turning);
        }
        contact
    }
}
