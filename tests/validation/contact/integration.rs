//! The integration of contacts: its order, its energy ledger, its purity, and what it does with extreme input.

use super::*;

/// Errors of the first particle's position at `end_s` with windows of end/n, for each n, against n = 51 200.
pub(super) fn errors(make: impl Fn(f64) -> Settings, end_s: f64, counts: &[usize]) -> Vec<f64> {
    let end = |count: usize| {
        let dt_s = end_s / count as f64;
        let (_, reply) = run(&Particles::new(make(dt_s)).unwrap(), count, dt_s, |_, _| ());
        field(&reply, "positions")[0]
    };
    let reference = end(51_200);
    counts.iter().map(|&count| (end(count) - reference).abs()).collect()
}

#[test]
fn verlet_is_of_second_order_with_and_without_damping() {
    for damping in [0.0, 1e5] {
        let make = |dt_s| {
            let mut settings = monograph(Integrator::Verlet { substep_s: Some(dt_s) });
            settings.contact.damping_n_s_m3 = damping;
            settings
        };
        // 7 ms is past the turning point, while force and damping act; halvings approach 2 to a few per cent.
        let orders = orders(&errors(make, 7e-3, &[200, 400, 800, 1600]));
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.15), "{damping}: {orders:?}");
    }
}

#[test]
fn trapezoidal_is_of_the_order_its_weight_gives() {
    for (phi, expected) in [(0.5, 2.0), (1.0, 1.0)] {
        let make = |_| monograph(Integrator::Trapezoidal { phi, tolerance: 1e-11, iterations: 60, anderson_depth: 0 });
        let orders = orders(&errors(make, 7e-3, &[200, 400, 800, 1600]));
        assert!(orders.iter().all(|order| (order - expected).abs() < 0.15), "{phi}: {orders:?}");
    }
}

#[test]
fn elastic_energy_is_kept_to_the_integrators_order() {
    for law in [
        OVERLAP,
        ContactLaw::Overlap { stiffness_pa: 1e7, exponent: 1.5 },
        ContactLaw::Hertz { young_pa: 1e7, poisson: 0.3 },
    ] {
        let drift = |count: usize| {
            let spheres = [([-0.052, 0.0, 0.0], [1.0, 0.0, 0.0], 0.05), ([0.042, 0.01, 0.0], [-1.0, 0.0, 0.0], 0.04)];
            let particles = Particles::new(settings(law, 2000.0, &spheres)).unwrap();
            let dt_s = 8e-3 / count as f64;
            let before = energy(&particles.initial().unwrap().1, Kind::Stored);
            let mut worst = 0.0f64;
            run(
                &Particles::new(Settings {
                    integrator: Integrator::Verlet { substep_s: Some(dt_s) },
                    ..settings(law, 2000.0, &spheres)
                })
                .unwrap(),
                count,
                dt_s,
                |_, reply| {
                    worst = worst.max((energy(reply, Kind::Stored) / before - 1.0).abs());
                },
            );
            worst
        };
        let drifts: Vec<f64> = [400, 800, 1600].map(drift).to_vec();
        // The peak drift is sampled on a grid, which blurs the order a little.
        assert!(orders(&drifts).iter().all(|order| (order - 2.0).abs() < 0.3), "{law:?}: {drifts:?}");
        assert!(drifts[2] < 1e-4, "{law:?}: {drifts:?}");
    }
}

pub fn temperature(values: Vec<f64>) -> Fields {
    let port = std::sync::Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude));
    [("temperature".into(), Field::new(&port, 0, values).unwrap())].into()
}

#[test]
fn the_ledger_closes_at_second_order() {
    // Two spheres and a floor: every store and every loss takes part, and the contacts soften as it gets hotter.
    let imbalance = |count: usize| {
        let spheres = [([0.0, 0.0, 0.0499], [0.3, 0.2, -1.0], 0.05), ([0.07, 0.0, 0.1149], [-0.8, 0.0, -1.0], 0.05)];
        let mut settings = settings(OVERLAP, 2000.0, &spheres);
        settings.contact.softening_rate = 1.0;
        settings.contact.damping_n_s_m3 = 5e4;
        settings.friction =
            Some(Friction::Regularised { stiffness_n_m3: 1e16, static_coefficient: 0.02, dynamic_coefficient: 0.02 });
        settings.drag = Some(Drag { viscosity_pa_s: 0.5, velocity_m_s: [1.0, 0.0, 0.0] });
        settings.gravity_m_s2 = [0.0, 0.0, -9.81];
        settings.walls = vec![floor()];
        settings.spin = true;
        let dt_s = 3e-3 / count as f64;
        settings.integrator = Integrator::Verlet { substep_s: Some(dt_s) };
        let particles = Particles::new(settings).unwrap();
        let (mut state, first) = particles.initial().unwrap();
        let before = energy(&first, Kind::Stored);
        let (mut gained, mut lost, mut stored) = (0.0, 0.0, 0.0);
        let mut parts = [0.0f64; 4];
        let hot = |k: usize| temperature(vec![300.0 + 200.0 * k as f64 / count as f64, 300.0]);
        for k in 0..count {
            let frozen = Frozen { start: hot(k), end: hot(k + 1) };
            let (next, reply) = particles.solve(&state, &frozen, Window { t_s: k as f64 * dt_s, dt_s }).unwrap();
            assert!(reply.not_converged.is_none());
            gained += energy(&reply, Kind::Gained);
            lost += energy(&reply, Kind::Lost);
            stored = energy(&reply, Kind::Stored);
            for (part, name) in parts.iter_mut().zip(["contact_damping", "friction", "drag", "softening"]) {
                *part += entry(&reply, name).abs();
            }
            state = next;
        }
        assert!(parts.iter().all(|part| *part > 1e-5 * before), "every part acts: {parts:?} of {before}");
        (stored - before - gained + lost).abs() / before
    };
    let imbalances = [250, 500, 1000, 2000].map(imbalance);
    assert!(orders(&imbalances).iter().all(|order| *order > 1.6), "{imbalances:?}");
    assert!(imbalances[3] < 1e-5, "{imbalances:?}");
}

#[test]
fn a_held_temperature_is_booked_as_softening_at_once() {
    // Two resting spheres pressed into each other; the frozen temperature jumps from 300 K to a held 600 K.
    let spheres = [([0.0; 3], [0.0; 3], 1.0), ([1.9, 0.0, 0.0], [0.0; 3], 1.0)];
    let mut settings = settings(OVERLAP, 2000.0, &spheres);
    settings.contact.softening_rate = 1.0;
    settings.integrator = Integrator::Verlet { substep_s: Some(1e-7) };
    let particles = Particles::new(settings).unwrap();
    let (state, first) = particles.initial().unwrap();
    let frozen = Frozen { start: temperature(vec![600.0; 2]), end: temperature(vec![600.0; 2]) };
    let (_, reply) = particles.solve(&state, &frozen, Window { t_s: 0.0, dt_s: 1e-7 }).unwrap();
    // Stiffness falls to 1/e; the spheres hardly move in 1e-7 s.
    close(entry(&reply, "softening"), entry(&first, "elastic") * ((-1.0f64).exp() - 1.0), 1e-9);
    close(entry(&reply, "elastic"), entry(&first, "elastic") * (-1.0f64).exp(), 1e-6);
}

#[test]
fn held_particles_stay_where_they_are_while_their_contacts_soften() {
    let spheres = [([0.0; 3], [0.1, 0.0, 0.0], 1e-3), ([1.9e-3, 0.0, 0.0], [0.0; 3], 1e-3)];
    let mut settings = settings(OVERLAP, 1000.0, &spheres);
    settings.contact.softening_rate = 1.0;
    settings.integrator = Integrator::Held;
    let particles = Particles::new(settings.clone()).unwrap();
    let (state, first) = particles.initial().unwrap();
    assert_eq!(field(&first, "velocities"), [0.0; 6], "they are at rest whatever their start says");
    let frozen = Frozen { start: temperature(vec![300.0; 2]), end: temperature(vec![600.0; 2]) };
    // No step is too long for what does not move.
    let (_, reply) = particles.solve(&state, &frozen, Window { t_s: 0.0, dt_s: 1e3 }).unwrap();
    for name in ["positions", "velocities", "contact_area"] {
        assert_eq!(field(&reply, name), field(&first, name), "{name}");
    }
    let share = (-1.0f64).exp();
    close(entry(&reply, "elastic"), entry(&first, "elastic") * share, 1e-14);
    // What softening takes is all that changes: nothing else is booked.
    let changed = energy(&reply, Kind::Stored) - energy(&first, Kind::Stored);
    close(changed, entry(&reply, "softening"), 1e-14);
    assert_eq!((energy(&reply, Kind::Gained) - entry(&reply, "softening"), energy(&reply, Kind::Lost)), (0.0, 0.0));

    settings.walls = vec![floor()];
    settings.walls[0].motion =
        stagger_physics::common::walls::Motion::Path(stagger_physics::common::walls::Series::constant([0.0; 3]));
    let refused = Particles::new(settings).unwrap_err().to_string();
    assert!(refused.contains("floor moves or pours, and particles that are held cannot follow"), "{refused}");
}

#[test]
fn solving_again_gives_the_same_bytes() {
    for integrator in [VERLET, Integrator::Trapezoidal { phi: 0.5, tolerance: 1e-6, iterations: 10, anderson_depth: 0 }]
    {
        let cloud = cloud(4, 2.0, 0.3);
        let mut settings = settings(ContactLaw::Overlap { stiffness_pa: 1e6, exponent: 2.0 }, 1000.0, &cloud);
        settings.integrator = integrator;
        settings.friction =
            Some(Friction::Regularised { stiffness_n_m3: 1e6, static_coefficient: 0.4, dynamic_coefficient: 0.3 });
        let particles = Particles::new(settings).unwrap();
        let (state, _) = run(&particles, 3, 1e-4, |_, _| ());
        let solve = |dt_s| particles.solve(&state, &Frozen::default(), Window { t_s: 3e-4, dt_s }).unwrap().1;
        let first = solve(1e-4);
        // Trials of other lengths in between leave no trace.
        solve(3e-5);
        let second = solve(1e-4);
        assert_eq!((&first.fields, &first.ledger, &first.figures), (&second.fields, &second.ledger, &second.figures));
    }
}

#[test]
fn no_particle_and_one_particle() {
    for integrator in [VERLET, Integrator::Trapezoidal { phi: 0.5, tolerance: 1e-8, iterations: 5, anderson_depth: 0 }]
    {
        let none = Settings { integrator, ..settings(OVERLAP, 1000.0, &[]) };
        let (_, reply) = run(&Particles::new(none).unwrap(), 2, 0.1, |_, _| ());
        assert!(reply.fields.values().all(|field| field.rows() == 0));
        let mut one = Settings { integrator, ..settings(OVERLAP, 1000.0, &[([0.0; 3], [1.0, 0.0, 0.0], 1.0)]) };
        one.gravity_m_s2 = [0.0, -2.0, 0.0];
        let (_, reply) = run(&Particles::new(one).unwrap(), 10, 0.1, |_, _| ());
        // A parabola, which both schemes follow exactly.
        let position = field(&reply, "positions");
        assert!((position[0] - 1.0).abs() < 1e-12 && (position[1] + 1.0).abs() < 1e-12 && position[2].abs() < 1e-12);
    }
}

#[test]
fn particles_at_the_same_place_part() {
    for law in [OVERLAP, ContactLaw::Hertz { young_pa: 1e8, poisson: 0.3 }] {
        for other in [1.0, 0.5] {
            let spheres = [([0.0; 3], [0.0; 3], 1.0), ([0.0; 3], [0.0; 3], other)];
            let mut settings = settings(law, 1000.0, &spheres);
            settings.friction =
                Some(Friction::Regularised { stiffness_n_m3: 1e6, static_coefficient: 0.4, dynamic_coefficient: 0.3 });
            let particles = Particles::new(settings).unwrap();
            let before = energy(&particles.initial().unwrap().1, Kind::Stored);
            let (_, reply) = run(&particles, 100, 1e-3, |_, _| ());
            assert!(reply.fields.values().all(|field| field.first_not_finite().is_none()));
            let positions = field(&reply, "positions");
            assert!((positions[5] - positions[2]).abs() > 1.0, "{positions:?}");
            // Parted with the elastic energy they began with.
            close(energy(&reply, Kind::Stored), before, 5e-3);
        }
    }
}

#[test]
fn a_grain_a_thousand_times_smaller_is_no_trouble() {
    let mut particles: Vec<_> = (0..2000)
        .map(|k| {
            let (x, y) = (f64::from(k % 50) * 2.5e-3 - 0.06, f64::from(k / 50) * 2.5e-3 - 0.05);
            // A tenth of the small radius above the large sphere.
            ([x, y, (1.0011f64 * 1.0011 - x * x - y * y).sqrt()], [0.0, 0.0, -0.01], 1e-3)
        })
        .collect();
    particles.push(([0.0; 3], [0.0; 3], 1.0));
    let particles = Particles::new(settings(OVERLAP, 1000.0, &particles)).unwrap();
    let (_, reply) = run(&particles, 3, 0.005, |_, _| ());
    assert!(reply.fields["contact_area"].rows() > 100);
    assert!(field(&reply, "contact_area").iter().all(|area| (0.0..=PI * 1e-6).contains(area)));
}

#[test]
fn a_window_far_too_long_is_refused_not_wrong() {
    for (integrator, dt_s) in [
        (VERLET, 1e12),
        (Integrator::Verlet { substep_s: Some(1e5) }, 1e5),
        (Integrator::Verlet { substep_s: Some(1e300) }, 1e300),
        (Integrator::Trapezoidal { phi: 0.5, tolerance: 1e-6, iterations: 10, anderson_depth: 0 }, 1e3),
        (Integrator::Trapezoidal { phi: 1.0, tolerance: 1e-6, iterations: 10, anderson_depth: 0 }, 1e300),
        // Short enough to stay in reach, but the fixed point does not contract.
        (Integrator::Trapezoidal { phi: 0.5, tolerance: 1e-9, iterations: 5, anderson_depth: 0 }, 4e-3),
    ] {
        let spheres = [([-0.045, 0.0, 0.0], [1.0, 0.0, 0.0], 0.05), ([0.045, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.05)];
        let particles = Particles::new(Settings { integrator, ..settings(OVERLAP, 2000.0, &spheres) }).unwrap();
        let (state, _) = particles.initial().unwrap();
        match particles.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s }) {
            Ok((_, reply)) => {
                let factor = reply.not_converged.expect("refused").step_factor;
                assert!((0.1..=0.9).contains(&factor), "{integrator:?}: {factor}");
                assert!(reply.fields.values().all(|field| field.first_not_finite().is_none()));
            }
            Err(error) => assert!(matches!(error, SolveError::NotFinite { .. }), "{integrator:?}: {error}"),
        }
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let wrong = |change: &dyn Fn(&mut Settings)| {
        let mut settings = settings(OVERLAP, 1000.0, &[([0.0; 3], [0.0; 3], 1.0)]);
        change(&mut settings);
        Particles::new(settings).unwrap_err().to_string()
    };
    assert!(wrong(&|s| s.materials[0].density_kg_m3 = 0.0).contains("density"));
    assert!(wrong(&|s| s.skin = f64::NAN).contains("skin"));
    assert!(wrong(&|s| s.materials.clear()).contains("material 0 of 0"));
    assert!(wrong(&|s| s.contact.law = ContactLaw::Hertz { young_pa: 1.0, poisson: 0.6 }).contains("Poisson"));
    assert!(
        wrong(
            &|s| s.integrator = Integrator::Trapezoidal { phi: 1.5, tolerance: 1.0, iterations: 1, anderson_depth: 0 }
        )
        .contains("phi")
    );
}
