//! The monograph's bond of overlapping particles.

use std::f64::consts::PI;

use stagger_coupling::Physics;
use stagger_messages::energy::Kind;
use stagger_physics::particles::{ContactLaw, Friction, Integrator, OverlapBond, Particles, Settings, Start};

use super::bed::*;

const RADIUS: f64 = 0.05;
const DENSITY: f64 = 2000.0;

/// A bond linear in the strain beside a contact quadratic in it: at rest at E = K_nb/K_p.
const BOND: OverlapBond = OverlapBond { stiffness_pa: 2e6, exponent: 1.0, shear_stiffness_n_m3: 0.0, strain: 0.0 };
const STRAIN: f64 = 0.02;

/// Two spheres with the overlap strain, each moving away from the other at `speed`.
fn pair(strain: f64, speed: f64, bond: Option<OverlapBond>, substep_s: f64) -> Settings {
    let at = RADIUS * (1.0 - strain);
    let spheres = [([-at, 0.0, 0.0], [-speed, 0.0, 0.0], RADIUS), ([at, 0.0, 0.0], [speed, 0.0, 0.0], RADIUS)];
    let integrator = Integrator::Verlet { substep_s: Some(substep_s) };
    Settings { bond, integrator, ..settings(OVERLAP, DENSITY, &spheres) }
}

/// Contact area in m² at rest.
fn area() -> f64 {
    PI * RADIUS * RADIUS * (1.0 - (1.0 - STRAIN) * (1.0 - STRAIN))
}

#[test]
fn a_bonded_pair_rests_where_attraction_and_contact_balance() {
    let particles = Particles::new(pair(STRAIN, 0.0, Some(BOND), 1e-5)).unwrap();
    let (_, reply) = run(&particles, 1, 1.0, |_, _| ());
    // Rounding of positions of 0.05 m moves the balance by 1e-17 m.
    assert!((field(&reply, "contact_distance")[0] - 2.0 * RADIUS * (1.0 - STRAIN)).abs() < 1e-15);
    // From elsewhere it comes there when damped.
    let mut settings = pair(0.03, 0.0, Some(BOND), 1e-5);
    settings.contact.damping_n_s_m3 = 1e5;
    let (_, reply) = run(&Particles::new(settings).unwrap(), 1, 2.0, |_, _| ());
    close(field(&reply, "contact_distance")[0], 2.0 * RADIUS * (1.0 - STRAIN), 1e-12);
}

#[test]
fn a_bonded_pair_swings_at_its_frequency_and_keeps_its_energy() {
    // About rest the stiffness is A K_nb/(2R), and the mass half of one sphere's.
    let stiffness = BOND.stiffness_pa * area() / (2.0 * RADIUS);
    let period_s = 2.0 * PI * (0.5 * mass(RADIUS, DENSITY) / stiffness).sqrt();
    let amplitude = 1e-4 * STRAIN;
    let particles = Particles::new(pair(STRAIN + amplitude, 0.0, Some(BOND), period_s / 2000.0)).unwrap();
    let before = energy(&particles.initial().unwrap().1, Kind::Stored);
    let (mut strains, mut drift) = (Vec::new(), 0.0f64);
    run(&particles, 100, period_s / 20.0, |_, reply| {
        strains.push(1.0 - field(reply, "contact_distance")[0] / (2.0 * RADIUS));
        drift = drift.max((energy(reply, Kind::Stored) - before).abs());
        assert!(entry(reply, "bonds") < 0.0);
    });
    // After five periods it is where it began; anharmonic terms are of the order 1e-4 of the amplitude.
    for (k, strain) in (1..).zip(strains) {
        let expected = amplitude * (f64::from(k) * 2.0 * PI / 20.0).cos();
        assert!((strain - STRAIN - expected).abs() < 1e-3 * amplitude, "{k}: {strain} {expected}");
    }
    // The energy of the swing is ½ k (2R A)²; of the stored 2e-3 J rounding leaves 4e-19.
    let swing = 0.5 * stiffness * (2.0 * RADIUS * amplitude).powi(2);
    assert!(drift < 1e-5 * swing + 1e-18, "{drift:e} of {swing:e} J");
}

#[test]
fn a_bond_of_the_contacts_exponent_only_softens_it() {
    // K_p |E|² A − K_nb |E|² A is the contact of K_p − K_nb.
    let bond = OverlapBond { stiffness_pa: 4e7, exponent: 2.0, shear_stiffness_n_m3: 0.0, strain: 0.0 };
    let bonded = pair(0.01, -1.0, Some(bond), 2e-5);
    let mut softer = pair(0.01, -1.0, None, 2e-5);
    softer.contact.law = ContactLaw::Overlap { stiffness_pa: 6e7, exponent: 2.0 };
    let [bonded, softer] =
        [bonded, softer].map(|settings| run(&Particles::new(settings).unwrap(), 10, 1e-3, |_, _| ()).1);
    // Some hundred substeps of rounding, and no hold: they part as fast as they met but for the overlap at the start.
    for (a, b) in field(&bonded, "velocities").iter().zip(field(&softer, "velocities")) {
        assert!((a - b).abs() < 1e-13);
    }
    assert!(field(&bonded, "velocities")[3] > 1.0);
}

#[test]
fn a_bond_below_its_strain_does_nothing() {
    let free = pair(0.001, 1.0, None, 1e-6);
    let bonded = Settings { bond: Some(OverlapBond { strain: 0.0011, ..BOND }), ..free.clone() };
    let [free, bonded] = [free, bonded].map(|settings| run(&Particles::new(settings).unwrap(), 1, 1e-4, |_, _| ()).1);
    assert_eq!(field(&free, "velocities"), field(&bonded, "velocities"));
}

#[test]
fn sliding_in_a_bond_decays_at_the_rate_of_its_shear_stiffness() {
    // K_rb A Δt over the reduced mass, here 50 1/s, with and without friction beside it.
    let (rate, substep_s, speed) = (50.0, 1e-5, 1e-4);
    let shear_stiffness_n_m3 = rate * 0.5 * mass(RADIUS, DENSITY) / area() / substep_s;
    let mut settings = pair(STRAIN, 0.0, Some(OverlapBond { shear_stiffness_n_m3, ..BOND }), substep_s);
    if let Start::Given { velocities_m_s, .. } = &mut settings.start {
        *velocities_m_s = vec![[0.0, speed, 0.0], [0.0, -speed, 0.0]];
    }
    let none = Friction::Regularised { stiffness_n_m3: 0.0, static_coefficient: 0.1, dynamic_coefficient: 0.1 };
    for friction in [None, Some(none)] {
        let particles = Particles::new(Settings { friction, ..settings.clone() }).unwrap();
        let before = entry(&particles.initial().unwrap().1, "kinetic");
        let mut lost = 0.0;
        run(&particles, 5, 0.02, |k, reply| {
            lost += entry(reply, "friction");
            let left = (-rate * 0.02 * (k + 1) as f64).exp();
            // (rate Δt)² is 2.5e-7.
            assert!((field(reply, "velocities")[1] / speed - left).abs() < 3e-7);
        });
        close(lost, before * (1.0 - (-2.0 * rate * 0.1).exp()), 1e-6);
    }
}
