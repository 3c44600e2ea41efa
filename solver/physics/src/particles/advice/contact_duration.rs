//! Contact duration over the step that integrates it.

use super::flight::speed_m_s;
use crate::{
    common::advice::{Advice, Edit, Effect, Facts, Number, Quantity, Verdict},
    particles::settings::{Integrator, Settings},
};

/// Steps to the shortest contact below which rebounds are wrong by more than a percent: the error of a Verlet collision falls
/// with the square of their number, and is 0.1 to 0.3 % at 25.
const ENOUGH: f64 = 10.0;
/// Steps beyond which more change nothing that a run of many impacts shows.
const PLENTY: f64 = 100.0;

/// Bound of the relative error of the speed after an impact at `steps` to the contact: measured, it is 0.6/n² to 2/n² for the
/// laws of this program without damping.
fn rebound_error(steps: f64) -> f64 {
    2.0 / (steps * steps)
}

/// The step of the particles' motion: t_c/Δt with t_c the duration of the shortest contact, from an impact of the
/// smallest particles at the highest speed there can be (Johnson 1985, section 11.4).
pub static CONTACT_DURATION: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let contact_s = facts.bodies.contact_s;
    let Some(settings) = facts.tables.main::<Settings>().filter(|_| contact_s.is_finite()) else { return Vec::new() };
    let Some(speed) = speed_m_s(facts, settings) else { return Vec::new() };
    let automatic_s = facts.bodies.substep_s;
    let (about, step_s) = match settings.integrator {
        Integrator::Held => return Vec::new(),
        Integrator::Trapezoidal { .. } => ("coupling.dt.limit", facts.coupling.dt.limit_s),
        Integrator::Verlet { substep_s } => {
            ("particles.integrator.substep", substep_s.unwrap_or(automatic_s).min(facts.coupling.dt.limit_s))
        }
    };
    let by_hand = !matches!(settings.integrator, Integrator::Verlet { substep_s: None });
    let steps = contact_s / step_s;
    let meaning = format!("shortest contact, {contact_s:.2e} s, over the step of the motion, {step_s:.2e} s");
    let effect = |share: f64| Effect { quantity: Quantity::ReboundSpeed, at_most: share * speed, share };
    let coarser = steps > PLENTY && by_hand && automatic_s > 2.0 * step_s;
    let (verdict, says) = if steps < ENOUGH && by_hand {
        (Verdict::Refine, format!("contacts are not resolved: {automatic_s:.2e} s has what they need"))
    } else if coarser {
        (Verdict::Suffices, format!("a coarser step does: {automatic_s:.2e} s resolves contact, damping and friction"))
    } else {
        (Verdict::Suffices, "contacts are resolved".to_owned())
    };
    let mut advice = Advice::new(about, "contact duration over step", steps, &meaning, verdict, says);
    if coarser {
        // Both ends of the change have an error.
        advice.effects = vec![effect(rebound_error(contact_s / automatic_s) + rebound_error(steps))];
    }
    if coarser || verdict == Verdict::Refine {
        advice.edits = match settings.integrator {
            Integrator::Trapezoidal { .. } => {
                // The first step is at most the largest, and must grow where it was that.
                let begins = facts.coupling.dt.start_s > automatic_s;
                let keys = ["coupling.dt.start", about].into_iter().skip(usize::from(!begins));
                keys.map(|key| Edit::set(key, format!("{automatic_s:.3e}"))).collect()
            }
            _ => vec![Edit::set("particles.integrator", "verlet")],
        };
    }
    vec![advice]
}
