//! Stokes number: how long a particle keeps its speed against the gas, over the time of the run.

use std::f64::consts::PI;

use stagger_coupling::math;

use super::flight::flight_s;
use crate::{
    common::advice::{Advice, Body, Edit, Effect, Facts, Number, Quantity, Verdict},
    particles::{
        model::ports::PUSH,
        settings::{Integrator, Settings},
    },
};

/// Viscosity of air at room temperature, in Pa s, for scenes that say nothing of a gas.
const AIR_PA_S: f64 = 1.8e-5;
/// Density of air, in kg/m³, for the Reynolds number.
const AIR_KG_M3: f64 = 1.2;
/// Density of a liquid, water, in kg/m³, for the same.
const LIQUID_KG_M3: f64 = 1000.0;
/// Viscosity above which what surrounds the particles counts as a liquid, in Pa s: gases stay below it, even hot.
const GAS_PA_S: f64 = 1e-4;
/// Reynolds number beyond which Stokes' law is told to be too little.
const STOKES_UP_TO: f64 = 5.0;
/// Reynolds number at which the boundary layer turns turbulent and drag falls (Chow 1980).
const DRAG_CRISIS: f64 = 3e5;

/// Relaxation time τ = m/(6π μ R) of a sphere in Stokes' drag, in s (Stokes 1851; Zohdi 2018, eq. 6.22).
#[must_use]
pub fn relaxation_s(mass_kg: f64, radius_m: f64, viscosity_pa_s: f64) -> f64 {
    mass_kg / (6.0 * PI * viscosity_pa_s * radius_m)
}

/// Drag coefficient C_D of a sphere at the Reynolds number `re` = 2 R ρ v/μ; positive (Chow 1980; Zohdi 2018, appendix E).
#[must_use]
pub fn drag_coefficient(re: f64) -> f64 {
    match re {
        _ if re <= 1.0 => 24.0 / re,
        _ if re <= 400.0 => 24.0 / math::powf(re, 0.646),
        _ if re <= DRAG_CRISIS => 0.5,
        _ if re <= 2e6 => 0.000_366 * math::powf(re, 0.4275),
        _ => 0.18,
    }
}

/// Largest drag over that of Stokes' law, C_D Re/24, at any Reynolds number up to `re`: 1 where that law holds.
#[must_use]
pub fn drag_over_stokes(re: f64) -> f64 {
    let at = |re: f64| drag_coefficient(re) * re / 24.0;
    // It grows but for the fall at the crisis.
    if re <= 1.0 { 1.0 } else { at(re).max(at(re.min(DRAG_CRISIS))) }
}

/// Drag: St = τ/t with t the time in which particles move: the run, or twice the longest fall.
///
/// A speed v loses at most v t/τ, and a place so changes by at most v t²/(2τ): the share 1/(2 St) of the way v t. Speeds are
/// bounded by the highest there can be without drag; a gas that streams adds its own. Where particles meet, the mean is not
/// known better than `BodyFacts::scatter_m`, which is in the bound, but not in the verdict.
///
/// The scene's drag is Stokes', and leaving it out changes what Stokes' law does. What a real gas or liquid does is C_D(Re)
/// Re/24 times that: τ of a scene without drag is of that law, and where it matters, but Stokes' part of it does not, no setting
/// covers it.
pub static STOKES: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let moving = |settings: &&Settings| settings.integrator != Integrator::Held;
    let Some(settings) = facts.tables.main::<Settings>().filter(moving) else { return Vec::new() };
    let t_s = flight_s(facts, settings);
    let viscosity_pa_s = settings.drag.map_or(AIR_PA_S, |drag| drag.viscosity_pa_s);
    let gas = settings.drag.map_or(0.0, |drag| drag.velocity_m_s.iter().map(|v| v * v).sum::<f64>().sqrt());
    // Attraction between particles moves no mean: the fields from outside do.
    let speed = facts.bodies.speed_m_s;
    let density_kg_m3 = if viscosity_pa_s < GAS_PA_S { AIR_KG_M3 } else { LIQUID_KG_M3 };
    let reynolds = |body: &Body| 2.0 * body.radius_m * density_kg_m3 * (speed + gas) / viscosity_pa_s;
    let stokes_s = |body: &Body| relaxation_s(body.mass_kg, body.radius_m, viscosity_pa_s);
    let real_s = |body: &Body| stokes_s(body) / drag_over_stokes(reynolds(body));
    let least = |of: &dyn Fn(&Body) -> f64| facts.bodies.each.iter().map(of).fold(f64::INFINITY, f64::min);
    let there = settings.drag.is_some();
    // Half of the share of a speed that is lost, by Stokes' law and by that of a real gas.
    let [stokes_s, real_s] = [least(&stokes_s), least(&real_s)];
    let lost = |fastest_s: f64| (0.5 * t_s / fastest_s).min(1.0);
    let fastest_s = if there { stokes_s } else { real_s };
    let (stokes, slowed) = (fastest_s / t_s, lost(fastest_s));
    let way_m = speed * t_s;
    let at_most = slowed * (way_m + gas * t_s) + facts.bodies.scatter_m();
    let share_of = |slowed: f64| if way_m > 0.0 { slowed * (1.0 + gas / speed) } else { slowed };
    let share = share_of(slowed);
    let small = share <= facts.within;
    // Stokes' law says that drag does not matter, and the law that holds says that it does.
    let beyond = share_of(lost(stokes_s)) <= facts.within && share_of(lost(real_s)) > facts.within;
    let reynolds = facts.bodies.each.iter().map(reynolds).fold(0.0, f64::max);
    let gas_is = if there { "the gas" } else { "air of 1.8e-5 Pa s" };
    // What sound or a magnet pushes depends on where each particle is: the least change grows, and no mean is bounded.
    let pushed = facts.written.contains(PUSH) || settings.fields.magnetic.is_some();
    let verdict = match (there, small) {
        _ if pushed => Verdict::Keep,
        _ if beyond => Verdict::Beyond,
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
        Verdict::Beyond => {
            format!(
                "{} by the law that holds at such speeds takes up to {slowed:.1e} of a speed; Stokes' law, the only one here, \
                 finds next to nothing",
                if there { "the gas" } else { "air" },
                slowed = 2.0 * lost(real_s)
            )
        }
        Verdict::Drop => "drag changes next to nothing in this time".into(),
        Verdict::Keep => "drag slows the particles".into(),
        Verdict::Suffices => "without drag: that of air would change next to nothing in this time".into(),
        _ => "air would slow the particles; in a vacuum leave it out".to_owned(),
    };
    // At a Reynolds number of 5 the drag is nearly twice Stokes' (Chow 1980).
    let says = if reynolds > STOKES_UP_TO {
        let medium = if viscosity_pa_s < GAS_PA_S { "air" } else { "a liquid like water" };
        format!(
            "{says}; in {medium} the Reynolds number may reach {reynolds:.0}, where drag is up to {:.1} times that of Stokes' \
             law, which is good up to 1",
            drag_over_stokes(reynolds)
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
    use super::{drag_coefficient, drag_over_stokes, relaxation_s};

    #[test]
    fn the_drag_law_joins_its_branches_and_bounds_what_lies_below() {
        assert!((drag_coefficient(0.01) - 2400.0).abs() < 1e-9);
        // Chow's branches meet within a percent but at the crisis, where drag falls from .5 to .080.
        for (at, jump) in [(1.0, 1.0), (400.0, 1.0), (3e5, 0.161), (2e6, 0.996)] {
            let ratio = drag_coefficient(at * (1.0 + 1e-9)) / drag_coefficient(at);
            assert!((ratio / jump - 1.0).abs() < 1e-2, "at {at}: {ratio}");
        }
        assert!((drag_over_stokes(0.3) - 1.0).abs() < 1e-15);
        // A baseball's 1e5: 0.5 · 1e5/24 times Stokes'.
        assert!((drag_over_stokes(1e5) / (0.5e5 / 24.0) - 1.0).abs() < 1e-12);
        // Beyond the crisis a sphere that slows down comes through it.
        assert!((drag_over_stokes(4e5) / (0.5 * 3e5 / 24.0) - 1.0).abs() < 1e-12);
        assert!((drag_over_stokes(1e7) / (0.18e7 / 24.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_sphere_of_steel_in_argon_stops_within_its_relaxation_time() {
        // 2 ρ R²/(9 μ) = 2 · 7950 · 6.25e-10/(9 · 2.2e-5) = 50.2 ms.
        let mass_kg = 7950.0 * 4.0 / 3.0 * std::f64::consts::PI * 25e-6f64.powi(3);
        let expected = 2.0 * 7950.0 * 25e-6f64.powi(2) / (9.0 * 2.2e-5);
        assert!((relaxation_s(mass_kg, 25e-6, 2.2e-5) / expected - 1.0).abs() < 1e-14);
    }
}
