//! Fault: a coupling that diverges named every cure but the one.
//!
//! Three spheres on a half-space a hundred times softer than they are push it down by more than they yield themselves: the
//! iteration grows at every step size.

use super::program::{folder, stagger, stderr, summary};

const SPHERES: &str = "x,y,z,radius\n0,0,0.000999,1e-3\n3e-3,0,0.000999,1e-3\n-1e-3,4e-3,0.000999,1e-3\n";

const SCENE: &str = r#"
duration = 2e-2
[materials.m]
density = 8000
young = 1e7
poisson = 0.3
[particles]
start = { kind = "file", path = "three.csv" }
material = "m"
contact = { law = "hertz", restitution = 0.1 }
[walls.p]
plane = { normal = [0, 0, 1] }
[substrate]
wall = "p"
poisson = 0.28
young = 1e5
deflection = true
[coupling]
dt = 1e-4
"#;

#[test]
fn a_coupling_that_diverges_names_the_acceleration_that_helps_and_what_was_seen() {
    let folder = folder(&[("three.csv", SPHERES), ("scene.toml", SCENE)]);
    let output = stagger(folder.path(), &["run", "scene.toml", "--in-process", "--no-record"]);
    assert!(!output.status.success());
    let told = stderr(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("coupling.acceleration = \"iqn-ils\""), "{told}");
    assert!(told.contains("its change shrinks to 0.9") || told.contains("its change grows to "), "{told}");
    assert!(told.contains("coupling.dt.minimum = 1e-7 s"), "{told}");
    // The cure cures.
    let iqn = "coupling.acceleration = \"iqn-ils\"";
    assert_eq!(summary(folder.path(), "scene.toml", &[iqn, "duration = 2e-3"])["completed"], true);
}
