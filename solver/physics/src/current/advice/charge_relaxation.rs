//! Charge relaxation over the step: whether a steady current is found in each step.

use crate::{
    common::advice::{Advice, Facts, Number, Verdict},
    current::{NODE, settings::Settings},
};

/// Permittivity of vacuum ε₀, in F/m (CODATA 2018).
const VACUUM_F_M: f64 = 8.854_187_812_8e-12;
/// Relaxation over step below which the current follows at once.
const STEADY: f64 = 0.1;

/// Time ε₀/σ in which charge inside a conductor of σ in S/m flows off, in s (Zohdi 2018, section 8.8); with a relative
/// permittivity as many times longer.
#[must_use]
pub fn charge_relaxation_s(conductivity_s_m: f64) -> f64 {
    VACUUM_F_M / conductivity_s_m
}

/// The steady current: ε₀/(σ Δt), with the first step, which the step control starts from, and the least σ.
pub static CHARGE_RELAXATION: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some(current) = facts.tables.main::<Settings>() else { return Vec::new() };
    let [least, _] = current.conductivity.range_s_m();
    let dt_s = facts.coupling.dt.start_s;
    if least <= 0.0 {
        return Vec::new();
    }
    let value = charge_relaxation_s(least) / dt_s;
    let steady = value <= STEADY;
    let verdict = if steady { Verdict::Suffices } else { Verdict::Beyond };
    let says = if steady {
        "a steady current in each step suffices"
    } else {
        "charge does not settle within a step: currents are those of a later time; this program knows no displacement current"
    };
    let meaning =
        format!("time in which charge settles, epsilon_0/sigma = {:.1e} s, over the first step", value * dt_s);
    vec![Advice::new(NODE, "charge relaxation over step", value, &meaning, verdict, says.into())]
}

#[cfg(test)]
mod tests {
    use super::charge_relaxation_s;

    #[test]
    fn charge_leaves_copper_at_once_and_glass_never() {
        // 8.854e-12/5.96e7 and 8.854e-12/1e-12.
        assert!((charge_relaxation_s(5.96e7) - 1.4856e-19).abs() < 1e-23);
        assert!((charge_relaxation_s(1e-12) - 8.854).abs() < 1e-3);
    }
}
