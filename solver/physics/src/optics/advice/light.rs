//! What lasers send, and how much of it particles may take.

use std::f64::consts::PI;

use stagger_coupling::{SolveError, Window, math};

use crate::{
    common::{
        Vec3,
        advice::{BeamFacts, Body, Facts, LightFacts},
    },
    optics::settings::{Model, Path, Settings},
};

/// Share of the light meeting a sphere's cross-section that is absorbed along its chords: 1 − (1 − (1 + 2s) e^{−2s})/(2s²)
/// with s = a R (van de Hulst 1957, section 11.22, for rays that go straight).
#[must_use]
pub fn absorbed_share(s: f64) -> f64 {
    if s < 1e-3 {
        // 4s/3 − s²: the closed form loses its digits here.
        return 4.0 / 3.0 * s - s * s;
    }
    1.0 - (1.0 - (1.0 + 2.0 * s) * math::exp(-2.0 * s)) / (2.0 * s * s)
}

/// A laser of the scene.
pub struct Laser<'f> {
    pub settings: &'f Settings,
    /// What was told of it.
    pub light: &'f LightFacts,
}

/// The lasers of the scene.
pub fn lasers<'f>(facts: &'f Facts<'_>) -> impl Iterator<Item = Laser<'f>> {
    facts.tables.each::<Settings>().filter_map(|(table, settings)| {
        let light = facts.lights.iter().find(|light| light.table == table)?;
        Some(Laser { settings, light })
    })
}

/// Tells what each laser sends, and how much of it particles may take.
pub fn tell(facts: &mut Facts<'_>) -> Result<(), SolveError> {
    let (duration_s, mass_kg) = (facts.duration_s, facts.bodies.mass_kg());
    for (table, settings) in facts.tables.each::<Settings>() {
        let beam = &settings.beam;
        let energy_j = beam.mean_power_w(Window { t_s: 0.0, dt_s: duration_s }) * duration_s;
        let shares: Vec<f64> = facts.bodies.each.iter().map(|body| share_of(settings.model, body)).collect();
        let peak_j_kg = match settings.model {
            Model::EnergyBalance => energy_j / mass_kg,
            _ => {
                let fluence_j_m2 = fluence_j_m2(settings, energy_j, duration_s);
                let of = |(body, share): (&Body, &f64)| {
                    fluence_j_m2 * share * PI * math::powi(body.radius_m, 2) / body.mass_kg
                };
                facts.bodies.each.iter().zip(&shares).map(of).fold(0.0, f64::max)
            }
        };
        facts.lights.push(LightFacts {
            table: table.to_owned(),
            energy_j,
            peak_j_kg,
            starts_s: beam.starts_s,
            ends_s: beam.ends_s,
            dwell_s: dwell_s(settings, energy_j),
            pulse_s: beam.pulses.map_or(f64::INFINITY, |pulses| pulses.on_s),
            middle_w_m2: beam.power_w * beam.profile.irradiance_1_m2(0.0),
            shares,
        });
        if energy_j > 0.0 {
            facts.beams.push(BeamFacts {
                table: table.to_owned(),
                radius_m: beam.profile.quantile_m(0.5),
                path: &beam.path,
                starts_s: beam.starts_s,
                ends_s: beam.ends_s,
                pulses: beam.pulses,
            });
        }
    }
    Ok(())
}

/// Most light that falls on a place over the run, in J/m²: the irradiance at points along the path, summed over instants.
fn fluence_j_m2(settings: &Settings, energy_j: f64, duration_s: f64) -> f64 {
    let beam = &settings.beam;
    let Path::Sweep { from_m, to_m, speed_m_s } = beam.path else {
        return energy_j * beam.profile.irradiance_1_m2(0.0);
    };
    let lit_s = (beam.ends_s.min(duration_s) - beam.starts_s).max(0.0);
    let length_m = (Vec3::from(to_m) - Vec3::from(from_m)).norm();
    // Steps of a tenth of the beam, so that the sum is an integral to some 1e-3; a bounded number for endless sweeps.
    let steps = (10.0 * speed_m_s * lit_s / beam.profile.radius_m()).clamp(100.0, 20_000.0) as usize;
    let spots: Vec<Vec3> =
        (0..steps).map(|k| beam.spot_m(beam.starts_s + lit_s * (k as f64 + 0.5) / steps as f64)).collect();
    let points = (10.0 * length_m / beam.profile.radius_m()).clamp(8.0, 64.0) as usize;
    let at = |k: usize| {
        let place = Vec3::from(from_m) + (Vec3::from(to_m) - Vec3::from(from_m)) * (k as f64 / points as f64);
        spots.iter().map(|spot| beam.profile.irradiance_1_m2((place - spot).norm())).sum::<f64>() / steps as f64
    };
    energy_j * (0..=points).map(at).fold(0.0, f64::max)
}

/// Bound of the share of the light meeting a particle's cross-section that it takes.
///
/// Lines at a quarter of the radius sample a circle's area within 8 %; light that neighbours reflect at most doubles what
/// falls on one.
fn share_of(model: Model, body: &Body) -> f64 {
    match model {
        Model::EnergyBalance => 0.0,
        Model::BeerLambert { absorption_1_m, spacing_m } => {
            let sampling = 1.0 + 0.32 * spacing_m / body.radius_m;
            absorbed_share(absorption_1_m * body.radius_m) * sampling
        }
        Model::BeerLambertMonograph { absorption_1_m } => 4.0 / 3.0 * absorption_1_m * body.radius_m,
        Model::Rays { .. } => 2.0,
    }
}

/// How long the beam lights a place it passes, in s: its width over its speed, or all its time.
fn dwell_s(settings: &Settings, energy_j: f64) -> f64 {
    let beam = &settings.beam;
    let on_s = if beam.power_w > 0.0 { energy_j / beam.power_w } else { 0.0 };
    match beam.path {
        Path::Fixed { .. } => on_s,
        Path::Sweep { speed_m_s, .. } => (2.0 * beam.profile.radius_m() / speed_m_s).min(on_s),
    }
}

#[cfg(test)]
mod tests {
    use super::absorbed_share;

    #[test]
    fn the_share_is_the_mean_over_the_chords_at_every_absorption() {
        for s in [1e-6, 9e-4, 1.1e-3, 0.25, 2.0, 40.0] {
            // Chord 2 √(1 − u) at the squared distance u from the centre; the integrand has a root's end at u = 1, where the
            // midpoint rule is good to n^(−3/2).
            let n = 100_000;
            let one = |k: usize| -(-2.0 * s * (1.0 - (k as f64 + 0.5) / n as f64).sqrt()).exp_m1();
            let mean = (0..n).map(one).sum::<f64>() / n as f64;
            // The closed form cancels to some 1e-10 where it begins.
            assert!((absorbed_share(s) / mean - 1.0).abs() < 1e-6, "{s}: {} and {mean}", absorbed_share(s));
        }
    }
}
