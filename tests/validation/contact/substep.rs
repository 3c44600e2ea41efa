//! What the automatic substep foresees of a contact, and what makes a window be solved again with a finer one.

use stagger_coupling::Physics as _;
use stagger_messages::energy::Kind;
use stagger_physics::{
    common::{Shape, Wall},
    particles::{
        Charge, ContactLaw, Electromagnetic, FieldForces, FieldRegion, Friction, Integrator, Pair, Particles, Presence,
        Rolling, Settings, Start,
    },
};

use super::bed::*;

const RADIUS: f64 = 0.01;
const DENSITY: f64 = 2000.0;

/// Change of the stored energy that the ledger does not explain, over `scale_j`.
fn imbalance(settings: Settings, windows: usize, dt_s: f64, scale_j: f64) -> f64 {
    let particles = Particles::new(settings).unwrap();
    let (state, first) = particles.initial().unwrap();
    let before = energy(&first, Kind::Stored);
    let mut lost = 0.0;
    let (_, reply) = run_from(&particles, (state, first), windows, dt_s, |_, reply| {
        lost += energy(reply, Kind::Lost) - energy(reply, Kind::Gained);
    });
    (energy(&reply, Kind::Stored) - before + lost).abs() / scale_j
}

/// A sphere at rest 0.5 m above the floor, which a field pulls at 400 m/s² from 0.1 m above the floor on.
fn pulled() -> Settings {
    let law = ContactLaw::Hertz { young_pa: 1e7, poisson: 0.3 };
    let mut settings = settings(law, DENSITY, &[([0.0, 0.0, 0.5], [0.0, 0.0, -1e-3], RADIUS)]);
    settings.walls = vec![floor()];
    let region = FieldRegion::HalfSpace { through_m: [0.0, 0.0, 0.6], normal: [0.0, 0.0, -1.0] };
    settings.fields = FieldForces {
        electromagnetic: Some(Electromagnetic {
            charge: Charge::PerMass(4.0),
            electric_v_m: [0.0, 0.0, -100.0],
            magnetic_t: [0.0; 3],
            presence: Presence { region, ..Presence::default() },
        }),
        ..FieldForces::default()
    };
    settings
}

#[test]
fn a_charged_sphere_meets_the_floor_as_finely_as_one_that_falls() {
    let work_j = mass(RADIUS, DENSITY) * 400.0 * 0.49;
    let driven = imbalance(pulled(), 30, 2.5e-3, work_j);
    let mut falls = Settings { fields: FieldForces::default(), ..pulled() };
    falls.gravity_m_s2 = [0.0, 0.0, -400.0];
    let falls = imbalance(falls, 30, 2.5e-3, work_j);
    // 25 substeps to the contact: the energy is good to a per mille or so in both, and no worse for the field.
    assert!(driven < 2.0 * falls.max(1e-4), "{driven:e}, falling {falls:e}");
    // The field counts only where it acts: twice as far away it works no more.
    let contacts = |settings: Settings| {
        let (_, reply) = run(&Particles::new(settings).unwrap(), 1, 1e-4, |_, _| ());
        reply.figures["shortest contact time over substep"] * reply.figures["substep [s]"]
    };
    let mut far = pulled();
    if let Start::Given { positions_m, .. } = &mut far.start {
        positions_m[0][2] = 5.0;
    }
    // A contact lasts as v^(−1/5): 400 m/s² over 0.6 m of 5 instead of over 0.49 m, from the centre on.
    close(contacts(far) / contacts(pulled()), (0.6f64 / 0.5).powf(-0.1), 1e-4);
}

#[test]
fn a_damping_of_one_pair_is_resolved_like_that_of_all() {
    let law = ContactLaw::Hertz { young_pa: 1e7, poisson: 0.3 };
    let spheres = [([0.0, 0.0, 1.001 * RADIUS], [0.0, 0.0, -1.0], RADIUS)];
    let substep_s = |damping: f64, own: Option<f64>| {
        let mut settings = settings(law, DENSITY, &spheres);
        settings.contact.damping_n_s_m3 = damping;
        settings.walls = vec![Wall::fixed("floor", Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), None)];
        settings.pairs = own
            .map(|damping| Pair {
                between: ["matter".into(), "floor".into()],
                damping_n_s_m3: Some(damping),
                restitution: None,
                static_coefficient: None,
                dynamic_coefficient: None,
                rolling: None,
                torsion: None,
            })
            .into_iter()
            .collect();
        let (_, reply) = run(&Particles::new(settings).unwrap(), 1, 1e-3, |_, _| ());
        reply.figures["substep [s]"]
    };
    let [none, all, one] = [(0.0, None), (1e7, None), (0.0, Some(1e7))].map(|(all, own)| substep_s(all, own));
    assert!(all < 0.5 * none, "{all:e} of {none:e} s");
    close(one, all, 1e-12);
}

#[test]
fn friction_that_sticks_hard_keeps_the_balance() {
    // Two spheres and a floor, rolling and sticking by the regularised law at stiffnesses over eight decades, with the scene's own
    // substep, which is a fiftieth of a contact.
    let law = ContactLaw::Hertz { young_pa: 3e7, poisson: 0.3 };
    let spheres = [([0.0, 0.0, 0.0499], [0.3, 0.2, -1.0], 0.05), ([0.07, 0.0, 0.1149], [-0.8, 0.0, -1.0], 0.05)];
    for stiffness_n_m3 in [1e7, 1e9, 1e11, 1e13, 1e15] {
        let mut settings = settings(law, DENSITY, &spheres);
        settings.friction =
            Some(Friction::Regularised { stiffness_n_m3, static_coefficient: 0.5, dynamic_coefficient: 0.5 });
        settings.rolling = Some(Rolling { rolling: 0.1, torsion: 0.1 });
        settings.contact.restitution = Some(0.6);
        settings.gravity_m_s2 = [0.0, 0.0, -9.81];
        settings.walls = vec![floor()];
        settings.spin = true;
        settings.integrator = Integrator::Verlet { substep_s: Some(3e-5) };
        let share = imbalance(settings, 20, 3e-4, mass(0.05, DENSITY));
        // Verlet's own error at this substep is 1e-3 of the kinetic energy of 1 m/s, ½ m; the force jumps where restitution
        // begins and where sliding ends.
        assert!(share < 5e-3, "{stiffness_n_m3:e} N/m³: {share:e}");
    }
}
