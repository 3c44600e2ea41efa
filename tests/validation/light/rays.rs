//! Light by rays (Zohdi 2018, ch. 10): Fresnel's values, shares in closed form, power that is neither made nor lost.

use stagger_physics::{
    common::rays::{Limits, POINTS, Pattern, RefractiveIndex, SHOWN, Sampling, reflectance},
    optics::Surface,
};

use super::*;

const LIMITS: Limits = Limits { threshold: 1e-9, reflections: 1000 };

fn dielectric(real: f64) -> RefractiveIndex {
    RefractiveIndex { real, extinction: 0.0 }
}

fn surface(solid: RefractiveIndex) -> Surface {
    Surface { solid, molten: None, permeability: 1.0 }
}

fn by_rays(index: RefractiveIndex, count: usize, pattern: Pattern) -> Model {
    Model::Rays { sampling: Sampling { count, pattern, limits: LIMITS }, surface: surface(index) }
}

#[test]
fn fresnels_reflectance_has_its_known_values() {
    let at = |real: f64, degrees: f64| reflectance(dielectric(real), 1.0, degrees.to_radians().cos());
    // Given to so many digits.
    for (real, degrees, expected, digit) in
        [(2.0, 0.0, 0.1111, 1e-4), (4.0, 0.0, 0.3600, 1e-4), (2.0, 45.0, 0.12265, 1e-5), (4.0, 45.0, 0.35883, 1e-5)]
    {
        assert!((at(real, degrees) - expected).abs() < 0.5 * digit, "n {real} at {degrees}°: {}", at(real, degrees));
    }
    for real in [1.5f64, 2.0, 4.0, 0.6] {
        // tan θ = n̂: nothing of r_∥ is left, and r_⊥ is (1 − n̂²)/(1 + n̂²).
        let brewster = real.atan().cos();
        let perpendicular = (1.0 - real * real) / (1.0 + real * real);
        let found = reflectance(dielectric(real), 1.0, brewster);
        assert!((found - 0.5 * perpendicular * perpendicular).abs() < 1e-15, "n {real}: {found}");
    }
    // Total reflection, exactly, at and beyond sin θ = n̂, and not before; the approach is by a root, hence not nearer.
    let critical = 0.6f64.asin();
    let found = |angle: f64| reflectance(dielectric(0.6), 1.0, angle.cos());
    for angle in [critical + 1e-12, critical + 0.1, 1.5] {
        assert_eq!(found(angle).to_bits(), 1.0f64.to_bits());
    }
    assert!(found(critical - 1e-6) < 0.999 && found(critical - 1e-12) < 1.0);
    // Without a contrast nothing is reflected, but for grazing light.
    assert!(reflectance(dielectric(1.0), 1.0, 1e-3).abs() < 1e-15);
    assert_eq!(reflectance(dielectric(1.0), 1.0, 0.0).to_bits(), 1.0f64.to_bits());
    // Impedances match where n̂ = μ̂ at normal incidence, whatever they are.
    assert!(reflectance(dielectric(3.0), 3.0, 1.0).abs() < 1e-15);
}

#[test]
fn a_complex_index_reflects_from_none_to_all_and_tends_to_the_real_one() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..20_000 {
        // Four decades of n, k and μ̂.
        let mut decades = || 10f64.powf(4.0 * uniform(&mut random) - 2.0);
        let (index, permeability) = (RefractiveIndex { real: decades(), extinction: decades() }, decades());
        let cosine = uniform(&mut random);
        let found = reflectance(index, permeability, cosine);
        assert!((0.0..=1.0).contains(&found), "{index:?}, {permeability}, {cosine}: {found}");
    }
    for (real, extinction) in [(3.0, 4.0), (0.2, 3.0), (1.5, 0.01)] {
        // At normal incidence ((n−1)² + k²)/((n+1)² + k²).
        let square = |n: f64| n * n + extinction * extinction;
        let expected = square(real - 1.0) / square(real + 1.0);
        assert!((reflectance(RefractiveIndex { real, extinction }, 1.0, 1.0) - expected).abs() < 1e-15);
    }
    for cosine in [0.05, 0.5, 0.9] {
        for real in [0.7, 2.0] {
            let [complex, plain] =
                [1e-9, 0.0].map(|extinction| reflectance(RefractiveIndex { real, extinction }, 1.0, cosine));
            // Linear in k.
            assert!((complex - plain).abs() < 1e-7, "n {real}, cosine {cosine}: {complex} and {plain}");
        }
    }
}

/// Share of a beam as wide as a sphere that the sphere absorbs: ∫ (1 − R(c)) 2c dc over the cosine of incidence. The
/// integrand is smooth for n̂ > 1: midpoint rule, second order.
fn absorbed_by_one(index: RefractiveIndex) -> f64 {
    let n = 100_000;
    let at = |k| (f64::from(k) + 0.5) / f64::from(n);
    (0..n).map(at).map(|cosine| (1.0 - reflectance(index, 1.0, cosine)) * 2.0 * cosine).sum::<f64>() / f64::from(n)
}

#[test]
fn a_sphere_in_a_beam_as_wide_absorbs_its_share_and_finer_rays_find_it() {
    let sphere = [(Vector3::new(0.3, -0.2, 1.0), 1.0)];
    let beam = Beam { path: Path::Fixed { at_m: [0.3, -0.2, 0.0] }, ..beam(Profile::TopHat { radius_m: 1.0 }) };
    for (real, expected) in [(2.0, 0.83940), (4.0, 0.63336)] {
        let exact = absorbed_by_one(dielectric(real));
        assert!((exact - expected).abs() < 5e-6, "the given value has five digits: {exact}");
        let error = |count: usize| {
            let share = shares(by_rays(dielectric(real), count, Pattern::Stratified), &beam, &sphere)[0];
            (share - exact).abs()
        };
        let (coarse, fine) = (error(1000), error(100_000));
        let order = (coarse / fine).log10() / 2.0;
        println!("n {real}: error {coarse:.2e} with 1000 rays, {fine:.2e} with 100000, order {order:.2}");
        // The midpoint rule in r² of an integrand with a root singularity at the sphere's edge: order 3/2.
        assert!((1.4..1.6).contains(&order), "order {order}");
        assert!(fine < 1e-7, "{fine}");
    }
}

#[test]
fn rays_at_random_scatter_about_the_share_as_the_root_of_their_number() {
    let (index, sphere) = (dielectric(2.0), [(Vector3::zeros(), 1.0)]);
    let (exact, beam) = (absorbed_by_one(index), beam(Profile::TopHat { radius_m: 1.0 }));
    let deviation = |count: usize| {
        let error = |seed| shares(by_rays(index, count, Pattern::Random { seed }), &beam, &sphere)[0] - exact;
        ((0..64).map(error).map(|error| error * error).sum::<f64>() / 64.0).sqrt()
    };
    let (coarse, fine) = (deviation(100), deviation(6400));
    let order = (coarse / fine).log2() / 6.0;
    // A deviation of 64 samples is known to 9 %: ±0.03 of the order.
    assert!((order - 0.5).abs() < 0.1, "{coarse} and {fine}: order {order}");
}

#[test]
fn matched_spheres_strewn_at_random_transmit_exponentially() {
    // As for Beer–Lambert; n̂ = 1 reflects nothing and takes all: black.
    let (count, half, radius_m) = (5_000, 1.6, 0.028);
    let optical_depth = count as f64 * PI * radius_m * radius_m / (4.0 * half * half);
    let expected = (-optical_depth).exp();
    let samples: Vec<f64> = (0..40)
        .map(|seed| {
            let spheres = strewn(seed, count, [half, half, 4.0], radius_m);
            let model = by_rays(dielectric(1.0), 20_000, Pattern::Stratified);
            1.0 - shares(model, &beam(Profile::TopHat { radius_m: 1.5 }), &spheres).iter().sum::<f64>()
        })
        .collect();
    let mean = samples.iter().sum::<f64>() / 40.0;
    let variance = samples.iter().map(|sample| (sample - mean).powi(2)).sum::<f64>() / 39.0;
    let standard_error = (variance / 40.0).sqrt();
    println!("transmission {mean:.5} ± {standard_error:.5}, expected {expected:.5}");
    // Four standard errors; N fixed instead of Poisson shifts it by τ²/(2N) = 1.4e-4 at most.
    assert!((mean - expected).abs() < 4.0 * standard_error + 1.5e-4, "{mean} instead of {expected}");
    assert!(standard_error < 2e-3, "the test resolves nothing: {standard_error}");
}

#[test]
fn black_spheres_take_by_rays_what_they_take_by_lines() {
    let spheres = strewn(21, 300, [0.8, 0.8, 1.5], 0.1);
    let beam = beam(Profile::Gaussian { radius_m: 0.5 });
    let lines = shares(Model::BeerLambert { absorption_1_m: 1e9, spacing_m: 0.0025 }, &beam, &spheres);
    let rays = shares(by_rays(dielectric(1.0), 200_000, Pattern::Stratified), &beam, &spheres);
    let largest = lines.iter().copied().fold(0.0, f64::max);
    for (line, ray) in lines.iter().zip(&rays) {
        // Lines R/40 apart leave 1e-3 of a full particle's share, the rays less.
        assert!((line - ray).abs() < 3e-3 * largest, "{line} and {ray}");
    }
}

#[test]
fn all_power_is_absorbed_passes_escapes_or_is_left_over() {
    // Dense and overlapping, so that light is caught in creases, on a plate.
    let spheres = strewn(5, 3_000, [1.0, 1.0, 0.5], 0.1);
    let metal = RefractiveIndex { real: 3.0, extinction: 4.0 };
    for (index, limits) in [
        (dielectric(2.0), LIMITS),
        (dielectric(0.6), LIMITS),
        (metal, LIMITS),
        (metal, Limits { threshold: 0.1, ..LIMITS }),
        (dielectric(0.3), Limits { reflections: 3, ..LIMITS }),
    ] {
        for profile in [Profile::TopHat { radius_m: 0.7 }, Profile::Exponential { decay_1_m: 5.0 }] {
            let sampling = Sampling { count: 5000, pattern: Pattern::Stratified, limits };
            let model = Model::Rays { sampling, surface: surface(index) };
            let settings = Settings { walls: vec![[0.0, 0.0, 1.0]], ..settings(spheres.len(), model, &beam(profile)) };
            let optics = Optics::new(settings).unwrap();
            let frozen = Frozen { start: fields(&optics, &spheres), end: fields(&optics, &spheres) };
            let (state, _) = optics.initial().unwrap();
            let (_, reply) = optics.solve(&state, &frozen, Window { t_s: 0.0, dt_s: 1e-3 }).unwrap();
            let [laser, absorbed, passed, escaped, residual] =
                ["laser", "absorbed", "passed", "escaped", "residual"].map(|name| joule(&reply, name));
            // Each is summed on its own: rounding of 5000 rays with some ten terms each.
            let sum = absorbed + passed + escaped + residual;
            assert!((laser - sum).abs() < 1e-13 * laser, "{index:?}, {limits:?}: {laser} and {sum}");
            assert!([absorbed, passed, escaped].iter().all(|part| *part > 0.0), "{absorbed}, {passed}, {escaped}");
            let cut = limits.threshold > 0.01 || limits.reflections < 10;
            // 1e-9 of a ray is left at the threshold.
            assert!(if cut { residual > 1e-3 * laser } else { residual <= 1e-9 * laser }, "{index:?}: {residual}");
            assert!(reply.figures["reflections"] > 5000.0 && reply.figures["rays"] as u32 == 5000);
        }
    }
    // What reflects all lets all escape, where the spheres lie so loosely that a thousand reflections lead out.
    let spheres = &spheres[..200];
    let mirror = by_rays(dielectric(1e-9), 5000, Pattern::Stratified);
    let reply = run(mirror, &beam(Profile::TopHat { radius_m: 0.7 }), spheres, 0.0, 1e-3, 1).pop().unwrap();
    let [laser, absorbed, escaped] = ["laser", "absorbed", "escaped"].map(|name| joule(&reply, name));
    assert!((escaped / laser - 1.0).abs() < 1e-13 && absorbed < 1e-13 * laser, "{laser}, {absorbed}, {escaped}");
}

#[test]
fn molten_particles_reflect_by_their_liquid_share() {
    let surface = Surface { molten: Some(dielectric(2.0)), ..surface(dielectric(4.0)) };
    let sampling = Sampling { count: 10_000, pattern: Pattern::Stratified, limits: LIMITS };
    let model = Model::Rays { sampling, surface };
    let optics = Optics::new(settings(1, model, &beam(Profile::TopHat { radius_m: 1.0 }))).unwrap();
    let share = |melted: f64| {
        let on = |port: stagger_messages::Port| {
            let values = match port.field.as_str() {
                "positions" => vec![0.0; 3],
                "radii" => vec![1.0],
                _ => vec![melted],
            };
            (port.field.clone(), Field::new(&Arc::new(port), 0, values).unwrap())
        };
        let fields: Fields = optics.ports().reads.into_iter().filter(|port| !port.optional).map(on).collect();
        assert_eq!(fields.len(), 3, "positions, radii, melted");
        let frozen = Frozen { start: fields.clone(), end: fields };
        let (_, reply) = optics.solve(&Default::default(), &frozen, Window { t_s: 0.0, dt_s: 1.0 }).unwrap();
        reply.fields["absorbed_power"].f64().unwrap()[0] / 40.0
    };
    // The error of 10⁴ rays is below 1e-6, as that of 1000 falls by their power 3/2.
    assert!((share(0.0) - 0.63336).abs() < 1e-5 && (share(1.0) - 0.83940).abs() < 1e-5);
    assert!((share(0.25) - (0.75 * share(0.0) + 0.25 * share(1.0))).abs() < 1e-12);
}

#[test]
fn rays_give_the_same_bits_for_any_number_of_threads_and_any_order_of_the_particles() {
    let spheres = strewn(9, 4_000, [1.0, 1.0, 1.0], 0.05);
    let beam = beam(Profile::Gaussian { radius_m: 0.6 });
    let model = by_rays(RefractiveIndex { real: 3.0, extinction: 4.0 }, 20_000, Pattern::Random { seed: 4 });
    let bits = |threads, spheres: &Spheres| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| shares(model, &beam, spheres)).into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    let one = bits(1, &spheres);
    for threads in [2, 3, 5] {
        assert_eq!(one, bits(threads, &spheres), "with {threads} threads");
    }
    let backwards: Vec<_> = spheres.iter().rev().copied().collect();
    let mut turned = bits(2, &backwards);
    turned.reverse();
    assert_eq!(one, turned, "the particles in the opposite order");
}

#[test]
fn a_dark_beam_is_not_traced_and_a_lit_one_shows_its_paths() {
    let spheres = strewn(2, 50, [0.5, 0.5, 0.5], 0.1);
    let dark = Beam { starts_s: 1.0, ..beam(Profile::TopHat { radius_m: 0.5 }) };
    let replies = run(by_rays(dielectric(2.0), 100, Pattern::Stratified), &dark, &spheres, 0.0, 1.0, 2);
    assert!(joule(&replies[0], "laser").abs() < 1e-300 && replies[0].figures["reflections"].abs() < 1e-300);
    let paths = |reply: &Reply| reply.fields["ray_paths"].clone();
    assert!(paths(&replies[0]).f64().unwrap().iter().all(|coordinate| coordinate.abs() < 1e-300));
    let (field, inside) = (paths(&replies[1]), |point: &[f64]| point.iter().all(|x| x.abs() < 0.61));
    assert_eq!((field.rows(), field.components()), (SHOWN, 3 * POINTS));
    let rows = field.f64().unwrap().chunks_exact(3 * POINTS);
    // Each starts before the first particle; most meet one within the box of all, of half width 0.6.
    let met = rows.filter(|row| row[2] > 0.5 && row[3..].chunks_exact(3).any(inside)).count();
    assert!(met > SHOWN / 2, "{met}");
}

#[test]
fn surfaces_and_rays_out_of_range_are_refused() {
    let good = Sampling { count: 10, pattern: Pattern::Stratified, limits: LIMITS };
    let beam = beam(Profile::TopHat { radius_m: 1.0 });
    for (sampling, surface) in [
        (Sampling { count: 0, ..good }, surface(dielectric(2.0))),
        (Sampling { limits: Limits { reflections: 0, ..LIMITS }, ..good }, surface(dielectric(2.0))),
        (Sampling { limits: Limits { threshold: 1.0, ..LIMITS }, ..good }, surface(dielectric(2.0))),
        (good, surface(dielectric(0.0))),
        (good, surface(RefractiveIndex { real: 1.0, extinction: -1.0 })),
        (good, Surface { permeability: 0.0, ..surface(dielectric(2.0)) }),
    ] {
        let refused = Optics::new(settings(1, Model::Rays { sampling, surface }, &beam));
        assert!(matches!(refused.err(), Some(SolveError::Start(_))), "{sampling:?}, {surface:?}");
    }
}
