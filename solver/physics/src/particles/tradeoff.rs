//! Trade-offs of the motion: integrator, substeps, spin, the neighbour list's skin, the near field's cut-off.

use super::settings::{Friction, Integrator, Settings};
use crate::common::tradeoff::{Axis, Point, Set, Setup, Tradeoff, is_first_order, plain, scaled, set, times};

/// What the particles contribute to trade-offs.
pub static TRADEOFF: Tradeoff = Tradeoff {
    axes: &[
        Axis { name: "integrator", points: integrators },
        Axis { name: "substep", points: substeps },
        Axis { name: "spin", points: spins },
        Axis { name: "skin", points: skins },
        Axis { name: "cut-off", points: cut_offs },
    ],
    has_substeps,
    tighter: |setup, factor| own_substep_s(setup).map(|own_s| verlet(own_s / factor)).unwrap_or_default(),
    in_series,
    first_order,
    advances: &["positions", "velocities"],
    usual: &["height"],
    words: &[("positions", "each positions")],
};

/// The settings of particles that move.
fn moving<'s>(setup: &Setup<'s>) -> Option<&'s Settings> {
    setup.tables.main::<Settings>().filter(|settings| settings.integrator != Integrator::Held)
}

fn has_substeps(setup: &Setup<'_>) -> bool {
    moving(setup).is_some_and(|settings| matches!(settings.integrator, Integrator::Verlet { .. }))
}

/// The substep that the scene took when it ran as it stands, in s.
fn own_substep_s(setup: &Setup<'_>) -> Option<f64> {
    setup.substep_s.filter(|_| has_substeps(setup))
}

/// Velocity Verlet in substeps of at most this.
fn verlet(substep_s: f64) -> Set {
    vec![set("particles.integrator", format!("{{ kind = \"verlet\", substep = {} }}", plain(substep_s)))]
}

fn in_series(setup: &Setup<'_>, factor: f64) -> Set {
    match moving(setup).map(|settings| settings.integrator) {
        Some(Integrator::Verlet { .. }) => setup.substep_s.map(|own_s| verlet(own_s * factor)).unwrap_or_default(),
        Some(Integrator::Trapezoidal { phi, .. }) => {
            let value = format!("{{ kind = \"trapezoidal\", phi = {phi:?}, tolerance = 1e-13, iterations = 1000 }}");
            vec![set("particles.integrator", value)]
        }
        Some(Integrator::Held) | None => Set::new(),
    }
}

fn first_order(setup: &Setup<'_>) -> Option<&'static str> {
    let settings = moving(setup)?;
    if matches!(settings.integrator, Integrator::Trapezoidal { phi, .. } if is_first_order(phi)) {
        return Some("the particles' weight phi is not 1/2");
    }
    matches!(settings.friction, Some(Friction::Regularised { .. }))
        .then_some("regularised friction sticks over one substep, whatever its size")
}

fn integrators(setup: &Setup<'_>) -> Vec<Point> {
    let with = |phi: &str| {
        let value = format!("{{ kind = \"trapezoidal\", phi = {phi} }}");
        Point::of(format!("trapezoidal phi {phi}"), "particles.integrator", value)
    };
    if has_substeps(setup) { ["0.5", "1"].map(with).into() } else { Vec::new() }
}

fn substeps(setup: &Setup<'_>) -> Vec<Point> {
    let Some(own_s) = own_substep_s(setup) else { return Vec::new() };
    scaled(&[0.25, 0.5, 2.0, 3.0], "substep", |factor| verlet(own_s * factor))
}

fn spins(setup: &Setup<'_>) -> Vec<Point> {
    let rough = moving(setup).filter(|settings| settings.friction.is_some());
    let other = |settings: &Settings| Point::of(format!("spin {}", !settings.spin), "particles.spin", !settings.spin);
    rough.map(other).into_iter().collect()
}

fn skins(setup: &Setup<'_>) -> Vec<Point> {
    let skins = |_| setup.numbers("particles.skin", "skin", &[0.1, 0.3, 0.6, 1.0]);
    moving(setup).map(skins).unwrap_or_default()
}

/// Cut-offs of the near field: about the scene's own, or, where all pairs are summed, by the largest mean diameter.
fn cut_offs(setup: &Setup<'_>) -> Vec<Point> {
    let settings = setup.tables.main::<Settings>();
    let Some((settings, near)) = settings.and_then(|settings| Some((settings, settings.fields.near_field.as_ref()?)))
    else {
        return Vec::new();
    };
    let radius_m = settings.groups.iter().map(|group| group.radius.mean_m()).fold(0.0, f64::max);
    let cut_off = |label: String, cut_off_m: f64| {
        Point::of(format!("cut-off {label}"), "particles.near-field.cut-off", plain(cut_off_m))
    };
    match near.cutoff_m {
        Some(own_m) => [0.5, 2.0].map(|factor| cut_off(times(factor), own_m * factor)).into(),
        None if radius_m > 0.0 => [2.0, 4.0, 8.0]
            .map(|diameters| cut_off(format!("{diameters} diameters"), 2.0 * diameters * radius_m))
            .into(),
        None => Vec::new(),
    }
}
