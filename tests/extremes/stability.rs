//! Up to which step the rules of motion stay bounded, over decades of stiffness, against theory.
//!
//! Two systems, each with a damping ratio of [`DAMPING`]. A *pair* is held at a distance by the near field: no contact, so that
//! nothing but the rule itself bounds the step. A *contact* is a sphere that gravity presses onto a plate, about which it
//! swings: there the program looks after the step too. z = ω Δt.

#[path = "stability_map.rs"]
mod map;

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3};
use stagger_coupling::{Frozen, Physics, Window};
use stagger_physics::particles::{
    Base, ContactLaw, Drag, FieldRegion, Integrator, NearFieldSettings, Particles, Presence, Settings, State,
};

use crate::bed::*;

/// Damping ratio ζ of both systems: without damping, no step is stable for φ = 0.
pub const DAMPING: f64 = 0.1;
/// Steps after which a motion has grown or decayed: one per cent a step is a factor of 20.
const STEPS: usize = 300;
/// Tolerance and iterations of the trapezoidal rule.
const TOLERANCE: f64 = 1e-8;
const ITERATIONS: u32 = 200;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum System {
    Pair,
    Contact,
}

/// A rule of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    Verlet,
    Trapezoidal { phi: f64, anderson: bool },
}

/// What a motion does at a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Course {
    Decays,
    Grows,
    /// A smaller step is asked for.
    Refused,
}

impl System {
    /// The system with a stiffness in N/m and a mass of 1 kg; ω in 1/s.
    fn settings(self, stiffness_n_m: f64) -> (Settings, f64) {
        let radius = 0.01;
        let density = 1.0 / mass(radius, 1.0);
        let law = ContactLaw::Linear { stiffness_n_m };
        match self {
            Self::Pair => {
                // K (1/d − 1/d²) has its zero at 1 m, where its slope is K; about the reduced mass of 1/2 kg.
                let omega = (2.0 * stiffness_n_m).sqrt();
                let mut settings =
                    settings(law, density, &[([0.0; 3], [0.0; 3], radius), ([1.0 + 1e-4, 0.0, 0.0], [0.0; 3], radius)]);
                settings.fields.near_field = Some(NearFieldSettings {
                    attraction: stiffness_n_m,
                    attraction_exponent: 1.0,
                    repulsion: stiffness_n_m,
                    repulsion_exponent: 2.0,
                    base: Base::Mass,
                    alternating: false,
                    cutoff_m: None,
                    skin: 0.1,
                    closest: 1e-3,
                    presence: Presence { region: FieldRegion::Everywhere, starts_s: 0.0, ends_s: f64::INFINITY },
                });
                let viscosity_pa_s = 2.0 * DAMPING * omega / (6.0 * PI * radius);
                settings.drag = Some(Drag { viscosity_pa_s, velocity_m_s: [0.0; 3] });
                (settings, omega)
            }
            Self::Contact => {
                let omega = stiffness_n_m.sqrt();
                // Pressed in by a hundredth of the radius, and started off that by a tenth of it.
                let rest = 1e-2 * radius;
                let mut settings = settings(law, density, &[([0.0, 0.0, radius - 0.9 * rest], [0.0; 3], radius)]);
                settings.gravity_m_s2 = [0.0, 0.0, -stiffness_n_m * rest];
                settings.walls = vec![floor()];
                settings.contact.restitution = Some((-PI * DAMPING / (1.0 - DAMPING * DAMPING).sqrt()).exp());
                (settings, omega)
            }
        }
    }

    /// (ω x)² + v² about the rest.
    fn energy(self, reply_positions: &[f64], velocities: &[f64], omega: f64) -> f64 {
        let (x, v) = match self {
            Self::Pair => (reply_positions[3] - reply_positions[0] - 1.0, velocities[3] - velocities[0]),
            Self::Contact => (reply_positions[2] - 0.01 * 0.99, velocities[2]),
        };
        (omega * x).powi(2) + v * v
    }
}

impl Rule {
    fn integrator(self, dt_s: f64) -> Integrator {
        match self {
            Self::Verlet => Integrator::Verlet { substep_s: Some(dt_s) },
            Self::Trapezoidal { phi, anderson } => {
                let anderson_depth = if anderson { 5 } else { 0 };
                Integrator::Trapezoidal { phi, tolerance: TOLERANCE, iterations: ITERATIONS, anderson_depth }
            }
        }
    }
}

/// What a system does at z = ω Δt.
pub fn course(system: System, rule: Rule, stiffness_n_m: f64, dt_s: f64) -> Course {
    let (mut settings, omega) = system.settings(stiffness_n_m);
    settings.integrator = rule.integrator(dt_s);
    let particles = Particles::new(settings).unwrap();
    let (mut state, reply): (State, _) = particles.initial().unwrap();
    let energy = |reply: &_| system.energy(field(reply, "positions"), field(reply, "velocities"), omega);
    let (start, mut now) = (energy(&reply), 0.0);
    for step in 0..STEPS {
        let window = Window { t_s: step as f64 * dt_s, dt_s };
        let solved = particles.solve(&state, &Frozen::default(), window);
        match solved {
            Ok((next, reply)) if reply.not_converged.is_none() => {
                now = energy(&reply);
                state = next;
            }
            // What has grown out of all bounds is not solved any more.
            _ if now > 4.0 * start => return Course::Grows,
            _ => return Course::Refused,
        }
        if now > 1e4 * start {
            return Course::Grows;
        }
        // Far below, rounding would be all that is left to iterate on.
        if now < 1e-4 * start {
            return Course::Decays;
        }
    }
    if now < start { Course::Decays } else { Course::Grows }
}

/// Largest factor of a motion in one step of a rule, at z.
fn growth(rule: Rule, z: f64) -> f64 {
    let radius = |values: Vec<nalgebra::Complex<f64>>| values.iter().map(|value| value.norm()).fold(0.0, f64::max);
    match rule {
        // Of (x, Δt v, Δt² a): forces that depend on velocity see that predicted, v + Δt a.
        Rule::Verlet => {
            let x = [1.0, 1.0, 0.5];
            let a = [-z * z, -z * z - 2.0 * DAMPING * z, -0.5 * z * z - 2.0 * DAMPING * z];
            let v = [0.5 * a[0], 1.0 + 0.5 * a[1], 0.5 + 0.5 * a[2]];
            radius(Matrix3::from_row_slice(&[x, v, a].concat()).complex_eigenvalues().iter().copied().collect())
        }
        Rule::Trapezoidal { phi, .. } => {
            let m = Matrix2::new(0.0, z, -z, -2.0 * DAMPING * z);
            let step = (Matrix2::identity() - phi * m).try_inverse().unwrap() * (Matrix2::identity() + (1.0 - phi) * m);
            radius(step.complex_eigenvalues().iter().copied().collect())
        }
    }
}

/// The largest z at which a motion decays, or infinity.
pub fn stable_to(rule: Rule) -> f64 {
    let steps = (1..4000).map(|step| 1e-3 * f64::from(step));
    steps.clone().find(|&z| growth(rule, z) > 1.0 + 1e-12).unwrap_or(f64::INFINITY)
}

/// The largest z at which the plain iteration contracts so much that `ITERATIONS` reach `TOLERANCE`; infinity for other rules.
/// Its factor is −(a² + 2 ζ a) with a = φ z.
pub fn contracts_to(rule: Rule, factor: f64) -> f64 {
    match rule {
        Rule::Trapezoidal { phi, anderson: false } if phi > 0.0 => {
            ((DAMPING * DAMPING + factor).sqrt() - DAMPING) / phi
        }
        _ => f64::INFINITY,
    }
}

/// Contraction with which so many iterations just reach the tolerance.
fn needed() -> f64 {
    TOLERANCE.powf(1.0 / f64::from(ITERATIONS))
}

/// The border between what decays and what does not, in z, by bisection between two of which the lower decays.
fn measured(system: System, rule: Rule, stiffness_n_m: f64, [mut low, mut high]: [f64; 2]) -> (f64, Course) {
    let omega = system.settings(stiffness_n_m).1;
    let at = |z: f64| course(system, rule, stiffness_n_m, z / omega);
    assert_eq!(at(low), Course::Decays, "{system:?} {rule:?} at {low}");
    let mut beyond = at(high);
    assert_ne!(beyond, Course::Decays, "{system:?} {rule:?} at {high}");
    while high / low > 1.002 {
        let middle = (low * high).sqrt();
        match at(middle) {
            Course::Decays => low = middle,
            other => (high, beyond) = (middle, other),
        }
    }
    ((low * high).sqrt(), beyond)
}

const STIFFNESSES: [f64; 3] = [1e2, 1e4, 1e6];

#[test]
fn borders_of_the_rules_are_those_of_theory() {
    for stiffness in STIFFNESSES {
        for rule in [Rule::Verlet, Rule::Trapezoidal { phi: 0.0, anderson: false }] {
            let theory = stable_to(rule);
            let (border, beyond) = measured(System::Pair, rule, stiffness, [0.5 * theory, 2.0 * theory]);
            assert_eq!(beyond, Course::Grows);
            // Bisected to 0.2 %, with 300 steps to see growth by: at 1 % beyond the border, by a factor of 1.6 and more.
            close(border, theory, 2e-2);
        }
        for phi in [0.5, 1.0] {
            let rule = Rule::Trapezoidal { phi, anderson: false };
            assert_eq!(stable_to(rule), f64::INFINITY);
            let theory = contracts_to(rule, 1.0);
            let (border, beyond) = measured(System::Pair, rule, stiffness, [0.5 * theory, 1.5 * theory]);
            assert_eq!(beyond, Course::Refused);
            // Short of where it contracts, it needs more iterations than there are, most at turning points.
            assert!((0.7..=1.0).contains(&(border / theory)), "{border} {theory}");
        }
    }
}

#[test]
fn mixed_iterations_go_beyond_the_contraction_and_stay_bounded() {
    for phi in [0.5, 1.0] {
        for z in [0.5, 2.0] {
            let rule = Rule::Trapezoidal { phi, anderson: true };
            let omega = System::Pair.settings(1e4).1;
            assert_eq!(course(System::Pair, rule, 1e4, z / omega), Course::Decays, "{phi} {z}");
        }
    }
}

#[test]
fn a_contact_is_never_left_to_grow_by_the_rules_that_are_stable() {
    // Verlet keeps to half of the critical step by substeps, the implicit rules ask for less where they do not contract: at
    // the contacts' critical step z = 2 at the latest.
    for stiffness in STIFFNESSES {
        for z in [0.1, 0.5, 1.0, 1.9, 2.1, 4.0, 10.0] {
            let omega = System::Contact.settings(stiffness).1;
            let at = |rule| course(System::Contact, rule, stiffness, z / omega);
            assert_eq!(at(Rule::Verlet), Course::Decays, "{z}");
            for phi in [0.5, 1.0] {
                let rule = Rule::Trapezoidal { phi, anderson: false };
                let expected = if z < contracts_to(rule, needed()).min(2.0) { Course::Decays } else { Course::Refused };
                assert_eq!(at(rule), expected, "{phi} {z}");
            }
        }
    }
}
