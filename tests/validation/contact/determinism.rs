//! The same bits: for any number of threads, and after a state was stored and read again.

use stagger_coupling::{Frozen, Physics, Reply, Window};
use stagger_physics::{
    common::{Shape, Wall},
    particles::{Integrator, Particles, State},
};

use super::{
    bed::*,
    conservation::{LAWS, REGULARISED, SPRING, everything},
};

const TRAPEZOIDAL: Integrator =
    Integrator::Trapezoidal { phi: 0.5, tolerance: 1e-6, iterations: 30, anderson_depth: 0 };

/// 18³ particles in six blocks, all of them in contact and on their way through many lists of neighbours.
fn bed(law: usize, integrator: Integrator) -> Particles {
    let spheres = super::cloud(18, 1.9, 0.2);
    let mut settings = everything(LAWS[law], if law == 1 { REGULARISED } else { SPRING }, &spheres);
    settings.skin = 0.02;
    settings.walls = vec![Wall::fixed("floor", Shape::plane([0.0, 0.0, -16.5], [0.0, 0.0, 1.0]), None)];
    settings.gravity_m_s2 = [0.0, 0.0, -9.81];
    settings.integrator = integrator;
    Particles::new(settings).unwrap()
}

fn window(k: usize, dt_s: f64) -> Window {
    Window { t_s: k as f64 * dt_s, dt_s }
}

fn same(a: &Reply, b: &Reply) {
    assert_eq!(a.fields, b.fields);
    assert_eq!(a.ledger, b.ledger);
    assert_eq!(a.figures, b.figures);
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    for (law, integrator, windows, dt_s) in
        [(0, VERLET, 4, 0.02), (1, VERLET, 4, 0.02), (2, VERLET, 4, 0.02), (2, TRAPEZOIDAL, 4, 2e-3)]
    {
        let particles = bed(law, integrator);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (state, reply) = pool.install(|| run(&particles, windows, dt_s, |_, _| ()));
            (postcard::to_allocvec(&state).unwrap(), reply)
        };
        let one = run(1);
        assert!(one.1.fields["contact_area"].rows() > 10_000);
        for threads in [2, 3] {
            let other = run(threads);
            same(&other.1, &one.1);
            assert!(other.0 == one.0, "the states of {threads} threads and of one differ");
        }
    }
}

#[test]
fn a_stored_state_goes_on_with_the_same_bits() {
    for law in 0..3 {
        for integrator in [VERLET, TRAPEZOIDAL] {
            let dt_s = if integrator == VERLET { 0.02 } else { 2e-3 };
            let particles = bed(law, integrator);
            let mut straight = run(&particles, 2, dt_s, |_, _| ()).0;
            let mut stored = straight.clone();
            for k in 2..4 {
                let bytes = postcard::to_allocvec(&stored).unwrap();
                stored = postcard::from_bytes::<State>(&bytes).unwrap();
                assert!(postcard::to_allocvec(&stored).unwrap() == bytes);
                let replies = [&mut straight, &mut stored].map(|state| {
                    let (next, reply) = particles.solve(state, &Frozen::default(), window(k, dt_s)).unwrap();
                    assert!(reply.not_converged.is_none());
                    *state = next;
                    reply
                });
                same(&replies[0], &replies[1]);
            }
        }
    }
}
