//! The model of a scene: everything that follows from its settings and from where its particles start.

use stagger_coupling::SolveError;

use super::{
    state_at::state_at_start,
    substep::{hardest, reference_speed, time_scales},
};
use crate::{
    common::{
        Vec3,
        walls::{Surface as WallSurface, Wall},
    },
    particles::{
        bonds::BondModel,
        contact::{
            force::Surface, law::Law, monograph_bond::MonographBond, normal::Normal as _, pair_table::PairTable,
            softening::Softening,
        },
        fields::Fields,
        model::{
            ContactLaws, Model, WallGeometry,
            bodies::Bodies,
            ports::ParticlePorts,
            state::Motion,
            time_scales::{StartScales, TimeScales},
        },
        settings::{Integrator, LeverArm, Settings},
    },
};

/// Derives what does not change during a run from `settings`, which are in their ranges, and from the particles at t = 0, in
/// the order of the fields.
///
/// # Errors
/// [`SolveError::Start`] or [`SolveError::Mismatch`] names what of the fields, the bonds or the pairs is out of its range.
pub fn prepare(settings: Settings, start: (Bodies, Motion)) -> Result<Model, SolveError> {
    let law = Law::from(settings.contact.law);
    let (table, wall_materials) = PairTable::new(&settings, law)?;
    let mut model = Model {
        contact: ContactLaws {
            law,
            surface: Surface {
                spin: settings.spin,
                arms_by_radius: settings.lever_arm == LeverArm::Radius,
                rolls: settings.spin && table.laws().iter().any(|pair| pair.rolling > 0.0 || pair.torsion > 0.0),
                bond: settings.bond.map(|settings| MonographBond { settings }),
                power: law.power(),
            },
            table,
            softening: settings.materials.iter().map(|material| Softening::of(&settings, material)).collect(),
        },
        walls: WallGeometry {
            surfaces: settings.walls.iter().map(|wall| WallSurface::new(&wall.shape, law.power())).collect(),
            reaches_m: settings.walls.iter().map(Wall::reach_m).collect(),
            materials: wall_materials,
        },
        gravity: Vec3::from(settings.gravity_m_s2),
        fields: Fields::new(&settings.fields, settings.drag, matches!(settings.integrator, Integrator::Verlet { .. }))?,
        bonds: settings.bonds.map(BondModel::new).transpose()?,
        start,
        scales: StartScales::UNKNOWN,
        ports: ParticlePorts::new(&settings),
        settings,
    };
    let state = state_at_start(&model)?;
    model.scales.hardest = hardest(&model, &state);
    let TimeScales { contact_s, substep_s } = time_scales(&model, reference_speed(&model, &state));
    model.scales.contact_s = contact_s;
    model.scales.substep_s = match model.settings.integrator {
        Integrator::Verlet { substep_s: Some(bound_s) } => bound_s,
        _ => substep_s,
    };
    Ok(model)
}
