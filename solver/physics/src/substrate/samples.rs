//! Stress of many loads at many points: the sum of eq. 9.6 of Zohdi 2018, over threads and processor lanes.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::{
    Load,
    far_field::{FarField, Groups, Near},
    hertz_disc,
    point_load::{COMPONENTS, Source, add, distance_squared},
};
use crate::common::{
    simd::{Lanes, Triple},
    width,
};

/// Points of a chunk: what a thread works on, a multiple of every processor's lanes.
const CHUNK: usize = 64;

/// Stress of `loads` at one point of depth z ≥ 0, in Pa, as xx, yy, zz, xy, yz, zx; the plain sum that [`Samples::stress`]
/// does faster.
#[must_use]
pub fn stress_at(poisson: f64, loads: &[Load], [x, y, z]: [f64; 3]) -> [f64; COMPONENTS] {
    let mut sum = [0.0; COMPONENTS];
    for load in loads {
        let source = Source::of(load);
        add(1.0 - 2.0 * poisson, &source, Triple { x, y, z }, &mut sum);
    }
    for load in loads {
        add_near(poisson, load, [x, y, z], &mut sum);
    }
    sum
}

/// Adds the stress of a load that is near enough to be spread over its disc.
fn add_near(poisson: f64, load: &Load, [x, y, z]: [f64; 3], sum: &mut [f64; COMPONENTS]) {
    let (x, y) = (x - load.x_m, y - load.y_m);
    if distance_squared(x, y, z) < Source::of(load).near_m2 {
        let spread = hertz_disc::stress(poisson, load, x, y, z);
        sum.iter_mut().zip(spread).for_each(|(sum, value)| *sum += value);
    }
}

/// Points in the half-space at which stress is asked for, sorted into compact chunks once.
#[derive(Clone, Debug)]
pub struct Samples {
    /// The point that each place of the chunks holds.
    order: Vec<u32>,
    chunks: Vec<Chunk>,
}

/// A coordinate of the points of a chunk; the last chunk is filled up with copies of its last point.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Column([f64; CHUNK]);

#[derive(Clone, Debug)]
struct Chunk {
    at: [Column; 3],
    bounds: Bounds,
}

/// An axis-aligned box around points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    lower: [f64; 3],
    upper: [f64; 3],
}

impl Bounds {
    /// Square of the distance from a point of the surface to the box, in m².
    pub fn distance_squared(&self, x_m: f64, y_m: f64) -> f64 {
        let gap = |axis: usize, at: f64| (self.lower[axis] - at).max(at - self.upper[axis]).max(0.0);
        distance_squared(gap(0, x_m), gap(1, y_m), gap(2, 0.0))
    }
}

impl Samples {
    /// Takes points of depth z ≥ 0, in m, in coordinates of the half-space.
    #[must_use]
    pub fn new(points_m: &[[f64; 3]]) -> Self {
        let order = along_z_curve(points_m);
        let chunks = order.chunks(CHUNK).map(|places| {
            let point = |k: usize| points_m[places[k.min(places.len() - 1)] as usize];
            let at = [0, 1, 2].map(|axis| Column(std::array::from_fn(|k| point(k)[axis])));
            let bounds = Bounds {
                lower: at.map(|column| column.0.iter().copied().fold(f64::INFINITY, f64::min)),
                upper: at.map(|column| column.0.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
            };
            Chunk { at, bounds }
        });
        Self { chunks: chunks.collect(), order }
    }

    /// Stress of `loads` at the points, in their order, in Pa, as xx, yy, zz, xy, yz, zx.
    ///
    /// Every point's sum runs over the loads in a fixed order, whatever the number of threads and of lanes.
    #[must_use]
    pub fn stress(&self, poisson: f64, loads: &[Load], far_field: Option<FarField>) -> Vec<[f64; COMPONENTS]> {
        let groups = far_field.map(|far_field| Groups::new(loads, far_field));
        let sources: Vec<Source> = loads.iter().map(Source::of).collect();
        let mut sums = vec![[0.0; COMPONENTS]; self.order.len()];
        let work = |(sums, chunk): (&mut [[f64; COMPONENTS]], &Chunk)| {
            let mut columns = [Column([0.0; CHUNK]); COMPONENTS];
            let mut near = Near::new();
            let grouped;
            let sources = match &groups {
                Some(groups) => {
                    let mut list = Vec::new();
                    groups.collect(&chunk.bounds, &mut list, &mut near);
                    grouped = list;
                    &grouped
                }
                None => {
                    near.extend((0..).zip(&sources).filter_map(|(index, source)| {
                        let reached = chunk.bounds.distance_squared(source.x_m, source.y_m) < source.near_m2;
                        reached.then_some(index)
                    }));
                    &sources
                }
            };
            let kernel = Kernel { compressible: 1.0 - 2.0 * poisson, sources, at: &chunk.at, sums: &mut columns };
            width::chosen().dispatch(kernel);
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum = std::array::from_fn(|component| columns[component].0[k]);
                let at = [0, 1, 2].map(|axis| chunk.at[axis].0[k]);
                for &load in &near {
                    add_near(poisson, &loads[load as usize], at, sum);
                }
            }
        };
        sums.par_chunks_mut(CHUNK).zip(&self.chunks).for_each(work);
        let mut ordered = vec![[0.0; COMPONENTS]; sums.len()];
        for (&place, sum) in self.order.iter().zip(sums) {
            ordered[place as usize] = sum;
        }
        ordered
    }
}

/// Sums point loads at the points of a chunk, lanes over points.
struct Kernel<'a> {
    compressible: f64,
    sources: &'a [Source],
    at: &'a [Column; 3],
    sums: &'a mut [Column; COMPONENTS],
}

impl WithSimd for Kernel<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { compressible, sources, at, sums } = self;
        for index in 0..CHUNK / S::F64_LANES {
            let [x, y, z] = [0, 1, 2].map(
                #[inline(always)]
                |axis: usize| Lanes { simd, values: S::as_simd_f64s(&at[axis].0).0[index] },
            );
            let zero = Lanes { simd, values: simd.splat_f64s(0.0) };
            let mut sum = [zero; COMPONENTS];
            for source in sources {
                add(compressible, source, Triple { x, y, z }, &mut sum);
            }
            for (column, sum) in sums.iter_mut().zip(sum) {
                S::as_mut_simd_f64s(&mut column.0).0[index] = sum.values;
            }
        }
    }
}

/// Bits of each coordinate along the curve.
const BITS: u32 = 20;

/// The points sorted along a Z curve through their bounding box, so that neighbours share chunks.
fn along_z_curve(points_m: &[[f64; 3]]) -> Vec<u32> {
    let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in points_m {
        for axis in 0..3 {
            lower[axis] = lower[axis].min(point[axis]);
            upper[axis] = upper[axis].max(point[axis]);
        }
    }
    let span = (0..3).map(|axis| upper[axis] - lower[axis]).fold(0.0, f64::max);
    let scale = if span > 0.0 { f64::from((1u32 << BITS) - 1) / span } else { 0.0 };
    let key = |point: &[f64; 3]| {
        let cell = [0, 1, 2].map(|axis| ((point[axis] - lower[axis]) * scale) as u64);
        (0..BITS).fold(0u64, |key, bit| {
            let triple = (0..3).fold(0, |triple, axis| triple | ((cell[axis] >> bit & 1) << axis));
            key | triple << (3 * bit)
        })
    };
    let keys: Vec<u64> = points_m.iter().map(key).collect();
    let mut order: Vec<u32> = (0u32..).take(points_m.len()).collect();
    order.sort_by_key(|&place| keys[place as usize]);
    order
}
