//! Motion of particles that come and go: what a dispenser pours and a domain takes.

use std::collections::BTreeSet;

use stagger_coupling::{Frozen, Ledger, Physics as _, Reply, Window};
use stagger_physics::particles::Particles;
use stagger_scene::Scene;

/// Solves the windows of a scene to its end; `look` sees each reply.
fn run(scene: &str, mut look: impl FnMut(&Reply)) -> Ledger {
    let scene = Scene::parse(scene, "scene.toml", &[]).unwrap();
    let dt_s = scene.coupling.dt.limit_s;
    let particles = Particles::new(scene.settings::<stagger_physics::particles::Settings>().unwrap().clone()).unwrap();
    let (mut state, reply) = particles.initial().unwrap();
    let mut ledger = Ledger::default();
    ledger.start("particles", &reply.ledger);
    for window in 0..(scene.duration_s / dt_s).round() as u32 {
        let window = Window { t_s: f64::from(window) * dt_s, dt_s };
        let reply;
        (state, reply) = particles.solve(&state, &Frozen::default(), window).unwrap();
        assert!(reply.not_converged.is_none(), "window at {} s", window.t_s);
        ledger.book("particles", &reply.ledger);
        look(&reply);
    }
    ledger
}

fn imbalance(ledger: &Ledger) -> f64 {
    let account = &ledger.nodes()["particles"];
    (account.imbalance() / account.turned_over()).abs()
}

/// Nothing but what a dispenser pours onto a plate.
const POURED: &str = r#"
    duration = "6 ms"
    [particles]
    count = 0
    radius = { mean = "25 um", spread = "5 um" }
    start = { box = ["1 mm", "1 mm", "1 mm"] }
    contact = { stiffness = "1e9 Pa", restitution = 0.5 }
    friction = { law = "spring" }
    rolling = 0.1
    spin = true
    [particles.pour.hopper]
    disc = { centre = [0, 0, "0.6 mm"], radius = "0.15 mm" }
    velocity = [0, 0, "-0.5 m/s"]
    rate = "3e4 1/s"
    until = "4 ms"
    [walls.plate]
    plane = { normal = [0, 0, 1] }
    [coupling]
    dt = "20 us"
"#;

#[test]
fn a_dispenser_pours_at_its_rate_onto_an_empty_plate_and_the_balance_closes() {
    let mut counts = Vec::new();
    let mut deepest = 0.0f64;
    let ledger = run(POURED, |reply| {
        counts.push(reply.fields["positions"].rows());
        let ids: Vec<u32> = (0..).take(reply.fields["ids"].rows()).collect();
        assert_eq!(reply.fields["ids"].u32().unwrap(), ids);
        deepest = deepest.max(reply.figures["largest overlap over radius"]);
    });
    // 3e4 1/s over windows of 20 µs.
    assert_eq!(counts[..5], [0, 1, 1, 2, 3]);
    assert_eq!((counts[199], counts.last()), (120, Some(&120)));
    // The substep follows from what is poured, as nothing is there at the start: each impact is resolved.
    assert!(deepest < 0.1, "overlap of {deepest} radii");
    assert!(imbalance(&ledger) < 5e-3, "{:e}", imbalance(&ledger));
    let came_j = ledger.nodes()["particles"].gained["poured"];
    // Each brings ½ v² + g h = 0.1309 J/kg.
    let mass_kg = came_j / (0.5 * 0.25 + 9.81 * 6e-4);
    let expected_kg = 120.0 * 7990.0 * 4.0 / 3.0 * std::f64::consts::PI * 25e-6 * (25e-6f64.powi(2) + 5e-6f64.powi(2));
    // 120 masses of a standard deviation of a third.
    assert!((mass_kg / expected_kg - 1.0).abs() < 0.12, "{mass_kg:e} kg instead of {expected_kg:e} kg");
}

#[test]
fn a_domain_takes_what_leaves_it_and_the_balance_closes() {
    // Without a plate all fall out; the last is poured at 4 ms and falls 1.1 mm in under 2.2 ms.
    let scene = POURED.replace("[walls.plate]\n    plane = { normal = [0, 0, 1] }", "")
        + "[particles.domain]\nlower = [-1, -1, \"-0.5 mm\"]\nupper = [1, 1, 1]";
    let scene = scene.replace("\"6 ms\"", "\"7 ms\"");
    let mut all = BTreeSet::new();
    let mut counts = Vec::new();
    let ledger = run(&scene, |reply| {
        let ids = reply.fields["ids"].u32().unwrap();
        all.extend(ids.iter().copied());
        assert!(ids.is_sorted(), "rows stay in the order of coming: {ids:?}");
        counts.push(ids.len());
    });
    assert_eq!((all.len(), all.last(), counts.last()), (120, Some(&119), Some(&0)));
    assert!(counts.iter().max() < Some(&90), "they leave while others come");
    assert!(imbalance(&ledger) < 1e-6, "{:e}", imbalance(&ledger));
    assert!(ledger.nodes()["particles"].lost["removed"] > 0.0);
}

#[test]
fn a_wall_that_strikes_resting_particles_is_resolved() {
    // Nothing moves at the start, so that nothing foretells the contact: a lid comes down with 1 m/s.
    let scene = POURED
        .replace("count = 0", "count = 60")
        .replace("[particles.pour.hopper]\n", "")
        .replace("[particles]", "[particles]\ngravity = [0, 0, 0]");
    let scene: String = scene
        .lines()
        .filter(|line| !["disc", "velocity", "rate", "until"].iter().any(|key| line.trim().starts_with(key)))
        .collect::<Vec<_>>()
        .join("\n");
    let scene = scene.replace("[\"1 mm\", \"1 mm\", \"1 mm\"]", "[\"0.3 mm\", \"0.3 mm\", \"0.3 mm\"]")
        + "\n[walls.lid]\nplane = { through = [0, 0, \"0.31 mm\"], normal = [0, 0, -1] }\n\
           motion = { kind = \"constant\", velocity = [0, 0, \"-1 m/s\"], until = \"0.2 ms\" }\n";
    let (mut deepest, mut critical) = (0.0f64, 0.0f64);
    let ledger = run(&scene.replace("\"6 ms\"", "\"1 ms\""), |reply| {
        deepest = deepest.max(reply.figures["largest overlap over radius"]);
        critical = critical.max(reply.figures["substep over critical"]);
    });
    assert!(critical < 0.5, "{critical}");
    assert!(imbalance(&ledger) < 5e-3, "{:e} {deepest}", imbalance(&ledger));
}
