//! The same answer for every number of threads and every order of particles and contacts.

use super::network::{Network, POTENTIAL, books, near, of, settings, solve, volt};

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let bed = Network::random(20_000);
    let settings = settings(POTENTIAL, &[volt(1.0), volt(0.0)], 20_000);
    let replies = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&settings, &bed))
    });
    for reply in &replies[1..] {
        for (name, field) in &reply.fields {
            assert_eq!(field.values().bytes(), replies[0].fields[name].values().bytes(), "{name}");
        }
        assert_eq!(reply.figures, replies[0].figures);
        assert_eq!(reply.ledger, replies[0].ledger);
    }
}

#[test]
fn the_order_of_particles_and_contacts_changes_the_answer_by_rounding_only() {
    let count = 3000;
    let bed = Network::random(count);
    let electrodes = [volt(1.0), volt(0.0)];
    let plain = solve(&settings(POTENTIAL, &electrodes, count as usize), &bed);
    // 1009 and 3000 have no common divisor: a permutation.
    let place = |i: u32| (i * 1009 + 17) % count;
    let mut other = bed.clone();
    other.pairs = bed.pairs.iter().rev().map(|&(i, j, area, distance)| (place(j), place(i), area, distance)).collect();
    other.walls = bed.walls.iter().rev().map(|&(i, wall, area, distance)| (place(i), wall, area, distance)).collect();
    let permuted = solve(&settings(POTENTIAL, &electrodes, count as usize), &other);
    // Both are within their residuals of the solution: 1e-12 times a condition of some thousand.
    let (potentials, moved) = (of(&plain, "potential"), of(&permuted, "potential"));
    assert!((0..count).all(|i| (potentials[i as usize] - moved[place(i) as usize]).abs() < 1e-8));
    assert!(near(books(&permuted)[1], books(&plain)[1], 1e-10));
}
