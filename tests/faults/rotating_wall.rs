//! A blade that turns was not felt at all with steps of 1 ms: a rotation had no speed, so that a window was one substep.

use crate::windows::{follow, norm, rectangle, vectors};

const SCENE: &str = r#"
duration = "5 ms"
[particles]
start = { kind = "file", path = "p.csv" }
contact = { law = "linear", spring = "1000 N/m", restitution = 1 }
gravity = [0, 0, 0]
[walls.m]
mesh = { file = "blade.stl", unit = "1 mm" }
motion = { kind = "rotation", axis = [0, 0, 1], frequency = "100 Hz" }
[coupling]
dt = "1 ms"
"#;

const SPHERE: &str = "x,y,z,radius\n0,0.0005,0,5e-05\n";
const HERTZ: &str = "{ law = \"hertz\", young = \"1 GPa\", poisson = 0.3, restitution = 1 }";

fn end(sets: &[(&str, &str)]) -> [f64; 3] {
    let blade = rectangle([[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]]);
    vectors(&follow(SCENE, &[("p.csv", SPHERE), ("blade.stl", &blade)], sets, |_, _| ()), "velocities")[0]
}

fn near(left: &[f64; 3], right: &[f64; 3], share: f64) -> bool {
    norm(&[left[0] - right[0], left[1] - right[1], left[2] - right[2]]) < share * norm(right)
}

#[test]
fn a_blade_throws_a_sphere_with_twice_its_speed() {
    // 0.5 mm from the axis the blade moves at 0.314 m/s.
    let fine = end(&[("coupling.dt", "1 us")]);
    assert!(near(&fine, &[-0.62, 0.06, 0.0], 0.02), "{fine:?}");
    for law in [None, Some(HERTZ)] {
        let law: Vec<_> = law.map(|law| ("particles.contact", law)).into_iter().collect();
        let fine = end(&[&law[..], &[("coupling.dt", "1 us")]].concat());
        for dt in ["0.3 ms", "1 ms", "5 ms"] {
            let thrown = end(&[&law[..], &[("coupling.dt", dt)]].concat());
            // Two at the speed of the blade, to how long it pushes: hence the same with any window.
            assert!(near(&thrown, &fine, 0.02), "{law:?} {dt}: {thrown:?} {fine:?}");
        }
    }
}

/// Other walls that turn through the sphere, and what they do with steps of 1 µs.
#[test]
fn whatever_turns_or_shifts_meets_the_sphere_in_any_window() {
    let turn = "motion = { kind = \"rotation\", axis = [0, 0, 1], frequency = \"100 Hz\" }";
    let walls = [
        // A plane through the axis, a tube beside it, and a drum's inside off its axis.
        format!("{{ plane = {{ through = [0, 0, 0], normal = [0, 1, 0] }}, {turn} }}"),
        format!("{{ cylinder = {{ through = [0.001, 0, -0.001], axis = [0, 0, 1], radius = \"0.55 mm\", length = \"2 mm\" }}, {turn} }}"),
        "{ plane = { through = [0, 0.00044, 0], normal = [0, 1, 0] }, motion = { kind = \"oscillation\", amplitude = [0, 0.0002, 0], frequency = \"300 Hz\" } }".into(),
        "{ plane = { through = [0, 0, 0], normal = [0, 1, 0] }, motion = { kind = \"constant\", velocity = [0, 0.3, 0] } }".into(),
        "{ plane = { through = [0, 0, 0], normal = [0, 1, 0] }, motion = { kind = \"path\", times = [0.001, 0.0025], displacements = [[0, 0, 0], [0, 0.0006, 0]] } }".into(),
        "{ plane = { through = [0, 0.0004, 0], normal = [0, 1, 0] }, motion = { kind = \"pressed\", direction = [0, 1, 0], mass = 1e-6, force = 1e-4 } }".into(),
    ];
    for wall in &walls {
        for law in ["{ law = \"linear\", spring = \"1000 N/m\", restitution = 1 }", HERTZ] {
            let sets = [("walls.m", wall.as_str()), ("particles.contact", law)];
            let fine = end(&[&sets[..], &[("coupling.dt", "1 us")]].concat());
            assert!(norm(&fine) > 0.05, "{sets:?}: it is met: {fine:?}");
            for dt in ["0.7 ms", "5 ms"] {
                let coarse = end(&[&sets[..], &[("coupling.dt", dt)]].concat());
                assert!(near(&coarse, &fine, 0.02), "{sets:?} {dt}: {coarse:?} {fine:?}");
            }
        }
    }
}

#[test]
fn a_wall_that_turns_into_itself_asks_for_no_substeps() {
    // A smooth drum and a disc turn at 2π 30 kHz, 94 m/s half a millimetre from the axis, and touch nobody; a blade as fast needs a thousand substeps a turn and more.
    let turn = "motion = { kind = \"rotation\", axis = [0, 0, 1], frequency = \"30 kHz\" }";
    let sets = format!(
        "{{ cylinder = {{ through = [0, 0, 0], axis = [0, 0, 1], radius = \"5 mm\", particles = \"inside\" }}, {turn} }}"
    );
    let disc = format!("{{ plane = {{ through = [0, 0, -0.001], normal = [0, 0, 1] }}, {turn} }}");
    for wall in [sets, disc] {
        let mut most = 0.0f64;
        follow(SCENE, &[("p.csv", SPHERE)], &[("walls.m", &wall), ("particles.contact", HERTZ)], |_, reply| {
            most = most.max(reply.figures["substeps"]);
        });
        assert!(most < 2.0, "{wall}: {most}");
    }
}
