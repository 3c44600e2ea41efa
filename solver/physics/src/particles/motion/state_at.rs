//! The state of particles at an instant, with their contacts and the forces on them.

use std::sync::Arc;

use stagger_coupling::SolveError;

use super::{forces::Evaluator, start_forces::forces_at_start};
use crate::{
    common::walls::WallState,
    particles::{
        bonds::{BondModel, Bonds},
        exchange::{
            contact_list::{Snapshot, contacts},
            external_fields::ExternalFields,
        },
        model::{
            Model,
            bodies::Bodies,
            id_map::IdMap,
            state::{Forces, Motion, Rows, State},
        },
        search::{
            neighbours::NeighbourList,
            z_curve::{along_z_curve, cell},
        },
    },
};

/// The state at t = 0. Friction is zero in its forces: it depends on a step that is not known yet.
pub fn state_at_start(model: &Model) -> Result<State, SolveError> {
    let (bodies, motion) = &model.start;
    let order = along_z_curve(&motion.positions, cell(&bodies.radii));
    let (bodies, motion) = (bodies.reordered(&order), motion.reordered(&order));
    let walls = vec![WallState::default(); model.settings.walls.len()];
    let id_map = IdMap::new(bodies.len() as u32, model.settings.pours.len());
    let moduli: Vec<f64> =
        bodies.materials.iter().map(|&material| model.modulus(material, model.settings.temperature_k)).collect();
    let lists = model.lists(&motion.positions, &bodies.radii, &model.poses(&walls, 0.0))?;
    let contact_history = lists.no_history();
    let mut bonds = Bonds::default();
    if let Some(bond_model) = &model.bonds {
        // Bonds bridge gaps that the contact lists need not reach.
        let gap = model.settings.bonds.and_then(|bonds| bonds.gap_share).unwrap_or(0.0);
        let near = NeighbourList::build(&motion.positions, &bodies.radii, 2.0 * gap)?;
        let places = bodies.places_by_id();
        bonds = bond_model.form(&motion.spheres(&bodies, &places), near.pairs());
    }
    let sunk_m = if model.sinking_wall().is_some() { vec![0.0; bodies.len()] } else { Vec::new() };
    let rows = Rows { bodies, motion, moduli, lists, contact_history, bonds, sunk_m };
    state_at(model, rows, walls, id_map, 0.0, None)
}

/// The state of these particles, with their contacts and the forces on them at a time in s. What depends on the step
/// is without it: it is not known yet.
pub fn state_at(
    model: &Model,
    rows: Rows,
    walls: Vec<WallState>,
    id_map: IdMap,
    t_s: f64,
    before: Option<&State>,
) -> Result<State, SolveError> {
    let Rows { bodies, motion, moduli, lists, contact_history, bonds, sunk_m } = rows;
    let poses = model.poses(&walls, t_s);
    let at = Snapshot {
        bodies: &bodies,
        motion: &motion,
        moduli: &moduli,
        lists: &lists,
        contact_history: &contact_history,
        poses: &poses,
        sunk_m: &sunk_m,
    };
    let contacts = contacts(model, at, before, bond_rate_1_s(model, &bodies, &motion, &bonds))?;
    let mut state = State {
        contacts: contacts.pairs,
        wall_contacts: contacts.walls,
        critical_s: contacts.critical_s,
        stable_s: contacts.stable_s,
        forces: Forces::none(bodies.len()),
        near: None,
        bodies: Arc::new(bodies),
        motion,
        moduli,
        lists: Arc::new(lists),
        builds: 0,
        contact_history,
        lead_s: before.map_or(0.0, |state| state.lead_s),
        bonds,
        walls,
        sunk_m,
        id_map,
    };
    let mut forces = state.forces.clone();
    let external = ExternalFields::default();
    let mut evaluator = Evaluator::new(model, &state, &external);
    forces_at_start(&state, &mut evaluator, t_s, 0.0, &mut forces)?;
    // Without a step to be ahead by, the springs are those of this instant.
    let contact_history = evaluator.contact_history().to_vec();
    (state.forces, state.contact_history, state.lead_s) = (forces, contact_history, 0.0);
    Ok(state)
}

/// Largest angular frequency of the bonds, in rad/s.
pub fn bond_rate_1_s(model: &Model, bodies: &Bodies, motion: &Motion, bonds: &Bonds) -> f64 {
    let rate = |bond_model: &BondModel| bond_model.rate_1_s(bonds, &motion.spheres(bodies, &bodies.places_by_id()));
    model.bonds.as_ref().map_or(0.0, rate)
}
