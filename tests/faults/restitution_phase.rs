//! What is left of the speed depended on where in a substep two particles first touched: −2.9 to +6.3 % for the linear law at a
//! restitution of 0.3, as its damping begins and ends with a jump.

use crate::windows::{follow, vectors};

const SCENE: &str = r#"
duration = 0.003
[materials.m]
density = 2500
[particles]
start = { kind = "file", path = "pair.csv" }
material = "m"
gravity = [0, 0, 0]
[coupling]
dt = 3e-5
"#;

const LAWS: [&str; 4] = [
    "law = \"linear\", spring = 1e4",
    "law = \"hertz\", young = \"10 MPa\", poisson = 0.3",
    "law = \"overlap\", stiffness = \"1e8 Pa\", exponent = 1",
    "law = \"overlap\", stiffness = \"1e10 Pa\", exponent = 2",
];

/// Largest departure, as a share, of what is left of 0.1 m/s over many phases of first touch.
fn departure(law: &str, restitution: f64, with_wall: bool) -> f64 {
    let contact = format!("{{ {law}, restitution = {restitution} }}");
    let wall = ("walls.floor", "{ plane = { through = [0, 0, 0], normal = [0, 0, 1] } }");
    let sets = [("particles.contact", contact.as_str()), wall];
    let sets = &sets[..if with_wall { 2 } else { 1 }];
    let mut worst = 0.0f64;
    for phase in 0..23 {
        // Gaps of 0.5 to 1.2 µm, some substeps' way, in steps that hit every part of one.
        let gap = 5e-7 + 3.1e-8 * f64::from(phase);
        let above = 1e-3 + gap;
        let mut rows = format!("x,y,z,radius,vx,vy,vz\n0,0,{above:e},0.001,0,0,-0.1\n");
        if !with_wall {
            rows += &format!("0,0,{:e},0.001,0,0,0.1\n", -above);
        }
        let end = follow(SCENE, &[("pair.csv", &rows)], sets, |_, _| ());
        worst = worst.max((vectors(&end, "velocities")[0][2] / (0.1 * restitution) - 1.0).abs());
    }
    worst
}

#[test]
fn the_default_substep_leaves_the_restitution_to_a_per_cent_whatever_the_phase_of_first_touch() {
    for law in LAWS {
        for restitution in [1.0, 0.9, 0.7, 0.5, 0.3] {
            for with_wall in [false, true] {
                let worst = departure(law, restitution, with_wall);
                assert!(worst < 1e-2, "{law}, {restitution}, wall {with_wall}: {worst:e}");
            }
        }
    }
}
