//! Biot number: whether one temperature for a particle is enough.

use std::f64::consts::PI;

use stagger_coupling::math;

use super::heat::all;
use crate::{
    common::{
        advice::{Advice, Body, Facts, HeatFacts, LightFacts, Number, Verdict},
        radiation::STEFAN_BOLTZMANN_W_M2_K4,
    },
    thermal::NODE,
};

/// Biot number below which a body counts as isothermal (Incropera & DeWitt, Fundamentals of Heat and Mass Transfer,
/// section 5.2).
const LUMPED: f64 = 0.1;

/// Bound of what lumping changes the temperature of a sphere by, as a share of its difference from its surroundings, at
/// Bi = h R/(3 K).
///
/// The slowest mode of a sphere decays at 3 Bi' (1 − Bi'/5) α/R² with Bi' = h R/K, the lumped one at 3 Bi' α/R²: a rate
/// smaller by the share 3 Bi/5, which moves e^{−x} by at most 3 Bi/(5 e) = 0.22 Bi. With the faster modes 0.25 Bi holds
/// while Bi is below 0.1.
#[must_use]
pub fn lumped_error(biot: f64) -> f64 {
    0.25 * biot
}

/// Lumped temperatures, from what heats or cools a particle from one side or all round: the surroundings, and the
/// light, which leaves a difference of I q R/K across it.
pub static BIOT: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let Some((thermal, heat)) = all(facts) else { return Vec::new() };
    let [least, _] = heat.conductivity_w_m_k;
    let largest_m = facts.bodies.largest_m();
    let mut all = vec![contacts(facts, heat)];
    if let Some(ambient) = thermal.enthalpy.as_ref().and_then(|enthalpy| enthalpy.ambient)
        && let Some(hottest_k) = facts.hottest_k(heat)
    {
        // Radiation, linearised where it is strongest.
        let transfer =
            ambient.convection_w_m2_k + ambient.emissivity * 4.0 * STEFAN_BOLTZMANN_W_M2_K4 * math::powi(hottest_k, 3);
        let biot = if least > 0.0 { transfer * largest_m / (3.0 * least) } else { f64::INFINITY };
        let meaning = "resistance inside a particle over that to the surroundings, h R/(3 K)";
        let fits = biot <= LUMPED;
        let verdict = if fits { Verdict::Suffices } else { Verdict::Beyond };
        let says = if fits {
            "one temperature for a particle suffices"
        } else {
            "a particle is warmer inside than outside; its one temperature is a mean, and it cools more slowly than said"
        };
        let mut advice = Advice::new(NODE, "Biot number", biot, meaning, verdict, says.into());
        if fits {
            let change_k = lumped_error(biot) * (hottest_k - ambient.temperature_k).abs();
            advice.effects = facts.temperatures(change_k, change_k);
        }
        all.push(advice);
    }
    let lit = facts.lights.iter().map(|light| lit_difference_k(facts, light, heat)).fold(0.0, f64::max);
    if let Some(hottest_k) = facts.hottest_k(heat).filter(|_| lit > 0.0) {
        let lit = lit.min(hottest_k - thermal.temperature_k);
        let value = lit / hottest_k;
        let fits = value <= LUMPED;
        let verdict = if fits { Verdict::Suffices } else { Verdict::Beyond };
        let says = if fits {
            format!("one temperature for a particle suffices: its lit side is at most {lit:.0} K warmer than the other")
        } else {
            format!(
                "the lit side of a particle may be {lit:.0} K warmer than the other, which its one temperature, the mean, \
                 does not show"
            )
        };
        let meaning = "difference across a lit particle, I q R/K, over the highest temperature (a bound)";
        all.push(Advice::new(NODE, "Biot number of the light", value, meaning, verdict, says));
    }
    all
}

/// Advice on contacts: Bi = G/(K R), the conductance of a contact over that of the particle behind it, as the run's own figure
/// `largest Biot number`.
fn contacts(facts: &Facts<'_>, heat: &HeatFacts) -> Advice {
    let floor = facts.bodies.on_floor();
    let hottest_k = facts.hottest_k(heat).unwrap_or(f64::INFINITY);
    let [least, most] = heat.conductivity_w_m_k;
    let one_w_k = facts.contact_conductance_w_k(heat, floor, hottest_k);
    let meaning = "conductance of a contact over that of the particle behind it, G/(K R), at the mean force";
    let Some(one_w_k) = one_w_k.filter(|_| most > 0.0) else {
        let says = "how hard particles are pressed is not known before the run; its figure `largest Biot number` tells";
        return Advice::new(NODE, "Biot number of contacts", f64::INFINITY, meaning, Verdict::Keep, says.into());
    };
    let biot = one_w_k / (least.max(most * f64::EPSILON) * facts.bodies.largest_m());
    let fits = biot <= LUMPED;
    let verdict = if fits { Verdict::Suffices } else { Verdict::Beyond };
    let says = if fits {
        "one temperature for a particle suffices"
    } else {
        "heat passes contacts as easily as particles: their temperature varies inside, which no fidelity here computes"
    };
    Advice::new(NODE, "Biot number of contacts", biot, meaning, verdict, says.into())
}

/// Bound of the difference in K across a particle in the middle of the beam: I q R/K where it has settled, at most the rise
/// 2 I q √(t/(π K ρ C)) of a surface lit for t (Carslaw & Jaeger 1959, section 2.9).
fn lit_difference_k(facts: &Facts<'_>, light: &LightFacts, heat: &HeatFacts) -> f64 {
    let [least, _] = heat.conductivity_w_m_k;
    let lit_s = light.pulse_s.min(light.dwell_s);
    let one = |(body, share): (&Body, &f64)| {
        let taken_w_m2 = light.middle_w_m2 * share.min(1.0);
        let density = body.mass_kg / (4.0 / 3.0 * PI * math::powi(body.radius_m, 3));
        let brief = 2.0 * (lit_s / (PI * least * density * heat.capacity_j_kg_k)).sqrt();
        taken_w_m2 * (body.radius_m / least).min(brief)
    };
    facts.bodies.each.iter().zip(&light.shares).map(one).fold(0.0, f64::max)
}
