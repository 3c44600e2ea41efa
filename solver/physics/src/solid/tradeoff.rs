//! Trade-offs of a solid: its cells, how a step is taken, the conductivity of a face.

use super::settings::{Level, Settings};
use crate::common::tradeoff::{Axis, Point, Set, Setup, Tradeoff, is_first_order, plain, scaled};

/// What a solid contributes to trade-offs.
pub static TRADEOFF: Tradeoff = Tradeoff {
    axes: &[
        Axis { name: "cells", points: |setup| scaled(&[0.5, 2.0, 4.0], "cells", |factor| cells(setup, factor)) },
        Axis { name: "solid-level", points: levels },
        Axis { name: "solid-phi", points: weights },
        Axis { name: "face-conductivity", points: faces },
    ],
    first_order: |setup| match setup.tables.main::<Settings>()?.level {
        Level::Implicit { phi } if !is_first_order(phi) => None,
        Level::Implicit { .. } => Some("the solid's weight phi is not 1/2"),
        Level::Explicit { .. } => Some("the solid's substeps are forward Euler's"),
    },
    advances: &["solid_temperature"],
    usual: &["mean solid_temperature", "peak solid_temperature"],
    ..Tradeoff::NONE
};

/// Cells so many times as wide as the scene's.
fn cells(setup: &Setup<'_>, factor: f64) -> Set {
    let Some(solid) = setup.tables.main::<Settings>() else { return Set::new() };
    let key = format!("grids.{}.cell", solid.grid.name);
    let Some(own) = setup.values.iter().find(|value| value.path == key) else { return Set::new() };
    let widths: Vec<String> = own.si.iter().map(|width_m| plain(width_m * factor)).collect();
    vec![(key, format!("[{}]", widths.join(", ")))]
}

fn levels(setup: &Setup<'_>) -> Vec<Point> {
    let relaxes = |solid: &Settings| solid.relaxation_s > 0.0;
    match setup.tables.main::<Settings>() {
        Some(solid) if !relaxes(solid) => setup.words("solid.level", &["implicit", "explicit"]),
        _ => Vec::new(),
    }
}

fn weights(setup: &Setup<'_>) -> Vec<Point> {
    match setup.tables.main::<Settings>().map(|solid| solid.level) {
        Some(Level::Implicit { .. }) => setup.numbers("solid.phi", "phi", &[0.5, 0.75, 1.0]),
        _ => Vec::new(),
    }
}

fn faces(setup: &Setup<'_>) -> Vec<Point> {
    let faces = |_| setup.words("solid.face-conductivity", &["harmonic", "arithmetic"]);
    setup.tables.main::<Settings>().map(faces).unwrap_or_default()
}
