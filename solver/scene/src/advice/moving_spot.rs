//! The way of a beam's spot, and the time of its pulses, over the step.

use super::{Advice, Edit, Verdict, facts::Facts};
use stagger_physics::{acoustics::Settings, common::beam::Path, optics::Pulses};

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

/// A beam that moves or pulses, of light or of sound.
struct Sweeping<'s> {
    table: String,
    radius_m: f64,
    path: &'s Path,
    /// Shortest time that it is on, in s.
    on_s: f64,
    /// Longest step that there can be while it is on, in s.
    step_s: f64,
}

/// Advice on the longest step: v Δt/r of the spot that goes furthest, with r the radius within which half of the power lies, and
/// Δt over the shortest time that a beam is on.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let beams = beams(facts);
    let share_of = |beam: &Sweeping<'_>| match *beam.path {
        Path::Sweep { speed_m_s, .. } => speed_m_s * beam.step_s / beam.radius_m,
        Path::Fixed { .. } => 0.0,
    };
    let fastest = beams.iter().max_by(|a, b| share_of(a).total_cmp(&share_of(b)));
    let over = |beam: &Sweeping<'_>| beam.step_s / beam.on_s;
    let shortest = beams.iter().max_by(|a, b| over(a).total_cmp(&over(b))).filter(|beam| over(beam) > 1.0);
    let share = fastest.map_or(0.0, share_of);
    // One step that serves all of them.
    let for_way_s = fastest.filter(|_| share > MOST).map_or(f64::INFINITY, |beam| GOOD / share * beam.step_s);
    let step_s = shortest.map_or(f64::INFINITY, |beam| beam.on_s / STEPS).min(for_way_s);
    let mut all = Vec::new();
    if let Some(beam) = fastest.filter(|_| share > 0.0) {
        let meaning = format!(
            "way of the spot of [{}] in the longest step, {:.2e} m, over the radius within which half of the power lies, {:.2e} m",
            beam.table,
            share * beam.radius_m,
            beam.radius_m
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
            advice.edits = steps(facts, step_s);
        }
        all.push(advice);
    }
    if let Some(beam) = shortest {
        let meaning = format!(
            "longest step, {:.2e} s, over the time that [{}] is on at once, {:.2e} s",
            beam.step_s, beam.table, beam.on_s
        );
        let says = format!(
            "a step takes the mean of the power: the energy is right, but a pulse heats as if it lasted the whole step, and its \
             peak is lost; {step_s:.2e} s follows it"
        );
        let mut advice =
            Advice::new("coupling.dt.limit", "step over pulse", over(beam), &meaning, Verdict::Refine, says);
        advice.edits = steps(facts, step_s);
        all.push(advice);
    }
    all
}

/// The beams that are on in the run.
fn beams<'f>(facts: &'f Facts<'_>) -> Vec<Sweeping<'f>> {
    let (dt, duration_s) = (&facts.scene.coupling.dt, facts.duration_s());
    let of = |table: String, radius_m: f64, path: &'f Path, starts_s: f64, ends_s: f64, pulses: Option<Pulses>| {
        let ends_s = ends_s.min(duration_s);
        let on_s = (ends_s - starts_s).min(pulses.map_or(f64::INFINITY, |pulses| pulses.on_s));
        // Steps that grow by a factor have grown by that less one of the time passed.
        let step_s = dt.limit_s.min(dt.start_s + (dt.growth - 1.0) * ends_s).min(duration_s);
        Sweeping { table, radius_m, path, on_s, step_s }
    };
    let lasers = facts.lasers.iter().filter(|laser| laser.energy_j > 0.0).map(|laser| {
        let beam = &laser.settings.beam;
        of(laser.table.clone(), beam.profile.quantile_m(0.5), &beam.path, beam.starts_s, beam.ends_s, beam.pulses)
    });
    let sound = facts.scene.settings::<Settings>().into_iter().map(|acoustics| {
        let beam = &acoustics.beam;
        // Of the same intensity all over: half of the power lies within 1/sqrt 2 of the radius.
        let radius_m = beam.radius_m * 0.5f64.sqrt();
        of("acoustics".into(), radius_m, &beam.path, beam.starts_s, beam.ends_s, beam.pulses)
    });
    lasers.chain(sound).filter(|beam| beam.on_s > 0.0).collect()
}

/// A longest step; the first one is at most that.
pub(super) fn steps(facts: &Facts<'_>, step_s: f64) -> Vec<Edit> {
    let (dt, value) = (&facts.scene.coupling.dt, format!("{step_s:.3e}"));
    // A step that does not grow is a single time in most scenes.
    if dt.start_s >= dt.limit_s {
        return vec![Edit::set("coupling.dt", value)];
    }
    let begins = dt.start_s > step_s;
    let keys = ["coupling.dt.start", "coupling.dt.limit"].into_iter().skip(usize::from(!begins));
    keys.map(|key| Edit::set(key, value.clone())).collect()
}
