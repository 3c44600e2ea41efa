//! Trade-offs of the temperature: the weight of a window's end, and how its equations are solved.

use super::settings::Settings;
use crate::common::tradeoff::{Axis, Point, Setup, Tradeoff, is_first_order};

/// What the temperature contributes to trade-offs.
pub static TRADEOFF: Tradeoff = Tradeoff {
    axes: &[Axis { name: "phi", points: weights }, Axis { name: "heat-solver", points: solvers }],
    first_order: |setup| {
        let thermal = setup.tables.main::<Settings>()?;
        is_first_order(thermal.phi).then_some("thermal's weight phi is not 1/2")
    },
    advances: &["temperature"],
    usual: &["mean temperature", "peak temperature"],
    ..Tradeoff::NONE
};

fn weights(setup: &Setup<'_>) -> Vec<Point> {
    let weights = |_| setup.numbers("thermal.phi", "phi", &[0.0, 0.5, 1.0]);
    setup.tables.main::<Settings>().map(weights).unwrap_or_default()
}

fn solvers(setup: &Setup<'_>) -> Vec<Point> {
    let solvers = |_| setup.words("thermal.solver", &["fixed-point", "conjugate-gradient"]);
    setup.tables.main::<Settings>().map(solvers).unwrap_or_default()
}
