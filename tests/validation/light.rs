//! Absorption of a laser beam (Zohdi 2018, ch. 5.10, 6.3.1): shares in closed form, shadowing, power that is neither
//! made nor lost, beams that move and pulse, and results that do not depend on threads or axes.

mod rays;

use std::{f64::consts::PI, sync::Arc};

use nalgebra::{Rotation3, Vector3};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::{Field, Fields};
use stagger_physics::optics::{Beam, Model, Optics, Path, Profile, Pulses, Settings};

fn beam(profile: Profile) -> Beam {
    Beam {
        power_w: 40.0,
        profile,
        direction: [0.0, 0.0, -1.0],
        path: Path::Fixed { at_m: [0.0; 3] },
        starts_s: 0.0,
        ends_s: f64::INFINITY,
        pulses: None,
    }
}

/// Settings without walls, for particles that neither come nor go.
fn settings(count: usize, model: Model, beam: &Beam) -> Settings {
    Settings { count, model, beam: beam.clone(), walls: Vec::new(), capacities_j_m3_k: Vec::new(), solid: None }
}

type Spheres = [(Vector3<f64>, f64)];

fn fields(optics: &Optics, spheres: &Spheres) -> Fields {
    let ports = optics.ports().reads.into_iter().map(|port| {
        let values: Vec<f64> = match port.field.as_str() {
            "positions" => spheres.iter().flat_map(|(centre, _)| [centre.x, centre.y, centre.z]).collect(),
            "radii" => spheres.iter().map(|(_, radius)| *radius).collect(),
            other => panic!("optics reads `{other}`, which this test does not write"),
        };
        (port.field.clone(), Field::new(&Arc::new(port), 0, values).unwrap())
    });
    ports.collect()
}

/// Solves consecutive windows of equal length over spheres at rest; returns every reply.
fn run(model: Model, beam: &Beam, spheres: &Spheres, t_s: f64, dt_s: f64, windows: u32) -> Vec<Reply> {
    let optics = Optics::new(settings(spheres.len(), model, beam)).unwrap();
    let frozen = Frozen { start: fields(&optics, spheres), end: fields(&optics, spheres) };
    let (mut state, _) = optics.initial().unwrap();
    let mut replies = Vec::new();
    for k in 0..windows {
        let window = Window { t_s: t_s + f64::from(k) * dt_s, dt_s };
        let (next, reply) = optics.solve(&state, &frozen, window).unwrap();
        replies.push(reply);
        state = next;
    }
    replies
}

/// Share of the beam's power that each sphere takes from a steady beam.
fn shares(model: Model, beam: &Beam, spheres: &Spheres) -> Vec<f64> {
    let absorbed = run(model, beam, spheres, 0.0, 1e-6, 1)[0].fields["absorbed_power"].clone();
    absorbed.f64().unwrap().iter().map(|power_w| power_w / beam.power_w).collect()
}

fn joule(reply: &Reply, name: &str) -> f64 {
    reply.ledger.iter().find(|energy| energy.name == name).unwrap().joule
}

/// Area of the light that a sphere of radius 1 takes from parallel light, over π: ∫ (1 − e^{−2a√(1−r²)}) 2 r dr
/// = 1 − 2/x² (1 − (1+x) e^{−x}) with x = 2a.
fn sphere_share(a: f64) -> f64 {
    let x = 2.0 * a;
    1.0 - 2.0 / (x * x) * (1.0 - (1.0 + x) * (-x).exp())
}

/// A number in [0, 1).
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    random.next_u32() as f64 / 2f64.powi(32)
}

/// Spheres of one radius, uniformly in the box of these half widths about the origin; they may overlap.
fn strewn(seed: u64, count: usize, half: [f64; 3], radius: f64) -> Vec<(Vector3<f64>, f64)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sphere = || (Vector3::from(half.map(|h| h * (2.0 * uniform(&mut random) - 1.0))), radius);
    (0..count).map(|_| sphere()).collect()
}

#[test]
fn the_closed_form_is_the_integral_it_stands_for() {
    for a in [0.1, 1.0, 5.0] {
        // Midpoint rule in c = √(1−r²), where the integrand 2 c (1 − e^{−2ac}) is smooth: error (1+a)²/(12 n²).
        let n = 10_000;
        let sum: f64 =
            (0..n).map(|k| (f64::from(k) + 0.5) / f64::from(n)).map(|c| 2.0 * c * -(-2.0 * a * c).exp_m1()).sum();
        assert!((sum / f64::from(n) - sphere_share(a)).abs() < 1e-7);
    }
}

#[test]
fn a_sphere_takes_its_share_and_finer_lines_find_it_faster_than_first_order() {
    let a = 1.5;
    // Root mean square over 32 places of the sphere and sizes of the beam: a single error jumps with the grid's place.
    let error = |spacing_m: f64| {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut squares = 0.0;
        for _ in 0..32 {
            let at = Vector3::new(uniform(&mut random) - 0.5, uniform(&mut random) - 0.5, 3.0);
            let radius_m = 2.0 + 0.5 * uniform(&mut random);
            let model = Model::BeerLambert { absorption_1_m: a, spacing_m };
            let share = shares(model, &beam(Profile::TopHat { radius_m }), &[(at, 1.0)])[0];
            squares += (share * radius_m * radius_m / sphere_share(a) - 1.0).powi(2);
        }
        (squares / 32.0).sqrt()
    };
    let (coarse, fine) = (error(0.2), error(0.0125));
    let order = (coarse / fine).log2() / 4.0;
    println!("line spacing R/5: {coarse:.2e}, R/80: {fine:.2e}, order {order:.2}");
    assert!((1.2..2.2).contains(&order), "order {order}");
    assert!(fine < 1e-3, "{fine}");
}

#[test]
fn every_profile_lights_a_small_sphere_by_its_irradiance() {
    let (radius, d_m) = (0.05_f64, 0.3);
    let a = 1.5 / radius;
    for (profile, irradiance) in [
        (Profile::TopHat { radius_m: 1.0 }, 1.0 / PI),
        (Profile::Gaussian { radius_m: 1.0 }, 2.0 / PI * (-2.0_f64 * d_m * d_m).exp()),
        (Profile::Exponential { decay_1_m: 3.0 }, 9.0 / (2.0 * PI) * (-3.0 * d_m).exp()),
    ] {
        let sphere = [(Vector3::new(0.0, d_m, 0.0), radius)];
        let model = Model::BeerLambert { absorption_1_m: a, spacing_m: radius / 8.0 };
        let share = shares(model, &beam(profile), &sphere)[0];
        let expected = irradiance * PI * radius * radius * sphere_share(a * radius);
        // Lines R/8 apart leave 7e-3 in the mean and up to three times that at one place; the curvature of the profile
        // over the disc, (b R)²/8, is 3e-3 at most.
        assert!((share / expected - 1.0).abs() < 2.5e-2, "{profile:?}: {share} instead of {expected}");
        // The monograph's form is a I V to rounding.
        let share = shares(Model::BeerLambertMonograph { absorption_1_m: a }, &beam(profile), &sphere)[0];
        let expected = a * irradiance * 4.0 / 3.0 * PI * radius.powi(3);
        assert!((share / expected - 1.0).abs() < 1e-13, "{profile:?}: {share} instead of {expected}");
    }
}

#[test]
fn a_sphere_in_line_gets_what_the_one_above_left() {
    let a = 0.8;
    let in_line = [(Vector3::new(0.0, 0.0, -2.5), 1.0), (Vector3::new(0.0, 0.0, 2.5), 1.0)];
    let profile = Profile::TopHat { radius_m: 1.5 };
    let model = Model::BeerLambert { absorption_1_m: a, spacing_m: 0.01 };
    let [lower, upper] = shares(model, &beam(profile), &in_line)[..] else { panic!("two shares") };
    // Both chords are equal on every line, so both spheres together are one of twice the absorption.
    let (alone, both) = (sphere_share(a) / 2.25, sphere_share(2.0 * a) / 2.25);
    assert!((upper / alone - 1.0).abs() < 2e-3, "upper {upper}: lines 1/100 of R leave 1e-3");
    assert!((lower / (both - alone) - 1.0).abs() < 2e-3, "lower {lower}");

    // The monograph weakens the light by the chord through the centre, 2 R.
    let model = Model::BeerLambertMonograph { absorption_1_m: a };
    let [lower, upper] = shares(model, &beam(profile), &in_line)[..] else { panic!("two shares") };
    assert!((lower / upper - (-2.0 * a).exp()).abs() < 1e-14);
}

#[test]
fn both_forms_agree_for_thin_particles() {
    let profile = Profile::Gaussian { radius_m: 1.0 };
    let spheres = strewn(3, 200, [0.8, 0.8, 2.0], 0.1);
    let a = 0.05;
    let conserving = shares(Model::BeerLambert { absorption_1_m: a, spacing_m: 0.01 }, &beam(profile), &spheres);
    let monograph = shares(Model::BeerLambertMonograph { absorption_1_m: a }, &beam(profile), &spheres);
    for (one, other) in conserving.iter().zip(&monograph) {
        // a·2R = 0.01 in a particle, a·ζ ~ 0.05 of shadow that differs over its disc, (R/w)² = 1 % from the profile.
        assert!((one / other - 1.0).abs() < 0.05, "{one} and {other}");
    }
    let total = |of: &[f64]| of.iter().sum::<f64>();
    assert!((total(&conserving) / total(&monograph) - 1.0).abs() < 0.02);
}

#[test]
fn black_spheres_strewn_at_random_transmit_exponentially() {
    // n π R² L = 1.2: N spheres over a cross-section of 4 h² = 3.2². The light keeps R away from the box's sides.
    let (count, half, radius_m) = (5_000, 1.6, 0.028);
    let optical_depth = count as f64 * PI * radius_m * radius_m / (4.0 * half * half);
    let expected = (-optical_depth).exp();
    let model = Model::BeerLambert { absorption_1_m: 1e9, spacing_m: 0.02 };
    let samples: Vec<f64> = (0..40)
        .map(|seed| {
            let spheres = strewn(seed, count, [half, half, 4.0], radius_m);
            1.0 - shares(model, &beam(Profile::TopHat { radius_m: 1.5 }), &spheres).iter().sum::<f64>()
        })
        .collect();
    let mean = samples.iter().sum::<f64>() / 40.0;
    let variance = samples.iter().map(|sample| (sample - mean).powi(2)).sum::<f64>() / 39.0;
    let standard_error = (variance / 40.0).sqrt();
    println!("transmission {mean:.5} ± {standard_error:.5}, expected {expected:.5}");
    // Four standard errors of independent samples; N fixed instead of Poisson shifts it by τ²/(2N) = 1.4e-4 at most.
    assert!((mean - expected).abs() < 4.0 * standard_error + 1.5e-4, "{mean} instead of {expected}");
    assert!(standard_error < 2e-3, "the test resolves nothing: {standard_error}");
}

#[test]
fn the_conserving_form_never_absorbs_more_than_the_laser_gives_and_books_all_of_it() {
    let spheres = strewn(5, 3_000, [1.0, 1.0, 1.0], 0.1);
    for profile in [
        Profile::TopHat { radius_m: 0.7 },
        Profile::Gaussian { radius_m: 0.5 },
        Profile::Exponential { decay_1_m: 20.0 },
    ] {
        for absorption_1_m in [0.0, 1.0, 1e6] {
            let model = Model::BeerLambert { absorption_1_m, spacing_m: 0.02 };
            let reply = run(model, &beam(profile), &spheres, 0.0, 1e-3, 2).pop().unwrap();
            let (laser, absorbed) = (joule(&reply, "laser"), joule(&reply, "absorbed"));
            let passed = joule(&reply, "passed");
            assert!((laser - 0.04).abs() < 1e-17);
            // Rounding of one subtraction.
            assert!((laser - absorbed - passed).abs() <= 1e-17, "{profile:?}, a = {absorption_1_m}");
            // Each line gives away at most what it has, so only the sum's rounding can pass 0: 1e5 terms of 1e-16.
            assert!((-1e-12 * laser..=laser).contains(&passed), "{profile:?}: {passed} J of {laser} J");
            let power: f64 = reply.fields["absorbed_power"].f64().unwrap().iter().sum();
            assert!((power * 1e-3 - absorbed).abs() <= 1e-13 * laser);
            assert!((reply.figures["absorbed over laser"] - absorbed / laser).abs() < 1e-15);
            if absorption_1_m == 0.0 {
                assert!(absorbed.abs() < f64::MIN_POSITIVE);
            }
            if absorption_1_m > 1.0 {
                // Depth n π R² L = 23 at each line: black.
                assert!(passed < 1e-3 * laser, "{profile:?}: {passed}");
            }
        }
    }
    // The monograph's form exceeds the beam here, and says so.
    let model = Model::BeerLambertMonograph { absorption_1_m: 1e3 };
    let reply = run(model, &beam(Profile::TopHat { radius_m: 0.7 }), &spheres, 0.0, 1e-3, 1).pop().unwrap();
    assert!(reply.figures["absorbed over laser"] > 1.0 && joule(&reply, "passed") < 0.0);
}

#[test]
fn without_particles_all_light_passes() {
    for model in [
        Model::EnergyBalance,
        Model::BeerLambert { absorption_1_m: 1.0, spacing_m: 0.1 },
        Model::BeerLambertMonograph { absorption_1_m: 1.0 },
    ] {
        let reply = run(model, &beam(Profile::TopHat { radius_m: 1.0 }), &[], 0.0, 1e-3, 1).pop().unwrap();
        assert!((joule(&reply, "passed") - 0.04).abs() < 1e-17 && joule(&reply, "absorbed").abs() < 1e-300);
    }
}

#[test]
fn the_energy_balance_spreads_all_power_by_mass() {
    let spheres = [(Vector3::zeros(), 1e-5), (Vector3::new(9.0, 9.0, 9.0), 2e-5)];
    let profile = Profile::TopHat { radius_m: 1e-4 };
    let found = shares(Model::EnergyBalance, &beam(profile), &spheres);
    assert!((found[0] - 1.0 / 9.0).abs() < 1e-15 && (found[1] - 8.0 / 9.0).abs() < 1e-15);
}

/// A Gaussian beam of w = 0.5 m sweeping 2 m back and forth at 1 m/s from t = 1 s on, past a sphere beside its path.
fn sweep() -> (Beam, [(Vector3<f64>, f64); 1]) {
    let path = Path::Sweep { from_m: [-1.0, 0.0, 0.0], to_m: [1.0, 0.0, 0.0], speed_m_s: 1.0 };
    let of = Beam { path, starts_s: 1.0, ends_s: 4.0, ..beam(Profile::Gaussian { radius_m: 0.5 }) };
    (of, [(Vector3::new(0.6, 0.2, 0.0), 0.1)])
}

#[test]
fn the_energy_from_a_swept_beam_is_that_of_the_integral_to_second_order_in_the_window() {
    let (beam, sphere) = sweep();
    let (a, w) = (0.3, 0.5);
    let model = Model::BeerLambertMonograph { absorption_1_m: a };
    let absorbed = |windows: u32| -> f64 {
        let dt_s = 5.0 / f64::from(windows);
        run(model, &beam, &sphere, 0.0, dt_s, windows).iter().map(|reply| joule(reply, "absorbed")).sum()
    };
    // From t = 1 to 4 s the spot runs from −1 to 1 and back to 0: P a V 2/(π w²) e^{−2y²/w²} ∫ e^{−2(x−x_i)²/w²} dx by
    // the midpoint rule, error 1e-8.
    let gaussian = |x: f64| (-2.0 * ((x - 0.6) / w).powi(2)).exp();
    let n = 20_000;
    let over = |from: f64, to: f64| {
        let width = (to - from) / f64::from(n);
        (0..n).map(|k| gaussian(from + (f64::from(k) + 0.5) * width)).sum::<f64>() * width
    };
    let volume = 4.0 / 3.0 * PI * 0.1_f64.powi(3);
    let peak = 40.0 * a * volume * 2.0 / (PI * w * w) * (-2.0 * (0.2 / w).powi(2)).exp();
    let exact = peak * (over(-1.0, 1.0) + over(0.0, 1.0));
    let error = |windows| (absorbed(windows) - exact).abs() / exact;
    let order = (error(50) / error(400)).log2() / 3.0;
    println!("swept beam: error {:.1e} with 50 windows, {:.1e} with 400, order {order:.2}", error(50), error(400));
    // 5 s in 50 or 400 windows: switching and turning fall on their ends, the rule's h² term is all that is left.
    assert!((order - 2.0).abs() < 0.05, "order {order}");
}

#[test]
fn a_beam_that_is_off_costs_nothing_and_gives_nothing() {
    let (beam, sphere) = sweep();
    let replies = run(Model::BeerLambert { absorption_1_m: 1.0, spacing_m: 0.02 }, &beam, &sphere, 0.0, 0.5, 10);
    for (k, reply) in replies.iter().enumerate() {
        let on = (2..8).contains(&k);
        let power_w = reply.fields["beam_power"].f64().unwrap()[0];
        let absorbed_w = reply.fields["absorbed_power"].f64().unwrap()[0];
        assert!((power_w - if on { 40.0 } else { 0.0 }).abs() < 1e-13, "window {k}: {power_w} W");
        assert_eq!(absorbed_w > 0.0, on, "window {k}: {absorbed_w} W");
    }
    // Fields hold the window's end: at 1.5 s the spot has run half a metre.
    assert!((replies[2].fields["beam_spot"].f64().unwrap()[0] + 0.5).abs() < 1e-15);
    assert!((replies[2].fields["beam_radius"].f64().unwrap()[0] - 0.5).abs() < 1e-15);
}

#[test]
fn the_energy_of_pulses_is_exact_whatever_the_windows() {
    let (mut beam, sphere) = sweep();
    // Ten pulses of 0.1 s in [1 s, 4 s], each 40 W: 40 J.
    beam.pulses = Some(Pulses { period_s: 0.3, on_s: 0.1 });
    for windows in [1, 7, 50, 1009] {
        let dt_s = 5.0 / f64::from(windows);
        let replies = run(Model::EnergyBalance, &beam, &sphere, 0.0, dt_s, windows);
        let laser: f64 = replies.iter().map(|reply| joule(reply, "laser")).sum();
        let absorbed: f64 = replies.iter().map(|reply| joule(reply, "absorbed")).sum();
        // Each window rounds its times, of some seconds, at 1e-15 s.
        let rounding = 40.0 * 1e-15 * f64::from(windows + 10);
        assert!((laser - 40.0).abs() < rounding, "{windows} windows: {laser} J");
        assert!((absorbed - laser).abs() < rounding);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let spheres = strewn(9, 4_000, [1.0, 1.0, 2.0], 0.05);
    let beam = beam(Profile::Gaussian { radius_m: 0.6 });
    for model in [
        Model::BeerLambert { absorption_1_m: 3.0, spacing_m: 0.01 },
        Model::BeerLambertMonograph { absorption_1_m: 3.0 },
    ] {
        let bits = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| shares(model, &beam, &spheres)).into_iter().map(f64::to_bits).collect::<Vec<_>>()
        };
        let one = bits(1);
        for threads in [2, 3, 5] {
            assert_eq!(one, bits(threads), "{model:?} with {threads} threads");
        }
    }
}

#[test]
fn an_oblique_beam_sees_what_an_upright_one_sees_of_the_turned_scene() {
    let spheres = strewn(13, 300, [0.6, 0.6, 1.0], 0.1);
    let upright = beam(Profile::Gaussian { radius_m: 0.5 });
    let turn = Rotation3::from_euler_angles(0.5, -0.3, 1.1);
    let shift = Vector3::new(3.0, -1.0, 2.0);
    let turned: Vec<_> = spheres.iter().map(|(centre, radius)| (turn * centre + shift, *radius)).collect();
    let oblique = Beam {
        direction: (turn * Vector3::from(upright.direction)).into(),
        path: Path::Fixed { at_m: shift.into() },
        ..upright.clone()
    };
    let model = Model::BeerLambertMonograph { absorption_1_m: 2.0 };
    let largest = shares(model, &upright, &spheres).into_iter().fold(0.0, f64::max);
    for (one, other) in shares(model, &upright, &spheres).iter().zip(shares(model, &oblique, &turned)) {
        // Chords near a sphere's edge turn a rounding ε of place into √ε of length, hence not 1e-16.
        assert!((one - other).abs() < 1e-7 * largest, "{one} and {other}");
    }
    // The lines turn about the beam as well, so their sampling error shows: R/20 leaves 5e-3 of a particle's share.
    let model = Model::BeerLambert { absorption_1_m: 2.0, spacing_m: 0.005 };
    let largest = shares(model, &upright, &spheres).into_iter().fold(0.0, f64::max);
    for (one, other) in shares(model, &upright, &spheres).iter().zip(shares(model, &oblique, &turned)) {
        assert!((one - other).abs() < 5e-3 * largest, "{one} and {other}");
    }
}

#[test]
fn bad_fields_and_settings_are_refused() {
    let profile = Profile::TopHat { radius_m: 1.0 };
    let good = settings(1, Model::EnergyBalance, &beam(profile));
    let with = |beam: Beam| Optics::new(Settings { beam, ..good.clone() });
    let fast = Path::Sweep { from_m: [0.0; 3], to_m: [1.0; 3], speed_m_s: 0.0 };
    for bad in [
        Beam { power_w: -1.0, ..beam(profile) },
        Beam { direction: [0.0, 0.0, 2.0], ..beam(profile) },
        Beam { ends_s: -1.0, ..beam(profile) },
        Beam { pulses: Some(Pulses { period_s: 1.0, on_s: 2.0 }), ..beam(profile) },
        Beam { path: fast, ..beam(profile) },
        beam(Profile::Exponential { decay_1_m: 0.0 }),
    ] {
        assert!(matches!(with(bad).err(), Some(SolveError::Start(_))));
    }
    for model in [
        Model::BeerLambert { absorption_1_m: 1.0, spacing_m: 0.0 },
        Model::BeerLambertMonograph { absorption_1_m: f64::NAN },
    ] {
        assert!(matches!(Optics::new(Settings { model, ..good.clone() }).err(), Some(SolveError::Start(_))));
    }

    let optics = Optics::new(good.clone()).unwrap();
    let refused = |spheres: &Spheres| {
        let frozen = Frozen { start: fields(&optics, spheres), end: fields(&optics, spheres) };
        optics.solve(&Default::default(), &frozen, Window { t_s: 0.0, dt_s: 1.0 }).unwrap_err()
    };
    let mut wrong = fields(&optics, &[(Vector3::zeros(), 1.0); 2]);
    wrong.extend(fields(&optics, &[(Vector3::zeros(), 1.0)]).remove_entry("radii"));
    let frozen = Frozen { start: wrong.clone(), end: wrong };
    let error = optics.solve(&Default::default(), &frozen, Window { t_s: 0.0, dt_s: 1.0 }).unwrap_err();
    assert!(error.to_string().contains("`positions` has 2 rows, but `radii` has 1"), "{error}");
    let error = refused(&[(Vector3::new(0.0, f64::NAN, 0.0), 1.0)]);
    assert!(error.retry() && error.to_string().contains("`positions` is NaN in row 0"), "{error}");
}

#[test]
fn particles_that_come_or_go_leave_the_balance_closed_and_take_the_share_at_the_windows_end() {
    let model = Model::BeerLambert { absorption_1_m: 1e4, spacing_m: 0.02 };
    let two: [(Vector3<f64>, f64); 2] = [(Vector3::new(-0.5, 0.0, 0.0), 0.4), (Vector3::new(0.5, 0.0, 0.0), 0.3)];
    let three = [two[1], (Vector3::new(-0.2, 0.3, 0.0), 0.2), (Vector3::new(0.0, -0.5, 0.0), 0.3)];
    let beam = beam(Profile::TopHat { radius_m: 1.0 });
    let optics = Optics::new(settings(2, model, &beam)).unwrap();
    let on = |spheres: &Spheres, revision: u64| {
        let fields = fields(&optics, spheres).into_values();
        let revised = fields.map(|field| Field::new(&field.port, revision, field.values().clone()).unwrap());
        revised.map(|field| (field.name().to_owned(), field)).collect::<Fields>()
    };
    let (mut state, _) = optics.initial().unwrap();
    // As many as before in the last window, but others.
    let windows = [on(&two, 0), on(&two, 0), on(&three, 1), on(&[], 2), on(&two, 3), on(&two, 4)];
    for (k, pair) in windows.windows(2).enumerate() {
        let frozen = Frozen { start: pair[0].clone(), end: pair[1].clone() };
        let (next, reply) = optics.solve(&state, &frozen, Window { t_s: k as f64, dt_s: 1.0 }).unwrap();
        let absorbed = &reply.fields["absorbed_power"];
        assert_eq!(absorbed.support, pair[1]["radii"].support);
        let sum: f64 = absorbed.f64().unwrap().iter().sum();
        // Sums of three numbers.
        assert!((joule(&reply, "absorbed") - sum).abs() <= 1e-15 * beam.power_w && sum <= beam.power_w);
        assert!(
            (joule(&reply, "laser") - joule(&reply, "absorbed") - joule(&reply, "passed")).abs()
                <= 1e-15 * beam.power_w
        );
        if k == 1 {
            let expected = shares(model, &beam, &three);
            assert_eq!(absorbed.f64().unwrap().len(), 3);
            for (found, share) in absorbed.f64().unwrap().iter().zip(expected) {
                assert!((found - share * beam.power_w).abs() <= 1e-15 * beam.power_w);
            }
        }
        state = next;
    }
}
