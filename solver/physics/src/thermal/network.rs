//! The contacts of one instant as a network of conductances.

use stagger_coupling::SolveError;
use stagger_messages::Fields;

use super::{Conductance, NODE, Settings};
use crate::common::{
    SolidSurface,
    checks::{field, values},
    contacts::{Contact, Names, PAIRS, WALLS, contacts, in_range},
};

/// Conductances between particles, and between particles and walls of given temperature, at one instant.
#[derive(Clone)]
pub(super) struct Network {
    model: Conductance,
    pairs: Vec<Pair>,
    walls: Vec<WallLink>,
    /// Sum of the conductances at each particle, in W/K.
    pub(super) at_particle_w_k: Vec<f64>,
    /// Largest Biot number of a contact: Bi = G/(K R), the larger one of its two particles (see [`super::Thermal`]).
    pub(super) biot: f64,
    /// Cells of the solid's upper face, where there is one.
    surface_cells: usize,
}

/// Heat that flows to walls, in W.
#[derive(Clone, Debug, Default)]
pub(super) struct ToWalls {
    /// To those of given temperature.
    pub(super) held_w: f64,
    /// To each cell of the solid's upper face; empty where there is none.
    pub(super) surface_w: Vec<f64>,
}

/// The same over a window, in J.
#[derive(Default)]
pub(super) struct GivenToWalls {
    pub(super) held_j: f64,
    pub(super) surface_j: Vec<f64>,
}

impl ToWalls {
    /// What is given over a window of which the end and the start count for these times, in s.
    pub(super) fn over(&self, end_s: f64, start: &Self, start_s: f64) -> GivenToWalls {
        let mean = |end: f64, start: f64| end_s * end + start_s * start;
        let surface = self.surface_w.iter().zip(&start.surface_w);
        GivenToWalls {
            held_j: mean(self.held_w, start.held_w),
            surface_j: surface.map(|(end, start)| mean(*end, *start)).collect(),
        }
    }
}

#[derive(Clone)]
struct Pair {
    i: usize,
    j: usize,
    conductance_w_k: f64,
    /// The conductance over the conductivity, in m, where particles have conductivities of their own; else 0.
    shape_m: f64,
}

#[derive(Clone)]
struct WallLink {
    i: usize,
    wall_temperature_k: f64,
    /// The cell of the solid's upper face that it lies on; `None` where the wall has a temperature of its own.
    cell: Option<u32>,
    conductance_w_k: f64,
    /// As that of a pair.
    shape_m: f64,
}

/// Conductivities K of the particles, in W/(m K).
#[derive(Clone, Copy)]
pub(super) enum Conductivities<'k> {
    /// One for all.
    All(f64),
    /// One for each.
    Each(&'k [f64]),
}

impl Conductivities<'_> {
    fn at(self, particle: usize) -> f64 {
        match self {
            Self::All(conductivity) => conductivity,
            Self::Each(conductivities) => conductivities[particle],
        }
    }

    /// Conductance and shape of a contact; where each particle has its own conductivity, [`Network::conduct`] adds the
    /// conductance.
    fn of(self, contact: &Contact, settings: &Settings) -> Result<[f64; 2], SolveError> {
        let conductance = |conductivity| contact.conductance(NODE, settings.conductance, conductivity);
        Ok(match self {
            Self::All(conductivity) => [conductance(conductivity)?, 0.0],
            Self::Each(_) => [0.0, conductance(1.0)?],
        })
    }
}

impl Network {
    /// Reads the contacts in `fields` and checks that they fit each other and the scene; `radii_m` are those of the
    /// particles that conduct. Where the contacts number others, `rows` says which of those each one is, and contacts
    /// of a particle that is gone conduct nothing.
    pub(super) fn new(
        settings: &Settings,
        conductivities: Conductivities<'_>,
        fields: &Fields,
        radii_m: &[f64],
        rows: Option<&[Option<u32>]>,
    ) -> Result<Self, SolveError> {
        let mut network = Self {
            model: settings.conductance,
            pairs: Vec::new(),
            walls: Vec::new(),
            at_particle_w_k: vec![0.0; radii_m.len()],
            biot: 0.0,
            surface_cells: settings.on_solid().map_or(0, SolidSurface::len),
        };
        let numbered = Numbered { rows, count: rows.map_or(radii_m.len(), <[_]>::len) };
        network.read_pairs(settings, conductivities, fields, numbered)?;
        network.read_walls(settings, conductivities, fields, numbered)?;
        network.conduct(conductivities);
        network.add_up(conductivities, radii_m);
        Ok(network)
    }

    fn read_pairs(
        &mut self,
        settings: &Settings,
        conductivities: Conductivities<'_>,
        fields: &Fields,
        numbered: Numbered<'_>,
    ) -> Result<(), SolveError> {
        for contact in contacts(NODE, fields, PAIRS)? {
            let [conductance_w_k, shape_m] = conductivities.of(&contact, settings)?;
            let ([i, j], row) = (contact.indices, contact.row);
            let (i, j) = (numbered.particle(PAIRS, row, i)?, numbered.particle(PAIRS, row, j)?);
            if let (Some(i), Some(j), true) = (i, j, conductance_w_k > 0.0 || shape_m > 0.0) {
                self.pairs.push(Pair { i, j, conductance_w_k, shape_m });
            }
        }
        Ok(())
    }

    fn read_walls(
        &mut self,
        settings: &Settings,
        conductivities: Conductivities<'_>,
        fields: &Fields,
        numbered: Numbered<'_>,
    ) -> Result<(), SolveError> {
        let solid = settings.on_solid().map(|solid| OnSolid::new(solid, fields)).transpose()?;
        for contact in contacts(NODE, fields, WALLS)? {
            let [conductance_w_k, shape_m] = conductivities.of(&contact, settings)?;
            let ([i, wall], row) = (contact.indices, contact.row);
            let own = i;
            let i = numbered.particle(WALLS, row, i)?;
            in_range(NODE, WALLS, row, "wall", wall, settings.walls.len())?;
            let (wall_temperature_k, cell) = match &solid {
                Some(solid) if solid.surface.wall == u32::try_from(wall).ok() => {
                    let (temperature_k, cell) = solid.at(own, row)?;
                    (Some(temperature_k), Some(cell))
                }
                _ => (settings.walls[wall].temperature_k, None),
            };
            if let (Some(i), Some(wall_temperature_k), true) = (i, wall_temperature_k, conductance_w_k + shape_m > 0.0)
            {
                self.walls.push(WallLink { i, wall_temperature_k, cell, conductance_w_k, shape_m });
            }
        }
        Ok(())
    }

    /// Takes the conductances that follow from conductivities of the particles' own, with K_ij of [`Conductance::between`].
    fn conduct(&mut self, conductivities: Conductivities<'_>) {
        let Conductivities::Each(conductivities) = conductivities else { return };
        for pair in &mut self.pairs {
            pair.conductance_w_k = self.model.between(conductivities[pair.i], conductivities[pair.j]) * pair.shape_m;
        }
        for link in &mut self.walls {
            link.conductance_w_k = conductivities[link.i] * link.shape_m;
        }
    }

    /// Takes other conductivities than those it was read with.
    pub(super) fn conduct_with(&mut self, conductivities: &[f64], radii_m: &[f64]) {
        self.conduct(Conductivities::Each(conductivities));
        self.add_up(Conductivities::Each(conductivities), radii_m);
    }

    fn add_up_conductances(&mut self) {
        self.at_particle_w_k.fill(0.0);
        for &Pair { i, j, conductance_w_k, .. } in &self.pairs {
            self.at_particle_w_k[i] += conductance_w_k;
            self.at_particle_w_k[j] += conductance_w_k;
        }
        for &WallLink { i, conductance_w_k, .. } in &self.walls {
            self.at_particle_w_k[i] += conductance_w_k;
        }
    }

    fn add_up(&mut self, conductivities: Conductivities<'_>, radii_m: &[f64]) {
        self.add_up_conductances();
        self.biot = 0.0;
        let biot = |particle: usize, conductance_w_k: f64| match conductivities.at(particle) {
            // It conducts because its partner does, and nothing reaches its inside.
            conductivity if conductivity <= 0.0 => 0.0,
            conductivity => conductance_w_k / (conductivity * radii_m[particle]),
        };
        for &Pair { i, j, conductance_w_k, .. } in &self.pairs {
            self.biot = self.biot.max(biot(i, conductance_w_k)).max(biot(j, conductance_w_k));
        }
        for &WallLink { i, conductance_w_k, .. } in &self.walls {
            self.biot = self.biot.max(biot(i, conductance_w_k));
        }
    }

    /// Heat flowing into each particle, in W (Zohdi 2018, eq. 6.36); returns what flows out to the walls.
    ///
    /// What one partner of a contact gains the other loses, to the last bit.
    pub(super) fn heat_flow(&self, temperatures_k: &[f64], into_w: &mut [f64]) -> ToWalls {
        into_w.fill(0.0);
        for &Pair { i, j, conductance_w_k, .. } in &self.pairs {
            let flow_w = conductance_w_k * (temperatures_k[j] - temperatures_k[i]);
            into_w[i] += flow_w;
            into_w[j] -= flow_w;
        }
        let mut to_walls = ToWalls { held_w: 0.0, surface_w: vec![0.0; self.surface_cells] };
        for &WallLink { i, wall_temperature_k, cell, conductance_w_k, .. } in &self.walls {
            let flow_w = conductance_w_k * (wall_temperature_k - temperatures_k[i]);
            into_w[i] += flow_w;
            match cell {
                Some(cell) => to_walls.surface_w[cell as usize] -= flow_w,
                None => to_walls.held_w -= flow_w,
            }
        }
        to_walls
    }

    /// What the heat flowing into each particle changes by where the temperatures change by `change_k` and the conductances
    /// stay, in W.
    pub(super) fn response(&self, change_k: &[f64], into_w: &mut [f64]) {
        into_w.fill(0.0);
        for &Pair { i, j, conductance_w_k, .. } in &self.pairs {
            let flow_w = conductance_w_k * (change_k[j] - change_k[i]);
            into_w[i] += flow_w;
            into_w[j] -= flow_w;
        }
        for &WallLink { i, conductance_w_k, .. } in &self.walls {
            into_w[i] -= conductance_w_k * change_k[i];
        }
    }

    /// The same where each particle is there for a share of the time only, and a contact for as long as both partners are:
    /// means over the time.
    pub(super) fn lasting(&self, shares: &[f64]) -> Self {
        let pair = |&Pair { i, j, conductance_w_k, shape_m }: &Pair| {
            let share = shares[i].min(shares[j]);
            Pair { i, j, conductance_w_k: share * conductance_w_k, shape_m: share * shape_m }
        };
        let wall = |link: &WallLink| {
            let share = shares[link.i];
            WallLink { conductance_w_k: share * link.conductance_w_k, shape_m: share * link.shape_m, ..*link }
        };
        let mut lasting = Self {
            model: self.model,
            pairs: self.pairs.iter().map(pair).collect(),
            walls: self.walls.iter().map(wall).collect(),
            at_particle_w_k: vec![0.0; self.at_particle_w_k.len()],
            biot: self.biot,
            surface_cells: self.surface_cells,
        };
        lasting.add_up_conductances();
        lasting
    }

    /// The contacts with walls: the particle, and the wall's temperature in K.
    pub(super) fn with_walls(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.walls.iter().map(|link| (link.i, link.wall_temperature_k))
    }

    /// The contacts between particles: i, j, and the conductance in W/K.
    pub(super) fn between_particles(&self) -> impl Iterator<Item = (u32, u32, f64)> + Clone + '_ {
        self.pairs.iter().map(|pair| (pair.i as u32, pair.j as u32, pair.conductance_w_k))
    }
}

/// The solid under a wall at one instant.
struct OnSolid<'f> {
    surface: &'f SolidSurface,
    temperatures_k: &'f [f64],
    /// Places of the particles, in m: they touch the upper face right below.
    positions_m: &'f [f64],
}

impl<'f> OnSolid<'f> {
    fn new(surface: &'f SolidSurface, fields: &'f Fields) -> Result<Self, SolveError> {
        let rows = field(fields, "radii")?.rows();
        Ok(Self {
            surface,
            temperatures_k: values(NODE, fields, "surface_temperature", surface.len(), "the solid's upper face")?,
            positions_m: values(NODE, fields, "positions", rows, "`radii`")?,
        })
    }

    /// Temperature in K of the cell under a particle, and the cell. Beyond the edge the nearest cell counts.
    fn at(&self, particle: usize, row: usize) -> Result<(f64, u32), SolveError> {
        in_range(NODE, WALLS, row, "particle", particle, self.positions_m.len() / 3)?;
        let cell = self.surface.cell_at(self.positions_m[3 * particle], self.positions_m[3 * particle + 1]);
        let count = u32::try_from(cell).map_err(|_| SolveError::Mismatch(format!("{NODE}: too many cells")))?;
        Ok((self.temperatures_k[cell], count))
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
    fn particle(&self, names: Names, row: usize, index: usize) -> Result<Option<usize>, SolveError> {
        in_range(NODE, names, row, "particle", index, self.count)?;
        Ok(self.rows.map_or(Some(index), |rows| rows[index].map(|row| row as usize)))
    }
}
