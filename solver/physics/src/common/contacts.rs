//! The contacts of one instant, as the fields of the particles' motion tell them.

use stagger_coupling::SolveError;
use stagger_messages::{Fields, Measure, Port};

use super::{
    checks::{field, not_physical, values},
    conductance::{Conductance, Partner, conductance},
};

/// Names of the fields of one kind of contact: indices, area, distance.
pub(crate) type Names = [&'static str; 3];
/// Contacts between two particles.
pub(crate) const PAIRS: Names = ["contact_pairs", "contact_area", "contact_distance"];
/// Contacts of a particle with a wall.
pub(crate) const WALLS: Names = ["wall_contact_pairs", "wall_contact_area", "wall_contact_distance"];

/// The ports a physics of both kinds of contact reads.
pub(crate) fn ports() -> Vec<Port> {
    let of = |[pairs, area, distance]: Names, support: &str| {
        let metric = |name, unit| Port::f64(name, unit, support, 1, Measure::None);
        [Port::u32(pairs, support, 2), metric(area, "m^2"), metric(distance, "m")]
    };
    [of(PAIRS, "contacts"), of(WALLS, "wall-contacts")].concat()
}

/// A row of a list of contacts.
pub(crate) struct Contact {
    names: Names,
    pub(crate) row: usize,
    /// Two particles, or a particle and a wall; not yet known to exist.
    pub(crate) indices: [usize; 2],
    /// In m².
    pub(crate) area_m2: f64,
    /// Between the centres, or from the centre to the wall, in m.
    distance_m: f64,
}

impl Contact {
    /// What it conducts of heat in W/K or of current in S, by the `conductivity` in W/(m K) or S/m: that of
    /// [`Conductance::between`], or of the particle where its partner is a wall.
    pub(crate) fn conductance(&self, node: &str, model: Conductance, conductivity: f64) -> Result<f64, SolveError> {
        let partner = if self.names == WALLS { Partner::Wall } else { Partner::Particle };
        conductance(model, partner, conductivity, self.area_m2, self.distance_m)
            .ok_or_else(|| not_physical(node, self.names[2], self.row, self.distance_m))
    }
}

/// The contacts of one kind, row by row, once their fields are known to stand on the same rows.
pub(crate) fn contacts<'f>(
    node: &str,
    fields: &'f Fields,
    names: Names,
) -> Result<impl Iterator<Item = Contact> + 'f, SolveError> {
    let [pairs, area, distance] = names;
    let list = field(fields, pairs)?;
    let of = format!("`{pairs}`");
    let areas = values(node, fields, area, list.rows(), &of)?;
    let distances = values(node, fields, distance, list.rows(), &of)?;
    for name in [area, distance] {
        let (found, expected) = (field(fields, name)?.support.revision, list.support.revision);
        if found != expected {
            return Err(SolveError::Mismatch(format!(
                "{node}: field `{name}` is of contact list {found}, but {of} is list {expected}"
            )));
        }
    }
    let rows = list.u32()?.chunks_exact(2).zip(areas.iter().zip(distances)).enumerate();
    Ok(rows.map(move |(row, (indices, (&area_m2, &distance_m)))| {
        let indices = [indices[0] as usize, indices[1] as usize];
        Contact { names, row, indices, area_m2, distance_m }
    }))
}

/// Refuses an index that a row of a list of contacts names and nothing has.
pub(crate) fn in_range(
    node: &str,
    [list, ..]: Names,
    row: usize,
    what: &str,
    index: usize,
    count: usize,
) -> Result<(), SolveError> {
    if index < count {
        return Ok(());
    }
    Err(SolveError::Mismatch(format!(
        "{node}: field `{list}` names {what} {index} in row {row}, but there are {count}, counted from 0"
    )))
}
