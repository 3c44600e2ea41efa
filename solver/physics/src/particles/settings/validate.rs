//! Ranges of the settings.

use stagger_coupling::SolveError;

use crate::{
    common::{Wall, walls::Motion},
    particles::settings::{ContactLaw, Friction, Integrator, Radius, Rolling, Settings, Start},
};

/// Checks that every setting is in its range.
///
/// # Errors
/// [`SolveError::Mismatch`] names the first setting that is not; [`SolveError::Start`] one of the start.
pub fn settings(settings: &Settings) -> Result<(), SolveError> {
    let positive = |name, value: f64| check(value > 0.0 && value.is_finite(), name, value, "must be positive");
    let not_negative = |name, value: f64| check(value >= 0.0 && value.is_finite(), name, value, "must not be negative");
    let finite = |name, values: &[f64; 3]| {
        let wrong = values.iter().find(|value| !value.is_finite());
        check(wrong.is_none(), name, wrong.copied().unwrap_or(0.0), "must be finite")
    };
    for material in &settings.materials {
        positive("density", material.density_kg_m3)?;
    }
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
    settings.pours.iter().try_for_each(|pour| pour.check(settings.materials.len()))?;
    settings.pours.iter().try_for_each(|pour| radii(&format!("dispenser {}", pour.name), &pour.radius))?;
    match settings.integrator {
        Integrator::Verlet { substep_s } => substep_s.map_or(Ok(()), |substep_s| positive("substep", substep_s))?,
        Integrator::Trapezoidal { phi, tolerance, iterations, .. } => {
            check((0.0..=1.0).contains(&phi), "phi", phi, "must lie in [0, 1]")?;
            positive("integrator tolerance", tolerance)?;
            check(iterations > 0, "integrator iterations", f64::from(iterations), "must be positive")?;
        }
        Integrator::Held => {
            let moves = settings.walls.iter().find(|wall| wall.motion != Motion::Fixed);
            let name = moves.map(|wall| &wall.name).or(settings.pours.first().map(|pour| &pour.name));
            if let Some(name) = name {
                let text = format!("particles: {name} moves or pours, and particles that are held cannot follow");
                return Err(SolveError::Mismatch(text));
            }
        }
    }
    start(settings)
}

fn start(settings: &Settings) -> Result<(), SolveError> {
    let fail = |text: String| Err(SolveError::Start(format!("particles: {text}")));
    if u32::try_from(settings.count()).is_err() {
        return fail(format!("{} particles are more than 32-bit indices can name", settings.count()));
    }
    let used: Vec<u16> = match &settings.start {
        Start::Given { positions_m, velocities_m_s, radii_m, materials, spins_rad_s } => {
            given(positions_m, velocities_m_s, radii_m, materials.len())?;
            if !(spins_rad_s.is_empty() || spins_rad_s.len() == positions_m.len()) {
                return fail(format!("{} positions, but {} spins are given", positions_m.len(), spins_rad_s.len()));
            }
            if let Some(row) = spins_rad_s.iter().position(|spin| spin.iter().any(|value| !value.is_finite())) {
                return fail(format!("the spin of particle {row} is not finite"));
            }
            materials.clone()
        }
        _ => {
            settings.groups.iter().try_for_each(|group| radii(&group.name, &group.radius))?;
            settings.groups.iter().map(|group| group.material).collect()
        }
    };
    if let Some(material) = used.iter().find(|material| usize::from(**material) >= settings.materials.len()) {
        return fail(format!("material {material} of {} is asked for", settings.materials.len()));
    }
    match &settings.start {
        Start::SequentialAddition { region, velocity_m_s } | Start::Lattice { region, velocity_m_s, .. } => {
            let (lower, upper) = region.bounds();
            place(&lower, &upper, velocity_m_s)?;
        }
        Start::Growth { lower_m, upper_m, velocity_m_s } => place(lower_m, upper_m, velocity_m_s)?,
        Start::Settle { region, until, damping, longest_s } => {
            let (lower, upper) = region.bounds();
            place(&lower, &upper, &[0.0; 3])?;
            check(*until > 0.0 && until.is_finite(), "the kinetic energy at rest", *until, "must be positive")?;
            check(*damping >= 0.0 && damping.is_finite(), "damping of settling", *damping, "must not be negative")?;
            let longest = longest_s.unwrap_or(1.0);
            check(longest > 0.0 && longest.is_finite(), "longest time to settle", longest, "must be positive")?;
            if settings.gravity_m_s2 == [0.0; 3] || settings.walls.is_empty() {
                return fail("to settle, they need gravity, and walls that hold them".into());
            }
        }
        Start::Given { .. } => {}
    }
    if let Start::Lattice { spacing, jitter, .. } = settings.start {
        check(spacing >= 1.0 && spacing.is_finite(), "lattice spacing", spacing, "must be at least 1")?;
        check((0.0..=1.0).contains(&jitter), "lattice jitter", jitter, "must lie in [0, 1]")?;
    }
    Ok(())
}

/// Whether radii are positive and finite.
fn radii(name: &str, radius: &Radius) -> Result<(), SolveError> {
    let right = match *radius {
        Radius::Uniform { mean_m, spread_m } => mean_m > 0.0 && mean_m.is_finite() && (0.0..mean_m).contains(&spread_m),
        Radius::LogNormal { mean_m, deviation_m, minimum_m, maximum_m } => {
            let limits = 0.0 < minimum_m && minimum_m <= mean_m && mean_m <= maximum_m && maximum_m.is_finite();
            limits && deviation_m >= 0.0 && deviation_m.is_finite()
        }
    };
    if right {
        return Ok(());
    }
    Err(SolveError::Start(format!(
        "particles: the radii of `{name}` are {radius:?}: expected a positive mean with a smaller spread, or between limits"
    )))
}

fn place(lower: &[f64; 3], upper: &[f64; 3], velocity: &[f64; 3]) -> Result<(), SolveError> {
    if [lower, upper, velocity].iter().all(|values| values.iter().all(|value| value.is_finite())) {
        return Ok(());
    }
    Err(SolveError::Start("particles: the start region and velocity must be finite".into()))
}

fn given(
    positions_m: &[[f64; 3]],
    velocities_m_s: &[[f64; 3]],
    radii_m: &[f64],
    materials: usize,
) -> Result<(), SolveError> {
    let fail = |text: String| Err(SolveError::Start(format!("particles: {text}")));
    let lengths = [positions_m.len(), velocities_m_s.len(), radii_m.len(), materials];
    if lengths != [positions_m.len(); 4] {
        return fail(format!(
            "{} positions, but {} velocities, {} radii and {} materials are given",
            lengths[0], lengths[1], lengths[2], lengths[3]
        ));
    }
    if let Some((row, radius)) = (0..).zip(radii_m).find(|(_, r)| !(r.is_finite() && **r > 0.0)) {
        let row: usize = row;
        return fail(format!("the radius {radius} m of particle {row} must be positive"));
    }
    let wrong = |vector: &[f64; 3]| vector.iter().any(|value| !value.is_finite());
    let mut vectors = positions_m.iter().zip(velocities_m_s).enumerate();
    if let Some((row, _)) = vectors.find(|(_, (r, v))| wrong(r) || wrong(v)) {
        return fail(format!("position or velocity of particle {row} is not finite"));
    }
    Ok(())
}

fn check(right: bool, name: &str, value: f64, rule: &str) -> Result<(), SolveError> {
    if right { Ok(()) } else { Err(SolveError::Mismatch(format!("particles: {name} {rule}, but is {value}"))) }
}
