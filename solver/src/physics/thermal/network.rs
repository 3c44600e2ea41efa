//! The contacts of one instant as a network of conductances.

use stagger_messages::Fields;

use super::{NODE, Settings, conductance::conductance};
use crate::{
    SolveError,
    physics::checks::{field, not_physical, values},
};

/// Conductances between particles, and between particles and walls of given temperature, at one instant.
pub(super) struct Network {
    pairs: Vec<Pair>,
    walls: Vec<WallLink>,
    /// Sum of the conductances at each particle, in W/K.
    pub(super) at_particle_w_k: Vec<f64>,
    /// Largest Biot number of a contact: Bi = G/(K R), R the smaller radius (see [`super::Thermal`]).
    pub(super) biot: f64,
}

struct Pair {
    i: usize,
    j: usize,
    conductance_w_k: f64,
}

struct WallLink {
    i: usize,
    wall_temperature_k: f64,
    conductance_w_k: f64,
}

impl Network {
    /// Reads the contacts in `fields` and checks that they fit each other and the scene; `radii_m` are those of the
    /// particles that conduct. Where the contacts number others, `rows` says which of those each one is, and contacts
    /// of a particle that is gone conduct nothing.
    pub(super) fn new(
        settings: &Settings,
        fields: &Fields,
        radii_m: &[f64],
        rows: Option<&[Option<u32>]>,
    ) -> Result<Self, SolveError> {
        let mut network =
            Self { pairs: Vec::new(), walls: Vec::new(), at_particle_w_k: vec![0.0; radii_m.len()], biot: 0.0 };
        let numbered = Numbered { rows, count: rows.map_or(radii_m.len(), <[_]>::len) };
        network.read_pairs(settings, fields, radii_m, numbered)?;
        network.read_walls(settings, fields, radii_m, numbered)?;
        Ok(network)
    }

    fn read_pairs(
        &mut self,
        settings: &Settings,
        fields: &Fields,
        radii_m: &[f64],
        numbered: Numbered<'_>,
    ) -> Result<(), SolveError> {
        for (row, contact) in contacts(settings, fields, PAIRS)?.enumerate() {
            let Contact { indices: [i, j], conductance_w_k } = contact?;
            let (i, j) = (numbered.particle(PAIRS[0], row, i)?, numbered.particle(PAIRS[0], row, j)?);
            if let (Some(i), Some(j), true) = (i, j, conductance_w_k > 0.0) {
                self.pairs.push(Pair { i, j, conductance_w_k });
                self.at_particle_w_k[i] += conductance_w_k;
                self.at_particle_w_k[j] += conductance_w_k;
                self.see(settings, conductance_w_k, radii_m[i].min(radii_m[j]));
            }
        }
        Ok(())
    }

    fn read_walls(
        &mut self,
        settings: &Settings,
        fields: &Fields,
        radii_m: &[f64],
        numbered: Numbered<'_>,
    ) -> Result<(), SolveError> {
        for (row, contact) in contacts(settings, fields, WALLS)?.enumerate() {
            let Contact { indices: [i, wall], conductance_w_k } = contact?;
            let i = numbered.particle(WALLS[0], row, i)?;
            in_range(WALLS[0], row, "wall", wall, settings.walls.len())?;
            let wall_temperature_k = settings.walls[wall].temperature_k;
            if let (Some(i), Some(wall_temperature_k), true) = (i, wall_temperature_k, conductance_w_k > 0.0) {
                self.walls.push(WallLink { i, wall_temperature_k, conductance_w_k });
                self.at_particle_w_k[i] += conductance_w_k;
                self.see(settings, conductance_w_k, radii_m[i]);
            }
        }
        Ok(())
    }

    fn see(&mut self, settings: &Settings, conductance_w_k: f64, radius_m: f64) {
        self.biot = self.biot.max(conductance_w_k / (settings.conductivity_w_m_k * radius_m));
    }

    /// Heat flowing into each particle, in W (Zohdi 2018, eq. 6.36); returns what flows out to the walls, in W.
    ///
    /// What one partner of a contact gains the other loses, to the last bit.
    pub(super) fn heat_flow(&self, temperatures_k: &[f64], into_w: &mut [f64]) -> f64 {
        into_w.fill(0.0);
        for &Pair { i, j, conductance_w_k } in &self.pairs {
            let flow_w = conductance_w_k * (temperatures_k[j] - temperatures_k[i]);
            into_w[i] += flow_w;
            into_w[j] -= flow_w;
        }
        let mut to_walls_w = 0.0;
        for &WallLink { i, wall_temperature_k, conductance_w_k } in &self.walls {
            let flow_w = conductance_w_k * (wall_temperature_k - temperatures_k[i]);
            into_w[i] += flow_w;
            to_walls_w -= flow_w;
        }
        to_walls_w
    }
}

/// How a list of contacts numbers the particles.
#[derive(Clone, Copy)]
struct Numbered<'r> {
    rows: Option<&'r [Option<u32>]>,
    count: usize,
}

impl Numbered<'_> {
    /// The row of the particle that the list calls `index`; `None` where it is gone.
    fn particle(&self, name: &str, row: usize, index: usize) -> Result<Option<usize>, SolveError> {
        in_range(name, row, "particle", index, self.count)?;
        Ok(self.rows.map_or(Some(index), |rows| rows[index].map(|row| row as usize)))
    }
}

/// Names of the fields of one kind of contact: indices, area, distance.
type Names = [&'static str; 3];
const PAIRS: Names = ["contact_pairs", "contact_area", "contact_distance"];
const WALLS: Names = ["wall_contact_pairs", "wall_contact_area", "wall_contact_distance"];

struct Contact {
    indices: [usize; 2],
    conductance_w_k: f64,
}

/// The contacts of one kind, row by row, once their fields are known to stand on the same rows.
fn contacts<'a>(
    settings: &'a Settings,
    fields: &'a Fields,
    [pairs, area, distance]: Names,
) -> Result<impl Iterator<Item = Result<Contact, SolveError>> + 'a, SolveError> {
    let list = field(fields, pairs)?;
    let of = format!("`{pairs}`");
    let areas = values(NODE, fields, area, list.rows(), &of)?;
    let distances = values(NODE, fields, distance, list.rows(), &of)?;
    for name in [area, distance] {
        let (found, expected) = (field(fields, name)?.support.revision, list.support.revision);
        if found != expected {
            return Err(SolveError::Mismatch(format!(
                "{NODE}: field `{name}` is of contact list {found}, but {of} is list {expected}"
            )));
        }
    }
    let rows = list.u32()?.chunks_exact(2).zip(areas.iter().zip(distances)).enumerate();
    Ok(rows.map(move |(row, (indices, (&area_m2, &distance_m)))| {
        let conductance_w_k = conductance(settings.conductance, settings.conductivity_w_m_k, area_m2, distance_m)
            .ok_or_else(|| not_physical(NODE, distance, row, distance_m))?;
        Ok(Contact { indices: [indices[0] as usize, indices[1] as usize], conductance_w_k })
    }))
}

fn in_range(name: &str, row: usize, what: &str, index: usize, count: usize) -> Result<(), SolveError> {
    if index < count {
        return Ok(());
    }
    Err(SolveError::Mismatch(format!(
        "{NODE}: field `{name}` names {what} {index} in row {row}, but there are {count}, counted from 0"
    )))
}
