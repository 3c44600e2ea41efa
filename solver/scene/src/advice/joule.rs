//! Joule heat over the heat of the particles.

use stagger_physics::current::Settings;

use super::{Advice, Verdict, facts::Facts};

/// Advice on the current: the rise a J² t/(σ ρ C) by Joule heat over the temperature at the start (Zohdi 2018, eq. 8.6), or that
/// of the most power that the contacts with the electrodes let through between their potentials.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(current) = facts.scene.settings::<Settings>() else { return Vec::new() };
    let Some(thermal) = facts.thermal else {
        let says = "Joule heat warms nothing: without [thermal] the current alone is found";
        let meaning = "physics of the scene that take the heat up";
        return vec![Advice::new("current", "readers of the heat", 0.0, meaning, Verdict::Keep, says.into())];
    };
    let number = "Joule heating";
    let meaning = "rise of temperature by Joule heat over the temperature at the start (a bound)";
    let Some([mean_k, peak_k]) = facts.joule_rise_k(thermal) else {
        let says = "the resistance between electrodes of set current, or of a bed that is pressed, is not known before the run";
        return vec![Advice::new("current", number, f64::INFINITY, meaning, Verdict::Keep, says.into())];
    };
    let start_k = thermal.temperature_k;
    let small = mean_k <= facts.within * start_k && peak_k <= super::fourier::PEAK_OVER_MEAN * facts.within * start_k;
    let verdict = if small { Verdict::Drop } else { Verdict::Keep };
    let on_s = current.ends_s.min(facts.duration_s()) - current.starts_s;
    let says = if on_s <= 0.0 {
        "no wall is electrified during the run".to_owned()
    } else if small {
        "the current warms nothing noticeably".to_owned()
    } else {
        format!("the current warms the particles, by up to {:.3e} K/s", mean_k / on_s)
    };
    let mut advice = Advice::new("current", number, mean_k / start_k, meaning, verdict, says);
    advice.effects = facts.temperatures(mean_k, peak_k);
    if small {
        advice.edits = facts.without(&["current"], &["joule_power"]);
    }
    vec![advice]
}
