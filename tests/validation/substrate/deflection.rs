//! The surface that gives way, and the particles on it.

use std::{collections::BTreeMap, f64::consts::PI, sync::Arc};

use stagger_coupling::{Frozen, Ledger, Local, Participant, Physics, Window};
use stagger_messages::{Field, Measure, Port};
use stagger_physics::{
    particles::{self, Particles},
    substrate::{Settings, Substrate, deflection_m},
};
use stagger_scene::Scene;

use super::{
    super::coupling::run,
    load,
    node::{Contact, fields, level, settings, solve},
};

#[test]
fn a_load_s_deflection_outside_and_at_the_centre() {
    let (nu, young, force, a) = (0.3, 2e11, 5.0, 1e-3);
    let at = |rho: f64| deflection_m(nu, young, &load(force, [9.0, 9.0], a), rho);
    let compliance = (1.0 - nu * nu) / (PI * young);
    for rho in [1e-3, 0.02, 3.0] {
        assert!((at(rho) - force * compliance / rho).abs() < 1e-15 * at(rho));
    }
    assert!((at(0.0) - 2.0 * force * compliance / a).abs() < 1e-15 * at(0.0));
}

#[test]
fn what_others_press_in_is_under_a_particle_and_its_own_contact_is_not() {
    let young = 1e6;
    let substrate = Substrate::new(Settings { deflection_young_pa: Some(young), ..settings(level()) }).unwrap();
    let contacts: [Contact; 2] =
        [(0, 1, 0.01, [0.0, 0.0, -2.0], [0.0; 3]), (1, 1, 0.01, [0.0, 0.0, -3.0], [3.0, 0.0, 0.0])];
    // The third lies above both, the fourth too high to touch.
    let particles = [[0.0, 0.0, 1.0], [3.0, 0.0, 1.0], [1.0, 0.0, 2.5], [0.0, 0.0, 5.0]];
    let reply = solve(&substrate, fields(&substrate, &contacts, &particles)).unwrap();
    let compliance = 0.91 / (PI * young);
    let expected = [3.0 / 3.0, 2.0 / 3.0, 2.0 / 1.0 + 3.0 / 2.0, 0.0].map(|sum| compliance * sum);
    for (found, expected) in reply.fields["wall_deflection"].f64().unwrap().iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-15 * expected, "{found} {expected}");
    }
    assert_eq!(reply.fields["wall_deflection"].support.revision, 4, "on the rows of the particles");
}

/// Two equal spheres beside each other, about where they rest on a plate that does not give way; `more` goes into the scene.
fn scene(more: &str) -> Scene {
    let text = format!(
        r#"
duration = "60 ms"
[materials.heavy]
density = "8000 kg/m^3"
[particles]
material = "heavy"
start    = {{ kind = "file", path = "two.csv" }}
contact  = {{ law = "linear", spring = "1000 N/m", restitution = 0.1 }}
[walls.plate]
plane = {{ normal = [0, 0, 1] }}
[substrate]
wall       = "plate"
young      = "1e6 Pa"
points     = [[0, 0, 0], [0, 0, "-1 mm"]]
{more}
[coupling]
dt = "50 us"
tolerance = {{ positions = 1e-9 }}
"#
    );
    let read = |_: &str| Ok(b"x,y,z,radius\n0.00105,0,0.00099967,0.001\n-0.00105,0,0.00099967,0.001\n".to_vec());
    Scene::parse_with_files(&text, "two", &[], &read).unwrap()
}

fn at_rest(scene: &Scene) -> (Vec<f64>, f64) {
    let particles = Particles::new(scene.settings::<particles::Settings>().unwrap().clone()).unwrap();
    let substrate = Substrate::new(scene.settings::<Settings>().unwrap().clone()).unwrap();
    let members: BTreeMap<String, Box<dyn Participant>> = BTreeMap::from([
        ("particles".to_owned(), Box::new(Local::new("particles", particles)) as Box<dyn Participant>),
        ("substrate".to_owned(), Box::new(Local::new("substrate", substrate))),
    ]);
    let (fields, _) = run(members, &scene.coupling, scene.duration_s);
    let forces = fields["wall_contact_force"].f64().unwrap();
    (fields["positions"].f64().unwrap().to_vec(), -forces[2] - forces[5])
}

#[test]
fn two_spheres_at_rest_press_with_their_weight_and_sink_by_what_the_other_presses_in() {
    let weight = 8000.0 * 4.0 / 3.0 * PI * 1e-9 * 9.81;
    let (stiff, normal) = at_rest(&scene(""));
    // 60 ms are hundreds of contact times (0.2 ms), each of which leaves a tenth of the speed.
    assert!((normal / (2.0 * weight) - 1.0).abs() < 1e-9, "{normal}");
    assert!((0.001 - stiff[2] - weight / 1000.0).abs() < 1e-9 * 0.001);
    let (soft, normal) = at_rest(&scene("deflection = true"));
    assert!((normal / (2.0 * weight) - 1.0).abs() < 1e-6, "{normal}");
    let sunk = weight * 0.91 / (PI * 1e6 * 2.1e-3);
    for z in [2, 5] {
        // A deflection counts as converged within 1e-12 m, 2e-5 of this one.
        assert!(((stiff[z] - soft[z]) / sunk - 1.0).abs() < 1e-4, "{} {sunk}", stiff[z] - soft[z]);
    }
}

#[test]
fn the_work_of_a_sinking_surface_is_booked() {
    // Two spheres about at rest on a plate that sinks evenly and comes back, by hand; nothing damps.
    let scene = scene("deflection = true");
    let mut settings = scene.settings::<particles::Settings>().unwrap().clone();
    settings.contact.restitution = None;
    let off = |windows: u32| {
        let particles = Particles::new(settings.clone()).unwrap();
        let port = Arc::new(Port::f64("wall_deflection", "m", "particles", 1, Measure::None));
        let (mut state, reply) = particles.initial().unwrap();
        let mut ledger = Ledger::default();
        ledger.start("particles", &reply.ledger);
        let dt_s = 2e-3 / f64::from(windows);
        for k in 1..=windows {
            let phase = std::f64::consts::TAU * f64::from(k) / f64::from(windows);
            let sunk = vec![2e-7 * (1.0 - phase.cos()); 2];
            let fields = BTreeMap::from([("wall_deflection".to_owned(), Field::new(&port, 0, sunk).unwrap())]);
            let frozen = Frozen { start: fields.clone(), end: fields };
            let window = Window { t_s: f64::from(k - 1) * dt_s, dt_s };
            let (next, reply) = particles.solve(&state, &frozen, window).unwrap();
            ledger.book("particles", &reply.ledger);
            state = next;
        }
        let account = &ledger.nodes()["particles"];
        assert!(account.gained["walls"].abs() > 1e-3 * account.turned_over(), "{account:?}");
        account.imbalance().abs() / account.turned_over()
    };
    let errors = [200, 400, 800].map(off);
    for pair in errors.windows(2) {
        // First order: a window is one substep here, and the power at its start is taken with the rate of the one before.
        assert!((pair[0] / pair[1]).log2() > 0.9, "{errors:?}");
    }
    assert!(errors[2] < 1e-2, "{errors:?}");
}
