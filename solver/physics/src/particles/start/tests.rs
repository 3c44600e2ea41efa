//! Every start against its density, its limits and its seed.

use proptest::prelude::*;

use super::*;
use crate::{
    common::{
        Vec3,
        random::{random, uniform},
    },
    particles::settings::{Group, Lattice, Radius, StartRegion},
};

/// A box with its lower corner off the origin.
fn cube(side: f64) -> StartRegion {
    StartRegion::Box { lower_m: [-1.0, 2.0, 0.0], upper_m: [side - 1.0, side + 2.0, side] }
}

fn uniform_radii(count: usize, mean_m: f64, spread_m: f64, material: u16) -> Group {
    Group { name: "balls".into(), count, radius: Radius::Uniform { mean_m, spread_m }, material }
}

fn drawn(groups: &[Group], seed: u64) -> radii::Bodies {
    radii::draw(groups, &mut random(seed))
}

fn added(count: usize, region: &StartRegion, seed: u64) -> Result<(Vec<Vec3>, Vec<f64>), SolveError> {
    let mut random = random(seed);
    let radii = radii::draw(&[uniform_radii(count, 1.0, 0.3, 0)], &mut random).radii;
    Ok((SequentialAddition { region, radii: &radii }.place(&mut random)?, radii))
}

fn grown(
    count: usize,
    spread: f64,
    fraction: f64,
    seed: u64,
) -> Result<(Vec<Vec3>, Vec<f64>, StartRegion), SolveError> {
    let mut random = random(seed);
    let radii = radii::draw(&[uniform_radii(count, 1.0, spread, 0)], &mut random).radii;
    let region = cube((radii::volume(&radii) / fraction).cbrt());
    let (lower, upper) = region.bounds();
    let positions = Growth { lower: lower.into(), upper: upper.into(), radii: &radii }.place(&mut random)?;
    Ok((positions, radii, region))
}

/// The deepest overlap over the smaller radius, and how far the farthest sphere reaches out of the region, over its radius.
fn faults(positions: &[Vec3], radii: &[f64], region: &StartRegion) -> (f64, f64) {
    let (mut overlap, mut out) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let (lower, upper) = region.bounds();
    for i in 0..positions.len() {
        for j in 0..i {
            let depth = radii[i] + radii[j] - (positions[i] - positions[j]).norm();
            overlap = overlap.max(depth / radii[i].min(radii[j]));
        }
        for axis in 0..3 {
            let below = lower[axis] - (positions[i][axis] - radii[i]);
            let above = positions[i][axis] + radii[i] - upper[axis];
            out = out.max(below.max(above) / radii[i]);
        }
        let beyond = match *region {
            StartRegion::Box { .. } => 0.0,
            StartRegion::Sphere { centre_m, radius_m } => {
                (positions[i] - Vec3::from(centre_m)).norm() + radii[i] - radius_m
            }
            StartRegion::Cylinder { base_m, axis, radius_m, .. } => {
                let across = (0..3).filter(|other| *other != axis);
                let square: f64 = across.map(|other| (positions[i][other] - base_m[other]).powi(2)).sum();
                square.sqrt() + radii[i] - radius_m
            }
        };
        out = out.max(beyond / radii[i]);
    }
    (overlap, out)
}

/// Rounding of coordinates of some tens of radii.
const ROUNDING: f64 = 1e-13;

#[test]
fn sequential_addition_neither_overlaps_nor_leaves_its_region() {
    let cylinder = StartRegion::Cylinder { base_m: [1.0, -2.0, 3.0], axis: 0, radius_m: 9.0, height_m: 20.0 };
    let sphere = StartRegion::Sphere { centre_m: [5.0, 6.0, 7.0], radius_m: 11.0 };
    for region in [cube(19.0), cylinder, sphere] {
        let (positions, radii) = added(300, &region, 7).unwrap();
        assert!(radii.iter().all(|radius| (0.7..=1.3).contains(radius)) && radii.is_sorted_by(|a, b| a >= b));
        let (overlap, out) = faults(&positions, &radii, &region);
        assert!(overlap < ROUNDING && out < ROUNDING, "{region:?}: {overlap:e} {out:e}");
        assert_eq!(added(300, &region, 7).unwrap().0, positions);
        assert_ne!(added(300, &region, 8).unwrap().0, positions);
    }
}

#[test]
fn the_stream_is_portable() {
    // ChaCha8 with a zero key and stream, first word of the keystream: 3e 00 ef 2f 89 5f 40 d6 (Strombergson,
    // Test Vectors for the Stream Cipher ChaCha, TC1).
    let expected = (0xd640_5f89_2fef_003e_u64 >> 11) as f64 / (1u64 << 53) as f64;
    assert!((uniform(&mut random(0)) - expected).abs() < f64::EPSILON);
}

#[test]
fn too_dense_says_so_and_ends() {
    let message = added(60, &cube(7.0), 7).unwrap_err().to_string();
    assert!(message.contains("packing fraction asked for is 0.69") && message.contains("0.38"), "{message}");
    assert!(added(1, &cube(1.0), 7).unwrap_err().to_string().contains("does not fit"));
    assert!(added(0, &cube(1.0), 7).unwrap().0.is_empty());
    assert!(grown(50, 0.0, 0.9, 1).unwrap_err().to_string().contains("no spheres pack denser"));
    // A crystal that fits would not be found between these walls.
    let jammed = grown(64, 0.0, 0.72, 1).unwrap_err().to_string();
    assert!(jammed.contains("where 0.720 is asked for") && jammed.contains("jammed"), "{jammed}");
}

#[test]
fn a_lattice_fills_the_share_of_space_that_is_its_own() {
    use Lattice::{BodyCentredCubic, FaceCentredCubic, HexagonalClosePacked, SimpleCubic};
    // Ashcroft & Mermin 1976, table 4.1 and problem 4.5.
    let (cubic, close) = (std::f64::consts::FRAC_PI_6, 0.7405);
    let fractions =
        [(SimpleCubic, cubic), (BodyCentredCubic, 0.6802), (FaceCentredCubic, close), (HexagonalClosePacked, close)];
    for (lattice, fraction) in fractions {
        let count = 20_000;
        let bodies = drawn(&[uniform_radii(count, 0.5, 0.0, 0)], 1);
        let region = cube(40.0);
        let positions = lattice.place(&region, &bodies, 1.0, 0.0, &mut random(1)).unwrap();
        // Within a block inside the filled part, whose faces blur by less than a layer each.
        let height = positions.iter().map(|position| position.z).fold(0.0, f64::max) - 4.0;
        let block = [4.0..34.0, 7.0..37.0, 2.0..2.0 + height];
        let inside = |position: &&Vec3| (0..3).all(|axis| block[axis].contains(&position[axis]));
        let found = positions.iter().filter(inside).count() as f64 * std::f64::consts::PI / 6.0 / (900.0 * height);
        assert!((found / fraction - 1.0).abs() < 0.12, "{lattice:?}: {found}");
        let (overlap, out) = faults(&positions[..2000], &bodies.radii[..2000], &region);
        // Neighbours touch.
        assert!(overlap.abs() < 1e-12 && out < 1e-12, "{lattice:?}: {overlap:e} {out:e}");
    }
}

#[test]
fn a_jittered_lattice_of_two_groups_does_not_overlap_and_mixes_them() {
    let groups = [uniform_radii(300, 0.4, 0.1, 0), uniform_radii(200, 0.2, 0.0, 1)];
    let bodies = drawn(&groups, 3);
    assert!(bodies.radii.is_sorted_by(|a, b| a >= b));
    assert_eq!(bodies.materials.iter().filter(|material| **material == 1).count(), 200);
    assert!(bodies.materials[300..].iter().all(|material| *material == 1));
    for region in [cube(12.0), StartRegion::Sphere { centre_m: [0.0; 3], radius_m: 8.0 }] {
        let place = |jitter| Lattice::FaceCentredCubic.place(&region, &bodies, 1.3, jitter, &mut random(3)).unwrap();
        let positions = place(1.0);
        let (overlap, out) = faults(&positions, &bodies.radii, &region);
        assert!(overlap < ROUNDING && out < ROUNDING, "{overlap:e} {out:e}");
        assert_ne!(positions, place(0.0));
        let mean_z = |rows: std::ops::Range<usize>| {
            positions[rows.clone()].iter().map(|position| position.z).sum::<f64>() / rows.len() as f64
        };
        // Unmixed, the larger ones would fill the lower half: 3 apart in either region.
        assert!((mean_z(0..300) - mean_z(300..500)).abs() < 0.8);
    }
    let message = Lattice::SimpleCubic.place(&cube(5.0), &bodies, 1.0, 0.0, &mut random(3)).unwrap_err().to_string();
    assert!(message.contains("holds 125 sites") && message.contains("500"), "{message}");
}

#[test]
fn growth_reaches_a_dense_packing_without_overlap() {
    // The walls of a small box keep spheres from packing as densely as in a wide one.
    for (count, spread, fraction) in [(2000, 0.0, 0.6), (600, 0.2, 0.56)] {
        let (positions, radii, region) = grown(count, spread, fraction, 1).unwrap();
        let (overlap, out) = faults(&positions, &radii, &region);
        assert!(overlap < ROUNDING && out < ROUNDING, "{overlap:e} {out:e}");
    }
    let positions = |seed| grown(300, 0.1, 0.5, seed).unwrap().0;
    assert_eq!(positions(1), positions(1));
    assert_ne!(positions(1), positions(2));
    // Where addition at random is enough, nothing has to grow.
    assert_eq!(grown(100, 0.0, 0.2, 1).unwrap().0.len(), 100);
    assert!(grown(0, 0.0, 0.5, 1).is_err() || grown(0, 0.0, 0.5, 1).unwrap().0.is_empty());
}

#[test]
fn log_normal_radii_have_their_mean_and_deviation_and_keep_their_limits() {
    let radius = |minimum_m, maximum_m| Radius::LogNormal { mean_m: 2.0, deviation_m: 0.5, minimum_m, maximum_m };
    let draw = |radius| drawn(&[Group { name: "a".into(), count: 20_000, radius, material: 0 }], 5).radii;
    let radii = draw(radius(1e-3, 1e3));
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    let variance = radii.iter().map(|radius| (radius - mean).powi(2)).sum::<f64>() / radii.len() as f64;
    // Four standard errors of the mean, 0.5/√20000, and of the deviation, whose own is about 1.3 times as large.
    assert!((mean - 2.0).abs() < 0.0142 && (variance.sqrt() - 0.5).abs() < 0.02, "{mean} {variance}");
    // Skewed to the right: the median is the exponential of the logarithm's mean, 2/√(1 + 1/16).
    assert!((radii[10_000] - 1.9403).abs() < 0.018, "{}", radii[10_000]);
    let cut = draw(radius(1.8, 2.1));
    assert!(cut.iter().all(|radius| (1.8..=2.1).contains(radius)) && cut[0] > 2.09 && cut[19_999] < 1.81);
    // Limits between which nothing ever falls do not hang.
    let never = Radius::LogNormal { mean_m: 1.0, deviation_m: 1e-9, minimum_m: 1.0, maximum_m: 1.0 };
    assert_eq!(draw(never)[0], 1.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn growth_ends_whatever_is_asked_for(count in 1usize..60, spread in 0.0f64..0.6, fraction in 0.1f64..0.75) {
        // Either it fits, wholly and without overlap, or it says that it does not.
        if let Ok((positions, radii, region)) = grown(count, spread, fraction, 1) {
            let (overlap, out) = faults(&positions, &radii, &region);
            prop_assert!(overlap < ROUNDING && out < ROUNDING, "{overlap:e} {out:e}");
        }
    }
}
