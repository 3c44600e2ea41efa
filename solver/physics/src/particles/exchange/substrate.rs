//! What an elastic substrate under a wall reads of its contacts, and how its surface gives way under the particles.

use std::collections::BTreeMap;

use stagger_coupling::SolveError;
use stagger_messages::Field;

use crate::{
    common::Vec3,
    particles::model::{
        Model,
        state::{State, WallLoad},
    },
};

/// The loads of the wall contacts of `state`, as fields on its list of them.
///
/// A contact that the implicit rule's last iterate opened, within its tolerance, has no load yet: it stands at its
/// particle's centre with a force of zero.
pub fn wall_load_fields(model: &Model, state: &State) -> Result<[Field; 2], SolveError> {
    let contacts = &state.wall_contacts.pairs;
    let pairs = contacts.u32()?.as_chunks::<2>().0;
    let loads = &state.forces.on_contacts;
    let same = loads.len() == pairs.len() && loads.iter().zip(pairs).all(|(load, pair)| load.pair == *pair);
    let mut rows = Vec::with_capacity(pairs.len());
    if same {
        rows.extend(loads.iter().map(|load| (load.force, load.position)));
    } else {
        let mut by_pair: BTreeMap<[u32; 2], Vec<&WallLoad>> = BTreeMap::new();
        for load in loads.iter().rev() {
            by_pair.entry(load.pair).or_default().push(load);
        }
        let centres = state.bodies.in_rows(&state.motion.positions);
        for pair in pairs {
            let load = by_pair.get_mut(pair).and_then(Vec::pop);
            let none = || (Vec3::zeros(), centres[pair[0] as usize]);
            rows.push(load.map_or_else(none, |load| (load.force, load.position)));
        }
    }
    let column = |port, of: fn(&(Vec3, Vec3)) -> Vec3| {
        let values: Vec<f64> = rows.iter().flat_map(|row| <[f64; 3]>::from(of(row))).collect();
        Field::new(port, contacts.support.revision, values)
    };
    Ok([column(&model.ports.wall_loads.force, |row| row.0)?, column(&model.ports.wall_loads.position, |row| row.1)?])
}
