//! The particles where they are placed, and the model that follows from them.

use stagger_coupling::SolveError;
use stagger_messages::Shown;

use crate::{
    common::Vec3,
    particles::{
        model::{
            Model,
            bodies::{Bodies, sphere_inertia, sphere_mass},
            state::Motion,
        },
        motion::prepare::prepare,
        settings::{Integrator, Settings},
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

/// Gives the particles back, where their positions are exact enough for contacts.
///
/// # Errors
/// [`SolveError::Start`] where they are so far from the origin that rounding moves one by more than a ten-thousandth of its radius.
pub(super) fn exact(placed: Placed) -> Result<Placed, SolveError> {
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

/// The model of particles that are placed; `settings` are in their ranges.
///
/// # Errors
/// Those of [`prepare`].
pub(super) fn model(settings: Settings, placed: Placed) -> Result<Model, SolveError> {
    let start = bodies(&settings, placed);
    prepare(settings, start)
}

/// The particles at t = 0, in the order of the fields.
fn bodies(settings: &Settings, placed: Placed) -> (Bodies, Motion) {
    let Placed { positions, mut velocities, radii, materials, mut spins } = placed;
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
    (bodies, Motion { positions, velocities, spins })
}
