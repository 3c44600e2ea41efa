//! The way of a beam's spot, and the time of its pulses, over the step.

use super::{Advice, BeamFacts, Facts, Number, Verdict};
use crate::common::beam::Path;

/// Share of the radius within which half of the power lies that the spot may go in a step.
///
/// What a particle takes in a step is the mean of the steps' ends, so that a pass is a sum over instants: of a Gaussian
/// it is exact to 1e-6 at the whole of that radius, of a top hat to a ninth at half of it. The temperature follows the light in
/// time, and its peak, the boiling of a particle above all, needs the step to be part of the pass.
const MOST: f64 = 0.5;
/// The share that the edit sets.
const GOOD: f64 = 0.25;
/// Steps to a pulse that the edit sets.
const STEPS: f64 = 4.0;

/// A beam that is on in the run.
struct Sweeping<'f> {
    beam: &'f BeamFacts<'f>,
    /// Shortest time that it is on, in s.
    on_s: f64,
    /// Longest step that there can be while it is on, in s.
    step_s: f64,
}

/// The longest step: v Δt/r of the spot that goes furthest, with r the radius within which half of the power lies, and
/// Δt over the shortest time that a beam is on.
pub static MOVING_SPOT: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let spots = facts.beams.iter().map(|beam| sweeping(facts, beam));
    let spots: Vec<Sweeping<'_>> = spots.filter(|spot| spot.on_s > 0.0).collect();
    let share_of = |spot: &Sweeping<'_>| match *spot.beam.path {
        Path::Sweep { speed_m_s, .. } => speed_m_s * spot.step_s / spot.beam.radius_m,
        Path::Fixed { .. } => 0.0,
    };
    let fastest = spots.iter().max_by(|a, b| share_of(a).total_cmp(&share_of(b)));
    let over = |spot: &Sweeping<'_>| spot.step_s / spot.on_s;
    let shortest = spots.iter().max_by(|a, b| over(a).total_cmp(&over(b))).filter(|spot| over(spot) > 1.0);
    let share = fastest.map_or(0.0, share_of);
    // One step that serves all of them.
    let for_way_s = fastest.filter(|_| share > MOST).map_or(f64::INFINITY, |spot| GOOD / share * spot.step_s);
    let step_s = shortest.map_or(f64::INFINITY, |spot| spot.on_s / STEPS).min(for_way_s);
    let mut all = Vec::new();
    if let Some(spot) = fastest.filter(|_| share > 0.0) {
        let meaning = format!(
            "way of the spot of [{}] in the longest step, {:.2e} m, over the radius within which half of the power lies, {:.2e} m",
            spot.beam.table,
            share * spot.beam.radius_m,
            spot.beam.radius_m
        );
        let number = "way of the spot over its radius";
        let mut advice = if share <= MOST {
            let says = "steps follow the spot".to_owned();
            Advice::new("coupling.dt.limit", number, share, &meaning, Verdict::Suffices, says)
        } else {
            let says = format!(
                "the spot passes a particle within {:.1} steps: peak temperatures depend on the step, and what a particle takes \
                 on where steps end; {step_s:.2e} s follows it",
                2.0 / share
            );
            Advice::new("coupling.dt.limit", number, share, &meaning, Verdict::Refine, says)
        };
        if advice.verdict == Verdict::Refine {
            advice.edits = facts.steps(step_s);
        }
        all.push(advice);
    }
    if let Some(spot) = shortest {
        let meaning = format!(
            "longest step, {:.2e} s, over the time that [{}] is on at once, {:.2e} s",
            spot.step_s, spot.beam.table, spot.on_s
        );
        let says = format!(
            "a step takes the mean of the power: the energy is right, but a pulse heats as if it lasted the whole step, and its \
             peak is lost; {step_s:.2e} s follows it"
        );
        let mut advice =
            Advice::new("coupling.dt.limit", "step over pulse", over(spot), &meaning, Verdict::Refine, says);
        advice.edits = facts.steps(step_s);
        all.push(advice);
    }
    all
}

/// How long a beam is on, and the steps meanwhile.
fn sweeping<'f>(facts: &'f Facts<'_>, beam: &'f BeamFacts<'f>) -> Sweeping<'f> {
    let (dt, ends_s) = (&facts.coupling.dt, beam.ends_s.min(facts.duration_s));
    let on_s = (ends_s - beam.starts_s).min(beam.pulses.map_or(f64::INFINITY, |pulses| pulses.on_s));
    // Steps that grow by a factor have grown by that less one of the time passed.
    let step_s = dt.limit_s.min(dt.start_s + (dt.growth - 1.0) * ends_s).min(facts.duration_s);
    Sweeping { beam, on_s, step_s }
}
