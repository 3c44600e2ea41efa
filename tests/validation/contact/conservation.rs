//! What all forces between particles conserve together, and what the ledger says of the rest.

use stagger_coupling::{Physics, Reply};
use stagger_messages::energy::Kind;
use stagger_physics::particles::{ContactLaw, Friction, Integrator, OverlapBond, Particles, Rolling, Settings, State};

use super::{bed::*, spin::spins};

const DENSITY: f64 = 1000.0;

/// Every force between particles at once.
pub fn everything(law: ContactLaw, friction: Friction, spheres: &[Sphere]) -> Settings {
    let mut settings = settings(law, DENSITY, spheres);
    settings.contact.damping_n_s_m3 = 1e3;
    settings.contact.restitution = Some(0.7);
    settings.friction = Some(friction);
    settings.rolling = Some(Rolling { rolling: 0.1, torsion: 0.1 });
    settings.bond = Some(OverlapBond { stiffness_pa: 2e4, exponent: 1.0, shear_stiffness_n_m3: 1e5, strain: 0.01 });
    settings.spin = true;
    settings
}

pub const SPRING: Friction =
    Friction::Spring { stiffness_ratio: None, damping_ratio: None, static_coefficient: 0.4, dynamic_coefficient: 0.3 };
pub const REGULARISED: Friction =
    Friction::Regularised { stiffness_n_m3: 1e6, static_coefficient: 0.4, dynamic_coefficient: 0.3 };

pub const LAWS: [ContactLaw; 3] = [
    ContactLaw::Overlap { stiffness_pa: 1e6, exponent: 2.0 },
    ContactLaw::Hertz { young_pa: 1e6, poisson: 0.3 },
    ContactLaw::Linear { stiffness_n_m: 1e6 },
];

fn cross(a: &[f64], b: &[f64]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Momentum and angular momentum about the origin, and the sums of their terms' sizes.
pub fn momenta(spheres: &[Sphere], state: &State, reply: &Reply) -> [[[f64; 3]; 2]; 2] {
    let (positions, velocities) = (field(reply, "positions"), field(reply, "velocities"));
    let (mut linear, mut angular) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
    for (i, (sphere, spin)) in spheres.iter().zip(spins(state)).enumerate() {
        let mass = mass(sphere.2, DENSITY);
        let velocity = &velocities[3 * i..3 * i + 3];
        let orbit = cross(&positions[3 * i..3 * i + 3], velocity);
        for axis in 0..3 {
            let terms = [mass * velocity[axis], mass * orbit[axis] + 0.4 * mass * sphere.2.powi(2) * spin[axis]];
            for (sums, term) in [&mut linear, &mut angular].into_iter().zip(terms) {
                sums[0][axis] += term;
                sums[1][axis] += term.abs();
            }
        }
    }
    [linear, angular]
}

/// Change of the linear and of the angular momentum over the sums of their terms.
fn changes(spheres: &[Sphere], particles: &Particles, look: impl FnMut(usize, &Reply)) -> [f64; 2] {
    let (state, reply) = particles.initial().unwrap();
    let before = momenta(spheres, &state, &reply);
    let (state, reply) = run_from(particles, (state, reply), 20, 0.05, look);
    let after = momenta(spheres, &state, &reply);
    [0, 1].map(|kind| {
        let axes = (0..3).map(|axis| (after[kind][0][axis] - before[kind][0][axis]).abs() / before[kind][1][axis]);
        axes.fold(0.0, f64::max)
    })
}

#[test]
fn momentum_is_conserved_to_rounding_by_all_forces_together() {
    let spheres = super::cloud(4, 2.15, 0.3);
    for law in LAWS {
        for friction in [SPRING, REGULARISED] {
            let particles = Particles::new(everything(law, friction, &spheres)).unwrap();
            let mut parts = [0.0f64; 4];
            let [linear, _] = changes(&spheres, &particles, |_, reply| {
                for (part, name) in parts.iter_mut().zip(["contact_damping", "friction", "rolling", "bonds"]) {
                    *part = part.max(entry(reply, name).abs());
                }
            });
            assert!(parts.iter().all(|part| *part > 1.0), "every part acts: {parts:?} J");
            // Some thousand substeps of rounding 1e-16 each, of either sign.
            assert!(linear < 1e-14, "{law:?}, {friction:?}: {linear:e}");
        }
    }
}

#[test]
fn central_forces_conserve_angular_momentum_to_rounding() {
    let spheres = super::cloud(4, 2.15, 0.3);
    for law in LAWS {
        let mut settings = Settings { friction: None, ..everything(law, SPRING, &spheres) };
        settings.bond = settings.bond.map(|bond| OverlapBond { shear_stiffness_n_m3: 0.0, ..bond });
        let [_, angular] = changes(&spheres, &Particles::new(settings).unwrap(), |_, _| ());
        assert!(angular < 1e-13, "{law:?}: {angular:e}");
    }
}

#[test]
fn friction_changes_angular_momentum_by_its_lever_through_the_overlap_and_nothing_else() {
    // Friction acts on either sphere at its full radius, as in eqs. 6.11–6.15, so that the arms together are longer than
    // the distance by the overlap δ: the pair gains δ n × F. Rolling and torsion turn both spheres against each other.
    let spheres = [([-1.0, 0.2, 0.0], [1.0, 0.5, 0.0], 1.0), ([0.93, -0.1, 0.1], [-1.0, -0.2, 0.3], 0.92)];
    let mut settings = everything(ContactLaw::Linear { stiffness_n_m: 1e8 }, SPRING, &spheres);
    settings.bond = None;
    let missing = |windows: usize| {
        let dt_s = 0.04 / windows as f64;
        settings.integrator = Integrator::Verlet { substep_s: Some(dt_s) };
        let particles = Particles::new(settings.clone()).unwrap();
        let (mut state, mut reply) = particles.initial().unwrap();
        let before = momenta(&spheres, &state, &reply)[1];
        let lever = |reply: &Reply| -> [f64; 3] {
            let positions = field(reply, "positions");
            let between: [f64; 3] = std::array::from_fn(|axis| positions[3 + axis] - positions[axis]);
            let distance = between.iter().map(|x| x * x).sum::<f64>().sqrt();
            between.map(|x| x / distance * (1.92 - distance).max(0.0))
        };
        let mut gained = [0.0; 3];
        for _ in 0..windows {
            let (arm, velocity) = (lever(&reply), field(&reply, "velocities").to_vec());
            (state, reply) = run_from(&particles, (state, reply), 1, dt_s, |_, _| ());
            let (late, kick) = (lever(&reply), field(&reply, "velocities"));
            let arm: [f64; 3] = std::array::from_fn(|axis| 0.5 * (arm[axis] + late[axis]));
            let kick: [f64; 3] = std::array::from_fn(|axis| mass(1.0, DENSITY) * (kick[axis] - velocity[axis]));
            let gain = cross(&arm, &kick);
            gained = std::array::from_fn(|axis| gained[axis] + gain[axis]);
        }
        assert_eq!(reply.fields["contact_area"].rows(), 0);
        let after = momenta(&spheres, &state, &reply)[1];
        let change: [f64; 3] = std::array::from_fn(|axis| after[0][axis] - before[0][axis]);
        let size = |vector: [f64; 3]| vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        [size(change) / before[1][2], size(std::array::from_fn(|axis| change[axis] - gained[axis])) / size(change)]
    };
    let [coarse, fine] = [500, 2000].map(missing);
    assert!(fine[0] > 1e-4, "friction acts: {fine:?}");
    // The sum over windows of the mean arm is of second order.
    assert!(fine[1] < 1e-5 && coarse[1] > 10.0 * fine[1], "{coarse:?} {fine:?}");
}

#[test]
fn the_ledger_closes_at_second_order_with_springs_rolling_and_bonds() {
    // Two spheres and a floor touch all the while, as does the floor; the last is stuck to by a spring that never slides.
    let spring = |coefficient| Friction::Spring {
        stiffness_ratio: None,
        damping_ratio: Some(0.2),
        static_coefficient: coefficient,
        dynamic_coefficient: coefficient,
    };
    let bond = OverlapBond { stiffness_pa: 2e5, exponent: 1.0, shear_stiffness_n_m3: 1e6, strain: 0.0 };
    let resists = Rolling { rolling: 0.2, torsion: 0.2 };
    for law in [OVERLAP, ContactLaw::Hertz { young_pa: 3e7, poisson: 0.3 }] {
        for (friction, restitution, rolling, bond) in [
            (0.02, None, None, None),
            (2.0, None, None, None),
            (0.02, Some(0.6), None, Some(bond)),
            (2.0, Some(0.6), None, None),
            (0.02, None, Some(resists), Some(bond)),
            (2.0, Some(0.6), Some(resists), None),
        ] {
            let imbalance = |substeps: usize| {
                let spheres =
                    [([0.0, 0.0, 0.0499], [0.3, 0.2, -1.0], 0.05), ([0.07, 0.0, 0.1149], [-0.8, 0.0, -1.0], 0.05)];
                let mut settings = settings(law, 2000.0, &spheres);
                settings.contact.damping_n_s_m3 = 5e4;
                settings.contact.restitution = restitution;
                settings.friction = Some(spring(friction));
                settings.rolling = rolling;
                settings.bond = bond;
                settings.gravity_m_s2 = [0.0, 0.0, -9.81];
                settings.walls = vec![floor()];
                settings.spin = true;
                settings.integrator = Integrator::Verlet { substep_s: Some(3e-3 / substeps as f64) };
                let particles = Particles::new(settings).unwrap();
                let before = energy(&particles.initial().unwrap().1, Kind::Stored);
                let mut lost = 0.0;
                let mut parts = [0.0; 2];
                let (_, reply) = run(&particles, 10, 3e-4, |_, reply| {
                    lost += energy(reply, Kind::Lost) - energy(reply, Kind::Gained);
                    parts[0] += entry(reply, "friction");
                    parts[1] += if rolling.is_some() { entry(reply, "rolling") } else { before };
                });
                assert!(parts.iter().all(|part| *part > 1e-5 * before), "every part acts: {parts:?} of {before}");
                (energy(&reply, Kind::Stored) - before + lost).abs() / before
            };
            let imbalances = [250, 500, 1000].map(imbalance);
            // The sampled balance follows Verlet's own energy error, which is smooth in the step.
            let orders = orders(&imbalances);
            assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.1), "{law:?} {friction}: {imbalances:?}");
            assert!(imbalances[2] < 1e-6, "{law:?} {friction}: {imbalances:?}");
        }
    }
}
