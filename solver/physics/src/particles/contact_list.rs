//! The contacts at the end of a window, as other physics read them.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use stagger_messages::{Field, Geometry, Measure, MessageError, Port};

use super::{
    PARALLEL_PARTICLES, Particles, State, Vec3,
    blocks::Block,
    bodies::Bodies,
    contact::{Normal as _, reduced},
    lists::Lists,
    pair_table::PairLaw,
    sliding,
    springs::Springs,
    state,
};
use crate::common::walls::{Motion, Pose};

/// Ports of one list of contacts: indices, area, distance; the force where it is asked for.
#[derive(Debug)]
pub(super) struct ContactPorts {
    pairs: Arc<Port>,
    area: Arc<Port>,
    distance: Arc<Port>,
    force: Option<Arc<Port>>,
}

impl ContactPorts {
    /// Ports on `support`, their names beginning with `prefix`.
    pub fn new(prefix: &str, support: &str, forces: bool) -> Self {
        let port = |name: &str, unit| Port::f64(&format!("{prefix}_{name}"), unit, support, 1, Measure::None);
        Self {
            pairs: Arc::new(Port::u32(&format!("{prefix}_pairs"), support, 2)),
            area: Arc::new(port("area", "m^2")),
            distance: Arc::new(port("distance", "m")),
            force: forces.then(|| Arc::new(port("normal_force", "N"))),
        }
    }

    /// The support of the list: pairs of rows of `of` and `with`.
    pub fn geometry(&self, of: &str, with: &str) -> Geometry {
        Geometry::pairs(&self.pairs.support, &self.pairs.field, of, with)
    }

    pub fn all(&self) -> impl Iterator<Item = &Arc<Port>> {
        [&self.pairs, &self.area, &self.distance].into_iter().chain(&self.force)
    }

    /// The list as fields. Where its pairs are those of `before` it keeps their revision, else it takes the next one.
    pub fn list(&self, found: &[Found], before: Option<&ContactList>) -> Result<ContactList, MessageError> {
        let indices: Vec<u32> = found.iter().flat_map(|contact| contact.pair).collect();
        let pairs = match before {
            Some(before) if before.pairs.u32()? == indices => before.pairs.clone(),
            Some(before) => Field::new(&self.pairs, before.pairs.support.revision + 1, indices)?,
            None => Field::new(&self.pairs, 0, indices)?,
        };
        let revision = pairs.support.revision;
        let areas: Vec<f64> = found.iter().map(|contact| contact.area_m2).collect();
        let distances: Vec<f64> = found.iter().map(|contact| contact.distance_m).collect();
        Ok(ContactList {
            area: Field::new(&self.area, revision, areas)?,
            distance: Field::new(&self.distance, revision, distances)?,
            force: (self.force.as_ref())
                .map(|port| Field::new(port, revision, found.iter().map(|contact| contact.force_n).collect::<Vec<_>>()))
                .transpose()?,
            pairs,
            energy_per_modulus: found.iter().map(|contact| contact.energy_per_modulus).collect(),
            bonds_j: found.iter().map(|contact| contact.other_j[0]).sum(),
            springs_j: found.iter().map(|contact| contact.other_j[1]).sum(),
            deepest: found.iter().fold(0.0, |deepest, contact| contact.relative_overlap.max(deepest)),
        })
    }
}

/// One contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Rows of the particles, or of the particle and the wall.
    pair: [u32; 2],
    area_m2: f64,
    distance_m: f64,
    /// Elastic normal force Ψ, in N.
    force_n: f64,
    energy_per_modulus: f64,
    /// Energy of the bond and of the tangential spring, in J.
    other_j: [f64; 2],
    relative_overlap: f64,
    yields: Yield,
}

/// How hard a contact is for the step, as its particles' motion feels it.
#[derive(Clone, Copy, Debug)]
struct Yield {
    /// Stiffness of its springs, in N/m.
    stiffness_n_m: f64,
    /// Its damping c_cd A, in kg/s.
    damping_kg_s: f64,
    /// Tangential damping over Δt of what sticks by eq. 6.13 and of the bond's shear, in N/m.
    sticking_n_m: f64,
}

/// A list of contacts at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ContactList {
    pub pairs: Field,
    pub area: Field,
    pub distance: Field,
    /// Elastic normal forces, where they are written.
    pub force: Option<Field>,
    /// Elastic energy over the contact's modulus, in m³ (m² for the linear law).
    pub energy_per_modulus: Vec<f64>,
    /// Potential of the bonds, in J.
    pub bonds_j: f64,
    /// Energy of the tangential springs, in J.
    pub springs_j: f64,
    /// Largest overlap over the smaller radius.
    pub deepest: f64,
}

impl ContactList {
    pub fn fields(&self) -> impl Iterator<Item = &Field> {
        [&self.pairs, &self.area, &self.distance].into_iter().chain(&self.force)
    }

    /// Σ energy, each contact's energy per modulus times `modulus(pair)`, in J; without bonds and springs.
    pub fn energy(&self, modulus: impl Fn([u32; 2]) -> f64) -> Result<f64, MessageError> {
        let pairs = self.pairs.u32()?.as_chunks::<2>().0;
        Ok(pairs.iter().zip(&self.energy_per_modulus).map(|(&pair, energy)| energy * modulus(pair)).sum())
    }
}

/// Where the contacts of an instant are looked for; in memory order.
#[derive(Clone, Copy)]
pub(super) struct Snapshot<'a> {
    pub bodies: &'a Bodies,
    pub motion: &'a state::Motion,
    pub moduli: &'a [f64],
    pub lists: &'a Lists,
    pub springs: &'a [Springs],
    pub poses: &'a [Pose],
    /// How far the surface of the wall that gives way has sunk under each particle, in m; empty where none does.
    pub sunk_m: &'a [f64],
}

/// The contacts of an instant, and the step that they and the bonds allow.
pub(super) struct Contacts {
    pub pairs: ContactList,
    pub walls: ContactList,
    pub critical_s: f64,
    pub stable_s: f64,
}

impl Particles {
    /// The contacts at an instant, as lists that follow those of `before`; `bonds_1_s` is the largest ω of the bonds.
    pub(super) fn contacts(
        &self,
        at: Snapshot<'_>,
        before: Option<&State>,
        bonds_1_s: f64,
    ) -> Result<Contacts, MessageError> {
        let (found, found_walls) = (self.find_contacts(at), self.find_wall_contacts(at));
        let [critical_s, stable_s] = self.largest_steps(at.bodies, &found, &found_walls, bonds_1_s);
        Ok(Contacts {
            pairs: self.contact_ports.list(&found, before.map(|state| &state.contacts))?,
            walls: self.wall_contact_ports.list(&found_walls, before.map(|state| &state.wall_contacts))?,
            critical_s,
            stable_s,
        })
    }

    /// Contacts between particles, in the order of the lists, which must hold.
    fn find_contacts(&self, at: Snapshot<'_>) -> Vec<Found> {
        let Snapshot { bodies, motion, moduli, lists, .. } = at;
        let positions = &motion.positions;
        let of_block = |(index, block): (usize, &Block)| -> Vec<Found> {
            let find = |(entry, [i, j]): (usize, [u32; 2])| {
                let (i, j) = (i as usize, j as usize);
                let (radius_i, radius_j) = (bodies.radii[i], bodies.radii[j]);
                let sum = radius_i + radius_j;
                let distance_squared = (positions[j] - positions[i]).norm_squared();
                (distance_squared < sum * sum).then(|| {
                    let distance_m = distance_squared.sqrt();
                    let overlap = sum - distance_m;
                    let touch = self.law.pair(overlap, distance_m, radius_i, radius_j);
                    let secant_n_m = self.law.pair_modulus(moduli[i], moduli[j]) * touch.secant;
                    let pair = self.table.get(bodies.materials[i], bodies.materials[j]);
                    let bond = self.surface.bond.map_or(0.0, |bond| {
                        bond.energy(overlap, sum, |depth| self.law.pair(depth, sum - depth, radius_i, radius_j).area_m2)
                    });
                    let spring = self.remembers().then(|| at.springs[index].pair(entry));
                    let (row_i, row_j) = (bodies.rows[i], bodies.rows[j]);
                    Found {
                        pair: [row_i.min(row_j), row_i.max(row_j)],
                        area_m2: touch.area_m2,
                        distance_m,
                        force_n: secant_n_m * overlap,
                        energy_per_modulus: self.law.pair_energy(overlap, radius_i, radius_j),
                        other_j: [bond, spring_energy(pair, secant_n_m, spring)],
                        relative_overlap: overlap / radius_i.min(radius_j),
                        yields: self.yields(pair, secant_n_m, [overlap, overlap / sum, touch.area_m2], || {
                            let mass = reduced(bodies.masses[i], bodies.masses[j]);
                            (mass, sliding::of_pair(self.surface.arms_by_radius, bodies, motion, [i, j]))
                        }),
                    }
                })
            };
            block.pairs().enumerate().filter_map(find).collect()
        };
        let blocks = &lists.pairs.blocks;
        let found: Vec<Vec<Found>> = if positions.len() > PARALLEL_PARTICLES {
            blocks.par_iter().enumerate().map(of_block).collect()
        } else {
            blocks.iter().enumerate().map(of_block).collect()
        };
        found.concat()
    }

    /// Contacts with walls, in the order of the lists, which must hold; a particle in a corner of one wall has a row for
    /// each of its surfaces.
    fn find_wall_contacts(&self, at: Snapshot<'_>) -> Vec<Found> {
        let mut found = Vec::new();
        let mut touches = Vec::new();
        let sinking = self.sinking_wall();
        for (block, walls, springs) in at.lists.blocks(at.springs) {
            for encounter in &walls.encounters {
                let i = (block.first + encounter.particle) as usize;
                let wall = encounter.wall as usize;
                let radius = at.bodies.radii[i];
                let features = &walls.features[encounter.range()];
                touches.clear();
                let sunk_m = if sinking == Some(wall) { at.sunk_m[i] } else { 0.0 };
                let seen = self.seen_from(wall, &at.poses[wall], &at.motion.positions[i], sunk_m);
                self.surfaces[wall].touch(&seen, radius, features, &mut touches);
                for touch in &touches {
                    let overlap = radius - touch.distance;
                    let contact = self.law.wall(overlap, radius).shared(touch.share);
                    let secant_n_m = at.moduli[i] * contact.secant;
                    let pair = self.table.get(at.bodies.materials[i], self.wall_materials[wall]);
                    let bond = self.surface.bond.map_or(0.0, |bond| {
                        let area_m2 = |depth| touch.share * self.law.wall(depth, radius).area_m2;
                        bond.energy(overlap, radius, area_m2)
                    });
                    let entry = encounter.features.start as usize + touch.entry as usize;
                    let spring = self.remembers().then(|| springs.wall(entry));
                    found.push(Found {
                        pair: [at.bodies.rows[i], encounter.wall],
                        area_m2: contact.area_m2,
                        distance_m: touch.distance.abs(),
                        force_n: secant_n_m * overlap,
                        energy_per_modulus: touch.energy_share * self.law.wall_energy(overlap, radius),
                        other_j: [bond, spring_energy(pair, secant_n_m, spring)],
                        relative_overlap: overlap / radius,
                        yields: self.yields(pair, secant_n_m, [overlap, overlap / radius, contact.area_m2], || {
                            let pose = &at.poses[wall];
                            let normal = pose.to_world_direction(&touch.normal);
                            let by_radius = self.surface.arms_by_radius;
                            let place = (&normal, touch.distance);
                            let velocity = sliding::of_wall(by_radius, at.bodies, at.motion, i, pose, place);
                            (at.bodies.masses[i], velocity)
                        }),
                    });
                }
            }
        }
        found
    }

    /// What limits the step: the stiffness of pressing, or of sliding where a particle's spin makes it yield more, by
    /// 1/m + R²/I = 7/(2m); damping; and what sticks. `[overlap, strain, area]` in m and m²; `sliding` gives m* in kg and the
    /// velocity at which the contact slides, in m/s.
    fn yields(
        &self,
        pair: &PairLaw,
        secant_n_m: f64,
        [overlap, strain, area_m2]: [f64; 3],
        sliding: impl FnOnce() -> (f64, Vec3),
    ) -> Yield {
        let spins = if self.surface.spin { 3.5 } else { 1.0 };
        let bond = self.surface.bond.filter(|bond| strain >= bond.settings.strain);
        let sheared = bond.map_or(0.0, |bond| bond.settings.shear_stiffness_n_m3);
        let mut rubbed_n_m = pair.friction_stiffness_n_m3 * area_m2;
        if rubbed_n_m > 0.0 {
            // Sliding resists by μ_d Ψ/v only: as much as sticking at the step (μ_d Ψ/v)/(K_f A), and less beyond.
            let (mass_kg, velocity) = sliding();
            let rubs_kg_s = pair.dynamic_friction * secant_n_m * overlap / velocity.norm().max(f64::MIN_POSITIVE);
            rubbed_n_m = rubbed_n_m.min(spins * rubs_kg_s * rubs_kg_s / mass_kg);
        }
        Yield {
            stiffness_n_m: secant_n_m * (self.law.power() - 1.0).max(spins * pair.tangential),
            damping_kg_s: pair.damping_n_s_m3 * area_m2,
            sticking_n_m: spins * (rubbed_n_m + sheared * area_m2),
        }
    }

    /// Largest stable steps of velocity Verlet in s: of the springs alone, 2/ω, and with the contacts' damping. Infinite
    /// without contacts and bonds.
    ///
    /// ω² is bounded by the largest sum of 2k/m at a particle (Gershgorin), which for two particles alone is k/m*, and the
    /// rates of damping likewise. `bonds_1_s` is the largest ω of the bonds. With velocities predicted as
    /// ours, one particle with spring and damper is stable while (ω Δt)²/4 + γ Δt < 1 (its amplification passes −1 there); what sticks
    /// has γ in proportion to Δt.
    fn largest_steps(&self, bodies: &Bodies, contacts: &[Found], wall_contacts: &[Found], bonds_1_s: f64) -> [f64; 2] {
        let mut sums = vec![Yield::NONE; bodies.len()];
        let mut on_walls = vec![Yield::NONE; self.surfaces.len()];
        for contact in contacts {
            for row in contact.pair {
                sums[row as usize].add(2.0, &contact.yields);
            }
        }
        for contact in wall_contacts {
            sums[contact.pair[0] as usize].add(1.0, &contact.yields);
            on_walls[contact.pair[1] as usize].add(1.0, &contact.yields);
        }
        let particles = bodies.rows.iter().zip(&bodies.masses).map(|(&row, &mass)| (&sums[row as usize], mass));
        let pistons = self.settings.walls.iter().zip(&on_walls).filter_map(|(wall, sum)| match &wall.motion {
            Motion::Pressed(piston) => Some((sum, piston.mass_kg)),
            _ => None,
        });
        let mut critical_s = if bonds_1_s > 0.0 { 2.0 / bonds_1_s } else { f64::INFINITY };
        let mut stable_s = critical_s;
        for (sum, mass_kg) in particles.chain(pistons) {
            critical_s = critical_s.min(2.0 / (sum.stiffness_n_m / mass_kg).sqrt());
            // a Δt² + b Δt = 1.
            let a = (0.25 * sum.stiffness_n_m + sum.sticking_n_m) / mass_kg;
            let b = sum.damping_kg_s / mass_kg;
            stable_s = stable_s.min(2.0 / (b + (b * b + 4.0 * a).sqrt()));
        }
        [critical_s, stable_s]
    }
}

impl Yield {
    const NONE: Self = Self { stiffness_n_m: 0.0, damping_kg_s: 0.0, sticking_n_m: 0.0 };

    fn add(&mut self, times: f64, other: &Self) {
        self.stiffness_n_m += times * other.stiffness_n_m;
        self.damping_kg_s += times * other.damping_kg_s;
        self.sticking_n_m += times * other.sticking_n_m;
    }
}

/// ½ k_t ξ², in J.
fn spring_energy(pair: &PairLaw, secant_n_m: f64, spring: Option<&Vec3>) -> f64 {
    spring.map_or(0.0, |spring| 0.5 * pair.tangential * secant_n_m * spring.norm_squared())
}
