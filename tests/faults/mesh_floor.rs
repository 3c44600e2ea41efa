//! Nine spheres that fell 1 mm onto a floor made of a mesh left it with 140 times their energy: the substep was planned from
//! the start's speed, which is zero, as no plane lies below. Whatever brings them to speed within a window, contacts are
//! resolved.

use crate::{
    program::{field, folder, summary},
    windows::{follow, norm, rectangle, vectors},
};

const SCENE: &str = r#"
duration = "30 ms"
[particles]
start = { kind = "file", path = "layer.csv" }
contact = { law = "linear", spring = "1000 N/m", restitution = 0.5 }
[walls.floor]
mesh = { file = "floor.stl", unit = "1 mm" }
[coupling]
dt = "1 ms"
"#;

fn layer() -> String {
    let rows = (0..9).map(|k| format!("{:e},{:e},1.05e-3,5e-5\n", 2e-4 * f64::from(k / 3), 2e-4 * f64::from(k % 3)));
    format!("x,y,z,radius\n{}", rows.collect::<String>())
}

fn floor() -> String {
    rectangle([[-30.0, -30.0, 0.0], [30.0, -30.0, 0.0], [30.0, 30.0, 0.0], [-30.0, 30.0, 0.0]])
}

/// Speed that a fall of 1 mm gives, √(2 g h) = 0.14 m/s.
const FALLEN_M_S: f64 = 0.14007;

/// The highest place and the highest speed on the way, and the lowest place, all after `from_s`.
fn bounds(sets: &[(&str, &str)], from_s: f64) -> [f64; 3] {
    let (layer, floor) = (layer(), floor());
    let [mut highest, mut lowest, mut fastest] = [f64::NEG_INFINITY, f64::INFINITY, 0.0];
    follow(SCENE, &[("layer.csv", &layer), ("floor.stl", &floor)], sets, |t_s, reply| {
        if t_s > from_s {
            for [_, _, z] in vectors(reply, "positions") {
                (highest, lowest) = (z.max(highest), z.min(lowest));
            }
        }
        fastest = vectors(reply, "velocities").iter().map(norm).fold(fastest, f64::max);
    });
    [highest, lowest, fastest]
}

#[test]
fn the_program_leaves_the_layer_on_the_floor() {
    let (layer, floor) = (layer(), floor());
    let folder = folder(&[("scene.toml", SCENE), ("layer.csv", &layer), ("floor.stl", &floor)]);
    let summary = summary(folder.path(), "scene.toml", &[]);
    // The largest coordinate of all is that of the layer's last row, 0.4 mm.
    assert!(field(&summary, "positions")["max"].as_f64().unwrap() < 0.41e-3, "{summary}");
    assert!(field(&summary, "velocities")["max"].as_f64().unwrap() < 0.05, "{summary}");
    assert!(field(&summary, "velocities")["min"].as_f64().unwrap() > -0.05, "{summary}");
}

#[test]
fn a_layer_falls_onto_a_mesh_as_onto_a_plane_with_any_law_wall_and_window() {
    let hertz = "{ law = \"hertz\", young = \"1 GPa\", poisson = 0.3, restitution = 0.5 }";
    let overlap = "{ law = \"overlap\", stiffness = \"1e9 Pa\", exponent = 1, restitution = 0.5 }";
    let linear = "{ law = \"linear\", spring = \"1000 N/m\", restitution = 0.5 }";
    let tube = "{ through = [0, 0, 1], axis = [1, 0, 0], radius = 1, particles = \"inside\" }";
    for law in [linear, hertz, overlap] {
        for dt in ["1 ms", "10 ms", "30 ms"] {
            for wall in [
                ("particles.contact", law),
                ("walls.floor", "{ plane = { through = [0, 0, 0], normal = [0, 0, 1] } }"),
                ("walls.floor", &format!("{{ cylinder = {tube} }}")),
                ("walls.floor", "{ box = { lower = [-0.03, -0.03, 0], upper = [0.03, 0.03, 0.03] } }"),
            ] {
                let [highest, lowest, fastest] =
                    bounds(&[("particles.contact", law), ("coupling.dt", dt), wall], 0.029);
                // Rebounds of half the speed: 0.25 mm, 16 µm, 1 µm …, over after 29 ms; overlaps below a tenth of the radius.
                assert!(highest < 0.1e-3 && lowest > 45e-6, "{law} {dt} {wall:?}: {highest:e} {lowest:e}");
                assert!(fastest < 1.001 * FALLEN_M_S, "{law} {dt} {wall:?}: {fastest}");
            }
        }
    }
}

/// A sphere 0.1 mm above a floor, and what draws it down; it comes to rest at 50 µm less its overlap.
const DRAWN: &str = r#"
duration = "20 ms"
[particles]
start = { kind = "file", path = "one.csv" }
contact = { law = "linear", spring = "1000 N/m", restitution = 0.5 }
gravity = [0, 0, 0]
[walls.floor]
plane = { through = [0, 0, 0], normal = [0, 0, 1] }
[coupling]
dt = "1 ms"
"#;

#[test]
fn a_sphere_drawn_by_a_field_comes_to_rest_on_the_floor() {
    let floor = floor();
    // 4/3 π R³ ρ = 4.2e-9 kg: a field of 1000 N/kg sinks it by 4 nm, and reaches 0.4 m/s.
    let magnet = "{ magnetisability = \"1.19e6 A^2/N\", dipole = { at = [0, 0, -0.002], moment = [0, 0, 0.006], radius = \"1 mm\" } }";
    let charge = "{ electric = [0, 0, -1000], charge = 1 }";
    for (key, field) in [("particles.magnetic", magnet), ("particles.electromagnetic", charge)] {
        for law in [
            "{ law = \"linear\", spring = \"1000 N/m\", restitution = 0.5 }",
            "{ law = \"hertz\", young = \"1 GPa\", poisson = 0.3, restitution = 0.5 }",
        ] {
            for wall in [
                "{ plane = { through = [0, 0, 0], normal = [0, 0, 1] } }",
                "{ mesh = { file = \"floor.stl\", unit = \"1 mm\" } }",
            ] {
                for dt in ["1 ms", "5 ms"] {
                    let sets = [(key, field), ("particles.contact", law), ("walls.floor", wall), ("coupling.dt", dt)];
                    let files = [("one.csv", "x,y,z,radius\n0,0,0.00015,5e-05\n"), ("floor.stl", &floor)];
                    let mut highest = 0.0f64;
                    let end = follow(DRAWN, &files, &sets, |_, reply| {
                        highest = highest.max(vectors(reply, "positions")[0][2])
                    });
                    let (z, speed) = (vectors(&end, "positions")[0][2], norm(&vectors(&end, "velocities")[0]));
                    assert!((49.7e-6..50e-6).contains(&z) && speed < 1e-3, "{sets:?}: {z:e} m, {speed:e} m/s");
                    assert!(highest < 1.5e-4, "{sets:?}: {highest:e} m");
                }
            }
        }
    }
}
