//! Where particles are at t = 0: how each kind of start places them.

mod cells;
mod growth;
mod lattice;
mod radii;
mod sequential_addition;
mod settle;

use stagger_coupling::{SolveError, math};
use stagger_messages::Shown;

use self::{growth::Growth, sequential_addition::SequentialAddition, settle::Settle};
use crate::{
    common::{Vec3, random::random},
    particles::{
        model::{
            Model,
            bodies::{Bodies, sphere_inertia, sphere_mass},
            state::Motion,
        },
        motion::prepare::prepare,
        settings::{Integrator, Settings, Start, validate},
    },
};

/// The particles at t = 0, by row; all lists are of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Placed {
    /// Positions, in m.
    pub positions: Vec<[f64; 3]>,
    /// Velocities, in m/s.
    pub velocities: Vec<[f64; 3]>,
    /// Radii, in m.
    pub radii: Vec<f64>,
    /// Materials, as indices into [`Settings::materials`].
    pub materials: Vec<u16>,
    /// Spins, in rad/s.
    pub spins: Vec<[f64; 3]>,
}

/// Largest rounding error of a position over the radius with which contacts are computed: a contact's overlap is some
/// hundredths of the radius, of which this is a per cent.
const COARSEST: f64 = 1e-4;

/// Places the particles of `settings`, of all groups jointly, largest first. The same seed gives the same numbers on every
/// machine; given particles keep their order.
///
/// # Errors
/// [`SolveError::Start`] where the particles do not fit, or not within the bounded effort of the method, or where they are so
/// far from the origin that rounding moves them by more than a ten-thousandth of their radius.
pub fn place(settings: &Settings) -> Result<Placed, SolveError> {
    let placed = placed(settings)?;
    for (row, (position, radius)) in placed.positions.iter().zip(&placed.radii).enumerate() {
        let farthest = position.iter().fold(0.0f64, |farthest, x| farthest.max(x.abs()));
        if f64::EPSILON * farthest > COARSEST * radius {
            return Err(SolveError::Start(format!(
                "particles: particle {row} of radius {:e} m starts {:e} m from the origin, where positions are \
                 exact to {:.1e} m only; move the scene nearer to the origin",
                Shown(*radius),
                Shown(farthest),
                f64::EPSILON * farthest
            )));
        }
    }
    Ok(placed)
}

/// Checks `settings`, places the particles, and derives what does not change during a run.
///
/// # Errors
/// [`SolveError::Start`] where the start cannot be made, [`SolveError::Mismatch`] where a setting is out of its range; the
/// message names the setting.
pub(super) fn model(settings: Settings) -> Result<Model, SolveError> {
    validate::settings(&settings)?;
    let start = at_start(&settings)?;
    prepare(settings, start)
}

/// The particles at t = 0, in the order of the fields.
fn at_start(settings: &Settings) -> Result<(Bodies, Motion), SolveError> {
    let Placed { positions, mut velocities, radii, materials, mut spins } = place(settings)?;
    if settings.integrator == Integrator::Held {
        // What is left of settling, or was read from a file.
        velocities.fill([0.0; 3]);
    }
    if settings.integrator == Integrator::Held || !settings.spin {
        spins.fill([0.0; 3]);
    }
    let density = |material: &u16| settings.materials[usize::from(*material)].density_kg_m3;
    let masses: Vec<f64> =
        (radii.iter().zip(&materials)).map(|(&radius, material)| sphere_mass(radius, density(material))).collect();
    let bodies = Bodies {
        ids: (0u32..).take(radii.len()).collect(),
        rows: (0u32..).take(radii.len()).collect(),
        inertias: masses.iter().zip(&radii).map(|(&mass, &radius)| sphere_inertia(mass, radius)).collect(),
        materials,
        masses,
        radii,
    };
    let vectors = |values: Vec<[f64; 3]>| values.into_iter().map(Vec3::from).collect::<Vec<_>>();
    let [positions, velocities, spins] = [positions, velocities, spins].map(vectors);
    Ok((bodies, Motion { positions, velocities, spins }))
}

fn placed(settings: &Settings) -> Result<Placed, SolveError> {
    let mut random = random(settings.seed);
    let bodies = radii::draw(&settings.groups, &mut random);
    let (positions, velocity) = match &settings.start {
        Start::SequentialAddition { region, velocity_m_s } => {
            (SequentialAddition { region, radii: &bodies.radii }.place(&mut random)?, *velocity_m_s)
        }
        Start::Lattice { region, lattice, spacing, jitter, velocity_m_s } => {
            (lattice.place(region, &bodies, *spacing, *jitter, &mut random)?, *velocity_m_s)
        }
        Start::Growth { lower_m, upper_m, velocity_m_s } => {
            let (lower, upper) = (Vec3::from(*lower_m), Vec3::from(*upper_m));
            (Growth { lower, upper, radii: &bodies.radii }.place(&mut random)?, *velocity_m_s)
        }
        Start::Settle { region, until, damping, longest_s } => {
            let settle = Settle { until: *until, damping: *damping, longest_s: *longest_s };
            (settle.place(settings, region, &bodies, &mut random)?, [0.0; 3])
        }
        Start::Given { positions_m, velocities_m_s, radii_m, materials, spins_rad_s } => {
            let spins = if spins_rad_s.is_empty() { vec![[0.0; 3]; positions_m.len()] } else { spins_rad_s.clone() };
            return Ok(Placed {
                spins,
                positions: positions_m.clone(),
                velocities: velocities_m_s.clone(),
                radii: radii_m.clone(),
                materials: materials.clone(),
            });
        }
    };
    Ok(Placed {
        spins: vec![[0.0; 3]; positions.len()],
        velocities: vec![velocity; positions.len()],
        positions: positions.into_iter().map(Into::into).collect(),
        radii: bodies.radii,
        materials: bodies.materials,
    })
}

/// Volume of all spheres, in m³.
fn volume(radii: &[f64]) -> f64 {
    radii.iter().map(|radius| 4.0 / 3.0 * std::f64::consts::PI * math::powi(*radius, 3)).sum()
}

#[cfg(test)]
mod tests;
