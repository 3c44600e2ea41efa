//! The node: what it reads of the contacts, what it writes, and what it refuses.

use std::{f64::consts::PI, sync::Arc};

use nalgebra::{Matrix3, Rotation3, Vector3};
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::{Field, Fields, Port, Values};
use stagger_physics::{
    common::{Shape, Wall},
    substrate::{Grid, Load, Settings, Substrate, stress_at},
};

use super::{Tensor, difference, norm};

/// A contact: particle, wall, area, force on the wall and position.
pub type Contact = (u32, u32, f64, [f64; 3], [f64; 3]);

pub fn settings(plane: Shape) -> Settings {
    Settings {
        count: 3,
        wall: Wall::fixed("plate", plane, None),
        wall_index: 1,
        poisson: 0.3,
        deflection_young_pa: None,
        grids: Vec::new(),
        points_m: Vec::new(),
        far_field_tolerance: None,
    }
}

pub fn level() -> Shape {
    Shape::plane([0.0; 3], [0.0, 0.0, 1.0])
}

/// The fields of these contacts and of particles of radius 1 over them.
pub fn fields(substrate: &Substrate, contacts: &[Contact], particles: &[[f64; 3]]) -> Fields {
    let values = |port: &Port| -> Values {
        let column = |of: &dyn Fn(&Contact) -> Vec<f64>| contacts.iter().flat_map(of).collect::<Vec<f64>>().into();
        match port.field.as_str() {
            "wall_contact_pairs" => contacts.iter().flat_map(|of| [of.0, of.1]).collect::<Vec<u32>>().into(),
            "wall_contact_area" => column(&|of| vec![of.2]),
            "wall_contact_force" => column(&|of| of.3.to_vec()),
            "wall_contact_position" => column(&|of| of.4.to_vec()),
            "positions" => particles.concat().into(),
            "radii" => vec![1.0; particles.len()].into(),
            other => panic!("the substrate reads `{other}`, which this test does not write"),
        }
    };
    let ports = substrate.ports().reads.into_iter();
    ports.map(|port| (port.field.clone(), Field::new(&Arc::new(port.clone()), 4, values(&port)).unwrap())).collect()
}

pub fn solve(substrate: &Substrate, end: Fields) -> Result<Reply, SolveError> {
    let frozen = Frozen { start: end.clone(), end };
    substrate.solve(&(), &frozen, Window { t_s: 0.0, dt_s: 1e-3 }).map(|(_, reply)| reply)
}

fn tensors(reply: &Reply) -> Vec<Tensor> {
    reply.fields["stress"].f64().unwrap().as_chunks::<6>().0.to_vec()
}

const CONTACTS: [Contact; 3] = [
    (0, 1, 0.04 * PI, [0.2, -0.1, -2.0], [0.3, 0.1, 0.0]),
    // Another wall's.
    (0, 0, 0.04 * PI, [9.0, 9.0, 9.0], [0.0, 0.0, 0.0]),
    (2, 1, 0.09 * PI, [0.0, 0.3, -1.0], [-0.8, 0.5, 0.0]),
];

#[test]
fn the_stress_of_a_level_plate_s_contacts_is_the_half_space_s_with_z_turned_over() {
    let points_m = vec![[0.1, 0.2, -0.4], [0.3, 0.1, 0.0], [2.0, -1.0, -0.3]];
    let substrate = Substrate::new(Settings { points_m: points_m.clone(), ..settings(level()) }).unwrap();
    let reply = solve(&substrate, fields(&substrate, &CONTACTS, &[])).unwrap();
    // z into the solid; y turned over with it, so that the axes stay right-handed.
    let load = |of: &Contact| Load {
        x_m: of.4[0],
        y_m: -of.4[1],
        normal_n: -of.3[2],
        tangential_n: [of.3[0], -of.3[1]],
        radius_m: (of.2 / PI).sqrt(),
    };
    let loads = [load(&CONTACTS[0]), load(&CONTACTS[2])];
    for (point, found) in points_m.iter().zip(tensors(&reply)) {
        let [xx, yy, zz, xy, yz, zx] = stress_at(0.3, &loads, [point[0], -point[1], -point[2]]);
        let expected = [xx, yy, zz, -xy, yz, -zx];
        assert!(difference(found, expected) < 1e-14 * norm(expected), "{found:?} {expected:?}");
    }
    assert_eq!(reply.figures["loads"], 2.0);
    assert!((reply.figures["normal load [N]"] - 3.0).abs() < 1e-15);
    assert!((reply.figures["tangential load [N]"] - 0.2f64.hypot(0.2)).abs() < 1e-15);
}

#[test]
fn a_plate_turned_in_space_with_its_loads_turns_the_stress() {
    let turn = Rotation3::from_euler_angles(0.4, -1.1, 2.3);
    let shift = Vector3::new(1.0, -2.0, 0.5);
    let place = |point: [f64; 3]| <[f64; 3]>::from(turn * Vector3::from(point) + shift);
    let points = [[0.1, 0.2, -0.4], [0.3, 0.1, 0.0], [2.0, -1.0, -0.3]];
    let straight = Substrate::new(Settings { points_m: points.to_vec(), ..settings(level()) }).unwrap();
    let plane = Shape::plane(place([0.0; 3]), (turn * Vector3::z()).into());
    let turned = Substrate::new(Settings { points_m: points.map(place).to_vec(), ..settings(plane) }).unwrap();
    let contacts = CONTACTS.map(|(particle, wall, area, force, at)| {
        (particle, wall, area, (turn * Vector3::from(force)).into(), place(at))
    });
    let before = solve(&straight, fields(&straight, &CONTACTS, &[])).unwrap();
    let after = solve(&turned, fields(&turned, &contacts, &[])).unwrap();
    for (before, after) in tensors(&before).into_iter().zip(tensors(&after)) {
        let [xx, yy, zz, xy, yz, zx] = before;
        let tensor = turn.matrix() * Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz) * turn.matrix().transpose();
        let expected = [tensor.m11, tensor.m22, tensor.m33, tensor.m12, tensor.m23, tensor.m31];
        // Rounding of the places, through the disc's closed form, which loses (γ/a)³ of the digits.
        assert!(difference(after, expected) < 1e-10 * norm(expected), "{after:?} {expected:?}");
    }
    for scalar in ["von_mises_stress", "pressure", "stress_deviator_norm"] {
        let [before, after] = [&before, &after].map(|reply| reply.fields[scalar].f64().unwrap().to_vec());
        assert!(before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-9 * a.abs()), "{scalar}");
    }
}

#[test]
fn a_grid_s_mean_is_the_volume_average_to_second_order_and_invariants_fit_the_tensor() {
    let mean = |spacing_m: f64| {
        let grid = Grid { name: "box".into(), lower_m: [-1.0, -1.0, -1.5], upper_m: [1.0, 1.0, -0.5], spacing_m };
        let substrate = Substrate::new(Settings { grids: vec![grid], ..settings(level()) }).unwrap();
        let reply = solve(&substrate, fields(&substrate, &CONTACTS, &[])).unwrap();
        for (row, tensor) in tensors(&reply).into_iter().enumerate() {
            let third = (tensor[0] + tensor[1] + tensor[2]) / 3.0;
            let mut deviator = tensor;
            deviator[..3].iter_mut().for_each(|value| *value -= third);
            let at = |name: &str| reply.fields[name].f64().unwrap()[row];
            assert!((at("pressure") + third).abs() < 1e-14);
            assert!((at("stress_deviator_norm") - norm(deviator)).abs() < 1e-14);
            assert!((at("von_mises_stress") - 1.5f64.sqrt() * norm(deviator)).abs() < 1e-14);
        }
        reply.figures["box: mean σ':σ' [Pa^2]"]
    };
    let means = [0.2, 0.1, 0.05].map(mean);
    let order = ((means[0] - means[1]) / (means[1] - means[2])).log2();
    // The midpoint rule's next term is a sixteenth of the difference.
    assert!((order - 2.0).abs() < 0.1, "{order}: {means:?}");
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let message = |settings: Settings| Substrate::new(settings).err().unwrap().to_string();
    let above = message(Settings { points_m: vec![[0.0, 0.0, 0.1]], ..settings(level()) });
    assert!(above.contains("lies 0.1 m above the surface"), "{above}");
    let cylinder = Shape::Box { lower_m: [0.0; 3], upper_m: [1.0; 3], open: Vec::new() };
    assert!(message(settings(cylinder)).contains("`plate` is not a plane"));
    assert!(message(Settings { poisson: 0.6, ..settings(level()) }).contains("Poisson's ratio is 0.6"));
    let tolerance = Settings { far_field_tolerance: Some(1e-9), ..settings(level()) };
    assert!(message(tolerance).contains("tolerance of the far field"));

    let substrate = Substrate::new(Settings { points_m: vec![[0.0; 3]], ..settings(level()) }).unwrap();
    let mut end = fields(&substrate, &CONTACTS, &[]);
    let mut stale = end["wall_contact_force"].clone();
    stale.support.revision = 3;
    end.insert("wall_contact_force".into(), stale);
    let error = solve(&substrate, end).err().unwrap().to_string();
    assert!(error.contains("`wall_contact_force` is of contact list 3"), "{error}");
    let mut flat = CONTACTS;
    flat[2].2 = 0.0;
    let error = solve(&substrate, fields(&substrate, &flat, &[])).err().unwrap().to_string();
    assert!(error.contains("`wall_contact_area` is 0 m^2 in row 2"), "{error}");
}
