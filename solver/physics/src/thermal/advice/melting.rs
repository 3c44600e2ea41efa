//! Energy of the light and of the current over what melting begins at.

use super::heat::all;
use crate::{
    common::advice::{Advice, Edit, Facts, Number, Verdict},
    thermal::settings::Enthalpy,
};

/// Phases: the enthalpy that particles can get, over that from the start to the solidus, (θ_max − θ_0)/(θ_s − θ_0)
/// with the temperature θ_max that the hottest particle would have without melting and without losing heat. From 1 on it
/// may melt; where the mean rise alone is that much, all does.
pub static MELTING: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some((thermal, heat)) = all(facts) else { return Vec::new() };
    let Some(hottest_k) = facts.hottest_without_phases_k(heat) else { return Vec::new() };
    let start_k = thermal.temperature_k;
    let known = facts.bodies.materials.iter().filter_map(|material| facts.solidus_k.get(material));
    let solidus_k = known.fold(f64::INFINITY, |least, own| least.min(*own));
    if !solidus_k.is_finite() || solidus_k <= start_k || hottest_k <= start_k {
        return Vec::new();
    }
    let value = (hottest_k - start_k) / (solidus_k - start_k);
    let [light_k, _] = facts.light_rise_k(heat);
    let surely = light_k > solidus_k - start_k;
    let phases = thermal.enthalpy.as_ref().is_some_and(Enthalpy::changes_phase);
    let verdict = match (phases, value >= 1.0) {
        (true, true) => Verdict::Keep,
        (true, false) => Verdict::Drop,
        (false, true) => Verdict::Add,
        (false, false) => Verdict::Suffices,
    };
    let says = match verdict {
        Verdict::Keep => "particles can melt".to_owned(),
        Verdict::Drop => format!("no particle gets from {start_k} K to its solidus, {solidus_k} K"),
        Verdict::Add if surely => format!("if the light is absorbed, the mean is above the solidus, {solidus_k} K"),
        Verdict::Add => format!("particles in the middle of the beam may reach {hottest_k:.0} K, above {solidus_k} K"),
        _ => format!("without phases: no particle gets to its solidus, {solidus_k} K"),
    };
    let meaning = "largest rise of temperature without melting over that to the solidus (a bound)";
    let mut advice = Advice::new("thermal.phases", "heat over heat to melt", value, meaning, verdict, says);
    match verdict {
        Verdict::Drop => {
            // The same equations, solved for the enthalpy or for the temperature: equal within the tolerances.
            let tolerance = facts.coupling.tolerance_of("temperature").max(thermal.tolerance);
            let change_k = 100.0 * tolerance * hottest_k;
            advice.effects = facts.temperatures(change_k, change_k);
            advice.edits = facts.without(&["thermal.phases"], &[]);
        }
        Verdict::Add => advice.edits = vec![Edit::set("thermal.phases", "{}")],
        _ => {}
    }
    vec![advice]
}
