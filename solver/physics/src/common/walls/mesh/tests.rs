//! A sphere against meshes of triangles, whose contacts must not depend on how a surface is cut.

use proptest::prelude::*;

use super::*;

/// Contacts of a sphere with a mesh: normal and distance of each.
fn contacts(surface: &MeshSurface, position: Vec3, radius: f64) -> Vec<(Vec3, f64)> {
    let (mut features, mut touches) = (Vec::new(), Vec::new());
    // A third more than the radius, as a list with a skin has it.
    surface.near(&position, 1.3 * radius, &mut features);
    surface.touch(&position, radius, &features, &mut touches);
    assert!(touches.is_sorted_by_key(|touch| touch.entry));
    touches.iter().map(|touch| (touch.normal, touch.distance)).collect()
}

fn surface(corners: &[[[f64; 3]; 3]]) -> MeshSurface {
    MeshSurface::new(&Mesh::new(corners).unwrap(), 2.0)
}

/// A rectangle of `count` × `count` pairs of triangles spanned from `origin` by `u` and `v`.
fn rectangle(origin: Vec3, u: Vec3, v: Vec3, count: u32) -> Vec<[[f64; 3]; 3]> {
    let corner = |i: u32, j: u32| (origin + (u * f64::from(i) + v * f64::from(j)) / f64::from(count)).into();
    let cells = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            // The diagonal alternates, so that corners of 4 and of 8 triangles occur.
            if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        })
        .collect()
}

/// The unit cube, of `count` × `count` pairs of triangles a face.
fn cube(count: u32) -> Vec<[[f64; 3]; 3]> {
    let [x, y, z] = [Vec3::x(), Vec3::y(), Vec3::z()];
    [(x, y, z), (y, z, x), (z, x, y)]
        .into_iter()
        .flat_map(|(u, v, w)| [rectangle(Vec3::zeros(), u, v, count), rectangle(w, v, u, count)].concat())
        .collect()
}

#[test]
fn a_sphere_on_a_triangulated_plane_has_the_plane_s_contact_wherever_it_is() {
    let floor = surface(&rectangle(Vec3::new(-1.0, -1.0, 0.5), Vec3::x() * 2.0, Vec3::y() * 2.0, 8));
    let (radius, distance) = (0.3, 0.29);
    // Along a line of corners, along diagonals, and askew, in steps that hit edges and corners exactly.
    for direction in [[1.0, 0.0], [1.0, 1.0], [1.0, -1.0], [0.0, 1.0], [0.7, 0.3]] {
        for step in -100i32..=100 {
            for side in [1.0, -1.0] {
                let along = f64::from(step) / 160.0;
                let position = Vec3::new(direction[0] * along, direction[1] * along, 0.5 + side * distance);
                let found = contacts(&floor, position, radius);
                assert_eq!(found.len(), 1, "{position}: {found:?}");
                let (normal, found) = found[0];
                // On an edge the normal is a difference of two points of order 1.
                assert!((normal - Vec3::z() * side).norm() < 1e-14 && (found - distance).abs() < 1e-15);
            }
        }
    }
}

proptest! {
    #[test]
    fn a_slanted_plane_of_triangles_is_a_plane(
        normal in [-1.0f64..1.0, -1.0f64..1.0, 0.1f64..1.0],
        [x, y] in [-0.5f64..0.5, -0.5f64..0.5],
        radius in 0.01f64..0.4,
        depth in 0.0f64..0.5,
    ) {
        let normal = Vec3::from(normal).normalize();
        let [u, v] = super::super::shape::across(&normal);
        let floor = surface(&rectangle(-(u + v), u * 2.0, v * 2.0, 6));
        let distance = radius * (1.0 - depth);
        let found = contacts(&floor, u * x + v * y + normal * distance, radius);
        prop_assert_eq!(found.len(), 1);
        // The corners are rounded to 1e-16; a triangle of edge 1/3 tells its normal to a few of that. On an edge the
        // normal is that of a distance of at least 0.005.
        prop_assert!((found[0].0 - normal).norm() < 1e-13 && (found[0].1 - distance).abs() < 4e-15);
    }

    #[test]
    fn the_tree_finds_what_a_search_of_all_triangles_does(
        position in [-0.3f64..1.3, -0.3f64..1.3, -0.3f64..1.3], reach in 0.01f64..0.5,
    ) {
        let corners = cube(3);
        let surface = surface(&corners);
        let position = Vec3::from(position);
        let mut found = Vec::new();
        surface.near(&position, reach, &mut found);
        let distance = |corners: &[[f64; 3]; 3]| {
            Triangle::new(corners.map(Vec3::from)).unwrap().nearest(&position).distance
        };
        let all: Vec<u32> =
            (0..).zip(&corners).filter(|(_, corners)| distance(corners) < reach).map(|(index, _)| index).collect();
        prop_assert_eq!(found, all);
    }

    #[test]
    fn around_a_cube_there_is_one_contact_with_the_nearest_point(
        position in [-0.4f64..1.4, -0.4f64..1.4, -0.4f64..1.4], radius in 0.05f64..0.3,
    ) {
        let position = Vec3::from(position);
        let nearest = position.map(|coordinate| coordinate.clamp(0.0, 1.0));
        let distance = (position - nearest).norm();
        prop_assume!(distance > 0.01);
        let found = contacts(&surface(&cube(4)), position, radius);
        prop_assert_eq!(found.len(), usize::from(distance < radius));
        for (normal, found) in found {
            prop_assert!((found - distance).abs() < 1e-15);
            prop_assert!((normal - (position - nearest) / distance).norm() < 1e-13);
        }
    }
}

#[test]
fn within_a_cube_s_corner_there_are_three_contacts() {
    for count in [1, 2, 5] {
        let cube = surface(&cube(count));
        let mut found = contacts(&cube, Vec3::new(0.1, 0.85, 0.125), 0.2);
        found.sort_by(|left, right| left.1.total_cmp(&right.1));
        let expected = [(Vec3::x(), 0.1), (Vec3::z(), 0.125), (-Vec3::y(), 0.15)];
        assert_eq!(found.len(), 3, "{found:?}");
        for ((normal, distance), (expected_normal, expected)) in found.iter().zip(expected) {
            // 1 − 0.85 rounds.
            assert!((normal - expected_normal).norm() < 1e-15 && (distance - expected).abs() < 1e-15);
        }
    }
}

#[test]
fn a_contact_passes_over_a_convex_edge_without_a_jump() {
    let cube = surface(&cube(2));
    // The centre goes around the edge x = z = 1 at a constant distance from the surface, by way of its arc.
    let (radius, distance) = (0.2, 0.19);
    for step in 0..=90 {
        let angle = f64::from(step).to_radians();
        let normal = Vec3::new(angle.sin(), 0.0, angle.cos());
        let found = contacts(&cube, Vec3::new(1.0, 0.5, 1.0) + normal * distance, radius);
        assert_eq!(found.len(), 1, "{step}: {found:?}");
        assert!((found[0].0 - normal).norm() < 1e-14 && (found[0].1 - distance).abs() < 1e-15);
    }
}

#[test]
fn triangles_that_do_not_share_their_corners_are_one_surface_too() {
    // One large triangle beside two small ones: the corner between these lies within its edge, off by STL's rounding.
    let near = 1.0 / 3.0 + 1e-8;
    let corners = [
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 0.0]],
        [[0.0, 0.0, 0.0], [near, 1e-8, 1e-8], [0.3, -1.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.3, -1.0, 0.0], [near, 1e-8, 1e-8]],
    ];
    let floor = surface(&corners);
    for step in 0..=40 {
        let position = Vec3::new(0.2 + 0.01 * f64::from(step), 1e-3 * f64::from(step - 20), 0.09);
        let found = contacts(&floor, position, 0.1);
        assert_eq!(found.len(), 1, "{position}: {found:?}");
        // The seam is uneven by 1e-8.
        assert!((found[0].0 - Vec3::z()).norm() < 1e-6 && (found[0].1 - 0.09).abs() < 2e-8);
    }
}

#[test]
fn stl_is_scaled_and_placed() {
    let text = "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
                facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid";
    let mesh = Mesh::from_stl(text.as_bytes(), 1e-3, [0.0, 0.0, 2.0]).unwrap();
    // The second has no area.
    assert_eq!(mesh.corners(), [[[0.0, 0.0, 2.0], [1e-3, 0.0, 2.0], [0.0, 1e-3, 2.0]]]);
    assert_eq!(mesh.bounds(), [[0.0, 0.0, 2.0], [1e-3, 1e-3, 2.0]]);
    let shown = serde_json::to_value(&mesh).unwrap();
    assert_eq!((&shown["triangles"], &shown["upper_m"][2]), (&serde_json::json!(1), &serde_json::json!(2.0)));
    let flat = text.replace("vertex 0 0 0", "vertex 2 -1 0");
    assert_eq!(
        Mesh::from_stl(flat.as_bytes(), 1.0, [0.0; 3]).unwrap_err().to_string(),
        "no triangle with an area (2 without)"
    );
    assert_eq!(Mesh::from_stl(b"solid\nendsolid\n", 1.0, [0.0; 3]), Err(MeshError::Empty(0)));
    let infinite = text.replace("vertex 0 1 0", "vertex 0 inf 0");
    assert_eq!(
        Mesh::from_stl(infinite.as_bytes(), 1.0, [0.0; 3]).unwrap_err().to_string(),
        "triangle 1 has a corner that is not finite"
    );
}
