//! Settings of bonds with a state of their own (Potyondy & Cundall 2004).

use serde::Serialize;

/// Bonds with a state of their own (Potyondy & Cundall 2004). SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BondSettings {
    /// Stiffness of the cement.
    pub stiffness: BondStiffness,
    /// Radius of a bond as a share of the smaller particle's, above 0 and at most 1.
    pub radius_share: f64,
    /// Pairs are bonded at the start where their gap is at most this share of the smaller radius; `None` bonds none.
    pub gap_share: Option<f64>,
    /// Pairs are bonded later where their overlap strain E reaches this E*; `None` bonds none.
    pub strain: Option<f64>,
    /// Tensile stress at which a bond breaks, in Pa; `None` is never.
    pub tensile_strength_pa: Option<f64>,
    /// Shear stress at which a bond breaks, in Pa; `None` is never.
    pub shear_strength_pa: Option<f64>,
    /// Damping of each motion of a bond as a share of its critical damping; not negative.
    pub damping: f64,
}

/// Stiffness of a bond.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BondStiffness {
    /// The same for every bond, per area of its cross-section.
    PerArea {
        /// Against stretching and bending, in N/m³.
        normal_n_m3: f64,
        /// Against sliding and torsion, in N/m³.
        shear_n_m3: f64,
    },
    /// That of a beam from centre to centre: E/L per area.
    Beam {
        /// Young's modulus E in Pa.
        young_pa: f64,
        /// Normal over shear stiffness.
        ratio: f64,
    },
}
