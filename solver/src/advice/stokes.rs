//! Stokes number: how long a particle keeps its speed against the gas, over the time of the run.

use std::f64::consts::PI;

use super::{
    Advice, Edit, Effect, Quantity, Verdict,
    facts::{Body, Facts},
};
use crate::physics::particles::Integrator;

/// Viscosity of air at room temperature, in Pa s, for scenes that say nothing of a gas.
const AIR_PA_S: f64 = 1.8e-5;
/// Density of air, in kg/m³, for the Reynolds number.
const AIR_KG_M3: f64 = 1.2;

/// Relaxation time τ = m/(6π μ R) of a sphere in Stokes' drag, in s (Stokes 1851; Zohdi 2018, eq. 6.22).
#[must_use]
pub fn relaxation_s(mass_kg: f64, radius_m: f64, viscosity_pa_s: f64) -> f64 {
    mass_kg / (6.0 * PI * viscosity_pa_s * radius_m)
}

/// Advice on drag: St = τ/t with t the time in which particles move: the run, or twice the longest fall.
///
/// A speed v loses at most v t/τ, and a place so changes by at most v t²/(2τ): the share 1/(2 St) of the way v t. Speeds are
/// bounded by the highest there can be without drag; a gas that streams adds its own. Where particles meet, the mean is not
/// known better than `Facts::scatter_m`, which is in the bound, but not in the verdict.
pub(super) fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    if matches!(facts.settings.integrator, Integrator::Held) {
        return Vec::new();
    }
    let t_s = facts.flight_s();
    let viscosity_pa_s = facts.settings.drag.map_or(AIR_PA_S, |drag| drag.viscosity_pa_s);
    let of = |body: &Body| relaxation_s(body.mass_kg, body.radius_m, viscosity_pa_s);
    let fastest_s = facts.bodies.iter().map(of).fold(f64::INFINITY, f64::min);
    let stokes = fastest_s / t_s;
    let gas = facts.settings.drag.map_or(0.0, |drag| drag.velocity_m_s.iter().map(|v| v * v).sum::<f64>().sqrt());
    let slowed = (0.5 / stokes).min(1.0);
    // Attraction between particles moves no mean: the fields from outside do.
    let speed = facts.expectation.speed_m_s;
    let way_m = speed * t_s;
    let at_most = slowed * (way_m + gas * t_s) + facts.scatter_m();
    let share = if way_m > 0.0 { slowed * (1.0 + gas / speed) } else { slowed };
    let reynolds = 2.0 * facts.largest_m() * AIR_KG_M3 * (speed + gas) / viscosity_pa_s;
    let (there, small) = (facts.settings.drag.is_some(), share <= facts.within);
    let gas_is = if there { "the gas" } else { "air of 1.8e-5 Pa s" };
    // What sound or a magnet pushes depends on where each particle is: the least change grows, and no mean is bounded.
    let pushed = facts.settings.fields.reads_acoustic_force || facts.settings.fields.magnetic.is_some();
    let verdict = match (there, small) {
        _ if pushed => Verdict::Keep,
        (true, true) => Verdict::Drop,
        (true, false) => Verdict::Keep,
        (false, true) => Verdict::Suffices,
        (false, false) => Verdict::Add,
    };
    let says = match verdict {
        _ if pushed => {
            format!(
                "drag takes some {slowed:.1e} of a speed, but the push of sound or of a magnet hangs on where each one is"
            )
        }
        Verdict::Drop => "drag changes next to nothing in this time".into(),
        Verdict::Keep => "drag slows the particles".into(),
        Verdict::Suffices => "without drag: that of air would change next to nothing in this time".into(),
        _ => "air would slow the particles; in a vacuum leave it out".to_owned(),
    };
    // At a Reynolds number of 5 the drag is nearly twice Stokes' (Chow 1980).
    let says = if viscosity_pa_s < 1e-4 && reynolds > 5.0 {
        format!(
            "{says}; in air the Reynolds number may reach {reynolds:.0}, and Stokes' law, good up to 1, is too little drag"
        )
    } else {
        says
    };
    let meaning = format!(
        "time in which {gas_is} stops the lightest particle, {fastest_s:.2e} s, over that in which they move, {t_s:.2e} s"
    );
    let mut advice = Advice::new("particles.drag", "Stokes number", stokes, &meaning, verdict, says);
    if !pushed {
        let share = if way_m > 0.0 { at_most / way_m } else { share };
        advice.effects = vec![Effect { quantity: Quantity::MeanPosition, at_most, share }];
    }
    match verdict {
        Verdict::Drop => advice.edits = vec![Edit::set("particles.drag", "none")],
        Verdict::Add => advice.edits = vec![Edit::set("particles.drag", "{ viscosity = \"1.8e-5 Pa s\" }")],
        _ => {}
    }
    vec![advice]
}

#[cfg(test)]
mod tests {
    use super::relaxation_s;

    #[test]
    fn a_sphere_of_steel_in_argon_stops_within_its_relaxation_time() {
        // 2 ρ R²/(9 μ) = 2 · 7950 · 6.25e-10/(9 · 2.2e-5) = 50.2 ms.
        let mass_kg = 7950.0 * 4.0 / 3.0 * std::f64::consts::PI * 25e-6f64.powi(3);
        let expected = 2.0 * 7950.0 * 25e-6f64.powi(2) / (9.0 * 2.2e-5);
        assert!((relaxation_s(mass_kg, 25e-6, 2.2e-5) / expected - 1.0).abs() < 1e-14);
    }
}
