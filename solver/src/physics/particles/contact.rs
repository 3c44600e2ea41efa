//! What a contact does, whichever law its normal force follows.

use super::{
    Vec3,
    hertz::{Hertz, reduced_radius},
    overlap::Overlap,
    settings::{ContactLaw, Friction},
};

/// Normal force over the modulus, and area of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Elastic force over the pair's modulus, in m².
    pub force_per_pa: f64,
    /// Contact area A in m².
    pub area_m2: f64,
}

/// Law of the normal force.
#[derive(Clone, Copy, Debug)]
pub(super) enum Law {
    Overlap(Overlap),
    Hertz(Hertz),
}

impl From<ContactLaw> for Law {
    fn from(law: ContactLaw) -> Self {
        match law {
            ContactLaw::Overlap { exponent, .. } => Self::Overlap(Overlap::new(exponent)),
            ContactLaw::Hertz { poisson, .. } => Self::Hertz(Hertz { poisson }),
        }
    }
}

impl Law {
    /// Modulus of a particle from its (softened) stiffness, in Pa.
    #[inline]
    pub fn modulus(self, stiffness_pa: f64) -> f64 {
        match self {
            Self::Overlap(_) => stiffness_pa,
            Self::Hertz(hertz) => hertz.modulus(stiffness_pa),
        }
    }

    /// Modulus of two particles in contact, in Pa. That of a particle at a wall is its own.
    #[inline]
    pub fn pair_modulus(self, modulus_i: f64, modulus_j: f64) -> f64 {
        match self {
            Self::Overlap(_) => 0.5 * (modulus_i + modulus_j),
            Self::Hertz(_) => Hertz::pair_modulus(modulus_i, modulus_j),
        }
    }

    /// Two particles at centre distance d with overlap δ > 0.
    #[inline]
    pub fn pair(self, overlap: f64, distance: f64, radius_i: f64, radius_j: f64) -> Touch {
        match self {
            Self::Overlap(law) => law.pair(overlap, distance, radius_i, radius_j),
            Self::Hertz(_) => Hertz::pair(overlap, radius_i, radius_j),
        }
    }

    /// A particle that overlaps a plane by δ > 0.
    #[inline]
    pub fn wall(self, overlap: f64, radius: f64) -> Touch {
        match self {
            Self::Overlap(law) => law.wall(overlap, radius),
            Self::Hertz(_) => Hertz::wall(overlap, radius),
        }
    }

    /// Elastic energy of two particles over their modulus, in m³.
    pub fn pair_energy(self, overlap: f64, radius_i: f64, radius_j: f64) -> f64 {
        match self {
            Self::Overlap(law) => law.pair_energy(overlap, radius_i, radius_j),
            Self::Hertz(_) => Hertz::pair_energy(overlap, radius_i, radius_j),
        }
    }

    /// Elastic energy of a particle at a plane over its modulus, in m³.
    pub fn wall_energy(self, overlap: f64, radius: f64) -> f64 {
        match self {
            Self::Overlap(law) => law.wall_energy(overlap, radius),
            Self::Hertz(_) => Hertz::wall_energy(overlap, radius),
        }
    }

    /// c and q of the force c E* δ^{q−1} that the law tends to at small overlap, for two particles.
    pub fn small_pair(self, radius_i: f64, radius_j: f64) -> (f64, f64) {
        self.small(reduced_radius(radius_i, radius_j), radius_i + radius_j)
    }

    /// The same for a particle at a plane.
    pub fn small_wall(self, radius: f64) -> (f64, f64) {
        self.small(radius, radius)
    }

    fn small(self, reduced_radius: f64, length: f64) -> (f64, f64) {
        match self {
            // A → 2π R* δ.
            Self::Overlap(law) => {
                let p = law.exponent();
                (std::f64::consts::TAU * reduced_radius / length.powf(p), p + 2.0)
            }
            Self::Hertz(_) => (4.0 / 3.0 * reduced_radius.sqrt(), 2.5),
        }
    }
}

/// Everything of a contact but its normal law: damping, friction, and whether particles spin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Normal damping c_cd, in N s/m³.
    pub damping_n_s_m3: f64,
    /// Tangential law.
    pub friction: Option<Friction>,
    /// Whether spin moves the contact point.
    pub spin: bool,
}

/// Force, moment and dissipation of one contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    /// Force on particle i, in N; the partner feels the opposite.
    pub force: Vec3,
    /// n × tangential force, in N: the moment on either particle is this times its radius.
    pub couple: Vec3,
    /// Power lost to normal damping, in W.
    pub damping_w: f64,
    /// Power lost to friction, in W.
    pub friction_w: f64,
}

impl Surface {
    /// Particle i and a partner in the direction `normal`, which moves at `velocity` relative to i.
    ///
    /// Damping c_cd A (v_nj − v_ni) (Zohdi 2018, eq. 6.10). `rolling` is R_i ω_i + R_j ω_j: the contact points move at
    /// v + ω × (R n), so their relative velocity is that of the centres less `rolling` × n.
    #[inline]
    pub fn respond(
        &self,
        normal: &Vec3,
        velocity: &Vec3,
        rolling: &Vec3,
        elastic_n: f64,
        area_m2: f64,
        step_s: f64,
    ) -> Response {
        let opening = velocity.dot(normal);
        let damping_n = self.damping_n_s_m3 * area_m2 * opening;
        let mut response = Response {
            force: normal * (damping_n - elastic_n),
            couple: Vec3::zeros(),
            damping_w: damping_n * opening,
            friction_w: 0.0,
        };
        if let Some(friction) = &self.friction {
            let mut sliding = velocity - normal * opening;
            if self.spin {
                sliding -= rolling.cross(normal);
            }
            let speed = sliding.norm();
            if speed > 0.0 {
                let magnitude = friction.force(speed, area_m2, elastic_n, step_s);
                let tangential = sliding * (magnitude / speed);
                response.force += tangential;
                response.couple = normal.cross(&tangential);
                response.friction_w = magnitude * speed;
            }
        }
        response
    }
}
