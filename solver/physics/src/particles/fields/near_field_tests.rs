//! The near field against sums over all pairs, and its limits.

use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use super::*;
use crate::{
    common::random::uniform,
    particles::settings::{FieldRegion, Presence},
};

/// Ch. 7 of the monograph: ᾱ1 0.5, β1 1, ᾱ2 0.01, β2 2, by mass, all pairs.
const CHAPTER_7: NearFieldSettings = NearFieldSettings {
    attraction: 0.5,
    attraction_exponent: 1.0,
    repulsion: 0.01,
    repulsion_exponent: 2.0,
    base: Base::Mass,
    alternating: false,
    cutoff_m: None,
    skin: 0.1,
    closest: 1e-3,
    presence: Presence { region: FieldRegion::Everywhere, starts_s: 0.0, ends_s: f64::INFINITY },
};

fn near(settings: NearFieldSettings) -> NearField {
    NearField::new(settings).unwrap()
}

/// Particles at random in a cube of 1 m, their strengths of both signs, their radii.
fn cloud(count: usize) -> (Vec<Vec3>, Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::from_seed([5; 32]);
    let positions = (0..count).map(|_| Vec3::from_fn(|_, _| uniform(&mut random))).collect();
    let sources = (0..count).map(|_| 2.0 * uniform(&mut random) - 1.0).collect();
    let radii = (0..count).map(|_| 0.01 + 0.01 * uniform(&mut random)).collect();
    (positions, sources, radii)
}

fn forces(near: &NearField, list: Option<&NearList>, (r, b, radii): &(Vec<Vec3>, Vec<f64>, Vec<f64>)) -> Vec<Vec3> {
    let mut forces = vec![Vec3::zeros(); r.len()];
    near.add(0.0, list, r, b, radii, &mut forces);
    forces
}

/// The double loop, as the equation is written.
fn plainly(settings: &NearFieldSettings, (r, b, radii): &(Vec<Vec3>, Vec<f64>, Vec<f64>)) -> (Vec<Vec3>, Vec<f64>) {
    let mut forces = vec![Vec3::zeros(); r.len()];
    let mut sizes = vec![0.0; r.len()];
    for i in 0..r.len() {
        for j in (0..r.len()).filter(|&j| j != i) {
            let between = r[j] - r[i];
            let distance = between.norm();
            if distance > settings.cutoff_m.unwrap_or(f64::INFINITY) {
                continue;
            }
            let guarded = distance.max(settings.closest * (radii[i] + radii[j]));
            let term = |alpha: f64, beta: f64| alpha * b[i] * b[j] * guarded.powf(-beta);
            let strength = term(settings.attraction, settings.attraction_exponent)
                - term(settings.repulsion, settings.repulsion_exponent);
            forces[i] += strength / guarded * between;
            sizes[i] += strength.abs();
        }
    }
    (forces, sizes)
}

/// Rounding of a sum of n terms is at most n ε of the sum of their sizes, and of a term some ε.
fn assert_close(found: &[Vec3], (wanted, sizes): &(Vec<Vec3>, Vec<f64>)) {
    let rounding = f64::EPSILON * (found.len() as f64 + 20.0);
    for (i, ((found, wanted), size)) in found.iter().zip(wanted).zip(sizes).enumerate() {
        assert!((found - wanted).norm() <= rounding * size, "row {i}: {found:?} {wanted:?}");
    }
}

fn exponents(attraction_exponent: f64, repulsion_exponent: f64) -> NearFieldSettings {
    NearFieldSettings { attraction_exponent, repulsion_exponent, ..CHAPTER_7 }
}

#[test]
fn lanes_and_strips_give_the_double_loop() {
    for count in [0, 1, 2, 3, 4, 5, 9, 1100] {
        let cloud = cloud(count);
        for settings in [CHAPTER_7, exponents(2.0, 1.0), exponents(3.0, 7.0), exponents(1.5, 2.5)] {
            assert_close(&forces(&near(settings), None, &cloud), &plainly(&settings, &cloud));
        }
    }
}

#[test]
fn a_list_gives_all_pairs_within_the_cut_off() {
    let cloud = cloud(3000);
    for (cutoff_m, settings) in [(0.03, CHAPTER_7), (0.15, exponents(2.0, 4.0)), (5.0, CHAPTER_7)] {
        let settings = NearFieldSettings { cutoff_m: Some(cutoff_m), ..settings };
        let near = near(settings);
        let list = near.list(&cloud.0).unwrap();
        let wanted = plainly(&settings, &cloud);
        assert_close(&forces(&near, Some(&list), &cloud), &wanted);
        assert_close(&forces(&near, None, &cloud), &wanted);
    }
}

#[test]
fn a_list_holds_every_pair_in_reach_once() {
    let mut cloud = cloud(700);
    // Across the origin, two at the same place, and two that share the outermost cell.
    cloud.0.iter_mut().for_each(|r| *r -= Vec3::repeat(0.5));
    cloud.0[1] = cloud.0[0];
    (cloud.0[2], cloud.0[3]) = (Vec3::repeat(1e30), Vec3::repeat(1e30));
    for reach in [0.05, 0.3, 2.0] {
        let list = NearList::build(&cloud.0, reach).unwrap();
        for i in 0..cloud.0.len() {
            let wanted: Vec<u32> = (i + 1..cloud.0.len())
                .filter(|&j| (cloud.0[j] - cloud.0[i]).norm_squared() <= reach * reach)
                .map(|j| j as u32)
                .collect();
            assert_eq!(list.row(i), wanted, "row {i}, reach {reach}");
        }
    }
}

#[test]
fn an_old_list_gives_the_same_bits_until_half_the_skin() {
    let before = cloud(2500);
    let near = near(NearFieldSettings { cutoff_m: Some(0.1), ..CHAPTER_7 });
    let old = near.list(&before.0).unwrap();
    let mut now = before.clone();
    now.0.iter_mut().enumerate().for_each(|(i, r)| r[i % 3] += 0.0049 * (i as f64).sin());
    assert!(near.holds(&old, &now.0));
    let new = near.list(&now.0).unwrap();
    assert_ne!(old.pairs(), new.pairs());
    assert_eq!(forces(&near, Some(&old), &now), forces(&near, Some(&new), &now));
    now.0[7].x += 0.011;
    assert!(!near.holds(&old, &now.0) && !near.holds(&old, &now.0[1..]));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let cloud = cloud(2500);
    let cut = near(NearFieldSettings { cutoff_m: Some(0.2), ..CHAPTER_7 });
    let list = cut.list(&cloud.0).unwrap();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| [forces(&near(CHAPTER_7), None, &cloud), forces(&cut, Some(&list), &cloud)])
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}

#[test]
fn momentum_is_conserved_to_rounding() {
    let cloud = cloud(1500);
    let found = forces(&near(CHAPTER_7), None, &cloud);
    let (_, sizes) = plainly(&CHAPTER_7, &cloud);
    let total: Vec3 = found.iter().sum();
    let size: f64 = sizes.iter().sum();
    // Each pair's two forces are equal and opposite; only the order of the sums differs. Rounding errors add up at
    // random, so their sum stays well below n ε.
    assert!(total.norm() < 4.0 * f64::EPSILON * size, "{total:?} of {size}");
}

#[test]
fn chapter_7_balances_at_two_centimetres() {
    let near = near(CHAPTER_7);
    let pull = |distance: f64| {
        let pair = (vec![Vec3::zeros(), Vec3::x() * distance], vec![2.0, 3.0], vec![0.05; 2]);
        let found = forces(&near, None, &pair);
        assert_eq!(found[0], -found[1]);
        found[0].x
    };
    // (α2/α1)^(1/(β2−β1)); terms of 6 · 25 N cancel there.
    assert!(pull(0.02).abs() < 1e-12 && pull(0.0201) > 0.0 && pull(0.0199) < 0.0);
    // 6 (0.5/0.1 − 0.01/0.1²)
    assert!((pull(0.1) - 24.0).abs() < 1e-13, "{}", pull(0.1));
}

#[test]
fn the_force_is_the_gradient_of_the_potential() {
    for settings in [CHAPTER_7, exponents(3.0, 0.5), NearFieldSettings { cutoff_m: Some(2.0), ..exponents(2.5, 4.0) }] {
        let near = near(settings);
        let mut cloud = cloud(40);
        for (i, step) in [(17, 1e-6), (0, 1e-7)] {
            if i == 0 {
                // Below the closest distance, of about 3e-5 m, the law is linear; its energy dwarfs all others.
                cloud.0[1] = cloud.0[0] + Vec3::new(5e-6, 3e-6, 0.0);
            }
            let found = forces(&near, None, &cloud);
            let mut energy = |shift: f64| {
                cloud.0[i].y += shift;
                let energy = near.potential_j(0.0, None, &cloud.0, &cloud.1, &cloud.2);
                cloud.0[i].y -= shift;
                energy
            };
            let slope = (energy(step) - energy(-step)) / (2.0 * step);
            assert!((found[i].y + slope).abs() < 1e-5 * found[i].norm().max(1.0), "{i}: {} {slope}", found[i].y);
        }
    }
    let cut = near(NearFieldSettings { cutoff_m: Some(0.3), ..CHAPTER_7 });
    let cloud = cloud(300);
    let list = cut.list(&cloud.0);
    let [listed, all] = [list.as_ref(), None].map(|list| cut.potential_j(0.0, list, &cloud.0, &cloud.1, &cloud.2));
    assert!((listed - all).abs() < 1e-12 * all.abs(), "{listed} {all}");
}

#[test]
fn particles_at_the_same_place_feel_none_of_each_other() {
    for settings in [CHAPTER_7, exponents(12.0, 16.0), exponents(0.5, 2.5)] {
        let near = near(settings);
        let at = |distance: f64| (vec![Vec3::zeros(), Vec3::x() * distance], vec![1.0; 2], vec![1e-9; 2]);
        assert_eq!(forces(&near, None, &at(0.0)), [Vec3::zeros(); 2]);
        for distance in [1e-300, 1e-160, 1e-13, 1e-12, 1e-9] {
            let force = forces(&near, None, &at(distance))[0];
            assert!(force.iter().all(|value| value.is_finite()), "{distance}: {force:?}");
        }
        let [inner, outer] = [0.5e-12, 1e-12].map(|distance| forces(&near, None, &at(distance))[0].x);
        assert!((outer / inner - 2.0).abs() < 1e-9, "it falls in proportion: {inner} {outer}");
    }
}

#[test]
fn strength_follows_its_base_and_sign() {
    let body = Body { radius_m: 0.5, mass_kg: 7.0, charge_c: -3.0 };
    let source = |base, alternating, id| near(NearFieldSettings { base, alternating, ..CHAPTER_7 }).source(body, id);
    assert!((source(Base::Mass, false, 1) - 7.0).abs() < 1e-15);
    assert!((source(Base::Mass, true, 1) + 7.0).abs() < 1e-15 && (source(Base::Mass, true, 2) - 7.0).abs() < 1e-15);
    assert!((source(Base::Area, false, 0) - PI).abs() < 1e-15);
    assert!((source(Base::Volume, false, 0) - PI / 6.0).abs() < 1e-15);
    assert!((source(Base::Charge, false, 0) + 3.0).abs() < 1e-15);
}

#[test]
fn it_acts_where_both_are_and_while_it_is_on() {
    let region = FieldRegion::Box { lower_m: [0.0; 3], upper_m: [1.0; 3] };
    let near = near(NearFieldSettings { presence: Presence { region, starts_s: 1.0, ends_s: 2.0 }, ..CHAPTER_7 });
    let r = [Vec3::repeat(0.1), Vec3::repeat(0.9), Vec3::new(0.5, 0.5, 1.1)];
    let sum = |t_s| {
        let mut forces = [Vec3::zeros(); 3];
        near.add(t_s, None, &r, &[1.0; 3], &[0.1; 3], &mut forces);
        (forces, near.potential_j(t_s, None, &r, &[1.0; 3], &[0.1; 3]))
    };
    let (on, energy) = sum(1.5);
    assert!(on[0].x > 0.0 && on[1].x < 0.0 && on[2] == Vec3::zeros());
    let distance = 0.8 * 3f64.sqrt();
    assert!((energy - (0.5 * distance.ln() + 0.01 / distance)).abs() < 1e-15);
    assert_eq!((sum(0.5), sum(2.0)), (([Vec3::zeros(); 3], 0.0), ([Vec3::zeros(); 3], 0.0)));
}

#[test]
fn the_stiffness_bounds_the_slope_of_the_force() {
    let near = near(CHAPTER_7);
    for distance in [0.005, 0.02, 0.1] {
        let slope = (near.force(distance * 1.0001) - near.force(distance * 0.9999)) / (2e-4 * distance);
        assert!(6.0 * slope.abs() <= near.stiffness_n_m(distance, 2.0, -3.0));
    }
    assert!((near.stiffness_n_m(0.1, 2.0, -3.0) - 6.0 * (50.0 + 20.0)).abs() < 1e-9);
}

#[test]
fn settings_out_of_range_are_named() {
    let wrong = |change: &dyn Fn(&mut NearFieldSettings)| {
        let mut settings = CHAPTER_7;
        change(&mut settings);
        NearField::new(settings).unwrap_err().to_string()
    };
    assert!(wrong(&|s| s.repulsion = -1.0).contains("repulsion"));
    assert!(wrong(&|s| s.attraction_exponent = 17.0).contains("exponent"));
    assert!(wrong(&|s| s.cutoff_m = Some(0.0)).contains("cut-off"));
    assert!(wrong(&|s| s.skin = f64::NAN).contains("skin"));
    assert!(wrong(&|s| s.closest = 0.0).contains("closest"));
}
