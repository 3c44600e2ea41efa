//! Properties that hold for any particles in any of the laws over decades; those of ordinary beds stand in
//! `tests/validation/contact/invariance.rs`.

use proptest::{collection::vec, prelude::*, sample::select};
use stagger_physics::particles::{ContactLaw, Friction, Settings};

use crate::{bed::*, outcome::*};

fn law() -> impl Strategy<Value = ContactLaw> {
    (0usize..4, 2.0..9.0f64).prop_map(|(kind, decade)| laws(10f64.powf(decade))[kind])
}

fn friction() -> impl Strategy<Value = Option<Friction>> {
    let regularised = (0.0..15.0f64).prop_map(|decade| {
        let stiffness_n_m3 = 10f64.powf(decade);
        Some(Friction::Regularised { stiffness_n_m3, static_coefficient: 0.5, dynamic_coefficient: 0.4 })
    });
    prop_oneof![Just(None), Just(Some(SPRING)), regularised]
}

/// Up to eight spheres anywhere in a cube they hardly fit in, of radii over three decades, at speeds over six.
fn spheres() -> impl Strategy<Value = Vec<Sphere>> {
    let place = prop::array::uniform3(-0.1..0.1f64);
    let direction = prop::array::uniform3(-1.0..1.0f64);
    vec((place, direction, -3.0..1.0f64, -4.0..-1.0f64), 0..9).prop_map(|particles| {
        let sphere = |(place, direction, speed, radius): ([f64; 3], [f64; 3], f64, f64)| {
            (place, direction.map(|x| x * 10f64.powf(speed)), 10f64.powf(radius))
        };
        particles.into_iter().map(sphere).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_particles_end_finite_with_their_momentum_or_are_refused(
        law in law(),
        friction in friction(),
        integrator in select(&INTEGRATORS[..]),
        restitution in select(vec![None, Some(0.5), Some(1e-3)]),
        spheres in spheres(),
    ) {
        let mut settings = Settings { integrator, ..settings(law, 2000.0, &spheres) };
        (settings.friction, settings.spin) = (friction, true);
        settings.contact.restitution = restitution;
        match outcome(&settings, &spheres, 1e-4, 5e-4) {
            // The sum of the sizes may be small at the start, where all is elastic energy: that of the way counts.
            Outcome::Ran(ran) => prop_assert!(ran.drift < 1e-11, "{:e}", ran.drift),
            Outcome::Refused(cause) => {
                prop_assert!(cause.contains("asks for less") || cause.contains("substeps"), "{cause}");
            }
        }
    }
}
