//! Fault: light that was computed for several steps at once (`coupling.every.optics`) was lost where it was meant for particles
//! that had boiled and left. It is booked as `missed`, so that thermal says that it was given all that it was given.

use super::program::{folder, summary};

const SCENE: &str = r#"
duration = "1.6 ms"
[materials.p]
density = 7800
heat-capacity = 450
conductivity = 40
solidus = 1658
liquidus = 1723
melting-heat = 2.7e5
boiling = 3100
boiling-heat = 6.1e6
absorption = 5e4
[particles]
count = 200
radius = "25 um"
material = "p"
start = { box = ["0.4 mm", "0.4 mm", "0.4 mm"], velocity = [0, 0, -0.5] }
contact = { stiffness = "1e8 Pa", damping = "2e5 N s/m^3" }
friction = "spring"
[walls.plate]
plane = { normal = [0, 0, 1] }
temperature = 300
[walls.sides]
box = { lower = ["-0.2 mm", "-0.2 mm", "-1 mm"], upper = ["0.2 mm", "0.2 mm", "2 mm"], open = ["+z"] }
[thermal]
phases = {}
[optics]
power = "300 W"
profile = { kind = "gaussian", radius = "80 um" }
path = { kind = "sweep", from = ["-0.15 mm", 0, 0], to = ["0.15 mm", 0, 0], speed = "0.3 m/s" }
starts = "1 ms"
[coupling]
every = { optics = 3 }
dt = { start = "2 us", limit = "20 us" }
"#;

#[test]
fn light_for_particles_that_have_boiled_is_booked_however_seldom_it_is_computed() {
    let folder = folder(&[("scene.toml", SCENE)]);
    let mut missed = Vec::new();
    for every in [1_u8, 3, 6] {
        let set = format!("coupling.every={{ optics = {every} }}");
        let summary = summary(folder.path(), "scene.toml", &[&set]);
        for balance in ["thermal", "optics"] {
            let open = summary["imbalance"][balance].as_f64().unwrap();
            // Rounding: sums of 200 particles over some 100 windows.
            assert!(open.abs() < 1e-12, "every {every}, {balance}: {open:e}");
        }
        let ledger = &summary["ledger"];
        let missed_j = ledger["thermal"]["lost"]["missed"].as_f64().unwrap();
        let absorbed_j = ledger["optics"]["lost"]["absorbed"].as_f64().unwrap();
        let between = summary["imbalance"]["absorbed: optics to thermal"].as_f64().unwrap();
        assert!(between.abs() < 1e-12, "every {every}, from optics to thermal: {between:e}");
        // Light found at the end of so many steps holds for the next ones: what is on the way is the beam's in that time at most,
        // where it is switched on and where the run ends.
        let taken_j = ledger["thermal"]["gained"]["absorbed"].as_f64().unwrap();
        let on_the_way_j = 2.0 * f64::from(every - 1) * 20e-6 * 300.0 + 1e-12 * absorbed_j;
        assert!((taken_j - absorbed_j).abs() <= on_the_way_j, "every {every}: {taken_j} J of {absorbed_j} J");
        let told_j = summary["on_the_way"]["absorbed: optics to thermal"].as_f64().unwrap_or(0.0);
        assert!((told_j - (absorbed_j - taken_j)).abs() <= 1e-12 * absorbed_j, "every {every}: {told_j} J are told of");
        assert!(every == 1 || told_j != 0.0, "every {every}: nothing is on its way");
        assert!(summary["nodes"]["thermal"]["figures"]["vapourised particles"].as_f64().unwrap() > 5.0, "little boils");
        missed.push(missed_j / absorbed_j);
    }
    // What boils in the very window takes what it can and misses the rest; that grows with the time between two looks.
    let [one, three, six] = missed[..] else { panic!("three runs") };
    assert!(one > 0.0 && three > one && six > three, "{missed:?}");
}
