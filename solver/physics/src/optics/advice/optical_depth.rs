//! Optical depth of the bed: which fidelity of the light suffices.

use std::f64::consts::PI;

use stagger_coupling::math;

use super::light::{Laser, absorbed_share, lasers};
use crate::{
    common::{
        advice::{Advice, Edit, Effect, Facts, Number, Quantity, Verdict},
        beam::{Beam, Frame},
        rays::{Limits, Pattern, Sampling, points_m},
    },
    optics::settings::Model,
};

/// Points over the beam and times over its way at which the light beside the particles is sampled.
const POINTS: usize = 400;
const TIMES: usize = 16;
/// Rays on the largest particle's cross-section in the beam's middle that give its power within a third.
const RAYS_ON_ONE: f64 = 10.0;

/// The fidelity of each laser, from τ = Σ q π R²/A over the area A that the particles cover: it does not depend on how
/// dense they lie. Light of the share e^{−τ} passes particles that are spread at random; a bed lets through less, a heap
/// in the middle more where it is thin, so that half of τ is taken for the bound.
pub static OPTICAL_DEPTH: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    lasers(facts).flat_map(|laser| of(facts, &laser)).collect()
}

fn of(facts: &Facts<'_>, laser: &Laser<'_>) -> Vec<Advice> {
    let (beam, bodies, light) = (&laser.settings.beam, &facts.bodies, laser.light);
    let (lower, upper) = (bodies.room.lower_m, bodies.room.upper_m);
    let side = [0, 1, 2].map(|axis| upper[axis] - lower[axis]);
    let area_m2: f64 =
        (0..3).map(|axis| beam.direction[axis].abs() * side[(axis + 1) % 3] * side[(axis + 2) % 3]).sum();
    if area_m2 <= 0.0 {
        return Vec::new();
    }
    let share = |radius_m: f64| match laser.settings.model {
        Model::BeerLambert { absorption_1_m, .. } | Model::BeerLambertMonograph { absorption_1_m } => {
            absorbed_share(absorption_1_m * radius_m)
        }
        Model::EnergyBalance | Model::Rays { .. } => 1.0,
    };
    let taken = bodies.each.iter().map(|body| body.number * share(body.radius_m) * PI * math::powi(body.radius_m, 2));
    let depth = taken.sum::<f64>() / area_m2;
    let beside = beside(facts, beam);
    let passed = (beside + (1.0 - beside) * math::exp(-0.5 * depth)).min(1.0);
    let about = format!("{}.fidelity", light.table);
    let meaning = format!(
        "cross-sections of the particles that absorb, over the {area_m2:.1e} m2 that they cover; {:.1} % of the beam goes \
         beside it",
        100.0 * beside
    );
    let energy = Effect { quantity: Quantity::AbsorbedEnergy, at_most: passed * light.energy_j, share: passed };
    let effects = |facts: &Facts<'_>| {
        let mut effects = vec![energy];
        if let Some(heat) = &facts.heat {
            let mean_k = passed * light.energy_j / (facts.bodies.mass_kg() * heat.capacity_j_kg_k);
            effects.extend(facts.temperatures(mean_k, 0.0).into_iter().take(1));
        }
        effects
    };
    let advice = |verdict, says: String| Advice::new(&about, "optical depth", depth, &meaning, verdict, says);
    let all = passed <= facts.within;
    vec![match laser.settings.model {
        Model::EnergyBalance if all => {
            advice(Verdict::Suffices, "all light is absorbed, as energy-balance says".into())
        }
        Model::EnergyBalance => {
            let mut own = advice(
                Verdict::Refine,
                format!(
                    "up to {:.0} % of the light may pass the particles, which energy-balance gives them",
                    100.0 * passed
                ),
            );
            own.edits = vec![Edit::set(about.clone(), "beer-lambert")];
            own
        }
        Model::BeerLambertMonograph { absorption_1_m } => {
            let radius_m = bodies.largest_m();
            let given = 4.0 / 3.0 * absorption_1_m * radius_m / absorbed_share(absorption_1_m * radius_m);
            let fits = given <= 1.0 + 10.0 * facts.within;
            let says =
                format!("the monograph's form gives the largest particle {given:.2} times the light it can absorb");
            let mut own = advice(if fits { Verdict::Suffices } else { Verdict::Refine }, says);
            if !fits {
                own.edits = vec![Edit::set(about.clone(), "beer-lambert")];
            }
            own
        }
        Model::Rays { sampling, .. } => {
            let largest_m2 = PI * math::powi(bodies.largest_m(), 2);
            let on_one = sampling.count as f64 * beam.profile.irradiance_1_m2(0.0) * largest_m2;
            let mut own = if on_one < RAYS_ON_ONE {
                let says = format!(
                    "only {on_one:.1} rays meet a particle in the beam's middle: its power is a matter of chance"
                );
                advice(Verdict::Refine, says)
            } else {
                advice(Verdict::Keep, format!("{on_one:.0} rays meet a particle in the beam's middle"))
            };
            if own.verdict == Verdict::Refine && on_one > 0.0 {
                let count = (sampling.count as f64 * RAYS_ON_ONE / on_one).ceil();
                own.edits = vec![Edit::set(format!("{}.rays.count", light.table), format!("{count:.0}"))];
            }
            own
        }
        Model::BeerLambert { .. } if all && bodies.room.confined => {
            let mut own = advice(
                Verdict::Suffices,
                "energy-balance suffices for the mean temperature: all light is absorbed; peaks need this fidelity"
                    .into(),
            );
            own.effects = effects(facts);
            own.edits = vec![Edit::set(about.clone(), "energy-balance")];
            own
        }
        Model::BeerLambert { .. } => {
            let says =
                format!("up to {:.0} % of the light passes the particles, which this fidelity finds", 100.0 * passed);
            advice(Verdict::Keep, says)
        }
    }]
}

/// Share of the beam that goes beside the particles' room, over its way.
fn beside(facts: &Facts<'_>, beam: &Beam) -> f64 {
    let room = &facts.bodies.room;
    let along =
        (0..3).fold(0, |most, axis| if beam.direction[axis].abs() > beam.direction[most].abs() { axis } else { most });
    let sampling =
        Sampling { count: POINTS, pattern: Pattern::Stratified, limits: Limits { threshold: 0.0, reflections: 1 } };
    let points = points_m(&beam.profile, &sampling);
    let frame = Frame::new(beam.direction);
    let ends_s = beam.ends_s.min(facts.duration_s);
    let lit_s = (ends_s - beam.starts_s).max(0.0);
    let mut outside = 0usize;
    for time in 0..TIMES {
        let t_s = beam.starts_s + lit_s * (time as f64 + 0.5) / TIMES as f64;
        let spot_m = beam.spot_m(t_s);
        let out = |[u, v]: &&[f64; 2]| {
            let place = frame.point_m([*u, *v, 0.0], spot_m);
            (0..3).any(|axis| axis != along && (place[axis] < room.lower_m[axis] || place[axis] > room.upper_m[axis]))
        };
        outside += points.iter().filter(out).count();
    }
    outside as f64 / (POINTS * TIMES) as f64
}
