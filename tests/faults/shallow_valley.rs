//! Fault: a shallow valley of a mesh counted as two contacts.
//!
//! Where two faces meet at a flat concave angle a sphere between them touched both, with twice the stiffness and the damping of one:
//! it rebounded from a valley of 0.001 degrees with 0.174 m/s, from the plane with 0.244. The jump was at 1e-4 degrees, so that
//! facets of drums never converged to the cylinder.

use super::program::{field, folder, summary};

const SPHERE: &str = "x,y,z,radius,vx,vy,vz\n0,0,6.0045e-05,5e-05,0,0,-0.5\n";

const SCENE: &str = r#"
duration = "0.2 ms"
[particles]
start = { kind = "file", path = "p.csv" }
contact = { law = "linear", spring = "1000 N/m", restitution = 0.5 }
gravity = [0, 0, 0]
[walls.m]
mesh = { file = "wall.stl", unit = "1 mm" }
[coupling]
dt = "20 us"
"#;

/// Binary STL of triangles.
fn stl(triangles: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        for coordinate in triangle.as_flattened() {
            bytes.extend((*coordinate as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// Speed of the sphere upwards after it has met a wall.
fn rebound(triangles: &[[[f64; 3]; 3]]) -> f64 {
    let folder = folder(&[("p.csv", SPHERE), ("scene.toml", SCENE)]);
    std::fs::write(folder.path().join("wall.stl"), stl(triangles)).unwrap();
    let summary = summary(folder.path(), "scene.toml", &[]);
    field(&summary, "velocities")["max"].as_f64().unwrap()
}

/// Two faces that rise from the y axis by this angle each, in degrees; a roof where it is negative. In mm.
fn faces(degrees: f64) -> Vec<[[f64; 3]; 3]> {
    let height = degrees.to_radians().tan();
    let face = |x: f64| {
        let [a, b, c, d] = [[0.0, -1.0, 0.0], [x, -1.0, height], [x, 1.0, height], [0.0, 1.0, 0.0]];
        [[a, b, c], [a, c, d]]
    };
    [face(1.0), face(-1.0)].concat()
}

#[test]
fn a_flat_valley_rebounds_as_a_plane_and_a_roof_do() {
    let flat = rebound(&faces(0.0));
    assert!((flat / 0.25 - 1.0).abs() < 0.03, "restitution: {flat}");
    for degrees in [1e-5, 1e-4, 1e-3, -1e-3] {
        let found = rebound(&faces(degrees));
        assert!((found / flat - 1.0).abs() < 1e-3, "{degrees} degrees: {found}, flat {flat}");
    }
}
