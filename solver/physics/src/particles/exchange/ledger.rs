//! The particles' energy: stored at an instant, gained and lost during a window.

use stagger_coupling::SolveError;
use stagger_messages::Energy;

use crate::{
    common::{
        Vec3,
        checks::not_physical,
        walls::{Motion, Wall},
    },
    particles::{
        contact::normal::Normal as _,
        model::{
            Model,
            contact_list::ContactList,
            state::{Dissipation, State},
        },
    },
};

/// Kinetic, rotational, potential (−m g·r) and elastic energy of `state`, in J.
///
/// # Errors
/// [`SolveError::NotFinite`] names the fastest particle where the kinetic or the rotational energy overflows.
pub fn stored(model: &Model, state: &State) -> Result<Vec<Energy>, SolveError> {
    let State { motion, bodies, contacts, wall_contacts, .. } = state;
    let of_motion = |name, vectors: &[Vec3], inertias: &[f64]| {
        let twice_j: f64 = vectors.iter().zip(inertias).map(|(vector, m)| m * vector.norm_squared()).sum();
        if twice_j.is_finite() {
            return Ok(Energy::of_motion(name, 0.5 * twice_j));
        }
        let sizes = vectors.iter().map(Vec3::amax).zip(&bodies.rows);
        let (_, row) = sizes.fold((0.0, 0), |most, (size, &row)| if size > most.0 { (size, row) } else { most });
        Err(not_physical("particles", &format!("{name} energy"), row as usize, twice_j))
    };
    let kinetic = of_motion("kinetic", &motion.velocities, &bodies.masses)?;
    let positions = motion.positions.iter().zip(&bodies.masses);
    let potential: f64 = positions.map(|(position, mass)| -mass * model.gravity.dot(position)).sum();
    let elastic = elastic(model, contacts, wall_contacts, &bodies.in_rows(&state.moduli))?;
    let mut stored = vec![kinetic, Energy::stored("potential", potential), Energy::stored("elastic", elastic)];
    if model.contact.surface.bond.is_some() {
        stored.push(Energy::stored("bonds", contacts.bonds_j + wall_contacts.bonds_j));
    }
    if model.remembers() {
        stored.push(Energy::stored("tangential_springs", springs_j(state)));
    }
    let pistons = model.settings.walls.iter().zip(&state.walls).filter_map(|(wall, moved)| match &wall.motion {
        Motion::Pressed(piston) => Some(piston.energy_j(moved)),
        _ => None,
    });
    if let Some(energy) = pistons.reduce(|sum, energy| sum + energy) {
        stored.push(Energy::stored("pistons", energy));
    }
    if let Some(bonds) = &model.bonds {
        stored.push(Energy::stored("beams", bonds.stored_j(&state.bonds)));
    }
    if model.settings.spin {
        stored.push(of_motion("rotational", &motion.spins, &bodies.inertias)?);
    }
    Ok(stored)
}

/// What a window lost to damping, friction and drag, and gained by softening, in J.
///
/// What goes into tangential forces and is not held in their springs is friction. With a gas that streams, `drag` is
/// what the particles lose to it, which may be negative. The work of sound is booked where there is a push.
pub fn exchanged(
    model: &Model,
    (from, to): (&State, &State),
    dissipated: &Dissipation,
    softening: f64,
    pushed: bool,
) -> Vec<Energy> {
    let held = springs_j(to) - springs_j(from);
    let mut exchanged = vec![
        Energy::lost("contact_damping", dissipated.contact_damping),
        Energy::lost("friction", dissipated.friction - held),
        Energy::lost("drag", dissipated.drag),
        Energy::gained("softening", softening),
    ];
    let mut book = |booked: bool, entry: Energy| {
        if booked {
            exchanged.push(entry);
        }
    };
    book(model.contact.surface.rolls, Energy::lost("rolling", dissipated.rolling));
    let moving = |pistons: bool| {
        let is = |wall: &Wall| wall.motion != Motion::Fixed && matches!(wall.motion, Motion::Pressed(_)) == pistons;
        model.settings.walls.iter().any(is)
    };
    book(moving(false) || model.sinking_wall().is_some(), Energy::gained("walls", -dissipated.walls));
    book(moving(true), Energy::gained("pressing", -dissipated.force_controlled_walls));
    book(model.fields.near_field.is_some(), Energy::gained("near_field", -dissipated.near_field));
    book(pushed, Energy::gained("sound_work", -dissipated.sound));
    let electromagnetic = model.settings.fields.electromagnetic.is_some() || model.settings.fields.magnetic.is_some();
    book(electromagnetic, Energy::gained("fields", -dissipated.fields));
    book(model.bonds.is_some(), Energy::lost("bond_damping", dissipated.bonds));
    book(model.bonds.is_some(), Energy::lost("broken_bonds", dissipated.broken));
    exchanged
}

/// Change of the elastic energy by the change of the moduli at fixed geometry, in J; `start` are the moduli at the
/// window's start in the memory order of `from`.
///
/// What the frozen temperature at the window's start differs from the last window's end counts at the start's
/// geometry; the change over the window counts at the mean of both ends' geometry, second order in the window.
pub fn softening(model: &Model, from: &State, start: &[f64], to: &State) -> Result<f64, SolveError> {
    let before = |moduli: &[f64]| elastic(model, &from.contacts, &from.wall_contacts, moduli);
    let after = |moduli: &[f64]| elastic(model, &to.contacts, &to.wall_contacts, moduli);
    let (last, start) = (from.bodies.in_rows(&from.moduli), from.bodies.in_rows(start));
    let end = to.bodies.in_rows(&to.moduli);
    let corrected = before(&start)? - before(&last)?;
    let early = before(&end)? - before(&start)?;
    let late = after(&end)? - after(&start)?;
    Ok(corrected + 0.5 * (early + late))
}

/// Elastic energy of all contacts with the given moduli of the rows, in J.
fn elastic(model: &Model, contacts: &ContactList, walls: &ContactList, moduli: &[f64]) -> Result<f64, SolveError> {
    let pair = |[i, j]: [u32; 2]| model.contact.law.pair_modulus(moduli[i as usize], moduli[j as usize]);
    Ok(contacts.energy(pair)? + walls.energy(|[i, _]| moduli[i as usize])?)
}

fn springs_j(state: &State) -> f64 {
    state.contacts.springs_j + state.wall_contacts.springs_j
}
