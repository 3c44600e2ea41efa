//! Rays followed from sphere to sphere until they end, with what each sphere is given.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Grid, Ray, Vec3};

/// Rays that a thread follows at a time; results do not depend on the number of threads.
const CHUNK: usize = 128;

/// Chunks whose deposits are in memory at a time.
const CHUNKS_AT_ONCE: usize = 64;

/// Where rays end among the spheres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// Share of its power at the start below which a ray ends; in [0, 1).
    pub threshold: f64,
    /// Reflections after which a ray ends; at least 1.
    pub reflections: u32,
}

/// A ray meets a sphere.
#[derive(Clone, Copy, Debug)]
pub struct Strike {
    /// Index of the sphere.
    pub sphere: u32,
    /// The point, in m.
    pub point: Vec3,
    /// Direction of the ray that comes.
    pub direction: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Cosine of the angle of incidence, from 0 to 1.
    pub cosine: f64,
    /// Power that comes, as a share of what the ray started with.
    pub power: f64,
}

/// What became of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Followed {
    /// Where and in which direction it left the spheres; `None` where it ended among them.
    pub left: Option<Ray>,
    /// Power left, as a share of what it started with.
    pub power: f64,
    /// Surfaces it met.
    pub strikes: u32,
}

/// What became of a beam's power, in shares of it, apart from what the spheres took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Of rays that met a solid on a grid.
    pub landed: f64,
    /// Of rays that met a wall.
    pub passed: f64,
    /// Of rays that left into the open.
    pub escaped: f64,
    /// Of rays that ended among the spheres, at the threshold or at the limit of reflections.
    pub residual: f64,
    /// Surfaces of spheres that rays met; a number, not a share.
    pub strikes: u64,
}

/// Follows a ray that starts outside every sphere. `surface` answers a strike with the share R that is reflected; the sphere
/// takes the rest, 1 − R (Zohdi 2018, eq. 10.28).
///
/// Reflection is specular, d − 2 (d·n) n. The sphere just left is not looked at: what leaves a sphere outwards cannot meet
/// it again. A ray outside all spheres so stays outside; where spheres overlap it turns at the surface of their union, and
/// where rounding puts it just below that of a neighbour, it meets the neighbour at once.
pub fn follow(grid: &Grid, mut ray: Ray, limits: Limits, mut surface: impl FnMut(&Strike) -> f64) -> Followed {
    let (mut power, mut strikes, mut last) = (1.0, 0, None);
    while strikes < limits.reflections && power > limits.threshold {
        let Some((sphere, way)) = grid.nearest(&ray, last) else {
            return Followed { left: Some(ray), power, strikes };
        };
        let centre = grid.spheres()[sphere as usize].centre;
        let point = ray.origin + ray.direction * way;
        let normal = (point - centre).normalize();
        let against = ray.direction.dot(&normal);
        let cosine = (-against).clamp(0.0, 1.0);
        let reflected = surface(&Strike { sphere, point, direction: ray.direction, normal, cosine, power });
        power -= power * (1.0 - reflected);
        strikes += 1;
        last = Some(sphere);
        // Normalised, so that rounding does not grow over many reflections.
        ray = Ray { origin: point, direction: (ray.direction - normal * (2.0 * against)).normalize() };
    }
    Followed { left: None, power, strikes }
}

/// The planes, by their unit normals, that face a beam: light that runs on along the beam meets them. The sides of a box
/// without a lid do not: what is reflected out of it is not theirs, though planes have no end.
pub(crate) fn facing(walls: &[[f64; 3]], direction: [f64; 3]) -> Vec<[f64; 3]> {
    let against = |normal: &&[f64; 3]| Vec3::from(**normal).dot(&Vec3::from(direction)) < -1e-6;
    walls.iter().filter(against).copied().collect()
}

/// Follows all rays, each with the same share of the beam's power, threads sharing them. `surface` answers a strike with R
/// and with what the sphere takes, which `add` gets in the order of the rays, whatever the number of threads. A ray that
/// leaves against one of the `walls`, planes given by their normals, meets that wall.
pub(crate) fn trace<D: Send>(
    grid: &Grid,
    rays: &[Ray],
    limits: Limits,
    walls: &[[f64; 3]],
    surface: impl Fn(&Strike) -> (f64, D) + Sync,
    add: impl FnMut(u32, D),
) -> Outcome {
    trace_onto(grid, rays, limits, walls, surface, add, (|_: &Ray| None, |_, _| ()))
}

/// The same over a solid: `lands` says where a ray that has left the spheres meets it; `land` gets that place and the ray's
/// power, as a share of the beam's, in the order of the rays.
pub(crate) fn trace_onto<D: Send>(
    grid: &Grid,
    rays: &[Ray],
    limits: Limits,
    walls: &[[f64; 3]],
    surface: impl Fn(&Strike) -> (f64, D) + Sync,
    mut add: impl FnMut(u32, D),
    (lands, mut land): (impl Fn(&Ray) -> Option<Vec3> + Sync, impl FnMut(Vec3, f64)),
) -> Outcome {
    let meets = |direction: &Vec3| walls.iter().any(|normal| Vec3::from(*normal).dot(direction) < 0.0);
    let chunk = |rays: &[Ray]| {
        let (mut taken, mut landed, mut outcome) = (Vec::new(), Vec::new(), Outcome::default());
        for ray in rays {
            let followed = follow(grid, *ray, limits, |strike| {
                let (reflected, deposit) = surface(strike);
                taken.push((strike.sphere, deposit));
                reflected
            });
            outcome.strikes += u64::from(followed.strikes);
            match followed.left {
                Some(ray) => match lands(&ray) {
                    Some(point) => {
                        outcome.landed += followed.power;
                        landed.push((point, followed.power));
                    }
                    None if meets(&ray.direction) => outcome.passed += followed.power,
                    None => outcome.escaped += followed.power,
                },
                None => outcome.residual += followed.power,
            }
        }
        (taken, landed, outcome)
    };
    let mut total = Outcome::default();
    let share = 1.0 / rays.len().max(1) as f64;
    for rays in rays.chunks(CHUNK * CHUNKS_AT_ONCE) {
        let chunks: Vec<_> = rays.par_chunks(CHUNK).map(chunk).collect();
        for (taken, landed, outcome) in chunks {
            taken.into_iter().for_each(|(sphere, deposit)| add(sphere, deposit));
            landed.into_iter().for_each(|(point, power)| land(point, power * share));
            total.landed += outcome.landed;
            total.passed += outcome.passed;
            total.escaped += outcome.escaped;
            total.residual += outcome.residual;
            total.strikes += outcome.strikes;
        }
    }
    Outcome {
        landed: total.landed * share,
        passed: total.passed * share,
        escaped: total.escaped * share,
        residual: total.residual * share,
        strikes: total.strikes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::rays::Sphere;

    const LIMITS: Limits = Limits { threshold: 0.0, reflections: 1000 };

    #[test]
    fn a_ray_between_two_mirrors_ends_at_the_limit_with_its_power() {
        // It falls onto the gap's axis through two centres: for ever back and forth, but it must start outside.
        let at = |z: f64| Sphere { centre: Vec3::new(0.0, 0.0, z), radius: 1.0 };
        let grid = Grid::new(vec![at(-2.0), at(2.0)]);
        let ray = Ray { origin: Vec3::zeros(), direction: Vec3::z() };
        let followed = follow(&grid, ray, LIMITS, |_| 1.0);
        assert!(followed.left.is_none() && followed.strikes == 1000);
        assert_eq!(followed.power.to_bits(), 1.0f64.to_bits());
        // Grey mirrors end it at the threshold: 1e-3 is reached by 10 halvings.
        let followed = follow(&grid, ray, Limits { threshold: 1e-3, ..LIMITS }, |_| 0.5);
        assert!(followed.left.is_none() && followed.strikes == 10);
    }

    #[test]
    fn a_ray_stays_outside_overlapping_spheres() {
        // Seven spheres about a ball of one, all overlapping: rays into the creases between them.
        let mut spheres = vec![Sphere { centre: Vec3::zeros(), radius: 1.0 }];
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                spheres.push(Sphere { centre: Vec3::ith(axis, 0.9 * side), radius: 0.7 });
            }
        }
        let grid = Grid::new(spheres.clone());
        let (mut strikes, mut deepest) = (0, 0.0f64);
        for k in 0..2000 {
            let (height, angle) = (2.0 * (f64::from(k) + 0.5) / 2000.0 - 1.0, 2.4 * f64::from(k));
            let (sine, cosine) = angle.sin_cos();
            let across = (1.0 - height * height).sqrt();
            let from = Vec3::new(across * cosine, across * sine, height) * 5.0;
            let aim = Vec3::new(0.3 * sine, -0.5 * height, 0.4 * cosine);
            let followed = follow(&grid, Ray { origin: from, direction: (aim - from).normalize() }, LIMITS, |strike| {
                for sphere in &spheres {
                    deepest = deepest.max(sphere.radius - (strike.point - sphere.centre).norm());
                }
                assert!(strike.cosine >= 0.0 && (strike.normal.norm() - 1.0).abs() < 1e-14);
                1.0
            });
            assert!(followed.left.is_some(), "ray {k} is caught: {followed:?}");
            strikes += followed.strikes;
        }
        assert!(strikes > 2400, "creases reflect more than once: {strikes}");
        // Rounding of coordinates of 5.
        assert!(deepest < 1e-14, "a strike lies {deepest:e} below a surface");
    }
}
