//! Time of the contacts on one thread, by law of contact and of friction, and of making the neighbour lists:
//! `cargo bench -p stagger-physics --bench particles`. Beside them, what this machine's memory moves.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench reports and stops at what is wrong")]

use std::{hint::black_box, time::Instant};

use bed::{HERTZ, RADIUS_M, SPRING};
use stagger_coupling::{Frozen, Physics, Reply, Window};
use stagger_physics::particles::{ContactLaw, Friction, Group, Particles, Radius, Rolling, Settings, State};

mod bed;

const STEP_S: f64 = 5e-6;
/// Steps until the lattice has dropped and lies, with the damping of `SETTLING_RESTITUTION`.
const SETTLING_STEPS: u32 = 6000;
const SETTLING_RESTITUTION: f64 = 0.05;
const STEPS: u32 = 100;
const TURNS: usize = 5;

const OVERLAP: ContactLaw = ContactLaw::Overlap { stiffness_pa: 1e9, exponent: 2.0 };
const LINEAR: ContactLaw = ContactLaw::Linear { stiffness_n_m: 1000.0 };
const REGULARISED: Friction =
    Friction::Regularised { stiffness_n_m3: 1e9, static_coefficient: 0.5, dynamic_coefficient: 0.5 };

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for count in [10_000, 100_000] {
            of_size(count);
        }
        memory();
    });
}

fn of_size(count: usize) {
    let (start, width_m) = bed::loose(count);
    let mut settings = bed::settings(start, width_m, HERTZ, Some(SPRING), STEP_S);
    let radius = Radius::Uniform { mean_m: RADIUS_M, spread_m: 0.0 };
    settings.groups = vec![Group { name: "particles".into(), count, radius, material: 0 }];
    settings.contact.restitution = Some(SETTLING_RESTITUTION);
    let particles = Particles::new(settings).unwrap();
    let (state, _) = particles.initial().unwrap();
    let (_, settled) = advance(&particles, &state, SETTLING_STEPS);
    let vectors = |name: &str| settled.fields[name].f64().unwrap().as_chunks().0.to_vec();
    let start = bed::given(vectors("positions"), vectors("velocities"));

    println!("{count} particles, {} contacts; ns a step", settled.fields["contact_pairs"].rows());
    println!("{:>8} {:>12} {:>8} {:>14} {:>13}", "law", "friction", "rolling", "per particle", "per contact");
    for (name, law) in [("overlap", OVERLAP), ("Hertz", HERTZ), ("linear", LINEAR)] {
        for (friction_name, friction, rolling) in [
            ("none", None, None),
            ("regularised", Some(REGULARISED), None),
            ("spring", Some(SPRING), None),
            ("spring", Some(SPRING), Some(Rolling { rolling: 0.1, torsion: 0.1 })),
        ] {
            let settings = bed::settings(start.clone(), width_m, law, friction, STEP_S);
            let (ns, contacts) = best_ns(Settings { rolling, ..settings });
            let (each, both) = (ns / count as f64, ns / contacts as f64);
            let rolling = if rolling.is_some() { "yes" } else { "no" };
            println!("{name:>8} {friction_name:>12} {rolling:>8} {each:>14.1} {both:>13.1}");
        }
    }
    let settings = || bed::settings(start.clone(), width_m, HERTZ, Some(SPRING), STEP_S);
    let (kept, _) = best_ns(settings());
    // Without a skin the lists are made again at every step.
    let (made, _) = best_ns(Settings { skin: 0.0, ..settings() });
    println!("neighbour lists made at every step: {:.1} ns a particle more\n", (made - kept) / count as f64);
}

fn advance(particles: &Particles, state: &State, steps: u32) -> (State, Reply) {
    let window = Window { t_s: 0.0, dt_s: f64::from(steps) * STEP_S };
    let (next, reply) = particles.solve(state, &Frozen::default(), window).unwrap();
    assert!(reply.not_converged.is_none(), "the window converges");
    (next, reply)
}

/// Shortest time of a step in ns, and the contacts at its end.
fn best_ns(settings: Settings) -> (f64, usize) {
    let particles = Particles::new(settings).unwrap();
    // The first window makes the lists and the springs.
    let (state, reply) = advance(&particles, &particles.initial().unwrap().0, STEPS);
    let turn = || {
        let start = Instant::now();
        black_box(advance(&particles, &state, STEPS));
        start.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS)
    };
    ((0..TURNS).map(|_| turn()).fold(f64::INFINITY, f64::min), reply.fields["contact_pairs"].rows())
}

/// What one thread moves: the triad a = b + s c (McCalpin 1995) in arrays as large as the state of 10 000, 100 000 and a
/// million particles.
fn memory() {
    println!("{:>10} {:>8}", "triad, MB", "GB/s");
    for bytes in [10_000_000usize, 100_000_000, 1_000_000_000] {
        let length = bytes / 24;
        let (b, c) = (vec![1.0f64; length], vec![2.0f64; length]);
        let mut a = vec![0.0f64; length];
        let mut turn = || {
            let start = Instant::now();
            for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
                *a = b + 3.0 * c;
            }
            black_box(&mut a);
            start.elapsed().as_secs_f64()
        };
        let best = (0..10).map(|_| turn()).fold(f64::INFINITY, f64::min);
        println!("{:>10} {:>8.1}", bytes / 1_000_000, (length * 24) as f64 / best / 1e9);
    }
}
