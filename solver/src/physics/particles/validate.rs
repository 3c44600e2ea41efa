//! Ranges of the settings.

use super::settings::{ContactLaw, Friction, Integrator, Rolling, Settings, Start};
use crate::{SolveError, physics::Wall};

/// Checks that every setting is in its range.
///
/// # Errors
/// [`SolveError::Mismatch`] names the first setting that is not; [`SolveError::Start`] one of the start.
pub(super) fn settings(settings: &Settings) -> Result<(), SolveError> {
    let positive = |name, value: f64| check(value > 0.0 && value.is_finite(), name, value, "must be positive");
    let not_negative = |name, value: f64| check(value >= 0.0 && value.is_finite(), name, value, "must not be negative");
    let finite = |name, values: &[f64; 3]| {
        let wrong = values.iter().find(|value| !value.is_finite());
        check(wrong.is_none(), name, wrong.copied().unwrap_or(0.0), "must be finite")
    };
    positive("density", settings.density_kg_m3)?;
    positive("temperature", settings.temperature_k)?;
    not_negative("skin", settings.skin)?;
    finite("gravity", &settings.gravity_m_s2)?;
    let contact = &settings.contact;
    match contact.law {
        ContactLaw::Overlap { stiffness_pa, exponent } => {
            positive("stiffness", stiffness_pa)?;
            positive("exponent", exponent)?;
        }
        ContactLaw::Hertz { young_pa, poisson } => {
            positive("Young's modulus", young_pa)?;
            check(poisson > -1.0 && poisson <= 0.5, "Poisson's ratio", poisson, "must lie in (-1, 0.5]")?;
        }
        ContactLaw::Linear { stiffness_n_m } => positive("stiffness", stiffness_n_m)?,
    }
    not_negative("softening rate", contact.softening_rate)?;
    positive("softening reference temperature", contact.softening_reference_k)?;
    not_negative("softening floor", contact.softening_floor_pa)?;
    not_negative("contact damping", contact.damping_n_s_m3)?;
    if let Some(restitution) = contact.restitution {
        check(restitution > 0.0 && restitution <= 1.0, "restitution", restitution, "must lie in (0, 1]")?;
    }
    let coefficients = match settings.friction {
        None => [0.0; 2],
        Some(Friction::Regularised { stiffness_n_m3, static_coefficient, dynamic_coefficient }) => {
            not_negative("friction stiffness", stiffness_n_m3)?;
            [static_coefficient, dynamic_coefficient]
        }
        Some(Friction::Spring { stiffness_ratio, damping_ratio, static_coefficient, dynamic_coefficient }) => {
            stiffness_ratio.map_or(Ok(()), |ratio| positive("stiffness ratio of friction", ratio))?;
            damping_ratio.map_or(Ok(()), |ratio| not_negative("damping ratio of friction", ratio))?;
            [static_coefficient, dynamic_coefficient]
        }
    };
    not_negative("static friction coefficient", coefficients[0])?;
    not_negative("dynamic friction coefficient", coefficients[1])?;
    if let Some(Rolling { rolling, torsion }) = settings.rolling {
        not_negative("rolling coefficient", rolling)?;
        not_negative("torsion coefficient", torsion)?;
    }
    if let Some(bond) = settings.bond {
        not_negative("bond stiffness", bond.stiffness_pa)?;
        positive("bond exponent", bond.exponent)?;
        not_negative("bond shear stiffness", bond.shear_stiffness_n_m3)?;
        not_negative("bond strain", bond.strain)?;
    }
    if let Some(drag) = &settings.drag {
        not_negative("viscosity", drag.viscosity_pa_s)?;
        finite("gas velocity", &drag.velocity_m_s)?;
    }
    settings.walls.iter().try_for_each(Wall::check)?;
    match settings.integrator {
        Integrator::Verlet { substep_s } => substep_s.map_or(Ok(()), |substep_s| positive("substep", substep_s))?,
        Integrator::Trapezoidal { phi, tolerance, iterations } => {
            check((0.0..=1.0).contains(&phi), "phi", phi, "must lie in [0, 1]")?;
            positive("integrator tolerance", tolerance)?;
            check(iterations > 0, "integrator iterations", f64::from(iterations), "must be positive")?;
        }
    }
    start(settings)
}

fn start(settings: &Settings) -> Result<(), SolveError> {
    let fail = |text: String| Err(SolveError::Start(format!("particles: {text}")));
    if u32::try_from(settings.count).is_err() {
        return fail(format!("{} particles are more than 32-bit indices can name", settings.count));
    }
    match &settings.start {
        Start::SequentialAddition { lower_m, upper_m, velocity_m_s } => {
            let (mean, spread) = (settings.radius_m, settings.radius_spread_m);
            if !(mean > 0.0 && mean.is_finite() && (0.0..mean).contains(&spread)) {
                return fail(format!(
                    "a radius of {mean:e} m with spread {spread:e} m; the spread must be less than it"
                ));
            }
            if ![lower_m, upper_m, velocity_m_s].iter().all(|values| values.iter().all(|value| value.is_finite())) {
                return fail("the start box and velocity must be finite".into());
            }
        }
        Start::Given { positions_m, velocities_m_s, radii_m } => {
            let lengths = [positions_m.len(), velocities_m_s.len(), radii_m.len()];
            if lengths != [settings.count; 3] {
                return fail(format!(
                    "{} particles, but {} positions, {} velocities and {} radii are given",
                    settings.count, lengths[0], lengths[1], lengths[2]
                ));
            }
            if let Some((row, radius)) = (0..).zip(radii_m).find(|(_, r)| !(r.is_finite() && **r > 0.0)) {
                let row: usize = row;
                return fail(format!("the radius {radius} m of particle {row} must be positive"));
            }
            let vectors = positions_m.iter().zip(velocities_m_s).enumerate();
            let wrong = |vector: &[f64; 3]| vector.iter().any(|value| !value.is_finite());
            if let Some((row, _)) = vectors.into_iter().find(|(_, (r, v))| wrong(r) || wrong(v)) {
                return fail(format!("position or velocity of particle {row} is not finite"));
            }
        }
    }
    Ok(())
}

fn check(right: bool, name: &str, value: f64, rule: &str) -> Result<(), SolveError> {
    if right { Ok(()) } else { Err(SolveError::Mismatch(format!("particles: {name} {rule}, but is {value}"))) }
}
