//! The paths of a few rays, to be shown.

use super::{Grid, Limits, Ray, Strike, Vec3, follow};

/// Rays whose paths are shown: enough to see where they go.
pub const SHOWN: usize = 32;

/// Points of a shown path; those after its end repeat it.
pub const POINTS: usize = 12;

/// Paths of [`SHOWN`] rays spread evenly over all, in m: [`POINTS`] points each, the start, the surfaces met and, where
/// the ray leaves, a point outside the spheres.
pub(crate) fn paths_m(grid: &Grid, rays: &[Ray], limits: Limits, reflected: impl Fn(&Strike) -> f64) -> Vec<f64> {
    let [lower, upper] = grid.bounds();
    let beyond = 0.25 * (upper - lower).norm();
    let mut values = Vec::with_capacity(SHOWN * POINTS * 3);
    for shown in 0..SHOWN {
        let ray = rays[shown * rays.len() / SHOWN];
        let mut points: Vec<Vec3> = vec![ray.origin];
        let followed = follow(grid, ray, limits, |strike| {
            points.push(strike.point);
            reflected(strike)
        });
        points.extend(followed.left.map(|ray| points[points.len() - 1] + ray.direction * beyond));
        let end = points[points.len() - 1];
        points.resize(points.len().max(POINTS), end);
        values.extend(points[..POINTS].iter().flat_map(|point| [point.x, point.y, point.z]));
    }
    values
}
