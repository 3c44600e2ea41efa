//! Radii and materials of what is to be placed, largest first.

use rand_chacha::rand_core::RngCore;
use stagger_coupling::math;

use crate::particles::settings::Group;

/// What is to be placed, largest first.
pub(super) struct Bodies {
    /// Radii, in m.
    pub radii: Vec<f64>,
    /// Materials by index.
    pub materials: Vec<u16>,
}

/// Radii of all groups, in the groups' order, then sorted; equal ones keep their order.
pub(super) fn draw(groups: &[Group], random: &mut impl RngCore) -> Bodies {
    let mut bodies = Vec::with_capacity(groups.iter().map(|group| group.count).sum());
    for group in groups {
        bodies.extend((0..group.count).map(|_| (group.radius.draw(random), group.material)));
    }
    bodies.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (radii, materials) = bodies.into_iter().unzip();
    Bodies { radii, materials }
}

/// Volume of all spheres, in m³.
pub(super) fn volume(radii: &[f64]) -> f64 {
    radii.iter().map(|radius| 4.0 / 3.0 * std::f64::consts::PI * math::powi(*radius, 3)).sum()
}
