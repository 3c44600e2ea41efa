//! Particles that come and go: at the start of a window, from what is committed alone.

use stagger_coupling::{Frozen, SolveError, Window};
use stagger_messages::Energy;

use super::moved::{Body, Moved};
use crate::{
    common::Vec3,
    particles::{
        exchange::ledger::stored,
        model::{
            Model,
            bodies::{Bodies, reordered, sphere_inertia, sphere_mass},
            id_map::IdMap,
            ports::VAPOURISED,
            state::{Motion, Rows, State},
        },
        motion::state_at::state_at,
        search::z_curve::{along_z_curve, cell},
    },
};

/// What a change of the rows did to the energy, in J.
#[derive(Clone, Copy, Debug, Default)]
pub struct Booked {
    /// Brought by particles that were poured.
    pub poured_j: f64,
    /// Taken by particles that left, with the energy of their contacts.
    pub removed_j: f64,
}

/// Places in memory of the particles that leave at a window's start: those outside the domain, and those that are vapour
/// then. Flags that are older than the last coming or going have been followed already.
fn leaving(model: &Model, state: &State, frozen: &Frozen) -> Result<Vec<usize>, SolveError> {
    let mut leaving = model.settings.domain.map_or_else(Vec::new, |domain| domain.outside(&state.motion.positions));
    if let Some(vapourised) = frozen.start.get(VAPOURISED) {
        let support = &vapourised.support;
        if (support.revision, support.count) == (state.id_map.revision, state.bodies.len() as u64) {
            let flags = state.bodies.in_memory(vapourised.u8()?);
            leaving.extend((0..).zip(flags).filter(|(_, flag)| *flag != 0).map(|(place, _)| place));
        }
    }
    Ok(leaving)
}

/// The state at the start of `window` with the particles that come and without those that go; `None` where none do.
///
/// New particles get the last rows; the others move up. Bonds of particles that go break with the next step.
pub fn renewed(
    model: &Model,
    state: &State,
    frozen: &Frozen,
    window: Window,
) -> Result<Option<(State, Booked)>, SolveError> {
    if !model.come_and_go() {
        return Ok(None);
    }
    let leaving = leaving(model, state, frozen)?;
    let mut pours = model.settings.pours.iter().zip(&state.id_map.poured);
    if leaving.is_empty() && pours.all(|(pour, &poured)| pour.due(window.t_s, window.dt_s, poured) == 0) {
        return Ok(None);
    }
    let mut keep = vec![true; state.bodies.len()];
    for &place in &leaving {
        keep[place] = false;
    }
    let kept: Vec<u32> = (0u32..).zip(&keep).filter(|(_, keep)| **keep).map(|(place, _)| place).collect();
    let mut id_map = state.id_map.clone();
    let (mut bodies, mut motion) = (state.bodies.reordered(&kept), state.motion.reordered(&kept));
    let mut moduli = reordered(&state.moduli, &kept);
    bodies.rows = ranks(&bodies.rows);
    let next_id = id_map.next_id;
    let came = pour(model, window, &mut id_map, &mut bodies, &mut motion, &mut moduli)?;
    if leaving.is_empty() && came == 0 {
        return Ok(None);
    }
    let fields = frozen.start.values().chain(frozen.end.values());
    let read = fields.filter(|field| field.support.name == "particles").map(|field| field.support.revision);
    let gone = leaving.iter().map(|&place| state.bodies.ids[place]).collect();
    id_map.change(next_id, gone, read.min().unwrap_or(u64::MAX));

    let order = along_z_curve(&motion.positions, cell(&bodies.radii));
    let poured = moved(model, &bodies, &motion, kept.len()..bodies.len());
    let (bodies, motion) = (bodies.reordered(&order), motion.reordered(&order));
    let lists = model.lists(&motion.positions, &bodies.radii, &model.poses(&state.walls, window.t_s))?;
    let mut places = vec![None; state.bodies.len()];
    for (place, &from) in (0u32..).zip(&order) {
        if let Some(&old) = kept.get(from as usize) {
            places[old as usize] = Some(place);
        }
    }
    let contact_history =
        model.handed_over(&state.lists, &state.contact_history, &lists, |particle| places[particle as usize]);
    let moduli = reordered(&moduli, &order);
    let mut sunk_m = Vec::new();
    if model.sinking_wall().is_some() {
        sunk_m = places_of(&order, kept.len(), |place| state.sunk_m[kept[place] as usize]);
    }
    let rows = Rows { bodies, motion, moduli, lists, contact_history, bonds: state.bonds.clone(), sunk_m };
    let renewed = state_at(model, rows, state.walls.clone(), id_map, window.t_s, Some(state))?;
    let sum = |stored: Vec<Energy>| stored.iter().map(|entry| entry.joule).sum::<f64>();
    let change_j = sum(stored(model, &renewed)?) - sum(stored(model, state)?);
    let booked = Booked { poured_j: poured.energy_j(), removed_j: poured.energy_j() - change_j };
    Ok(Some((renewed, booked)))
}

/// Adds what the dispensers are due to pour; returns how many came.
fn pour(
    model: &Model,
    window: Window,
    id_map: &mut IdMap,
    bodies: &mut Bodies,
    motion: &mut Motion,
    moduli: &mut Vec<f64>,
) -> Result<usize, SolveError> {
    let before = bodies.len();
    for (pour, poured) in model.settings.pours.iter().zip(&mut id_map.poured) {
        let due = pour.due(window.t_s, window.dt_s, *poured);
        for new in pour.place(due, *poured, &motion.positions, &bodies.radii) {
            *poured += 1;
            let row = u32::try_from(bodies.len()).map_err(|_| {
                SolveError::Mismatch("particles: more of them than 32-bit indices can name; let fewer be poured".into())
            })?;
            let density_kg_m3 = model.settings.materials[usize::from(pour.material)].density_kg_m3;
            let mass = sphere_mass(new.radius_m, density_kg_m3);
            bodies.rows.push(row);
            bodies.ids.push(id_map.next_id);
            bodies.radii.push(new.radius_m);
            bodies.masses.push(mass);
            bodies.inertias.push(sphere_inertia(mass, new.radius_m));
            bodies.materials.push(pour.material);
            motion.positions.push(new.position_m);
            motion.velocities.push(new.velocity_m_s);
            motion.spins.push(Vec3::zeros());
            moduli.push(model.modulus(pour.material, model.settings.temperature_k));
            id_map.next_id += 1;
        }
    }
    Ok(bodies.len() - before)
}

fn moved(model: &Model, bodies: &Bodies, motion: &Motion, places: impl Iterator<Item = usize>) -> Moved {
    let body = |place: usize| Body {
        mass_kg: bodies.masses[place],
        inertia_kg_m2: bodies.inertias[place],
        position_m: motion.positions[place],
        velocity_m_s: motion.velocities[place],
        spin_1_s: motion.spins[place],
    };
    Moved::of(places.map(body), &model.gravity)
}

/// Values of the first `kept` places of the list that `order` sorts, in its order; zero for those that are new.
fn places_of(order: &[u32], kept: usize, value: impl Fn(usize) -> f64) -> Vec<f64> {
    order.iter().map(|&place| if (place as usize) < kept { value(place as usize) } else { 0.0 }).collect()
}

/// The rank of each value among all.
fn ranks(values: &[u32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0u32..).take(values.len()).collect();
    order.sort_unstable_by_key(|&place| values[place as usize]);
    let mut ranks = vec![0; values.len()];
    for (rank, place) in (0u32..).zip(order) {
        ranks[place as usize] = rank;
    }
    ranks
}
