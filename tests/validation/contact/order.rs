//! The measured order of both integrators with everything a contact does: pressing, damping, sticking and sliding by the
//! spring, rolling and torsion, and softening as it gets hotter.

use stagger_coupling::{Frozen, Physics, Reply, Window};
use stagger_physics::particles::{ContactLaw, Friction, Integrator, Particles, Rolling, Settings, State};

use super::{bed::*, integration::temperature, spin::spins};

const END_S: f64 = 4e-3;
const RADIUS: f64 = 0.05;
const LAWS: [ContactLaw; 3] =
    [OVERLAP, ContactLaw::Hertz { young_pa: 1e7, poisson: 0.3 }, ContactLaw::Linear { stiffness_n_m: 1e5 }];

/// A sphere pressed to the floor, on which it sticks or slides.
fn sphere(law: ContactLaw, coefficient: f64, gravity_m_s2: [f64; 3], velocity: [f64; 3], substep_s: f64) -> Settings {
    let mut settings = settings(law, 2000.0, &[([0.0, 0.0, 0.999 * RADIUS], velocity, RADIUS)]);
    settings.walls = vec![floor()];
    settings.contact.softening_rate = 1.0;
    settings.contact.restitution = Some(0.8);
    settings.contact.damping_n_s_m3 = 5e4;
    settings.gravity_m_s2 = gravity_m_s2;
    settings.friction = Some(Friction::Spring {
        stiffness_ratio: None,
        damping_ratio: Some(0.2),
        static_coefficient: coefficient,
        dynamic_coefficient: coefficient,
    });
    settings.spin = true;
    settings.integrator = Integrator::Verlet { substep_s: Some(substep_s) };
    settings
}

/// Runs `start` through windows of the given lengths, in which it gets `rate` K/s hotter.
fn through(particles: &Particles, start: State, rate: f64, windows: &[f64]) -> (State, Reply) {
    let (mut state, mut reply) = (start, Reply::default());
    let hot = |t_s: f64| temperature(vec![300.0 + rate * t_s]);
    let mut t_s = 0.0;
    for &dt_s in windows {
        let frozen = Frozen { start: hot(t_s), end: hot(t_s + dt_s) };
        (state, reply) = particles.solve(&state, &frozen, Window { t_s, dt_s }).unwrap();
        assert!(reply.not_converged.is_none(), "{t_s} s");
        t_s += dt_s;
    }
    (state, reply)
}

/// How a sphere moves: a start, and the settings from there on.
struct Case {
    start: State,
    settings: Settings,
}

impl Case {
    /// Starts at rest while it is dragged aside: it sticks, or slides after a while.
    fn dragged(law: ContactLaw, coefficient: f64) -> Self {
        let settings = sphere(law, coefficient, [50.0, 100.0, -200.0], [0.0; 3], 1e-6);
        Self { start: Particles::new(settings.clone()).unwrap().initial().unwrap().0, settings }
    }

    /// Rolls at the start, then is braked and dragged aside. The roll is steady, so that the spring has no velocity that
    /// it would be ahead by. Forces are taken anew as the step is another one than before.
    fn braked(law: ContactLaw, coefficient: f64) -> Self {
        let rolls = sphere(law, coefficient, [0.0, 0.0, -200.0], [1.0, 0.5, 0.0], 0.9e-5);
        let rolls = Particles::new(rolls).unwrap();
        let start = through(&rolls, rolls.initial().unwrap().0, 0.0, &[0.4]).0;
        let mut settings = sphere(law, coefficient, [50.0, 100.0, -200.0], [0.0; 3], 1e-6);
        settings.rolling = Some(Rolling { rolling: 0.3, torsion: 0.3 });
        Self { start, settings }
    }

    /// Position in cm, velocity in m/s and spin in 100 rad/s at the end.
    fn end(&self, integrator: Integrator, windows: &[f64]) -> [f64; 9] {
        let particles = Particles::new(Settings { integrator, ..self.settings.clone() }).unwrap();
        let (state, reply) = through(&particles, self.start.clone(), 100.0 / END_S, windows);
        assert_eq!(reply.fields["wall_contact_area"].rows(), 1);
        let (at, velocity, spin) = (field(&reply, "positions"), field(&reply, "velocities"), spins(&state)[0]);
        std::array::from_fn(|i| match i / 3 {
            0 => 100.0 * at[i],
            1 => velocity[i - 3],
            _ => 0.01 * spin[i - 6],
        })
    }

    /// Order over three halvings from 100 windows on, against Verlet with 25 600; every second window is `longer` by a
    /// share than their mean.
    fn order(&self, integrator: impl Fn(f64) -> Integrator, longer: f64) -> f64 {
        let exact = self.end(Integrator::Verlet { substep_s: Some(END_S / 25_600.0) }, &[END_S]);
        let error = |count: usize| {
            let dt_s = END_S / count as f64;
            let share = |k: usize| if k.is_multiple_of(2) { 1.0 + longer } else { 1.0 - longer };
            let windows: Vec<f64> = (0..count).map(|k| dt_s * share(k)).collect();
            let end = self.end(integrator(dt_s * (1.0 + longer)), &windows);
            end.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        (error(100) / error(800)).log2() / 3.0
    }
}

/// The laws, sticking and sliding, without and with rolling.
fn cases() -> impl Iterator<Item = (String, Case)> {
    LAWS.into_iter().flat_map(|law| {
        [5.0, 0.05].into_iter().flat_map(move |coefficient| {
            let cases = [("dragged", Case::dragged(law, coefficient)), ("braked", Case::braked(law, coefficient))];
            cases.map(|(name, case)| (format!("{law:?}, {coefficient}, {name}"), case))
        })
    })
}

fn trapezoidal(phi: f64) -> Integrator {
    Integrator::Trapezoidal { phi, tolerance: 1e-12, iterations: 200, anderson_depth: 0 }
}

#[test]
fn verlet_and_the_midpoint_rule_are_of_second_order_and_backward_euler_of_first() {
    for (name, case) in cases() {
        let verlet = case.order(|dt_s| Integrator::Verlet { substep_s: Some(dt_s) }, 0.0);
        let [midpoint, euler] = [0.5, 1.0].map(|phi| case.order(|_| trapezoidal(phi), 0.0));
        // Smooth cases differ by less than 0.01; the instant at which sticking turns into sliding lies anywhere in a step,
        // which shows in these errors of 1e-7.
        let text = format!("{name}: {verlet} {midpoint} {euler}");
        assert!((verlet - 2.0).abs() < 0.2 && (midpoint - 2.0).abs() < 0.2 && (euler - 1.0).abs() < 0.05, "{text}");
    }
}

#[test]
fn windows_of_changing_length_keep_the_order() {
    for (name, case) in cases() {
        let verlet = case.order(|dt_s| Integrator::Verlet { substep_s: Some(1.01 * dt_s) }, 0.4);
        let midpoint = case.order(|_| trapezoidal(0.5), 0.4);
        // As with equal windows; a spring half a step ahead of the wrong step would make it 1. The instant at which sticking turns
        // into sliding lies elsewhere in every run's steps, which blurs errors of 1e-7.
        let blur = if name.contains("0.05") { 0.5 } else { 0.2 };
        assert!((verlet - 2.0).abs() < blur && (midpoint - 2.0).abs() < blur, "{name}: {verlet} {midpoint}");
    }
}
