//! Anderson's mixing of the trapezoidal fixed point: it takes fewer iterations to the same answer, and goes on beyond the
//! critical step.

use super::*;

fn trapezoidal(tolerance: f64, iterations: u32, anderson_depth: u32) -> Integrator {
    Integrator::Trapezoidal { phi: 0.5, tolerance, iterations, anderson_depth }
}

/// 5 × 5 × 5 spheres on a cubic lattice, pressed into each other by a hundredth of their diameter, each moving its own way.
fn cluster(law: ContactLaw, integrator: Integrator) -> Settings {
    let mut spheres = Vec::new();
    for k in 0..125u32 {
        let [x, y, z] = [k % 5, k / 5 % 5, k / 25].map(|index| f64::from(index) * 1.98e-3);
        // Irrational steps of the circle: no two alike, none random.
        let velocity = [1.0f64, 2.0f64.sqrt(), 5.0f64.sqrt()].map(|step| 0.05 * (step * f64::from(k * k)).sin());
        spheres.push(([x, y, z], velocity, 1e-3));
    }
    Settings { integrator, ..settings(law, 2500.0, &spheres) }
}

/// One window of `share` critical steps: iterations, or `None` where it did not converge; and positions.
fn window(
    law: ContactLaw,
    share: f64,
    integrator: Integrator,
    more: impl Fn(&mut Settings),
) -> (Option<u32>, Vec<f64>) {
    let mut settings = cluster(law, Integrator::Verlet { substep_s: Some(1e-9) });
    more(&mut settings);
    let probe = Particles::new(settings.clone()).unwrap();
    let solve = |particles: &Particles, dt_s: f64| {
        let (state, _) = particles.initial().unwrap();
        particles.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s }).unwrap().1
    };
    let critical_s = 1e-9 / solve(&probe, 1e-9).figures["substep over critical"];
    let reply = solve(&Particles::new(Settings { integrator, ..settings }).unwrap(), share * critical_s);
    let iterations = reply.not_converged.is_none().then(|| reply.figures["force evaluations"] as u32);
    (iterations, field(&reply, "positions").to_vec())
}

const LAWS: [ContactLaw; 3] =
    [OVERLAP, ContactLaw::Hertz { young_pa: 1e9, poisson: 0.3 }, ContactLaw::Linear { stiffness_n_m: 1e5 }];

fn sliding(settings: &mut Settings) {
    settings.spin = true;
    settings.contact.restitution = Some(0.5);
    settings.friction = Some(Friction::Spring {
        stiffness_ratio: None,
        damping_ratio: None,
        static_coefficient: 0.3,
        dynamic_coefficient: 0.3,
    });
}

/// Largest difference of two sets of positions over the largest way of the second's since `start`.
fn apart(a: &[f64], b: &[f64], start: &[f64]) -> f64 {
    let largest = |from: &[f64]| b.iter().zip(from).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    largest(a) / largest(start)
}

#[test]
fn mixing_takes_fewer_iterations_to_the_same_answer_near_the_critical_step() {
    for law in LAWS {
        for slides in [false, true] {
            let more = |settings: &mut Settings| {
                if slides {
                    sliding(settings)
                }
            };
            // Springs that slide and damping bend the map: the plain iteration fails a little earlier.
            let share = if slides { 0.6 } else { 0.9 };
            let (plain, expected) = window(law, share, trapezoidal(1e-10, 200, 0), more);
            let (mixed, found) = window(law, share, trapezoidal(1e-10, 200, 5), more);
            let (plain, mixed) = (plain.unwrap(), mixed.unwrap());
            // Measured: 24 to 11 with the overlap law, 15 to 8 with the others; three times fewer with friction.
            assert!(f64::from(mixed) < 0.6 * f64::from(plain), "{law:?} {slides}: {mixed} instead of {plain}");
            let start =
                field(&Particles::new(cluster(law, VERLET)).unwrap().initial().unwrap().1, "positions").to_vec();
            // The tolerance of the sums over 1 − 0.9², for the worst of 125.
            let difference = apart(&found, &expected, &start);
            assert!(difference < 1e-8, "{law:?} {slides}: {difference:e}");
        }
    }
}

#[test]
fn mixing_converges_beyond_the_critical_step_where_the_plain_iteration_is_refused() {
    for law in LAWS {
        for slides in [false, true] {
            let more = |settings: &mut Settings| {
                if slides {
                    sliding(settings)
                }
            };
            assert!(window(law, 1.5, trapezoidal(1e-8, 200, 0), more).0.is_none());
            let (iterations, found) = window(law, 1.5, trapezoidal(1e-8, 30, 5), more);
            assert!(iterations.is_some(), "{law:?} {slides}");
            // More room for mixing and a finer tolerance change the answer by no more than the tolerance.
            let (_, finer) = window(law, 1.5, trapezoidal(1e-12, 200, 10), more);
            let start =
                field(&Particles::new(cluster(law, VERLET)).unwrap().initial().unwrap().1, "positions").to_vec();
            let difference = apart(&found, &finer, &start);
            assert!(difference < 1e-6, "{law:?} {slides}: {difference:e}");
        }
    }
}

#[test]
fn one_mode_needs_one_difference() {
    // Two spheres on a linear spring that stays closed: two iterates give the slope of the map, so that the third is the
    // answer, and what it gives says so.
    let spheres = [([0.0; 3], [0.0; 3], 1e-3), ([1.98e-3, 0.0, 0.0], [0.0; 3], 1e-3)];
    let growth = 0.4;
    let dt_s = (4.0 * growth * 0.5 * mass(1e-3, 2500.0) / 1e3).sqrt();
    let solve = |depth| {
        let integrator = trapezoidal(1e-9, 50, depth);
        let settings = Settings { integrator, ..settings(ContactLaw::Linear { stiffness_n_m: 1e3 }, 2500.0, &spheres) };
        let particles = Particles::new(settings).unwrap();
        let (state, _) = particles.initial().unwrap();
        let reply = particles.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s }).unwrap().1;
        assert!(reply.not_converged.is_none());
        let positions = field(&reply, "positions");
        // (Δt ω/2)² = 0.4 in the trapezoidal rule of one oscillator.
        close(positions[3] - positions[0] - 1.98e-3, 2.0 * growth / (1.0 + growth) * 0.02e-3, 1e-8);
        reply.figures["force evaluations"]
    };
    assert!(solve(1) <= 4.0 && solve(0) > 15.0, "{} {}", solve(1), solve(0));
}

#[test]
fn mixing_keeps_the_order_of_the_rule() {
    for (phi, expected) in [(0.5, 2.0), (1.0, 1.0)] {
        let make = |_| monograph(Integrator::Trapezoidal { phi, tolerance: 1e-11, iterations: 60, anderson_depth: 3 });
        let orders = orders(&integration::errors(make, 7e-3, &[200, 400, 800, 1600]));
        assert!(orders.iter().all(|order| (order - expected).abs() < 0.15), "{phi}: {orders:?}");
    }
}
