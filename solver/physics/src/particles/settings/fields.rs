//! Settings of electric, magnetic and near fields.

use serde::Serialize;

/// Field forces on the particles; each acts only where it is given. SI units.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FieldForces {
    /// Electric and magnetic field on charged particles.
    pub electromagnetic: Option<Electromagnetic>,
    /// Near field between particles.
    pub near_field: Option<NearFieldSettings>,
    /// Magnetic field on magnetisable particles.
    pub magnetic: Option<Magnetic>,
}

/// Where and when a field is there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Presence {
    /// Where.
    pub region: FieldRegion,
    /// From this time on, in s.
    pub starts_s: f64,
    /// Until just before this time, in s; infinite where it is never switched off.
    pub ends_s: f64,
}

impl Default for Presence {
    fn default() -> Self {
        Self { region: FieldRegion::Everywhere, starts_s: 0.0, ends_s: f64::INFINITY }
    }
}

/// A part of space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FieldRegion {
    /// All of it.
    Everywhere,
    /// The side of a plane that its normal points to.
    HalfSpace {
        /// A point of the plane, in m.
        through_m: [f64; 3],
        /// Its normal, of any length but zero.
        normal: [f64; 3],
    },
    /// The inside of an axis-aligned box.
    Box {
        /// Lower corner, in m.
        lower_m: [f64; 3],
        /// Upper corner, in m.
        upper_m: [f64; 3],
    },
}

/// Uniform fields on charged particles: q (E + v × B) (Zohdi 2018, eq. 6.19).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Electromagnetic {
    /// What charge a particle carries.
    pub charge: Charge,
    /// Electric field E, in V/m.
    pub electric_v_m: [f64; 3],
    /// Magnetic flux density B, in T.
    pub magnetic_t: [f64; 3],
    /// Where and when.
    pub presence: Presence,
}

/// Charge of a particle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Charge {
    /// In proportion to its mass, in C/kg.
    PerMass(f64),
    /// The same on every particle, in C.
    PerParticle(f64),
    /// In proportion to its surface, in C/m².
    PerArea(f64),
    /// In proportion to its volume, in C/m³.
    PerVolume(f64),
}

/// Near field between particles: (α1 d^−β1 − α2 d^−β2) n, α = ᾱ b_i b_j c_i c_j (Zohdi 2018, eq. 6.20).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NearFieldSettings {
    /// ᾱ1 of the attraction, in N m^β1 per square of the base; not negative.
    pub attraction: f64,
    /// β1, above 0 and at most 16.
    pub attraction_exponent: f64,
    /// ᾱ2 of the repulsion, in N m^β2 per square of the base; not negative.
    pub repulsion: f64,
    /// β2, above 0 and at most 16.
    pub repulsion_exponent: f64,
    /// What b is.
    pub base: Base,
    /// Whether the signs c alternate from one particle to the next, by number; else all are +1.
    pub alternating: bool,
    /// Distance of centres up to which pairs are summed, in m; `None` sums all.
    pub cutoff_m: Option<f64>,
    /// Skin of the list of pairs as a share of the cut-off; not negative.
    pub skin: f64,
    /// Share of R_i + R_j below which the force falls in proportion to the distance, instead of growing without bound;
    /// above 0, at most 1.
    pub closest: f64,
    /// Where both particles must be, and when.
    pub presence: Presence,
}

/// What the strength of a particle's near field is proportional to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Base {
    /// Its mass, in kg.
    Mass,
    /// Its surface, in m².
    Area,
    /// Its volume, in m³.
    Volume,
    /// Its charge, in C.
    Charge,
}

/// Magnetic field on magnetisable particles: γ ∇(B·B) (Zohdi 2018, eq. 6.21).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Magnetic {
    /// γ per volume of a particle, in A²/N; negative for diamagnetic particles. A sphere of small susceptibility χ has
    /// χ/(2 μ0), one of any χ has 3χ/(2 μ0 (3 + χ)).
    pub magnetisability_a2_n: f64,
    /// The field B.
    pub source: MagneticSource,
    /// Where and when.
    pub presence: Presence,
}

/// A magnetic field that is not uniform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MagneticSource {
    /// B = B0 + G r.
    Gradient {
        /// B0 at the origin, in T.
        origin_t: [f64; 3],
        /// Rows of G, in T/m: row k is the gradient of B_k.
        gradient_t_m: [[f64; 3]; 3],
    },
    /// A uniformly magnetised ball: outside a point dipole, inside a uniform field that pulls nothing.
    Dipole {
        /// Its centre, in m.
        at_m: [f64; 3],
        /// Its moment, in A m².
        moment_a_m2: [f64; 3],
        /// Its radius, in m; positive.
        radius_m: f64,
    },
}
