//! Size parameter: whether light travels in straight rays past particles of this size.

use std::f64::consts::PI;

use stagger_coupling::math;

use super::light::{Laser, lasers};
use crate::{
    common::advice::{Advice, Facts, Number, Verdict},
    optics::settings::Model,
};

/// Wavelength of Nd:YAG and fibre lasers, in m: the scene does not name one.
const WAVELENGTH_M: f64 = 1.06e-6;
/// Size parameter from which rays do: edges then take a fifth of what rays say.
const LARGE: f64 = 30.0;

/// Share of the light taken by a particle of size parameter x = 2πR/λ that rays get wrong: the edge's, at most 2 x^(−2/3)
/// (Nussenzveig & Wiscombe 1980, Phys. Rev. Lett. 45, 1490, for spheres).
#[must_use]
pub fn edge_share(size_parameter: f64) -> f64 {
    2.0 * math::powf(size_parameter, -2.0 / 3.0)
}

/// Rays, and lines of Beer and Lambert, which are rays too.
pub static SIZE_PARAMETER: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let rays = |laser: &Laser<'_>| laser.settings.model != Model::EnergyBalance;
    let Some(laser) = lasers(facts).find(rays) else { return Vec::new() };
    let value = 2.0 * PI * facts.bodies.smallest_m() / WAVELENGTH_M;
    let large = value >= LARGE;
    let edge = 100.0 * edge_share(value);
    let verdict = if large { Verdict::Suffices } else { Verdict::Beyond };
    let says = if large {
        format!("rays suffice: diffraction at edges changes what the smallest particle takes by at most {edge:.0} %")
    } else {
        "particles are too small for rays: waves bend round them, and no fidelity here computes that; energy-balance \
         at least depends on no cross-section"
            .to_owned()
    };
    let meaning = "circumference of the smallest particle over a wavelength of 1.06 um (at 10.6 um a tenth of it)";
    vec![Advice::new(&format!("{}.fidelity", laser.light.table), "size parameter", value, meaning, verdict, says)]
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::edge_share;
    use crate::common::rays::{RefractiveIndex, reflectance};

    /// Share of the light on its cross-section that a sphere of index m absorbs by Mie's series (Bohren & Huffman 1983,
    /// appendix A): Q_ext − Q_sca.
    fn absorbed_by_waves(x: f64, m: Complex<f64>) -> f64 {
        let terms = (x + 4.0 * x.cbrt() + 2.0).ceil() as usize;
        // Logarithmic derivatives, downwards from far beyond the last term.
        let y = m * x;
        let from = terms.max(y.norm().ceil() as usize) + 16;
        let mut d = vec![Complex::new(0.0, 0.0); from + 1];
        for n in (1..=from).rev() {
            let ratio = Complex::new(n as f64, 0.0) / y;
            d[n - 1] = ratio - Complex::new(1.0, 0.0) / (d[n] + ratio);
        }
        let (mut psi, mut chi) = ([x.cos(), x.sin()], [-x.sin(), x.cos()]);
        let (mut extinction, mut scattering) = (0.0, 0.0);
        for n in 1..=terms {
            let order = n as f64;
            let next = |[before, now]: [f64; 2]| (2.0 * order - 1.0) / x * now - before;
            let (psi_n, chi_n) = (next(psi), next(chi));
            let (xi, xi_before) = (Complex::new(psi_n, -chi_n), Complex::new(psi[1], -chi[1]));
            let [a, b] = [d[n] / m, d[n] * m].map(|own| {
                let factor = own + order / x;
                (factor * psi_n - psi[1]) / (factor * xi - xi_before)
            });
            extinction += (2.0 * order + 1.0) * (a + b).re;
            scattering += (2.0 * order + 1.0) * (a.norm_sqr() + b.norm_sqr());
            (psi, chi) = ([psi[1], psi_n], [chi[1], chi_n]);
        }
        2.0 / (x * x) * (extinction - scattering)
    }

    /// The same by rays at an opaque sphere: the mean over its cross-section of what the surface does not reflect.
    fn absorbed_by_rays(index: RefractiveIndex) -> f64 {
        let n = 20_000;
        let at = |k: usize| 1.0 - reflectance(index, 1.0, (1.0 - (k as f64 + 0.5) / n as f64).sqrt());
        (0..n).map(at).sum::<f64>() / n as f64
    }

    #[test]
    fn rays_are_wrong_by_less_than_the_edge_and_by_much_where_particles_are_small() {
        // Opaque at every size: light falls to e^{-2 k x} of itself along a radius.
        let (real, extinction) = (2.0, 1.0);
        let rays = absorbed_by_rays(RefractiveIndex { real, extinction });
        let error = |x: f64| (absorbed_by_waves(x, Complex::new(real, extinction)) / rays - 1.0).abs();
        for x in [30.0, 60.0, 120.0, 240.0, 480.0] {
            assert!(error(x) < edge_share(x) && error(x) > 0.1 * edge_share(x), "x = {x}: {}", error(x));
        }
        assert!(error(3.0) > 0.1, "{}", error(3.0));
    }
}
