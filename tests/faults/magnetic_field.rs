//! Fault: a magnetic field accelerated charges.
//!
//! v × B does no work. As a force at a predicted velocity it is Heun's rule, which is unstable for any step: after a hundred turns
//! a charged sphere had 3.9 times its speed.

use super::program::{folder, summary};

const ONE: &str = "x,y,z,radius,vx,vy,vz\n0,0,0,1,1,0,0\n";

/// A charged sphere of 1000 kg/m³ that turns with 6 rad/s.
fn scene(duration_s: f64, particles: &str) -> String {
    format!(
        "duration = {duration_s}\n[materials.m]\ndensity = 1000\n[particles]\nstart = {{ kind = \"file\", path = \"one.csv\" }}\n\
         material = \"m\"\ngravity = [0, 0, 0]\ncontact = {{ stiffness = 1e3 }}\n{particles}\n\
         [particles.electromagnetic]\ncharge = 3\nmagnetic = [0, 0, 2]\n[coupling]\ndt = \"0.5 s\"\n"
    )
}

/// Speed of the sphere at the end, in m/s, from its kinetic energy.
fn speed_m_s(scene: &str) -> f64 {
    let folder = folder(&[("scene.toml", scene), ("one.csv", ONE)]);
    let summary = summary(folder.path(), "scene.toml", &[]);
    let kinetic_j = summary["ledger"]["particles"]["stored"]["kinetic"].as_f64().unwrap();
    let mass_kg = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI;
    (2.0 * kinetic_j / mass_kg).sqrt()
}

#[test]
fn a_hundred_turns_keep_the_speed() {
    let turns = |integrator: &str| speed_m_s(&scene(104.72, integrator));
    // Rounding of 3000 substeps of two rotations each.
    let speed = turns("");
    assert!((speed - 1.0).abs() < 1e-12, "{speed}");
    // However long the substep: half a second is 3 rad.
    let speed = turns("integrator = { kind = \"verlet\", substep = \"0.5 s\" }");
    assert!((speed - 1.0).abs() < 1e-12, "{speed}");
}
