//! Rays a second that find the nearest of 10⁵ spheres, on one thread, beside the hierarchy of the crate `bvh` and trying all:
//! `cargo bench -p stagger-physics --bench rays`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::{hint::black_box, time::Instant};

use bvh::{
    aabb::{Aabb, Bounded},
    bounding_hierarchy::BHShape,
    bvh::Bvh,
};
use nalgebra::{Point3, Vector3};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use stagger_physics::common::rays::{Grid, Limits, Ray, RefractiveIndex, Sphere, follow, reflectance};

/// A sphere as `bvh` wants it.
struct Shape {
    sphere: Sphere,
    index: usize,
}

impl Bounded<f64, 3> for Shape {
    fn aabb(&self) -> Aabb<f64, 3> {
        let reach = Vector3::repeat(self.sphere.radius);
        let centre = self.sphere.centre;
        Aabb::with_bounds(Point3::from(centre - reach), Point3::from(centre + reach))
    }
}

impl BHShape<f64, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.index = index;
    }

    fn bh_node_index(&self) -> usize {
        self.index
    }
}

/// Way to the nearest sphere by the hierarchy: boxes by their distance, until the next begins behind the nearest hit.
fn by_bvh(bvh: &Bvh<f64, 3>, shapes: &[Shape], ray: &Ray) -> Option<f64> {
    let query = bvh::ray::Ray::new(Point3::from(ray.origin), ray.direction);
    let mut nearest: Option<f64> = None;
    for shape in bvh.nearest_traverse_iterator(&query, shapes) {
        if let Some(found) = nearest
            && query.intersection_slice_for_aabb(&shape.aabb()).is_none_or(|(entry, _)| entry > found)
        {
            break;
        }
        if let Some(way) = shape.sphere.entry(ray) {
            nearest = Some(nearest.map_or(way, |found| found.min(way)));
        }
    }
    nearest
}

/// Numbers in [0, 1).
struct Uniform(ChaCha8Rng);

impl Uniform {
    fn next(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next())
    }

    fn direction(&mut self) -> Vector3<f64> {
        loop {
            let point = self.point() * 2.0 - Vector3::repeat(1.0);
            if (1e-3..1.0).contains(&point.norm_squared()) {
                return point.normalize();
            }
        }
    }
}

/// 10⁵ spheres in a cube of 1 m, in an order that has nothing to do with where they are: on a lattice, moved by a tenth of
/// what is between them, or anywhere.
fn bed(random: &mut Uniform, filling: f64, lattice: bool) -> Vec<Sphere> {
    let side = 47u32;
    let count = if lattice { side.pow(3) } else { 100_000 };
    let radius = (filling / f64::from(count) * 0.75 / std::f64::consts::PI).cbrt();
    let cell = 1.0 / f64::from(side);
    let mut spheres: Vec<(u64, Sphere)> = (0..count)
        .map(|k| {
            let site = Vector3::new(k % side, k / side % side, k / side / side).map(|at| (f64::from(at) + 0.5) * cell);
            let shift = (random.point() - Vector3::repeat(0.5)) * (0.1 * cell);
            let centre = if lattice { site + shift } else { random.point() };
            (random.0.next_u64(), Sphere { centre, radius })
        })
        .collect();
    spheres.sort_by_key(|(key, _)| *key);
    spheres.into_iter().map(|(_, sphere)| sphere).collect()
}

/// Rays a second of the best of five rounds, and the sum of their ways.
fn measure(rays: &[Ray], nearest: impl Fn(&Ray) -> Option<f64>) -> (f64, f64) {
    let round = || {
        let start = Instant::now();
        let sum = black_box(rays.iter().filter_map(&nearest).sum::<f64>());
        (rays.len() as f64 / start.elapsed().as_secs_f64(), sum)
    };
    (0..5).map(|_| round()).fold((0.0, 0.0), |best, round| if round.0 > best.0 { round } else { best })
}

fn main() {
    let mut random = Uniform(ChaCha8Rng::seed_from_u64(1));
    println!("{:<28} {:<22} {:>10} {:>10} {:>10}", "10^5 spheres", "rays", "grid /s", "bvh /s", "all /s");
    for (name, filling, lattice) in
        [("packed, volume share 0.5", 0.5, true), ("strewn, volume share 0.05", 0.05, false)]
    {
        let spheres = bed(&mut random, filling, lattice);
        let mut shapes: Vec<Shape> = spheres.iter().map(|&sphere| Shape { sphere, index: 0 }).collect();
        let start = Instant::now();
        let bvh = Bvh::build(&mut shapes);
        let bvh_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let grid = Grid::new(spheres.clone());
        let grid_s = start.elapsed().as_secs_f64();

        let down = -Vector3::z();
        let beam: Vec<Ray> = (0..50_000)
            .map(|_| Ray { origin: Vector3::new(random.next(), random.next(), 1.5), direction: down })
            .collect();
        let inside: Vec<Ray> =
            (0..50_000).map(|_| Ray { origin: random.point(), direction: random.direction() }).collect();
        for (kind, rays) in [("a beam from above", &beam), ("from anywhere anywhere", &inside)] {
            let (by_grid, sum) = measure(rays, |ray| grid.nearest(ray, None).map(|(_, way)| way));
            let (bvh_speed, bvh_sum) = measure(rays, |ray| by_bvh(&bvh, &shapes, ray));
            assert!((sum - bvh_sum).abs() < 1e-9 * sum, "both find the same: {sum} and {bvh_sum}");
            let all = |ray: &Ray| spheres.iter().filter_map(|sphere| sphere.entry(ray)).reduce(f64::min);
            let (all_speed, _) = measure(&rays[..50], all);
            println!("{name:<28} {kind:<22} {by_grid:>10.2e} {bvh_speed:>10.2e} {all_speed:>10.2e}");
        }
        println!("{name:<28} built in {:.1} ms (grid) and {:.1} ms (bvh)", 1e3 * grid_s, 1e3 * bvh_s);

        // Whole rays of light, Fresnel's equations of a metal at every surface.
        let metal = RefractiveIndex { real: 3.0, extinction: 4.0 };
        let limits = Limits { threshold: 1e-6, reflections: 1000 };
        let start = Instant::now();
        let followed =
            beam.iter().map(|ray| follow(&grid, *ray, limits, |strike| reflectance(metal, 1.0, strike.cosine)));
        let strikes: u32 = followed.map(|followed| followed.strikes).sum();
        let elapsed_s = start.elapsed().as_secs_f64();
        let (rays_s, each) = (beam.len() as f64 / elapsed_s, f64::from(strikes) / beam.len() as f64);
        println!("{name:<28} {rays_s:.2e} whole rays a second, {each:.1} reflections each");
    }
}
