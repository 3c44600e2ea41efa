//! Size parameter: whether light travels in straight rays past particles of this size.

use std::f64::consts::PI;

use super::{Advice, Verdict, facts::Facts};

/// Wavelength of Nd:YAG and fibre lasers, in m: the scene does not name one.
const WAVELENGTH_M: f64 = 1.06e-6;
/// Size parameter from which rays do: edges then are a tenth of the cross-section.
const LARGE: f64 = 30.0;

/// Share of the light taken by a particle of size parameter x = 2πR/λ that rays get wrong: the edge's, x^(−2/3)
/// (Nussenzveig & Wiscombe 1980, Phys. Rev. Lett. 45, 1490, for spheres).
#[must_use]
pub fn edge_share(size_parameter: f64) -> f64 {
    size_parameter.powf(-2.0 / 3.0)
}

/// Advice on rays and on lines of Beer and Lambert, which are rays too.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let rays =
        |laser: &super::facts::Laser<'_>| !matches!(laser.settings.model, crate::physics::optics::Model::EnergyBalance);
    let Some(laser) = facts.lasers.iter().find(|laser| rays(laser)) else { return Vec::new() };
    let value = 2.0 * PI * facts.smallest_m() / WAVELENGTH_M;
    let large = value >= LARGE;
    let edge = 100.0 * edge_share(value);
    let verdict = if large { Verdict::Suffices } else { Verdict::Beyond };
    let says = if large {
        format!("rays suffice: diffraction at edges changes what the smallest particle takes by some {edge:.0} %")
    } else {
        "particles are too small for rays: waves bend round them, and no fidelity here computes that; energy-balance \
         at least depends on no cross-section"
            .to_owned()
    };
    let meaning = "circumference of the smallest particle over a wavelength of 1.06 um (at 10.6 um a tenth of it)";
    vec![Advice::new(&format!("{}.fidelity", laser.table), "size parameter", value, meaning, verdict, says)]
}
