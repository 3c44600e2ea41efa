//! What the particles write: the fields, energies and figures of a state.

use std::{collections::BTreeMap, sync::Arc};

use stagger_coupling::{Reply, SolveError};
use stagger_messages::{Field, Fields, Port};

use super::{ledger::stored, substrate::wall_load_fields};
use crate::{
    common::{Vec3, walls::Motion as WallMotion},
    particles::model::{Model, state::State},
};

/// Vectors in memory order as a field on the rows of `state`.
pub fn vectors(port: &Arc<Port>, state: &State, vectors: &[Vec3]) -> Result<Field, SolveError> {
    let rows = state.bodies.in_rows(vectors);
    let values: Vec<f64> = rows.iter().flat_map(|vector| [vector.x, vector.y, vector.z]).collect();
    Ok(Field::new(port, state.id_map.revision, values)?)
}

/// The fields and the stored energy of `state`.
pub fn reply(model: &Model, state: &State) -> Result<Reply, SolveError> {
    let bodies = &state.bodies;
    let mut fields = Fields::new();
    let revision = state.id_map.revision;
    let motion = [
        vectors(&model.ports.positions, state, &state.motion.positions)?,
        vectors(&model.ports.velocities, state, &state.motion.velocities)?,
        Field::new(&model.ports.radii, revision, bodies.in_rows(&bodies.radii))?,
    ];
    let lists = state.contacts.fields().chain(state.wall_contacts.fields());
    for field in motion.into_iter().chain(identities(model, state)?).chain(lists.cloned()) {
        fields.insert(field.name().into(), field);
    }
    if model.settings.substrate.is_some() {
        for field in wall_load_fields(model, state)? {
            fields.insert(field.name().into(), field);
        }
    }
    let figures = pressed(model, state);
    let mut reply = Reply { fields, figures, ledger: stored(model, state)?, ..Reply::default() };
    let deepest = state.contacts.deepest.max(state.wall_contacts.deepest);
    reply.figures.insert("largest overlap over radius".into(), deepest);
    Ok(reply)
}

/// Who the particles of `state` are and what they are made of, where somebody may ask.
fn identities(model: &Model, state: &State) -> Result<Vec<Field>, SolveError> {
    let (bodies, revision) = (&state.bodies, state.id_map.revision);
    let mut identities = Vec::new();
    if model.come_and_go() {
        identities.push(Field::new(&model.ports.ids, revision, bodies.in_rows(&bodies.ids))?);
    }
    if model.settings.writes_material {
        let materials: Vec<u32> = bodies.in_rows(&bodies.materials).into_iter().map(u32::from).collect();
        identities.push(Field::new(&model.ports.material, revision, materials)?);
    }
    Ok(identities)
}

/// What is known of each pressed wall: the force of the particles against its direction, in N, which is the set force at
/// rest; and how far it has moved, in m.
fn pressed(model: &Model, state: &State) -> BTreeMap<String, f64> {
    let mut figures = BTreeMap::new();
    for ((wall, moved), force) in model.settings.walls.iter().zip(&state.walls).zip(&state.forces.on_walls) {
        if let WallMotion::Pressed(piston) = &wall.motion {
            let against_n = -force.dot(&Vec3::from(piston.direction));
            figures.insert(format!("force on {} [N]", wall.name), against_n);
            figures.insert(wall.displacement_figure(), moved.displacement_m);
        }
    }
    figures
}
