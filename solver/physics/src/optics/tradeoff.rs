//! Trade-offs of light: its fidelity, and how finely it is sampled.

use super::settings::{Model, Settings};
use crate::common::tradeoff::{Axis, Point, Set, Setup, Tradeoff, plain, scaled, set};

/// What a laser contributes to trade-offs.
pub static TRADEOFF: Tradeoff = Tradeoff {
    axes: &[
        Axis { name: "fidelity", points: fidelities },
        Axis { name: "light", points: |setup| scaled(&[0.25, 0.5, 2.0], "light", |factor| finer(setup, factor)) },
    ],
    tighter: |setup, factor| finer(setup, factor.sqrt()),
    first_order: |setup| {
        let pulses = setup.tables.main::<Settings>()?.beam.pulses;
        pulses.map(|_| "pulses of light begin and end within a step")
    },
    usual: &["energy absorbed"],
    words: &[("absorbed energy", "energy absorbed")],
    ..Tradeoff::NONE
};

fn fidelities(setup: &Setup<'_>) -> Vec<Point> {
    let words = ["energy-balance", "beer-lambert", "beer-lambert-monograph", "rays"];
    setup.tables.main::<Settings>().map(|_| setup.words("optics.fidelity", &words)).unwrap_or_default()
}

/// Sampling of the light, `factor` times as fine.
fn finer(setup: &Setup<'_>, factor: f64) -> Set {
    match setup.tables.main::<Settings>().map(|optics| optics.model) {
        Some(Model::BeerLambert { spacing_m, .. }) => vec![set("optics.spacing", plain(spacing_m / factor))],
        // As many times more rays as there would be lines.
        Some(Model::Rays { sampling, .. }) => {
            let count = (sampling.count as f64 * factor * factor).round().clamp(1.0, 16_777_216.0);
            vec![set("optics.rays.count", count as u64)]
        }
        _ => Set::new(),
    }
}
