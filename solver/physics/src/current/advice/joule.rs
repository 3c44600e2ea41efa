//! Joule heat over the heat of the particles.

use crate::{
    common::advice::{Advice, Facts, Number, Verdict},
    current::{NODE, settings::Settings},
};

/// The current: the rise a J² t/(σ ρ C) by Joule heat over the temperature at the start (Zohdi 2018, eq. 8.6), or that
/// of the most power that the contacts with the electrodes let through between their potentials.
pub static JOULE: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(current) = facts.tables.main::<Settings>() else { return Vec::new() };
    let Some(heat) = &facts.heat else {
        let says = "Joule heat warms nothing: without [thermal] the current alone is found";
        let meaning = "physics of the scene that take the heat up";
        return vec![Advice::new(NODE, "readers of the heat", 0.0, meaning, Verdict::Keep, says.into())];
    };
    let number = "Joule heating";
    let meaning = "rise of temperature by Joule heat over the temperature at the start (a bound)";
    let Some([mean_k, peak_k]) = facts.heating_rise_k(heat) else {
        let says = "the resistance between electrodes of set current, or of a bed that is pressed, is not known before the run";
        return vec![Advice::new(NODE, number, f64::INFINITY, meaning, Verdict::Keep, says.into())];
    };
    let start_k = heat.start_k;
    let small = facts.is_small(heat, [mean_k, peak_k]);
    let verdict = if small { Verdict::Drop } else { Verdict::Keep };
    let on_s = current.ends_s.min(facts.duration_s) - current.starts_s;
    let says = if on_s <= 0.0 {
        "no wall is electrified during the run".to_owned()
    } else if small {
        "the current warms nothing noticeably".to_owned()
    } else {
        format!("the current warms the particles, by up to {:.3e} K/s", mean_k / on_s)
    };
    let mut advice = Advice::new(NODE, number, mean_k / start_k, meaning, verdict, says);
    advice.effects = facts.temperatures(mean_k, peak_k);
    if small {
        advice.edits = facts.without(&[NODE], &["joule_power"]);
    }
    vec![advice]
}
