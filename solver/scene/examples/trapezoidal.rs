//! What a window costs by the trapezoidal rule, plain and with Anderson's mixing, and by velocity Verlet at the same error.
//!
//! `trapezoidal [SIDE]`: SIDE³ spheres (12³ by default) on a cubic lattice, pressed into each other by 1 % of their diameter, each
//! moving its own way; Hertz, one thread. Run for 20 critical steps; the error is the root mean square of the distance from where
//! Verlet with substeps of 1/400 of the critical step takes the spheres, over that of their way.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::time::Instant;

use stagger_coupling::{Frozen, Physics, Window};
use stagger_physics::particles::{Contact, ContactLaw, Integrator, Material, Particles, Settings, Start};

/// How long all run, in critical steps of the start.
const CRITICAL_STEPS: f64 = 20.0;
/// Substeps of the reference to the critical step.
const REFERENCE: f64 = 400.0;
/// Tolerance of the fixed point.
const TOLERANCE: f64 = 1e-8;

fn settings(side: u32, integrator: Integrator) -> Settings {
    let count = side * side * side;
    let place = |k: u32| [k % side, k / side % side, k / (side * side)].map(|index| f64::from(index) * 1.98e-3);
    // Irrational steps of the circle: no two alike, none random.
    let velocity =
        |k: u32| [1.0f64, 2.0f64.sqrt(), 5.0f64.sqrt()].map(|step| 0.05 * (step * f64::from(k % 9973).powi(2)).sin());
    let start = Start::Given {
        positions_m: (0..count).map(place).collect(),
        velocities_m_s: (0..count).map(velocity).collect(),
        radii_m: vec![1e-3; count as usize],
        materials: vec![0; count as usize],
        spins_rad_s: Vec::new(),
    };
    let material = Material { name: "matter".into(), density_kg_m3: 2500.0, stiffness: None, poisson: None };
    let law = ContactLaw::Hertz { young_pa: 1e9, poisson: 0.3 };
    Settings {
        contact: Contact { softening_floor_pa: 0.0, ..Contact::new(law) },
        gravity_m_s2: [0.0; 3],
        integrator,
        ..Settings::new(start, material, law)
    }
}

/// Where the particles are in the end, evaluations of all forces, and seconds; `None` where a window did not converge.
fn run(side: u32, integrator: Integrator, windows: u32, end_s: f64) -> Option<(Vec<f64>, f64, f64)> {
    let particles = Particles::new(settings(side, integrator)).unwrap();
    let (mut state, mut reply) = particles.initial().unwrap();
    let dt_s = end_s / f64::from(windows);
    let mut evaluations = 0.0;
    let from = Instant::now();
    for window in 0..windows {
        let window = Window { t_s: f64::from(window) * dt_s, dt_s };
        (state, reply) = particles.solve(&state, &Frozen::default(), window).unwrap();
        if reply.not_converged.is_some() {
            return None;
        }
        evaluations += reply.figures["force evaluations"];
    }
    Some((reply.fields["positions"].f64().unwrap().to_vec(), evaluations, from.elapsed().as_secs_f64()))
}

/// Root of the sum of the squared differences.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn main() {
    let side = std::env::args().nth(1).map_or(12, |text| text.parse().unwrap());
    let probe = Particles::new(settings(side, Integrator::Verlet { substep_s: Some(1e-9) })).unwrap();
    let (state, first) = probe.initial().unwrap();
    let start = first.fields["positions"].f64().unwrap().to_vec();
    let (_, reply) = probe.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s: 1e-9 }).unwrap();
    let critical_s = 1e-9 / reply.figures["substep over critical"];
    let end_s = CRITICAL_STEPS * critical_s;
    let verlet = |steps: f64| Integrator::Verlet { substep_s: Some(1.001 * end_s / steps) };
    let (exact, ..) = run(side, verlet(CRITICAL_STEPS * REFERENCE), 1, end_s).unwrap();
    let way = distance(&exact, &start);

    println!("{} spheres, critical step {critical_s:.3e} s, {CRITICAL_STEPS} of them", side * side * side);
    println!(
        "{:<14} {:>16} {:>8} {:>14} {:>14} {:>10} {:>9}",
        "rule", "step/critical", "windows", "evaluations", "ms a window", "s in all", "error"
    );
    let show = |name: &str, share: f64, integrator: Integrator| {
        let windows = (CRITICAL_STEPS / share).round() as u32;
        let Some((end, evaluations, seconds)) = run(side, integrator, windows, end_s) else {
            println!("{name:<14} {share:>16.4} {windows:>8} not converged");
            return;
        };
        let per_window = evaluations / f64::from(windows);
        let ms = 1e3 * seconds / f64::from(windows);
        let error = distance(&end, &exact) / way;
        println!("{name:<14} {share:>16.4} {windows:>8} {per_window:>14.1} {ms:>14.2} {seconds:>10.3} {error:>9.1e}");
    };
    for share in [0.05, 0.1, 0.2, 0.5, 0.8, 1.25] {
        for depth in [0, 3, 5] {
            let rule =
                Integrator::Trapezoidal { phi: 0.5, tolerance: TOLERANCE, iterations: 100, anderson_depth: depth };
            let name = if depth == 0 { "plain".into() } else { format!("mixed, {depth}") };
            show(&name, share, rule);
        }
    }
    for share in [0.025, 0.05, 0.1, 0.2, 0.25, 0.4, 0.5] {
        show("Verlet", share, verlet(CRITICAL_STEPS / share));
    }
}
