//! What the laws of motion do not depend on: the frame, the directions of space, and the order of the particles.

use proptest::{collection::vec, prelude::*, sample::select};
use stagger_coupling::Physics;
use stagger_physics::particles::{ContactLaw, Friction, Integrator, OverlapBond, Particles};

use super::{
    bed::*,
    conservation::{LAWS, REGULARISED, SPRING, everything, momenta},
    spin::spins,
};

/// A substep is some 1/60 of a contact, and the run two or three contacts long.
const SUBSTEP_S: f64 = 2e-3;
const END_S: f64 = 0.4;

type Vector = [f64; 3];

/// Up to 27 spheres near the sites of a lattice on which neighbours overlap a little; never two in one place.
fn bed() -> impl Strategy<Value = Vec<Sphere>> {
    let offset = || prop::array::uniform3(-0.1..0.1f64);
    let velocity = prop::array::uniform3(-1.0..1.0f64);
    vec((offset(), velocity, 0.9..1.1f64), 2..28).prop_map(|particles| {
        let site = |k: usize| [k % 3, k / 3 % 3, k / 9].map(|c| 1.93 * c as f64 - 1.93);
        let place = |(k, (offset, velocity, radius)): (usize, (Vector, Vector, f64))| {
            let site = site(k);
            (std::array::from_fn(|axis| site[axis] + offset[axis]), velocity, radius)
        };
        particles.into_iter().enumerate().map(place).collect()
    })
}

fn friction() -> impl Strategy<Value = Option<Friction>> {
    select(vec![None, Some(SPRING), Some(REGULARISED)])
}

fn integrator() -> impl Strategy<Value = Integrator> {
    let trapezoidal = Integrator::Trapezoidal { phi: 0.5, tolerance: 1e-11, iterations: 100, anderson_depth: 0 };
    select(vec![Integrator::Verlet { substep_s: Some(SUBSTEP_S) }, trapezoidal])
}

/// The laws of a scene.
#[derive(Clone, Copy, Debug)]
struct Scene {
    law: ContactLaw,
    friction: Option<Friction>,
    integrator: Integrator,
}

fn scene() -> impl Strategy<Value = Scene> {
    (select(&LAWS[..]), friction(), integrator()).prop_map(|(law, friction, integrator)| Scene {
        law,
        friction,
        integrator,
    })
}

impl Scene {
    fn particles(&self, spheres: &[Sphere], gravity_m_s2: Vector) -> Particles {
        let Self { law, friction, integrator } = *self;
        let mut settings = everything(law, SPRING, spheres);
        (settings.friction, settings.integrator, settings.gravity_m_s2) = (friction, integrator, gravity_m_s2);
        if let Integrator::Trapezoidal { .. } = integrator {
            // Where a force jumps, the implicit rule may have no solution at all: damping at the first touch, a bond at
            // its strain, friction from the static to the dynamic coefficient.
            settings.contact.restitution = None;
            settings.bond = settings.bond.map(|bond| OverlapBond { strain: 0.0, ..bond });
            settings.friction = friction.map(|friction| match friction {
                Friction::Spring { static_coefficient, stiffness_ratio, damping_ratio, .. } => Friction::Spring {
                    stiffness_ratio,
                    damping_ratio,
                    static_coefficient,
                    dynamic_coefficient: static_coefficient,
                },
                Friction::Regularised { static_coefficient, stiffness_n_m3, .. } => Friction::Regularised {
                    stiffness_n_m3,
                    static_coefficient,
                    dynamic_coefficient: static_coefficient,
                },
            });
        }
        Particles::new(settings).unwrap()
    }

    /// How far two runs of the same motion may differ: by the rounding of 200 substeps, 1e-15 each of ten metres, that
    /// collisions make grow some thousand times; and by what the fixed point leaves of each step, 1e-11 of the way of all
    /// particles together, the frame's own included.
    fn tolerance(&self) -> f64 {
        if matches!(self.integrator, Integrator::Verlet { .. }) { 1e-9 } else { 1e-6 }
    }

    /// Positions, velocities and spins at the end.
    fn end(&self, spheres: &[Sphere], gravity_m_s2: Vector) -> [Vec<Vector>; 3] {
        let windows = (END_S / SUBSTEP_S).round() as usize;
        let (state, reply) = run(&self.particles(spheres, gravity_m_s2), windows, SUBSTEP_S, |_, _| ());
        let vectors = |name| field(&reply, name).as_chunks::<3>().0.to_vec();
        [vectors("positions"), vectors("velocities"), spins(&state)]
    }
}

fn sum(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

/// Largest difference of two motions, in m, m/s and rad/s.
fn difference(a: &[Vec<Vector>; 3], b: &[Vec<Vector>; 3]) -> f64 {
    let vectors = a.iter().flatten().zip(b.iter().flatten());
    let differences = vectors.flat_map(|(a, b)| (0..3).map(|axis| (a[axis] - b[axis]).abs()));
    // A difference that is not a number is no agreement.
    differences.fold(0.0, |most, value| if value <= most { most } else { value })
}

/// Turns a vector by 90° about one axis.
fn turned(vector: Vector, about: usize) -> Vector {
    let (first, second) = ((about + 1) % 3, (about + 2) % 3);
    let mut turned = vector;
    (turned[first], turned[second]) = (-vector[second], vector[first]);
    turned
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_frame_that_moves_and_is_elsewhere_sees_the_same(
        scene in scene(),
        spheres in bed(),
        shift in prop::array::uniform3(-10.0..10.0f64),
        boost in prop::array::uniform3(-3.0..3.0f64),
    ) {
        let rest = scene.end(&spheres, [0.0; 3]);
        let moved: Vec<Sphere> = spheres.iter().map(|s| (sum(s.0, shift), sum(s.1, boost), s.2)).collect();
        let [positions, velocities, spins] = scene.end(&moved, [0.0; 3]);
        let back = [
            positions.into_iter().map(|r| std::array::from_fn(|axis| r[axis] - shift[axis] - END_S * boost[axis])).collect(),
            velocities.into_iter().map(|v| std::array::from_fn(|axis| v[axis] - boost[axis])).collect(),
            spins,
        ];
        prop_assert!(difference(&rest, &back) < scene.tolerance(), "{:e}", difference(&rest, &back));
    }

    #[test]
    fn no_direction_of_space_is_another(
        scene in scene(),
        spheres in bed(),
        gravity in prop::array::uniform3(-5.0..5.0f64),
        about in 0usize..3,
    ) {
        let upright = scene.end(&spheres, gravity).map(|vectors| vectors.into_iter().map(|v| turned(v, about)).collect());
        let spheres: Vec<Sphere> = spheres.iter().map(|s| (turned(s.0, about), turned(s.1, about), s.2)).collect();
        let lying = scene.end(&spheres, turned(gravity, about));
        prop_assert!(difference(&upright, &lying) < scene.tolerance(), "{:e}", difference(&upright, &lying));
    }

    #[test]
    fn a_mirror_shows_a_motion_that_happens_too(scene in scene(), spheres in bed(), axis in 0usize..3) {
        let flip = |mut vector: Vector| {
            vector[axis] = -vector[axis];
            vector
        };
        let [positions, velocities, spins] = scene.end(&spheres, [0.0; 3]);
        // A spin is turned the other way in a mirror, but for that about the mirror's axis.
        let image = [
            positions.into_iter().map(flip).collect(),
            velocities.into_iter().map(flip).collect(),
            spins.into_iter().map(|spin| flip(spin).map(|component| -component)).collect(),
        ];
        let spheres: Vec<Sphere> = spheres.iter().map(|s| (flip(s.0), flip(s.1), s.2)).collect();
        let mirrored = scene.end(&spheres, [0.0; 3]);
        prop_assert!(difference(&image, &mirrored) < scene.tolerance(), "{:e}", difference(&image, &mirrored));
    }

    #[test]
    fn the_order_of_the_particles_changes_rounding_alone(
        scene in scene(),
        (spheres, order) in bed().prop_flat_map(|spheres| {
            let order: Vec<usize> = (0..spheres.len()).collect();
            (Just(spheres), Just(order).prop_shuffle())
        }),
    ) {
        let straight = scene.end(&spheres, [0.0; 3]).map(|vectors| order.iter().map(|&k| vectors[k]).collect());
        let shuffled: Vec<Sphere> = order.iter().map(|&k| spheres[k]).collect();
        let shuffled = scene.end(&shuffled, [0.0; 3]);
        prop_assert!(difference(&straight, &shuffled) < scene.tolerance(), "{:e}", difference(&straight, &shuffled));
    }

    #[test]
    fn momentum_stays(scene in scene(), spheres in bed()) {
        let particles = scene.particles(&spheres, [0.0; 3]);
        let (state, reply) = particles.initial().unwrap();
        let [before, _] = momenta(&spheres, &state, &reply);
        let (state, reply) = run(&particles, 50, SUBSTEP_S, |_, _| ());
        let [after, _] = momenta(&spheres, &state, &reply);
        for axis in 0..3 {
            // Fifty steps of rounding 1e-16 of what the contacts exchange.
            prop_assert!((after[0][axis] - before[0][axis]).abs() < 1e-13 * (before[1][axis] + after[1][axis]));
        }
    }
}
