//! The end of a window: its state and its reply, and the order of the particles in memory.

use std::sync::Arc;

use stagger_coupling::{Reply, SolveError};

use super::{state_at::bond_rate_1_s, substep::time_scales};
use crate::{
    common::Vec3,
    particles::{
        exchange::{
            contact_list::{Snapshot, contacts},
            external_fields::{ExternalFields, soften},
            ledger::{exchanged, softening},
            reply::reply,
        },
        model::{
            Model, bodies,
            state::{Advanced, State},
        },
        search::z_curve::{along_z_curve, cell},
    },
};

/// Lists built from one sorting of the memory to the next.
const BUILDS_PER_SORTING: u32 = 8;

/// The state at the end of a window, at `t_s`, and what is said about it.
pub fn finish(
    model: &Model,
    from: &State,
    advanced: Advanced,
    external: &ExternalFields,
    t_s: f64,
) -> Result<(State, Reply), SolveError> {
    let Advanced { motion, walls, forces, moduli, lists, near, contact_history, mut bonds, dissipated, .. } = advanced;
    let bodies = Arc::clone(&from.bodies);
    let poses = model.poses(&walls, t_s);
    let sunk_m = external.sunk_m.as_ref().map_or(&from.sunk_m, |(end_m, _)| end_m).clone();
    let at = Snapshot {
        bodies: &bodies,
        motion: &motion,
        moduli: &moduli,
        lists: &lists,
        contact_history: &contact_history,
        poses: &poses,
        sunk_m: &sunk_m,
    };
    if let Some(bond_model) = &model.bonds {
        bond_model.sinter(&mut bonds, &motion.spheres(&bodies, &[]), lists.pairs.pairs());
    }
    let contacts = contacts(model, at, Some(from), bond_rate_1_s(model, &bodies, &motion, &bonds))?;
    let state = State {
        contacts: contacts.pairs,
        wall_contacts: contacts.walls,
        critical_s: contacts.critical_s,
        stable_s: contacts.stable_s,
        bodies,
        motion,
        forces,
        moduli,
        lists,
        near,
        builds: from.builds + advanced.builds,
        contact_history,
        lead_s: advanced.substep_s,
        bonds,
        walls,
        sunk_m,
        id_map: from.id_map.clone(),
    };
    let softening = match &external.heat {
        Some(heat) => {
            let mut start = from.moduli.clone();
            soften(model, heat, &from.bodies.materials, 0.0, &mut start);
            softening(model, from, &start, &state)?
        }
        None => 0.0,
    };
    let mut reply = reply(model, &state)?;
    reply.ledger.extend(exchanged(model, (from, &state), &dissipated, softening, external.push.is_some()));
    reply.figures.insert("force evaluations".into(), f64::from(advanced.evaluations));
    if advanced.substeps > 0 {
        reply.figures.insert("substeps".into(), f64::from(advanced.substeps));
        reply.figures.insert("substep [s]".into(), advanced.substep_s);
        // Without contacts nothing is critical, and this is zero.
        reply.figures.insert("substep over critical".into(), advanced.substep_s / state.critical_s);
        let fastest_m_s = state.motion.velocities.iter().map(Vec3::norm).fold(0.0, f64::max);
        let share = model.scales.contact_s.min(time_scales(model, fastest_m_s).contact_s) / advanced.substep_s;
        if share.is_finite() {
            reply.figures.insert("shortest contact time over substep".into(), share);
        }
    }
    let state = if state.builds >= BUILDS_PER_SORTING { sorted(model, state, t_s)? } else { state };
    Ok((state, reply))
}

/// The same state, with particles that have become neighbours near each other in memory again.
fn sorted(model: &Model, state: State, t_s: f64) -> Result<State, SolveError> {
    let order = along_z_curve(&state.motion.positions, cell(&state.bodies.radii));
    let mut places = vec![0u32; order.len()];
    for (place, &from) in (0u32..).zip(&order) {
        places[from as usize] = place;
    }
    let (bodies, motion) = (state.bodies.reordered(&order), state.motion.reordered(&order));
    let lists = model.lists(&motion.positions, &bodies.radii, &model.poses(&state.walls, t_s))?;
    let contact_history =
        model.handed_over(&state.lists, &state.contact_history, &lists, |particle| Some(places[particle as usize]));
    Ok(State {
        forces: state.forces.reordered(&order),
        moduli: bodies::reordered(&state.moduli, &order),
        sunk_m: if state.sunk_m.is_empty() { Vec::new() } else { bodies::reordered(&state.sunk_m, &order) },
        bodies: Arc::new(bodies),
        motion,
        lists: Arc::new(lists),
        near: None,
        builds: 0,
        contact_history,
        ..state
    })
}
