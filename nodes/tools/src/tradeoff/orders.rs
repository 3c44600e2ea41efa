//! Order of accuracy over Δt: differences between runs whose steps are halved again and again.

use std::sync::atomic::AtomicBool;

use serde::Serialize;
use stagger_coupling::math;
use stagger_scene::Scene;

use super::{
    Failed, Workshop,
    axis::{self, Set},
    quantity::{Ends, Quantity},
    table::share,
};

/// Orders measured.
#[derive(Clone, Debug, Serialize)]
pub struct Orders {
    /// Steps, in s, from large to small.
    pub dt_s: Vec<f64>,
    /// By quantity.
    pub rows: Vec<Row>,
    /// The order to expect, and why.
    pub expected: f64,
    /// What limits it.
    pub because: String,
}

/// A quantity over the steps.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub quantity: String,
    /// Difference of each run to the one with half its step, as a share of how far the quantity came.
    pub differences: Vec<Option<f64>>,
    /// log₂ of each difference over the next.
    pub orders: Vec<Option<f64>>,
}

/// The order that the methods of a scene have, and the one that limits it.
fn expected(scene: &Scene) -> (f64, &'static str) {
    if !scene.coupling.interpolate {
        return (1.0, "frozen fields are held over a step");
    }
    let setup = axis::setup(scene, None);
    match axis::contributions().find_map(|own| (own.first_order)(&setup)) {
        Some(because) => (1.0, because),
        None => (
            2.0,
            "all methods are of second order; contacts that begin or end within a step, and light that is switched, make it less",
        ),
    }
}

/// Measures the order with `levels` runs, the first with steps of `dt_s`, each other with half the step of the one before.
/// The step does not adapt, tolerances are far below the differences, and substeps shrink with the step.
///
/// # Errors
/// A run has no result, or a file cannot be read or written.
pub fn orders(
    scene: &Scene,
    workshop: &Workshop,
    quantities: &[Quantity],
    (dt_s, levels): (f64, u32),
    interrupted: &AtomicBool,
    tell: &mut dyn FnMut(&str),
) -> Result<Orders, Failed> {
    let mut setup = axis::setup(scene, None);
    let has_substeps = axis::contributions().any(|own| (own.has_substeps)(&setup));
    let mut runs: Vec<(Ends, f64)> = Vec::new();
    for level in 0..levels {
        let dt_s = dt_s / f64::from(1u32 << level.min(31));
        let mut set: Set = vec![(
            "coupling.dt".into(),
            format!("{{ start = {dt_s:e}, limit = {dt_s:e}, minimum = {:e} }}", 1e-3 * dt_s),
        )];
        set.extend(axis::tolerances(scene, 1e-4));
        set.push(("coupling.iterations".into(), "60".into()));
        set.push(("coupling.reuse".into(), "0".into()));
        if has_substeps && setup.substep_s.is_none() {
            setup.substep_s = workshop.outcome(&set, None, interrupted)?.0.substep_s;
        }
        // A hair more, so that rounding does not add a substep.
        let factor = (1.0 + 1e-9) / f64::from(1u32 << level.min(31));
        set.extend(axis::contributions().flat_map(|own| (own.in_series)(&setup, factor)));
        tell(&format!("dt = {dt_s:e} s"));
        let (outcome, recording) = workshop.outcome(&set, None, interrupted)?;
        let hint = "a smaller first step may help: --dt";
        if let Some(why) = outcome.failed {
            return Err(Failed::Base { what: "a run of the series", why, hint });
        }
        let empty = || Failed::Base { what: "a run of the series", why: "its recording holds no state".into(), hint };
        let ends = recording.map(|path| Ends::of(&path)).transpose()?.flatten();
        runs.push((ends.ok_or_else(empty)?, dt_s));
    }
    let (expected, because) = expected(scene);
    let row = |quantity: &Quantity| {
        let differences: Vec<Option<f64>> = runs.windows(2).map(|pair| pair[0].0.error(quantity, &pair[1].0)).collect();
        let orders =
            differences.windows(2).map(|pair| Some(order(pair[0]?, pair[1]?)).filter(|order| order.is_finite()));
        Row { quantity: quantity.to_string(), orders: orders.collect(), differences }
    };
    let orders = Orders {
        dt_s: runs.iter().map(|(_, dt_s)| *dt_s).collect(),
        rows: quantities.iter().map(row).collect(),
        expected,
        because: because.into(),
    };
    tell(&text(&orders));
    Ok(orders)
}

fn order(coarse: f64, fine: f64) -> f64 {
    math::log2(coarse / fine)
}

fn text(orders: &Orders) -> String {
    let mut text =
        String::from("difference of each run to the one with half its step, and the order between the brackets\n");
    for row in &orders.rows {
        text += &format!("{:<28}", row.quantity);
        for (place, difference) in row.differences.iter().enumerate() {
            if let Some(order) = place.checked_sub(1).and_then(|place| row.orders.get(place)) {
                text += &format!(" [{}]", order.map_or("?".into(), |order| format!("{order:.2}")));
            }
            text += &format!(" {:>9}", share(difference.unwrap_or(f64::INFINITY)));
        }
        text.push('\n');
    }
    text + &format!("expected {}: {}", orders.expected, orders.because)
}
