//! Time of one evaluation of the near field on one thread: `cargo bench -p stagger-physics --bench near_field`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::{hint::black_box, time::Instant};

use nalgebra::Vector3;
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use stagger_physics::particles::{Base, NearFieldSettings, Presence, fields::NearField};

/// Particles at random in a cube of 1 m, in layers as if sorted by cell.
fn cloud(count: usize) -> Vec<Vector3<f64>> {
    let mut random = ChaCha8Rng::from_seed([1; 32]);
    let mut uniform = || random.next_u64() as f64 / u64::MAX as f64;
    let mut positions: Vec<_> = (0..count).map(|_| Vector3::from_fn(|_, _| uniform())).collect();
    positions.sort_by_key(|position| [position.z, position.y, position.x].map(|x| (20.0 * x) as u32));
    positions
}

fn main() {
    println!(
        "{:>10} {:>9} {:>8} {:>12} {:>10} {:>12}",
        "exponents", "particles", "cut-off", "pairs", "best ms", "pairs/s"
    );
    for (attraction_exponent, repulsion_exponent, cutoff_m, count) in
        [(1.0, 2.0, None, 2_000), (2.0, 6.0, None, 2_000), (1.5, 2.5, None, 2_000), (1.0, 2.0, Some(0.05), 100_000)]
    {
        let near = NearField::new(NearFieldSettings {
            attraction: 0.5,
            attraction_exponent,
            repulsion: 0.01,
            repulsion_exponent,
            base: Base::Mass,
            alternating: false,
            cutoff_m,
            skin: 0.1,
            closest: 1e-3,
            presence: Presence::default(),
        })
        .unwrap();
        let positions = cloud(count);
        let list = near.list(&positions);
        let pairs = list.as_ref().map_or(count * (count - 1) / 2, |list| list.pairs());
        let (sources, radii) = (vec![1.0; count], vec![1e-3; count]);
        let mut forces = vec![Vector3::zeros(); count];
        let mut evaluate = || {
            let start = Instant::now();
            near.add(0.0, list.as_ref(), &positions, &sources, &radii, black_box(&mut forces));
            start.elapsed().as_secs_f64()
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let best = pool.install(|| (0..40).map(|_| evaluate()).fold(f64::INFINITY, f64::min));
        let exponents = format!("{attraction_exponent}, {repulsion_exponent}");
        let cutoff = cutoff_m.map_or("none".into(), |cutoff| format!("{cutoff} m"));
        let speed = pairs as f64 / best;
        println!("{exponents:>10} {count:>9} {cutoff:>8} {pairs:>12} {:>10.2} {speed:>12.2e}", 1e3 * best);
    }
}
