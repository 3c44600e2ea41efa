//! Bonds between particles with a state of their own, which hold in tension and break (Potyondy & Cundall 2004).
//!
//! A bond acts beside the contact of its particles, not in its place. Its force and moments are equal and opposite about
//! its middle, so momentum and angular momentum are conserved to rounding; the particles must be free to spin. Bonds are
//! kept in the order of their particles' numbers and added in that order: the result depends neither on the order of
//! particles in memory nor on the number of threads.

mod bond;
mod model;

use std::collections::BTreeMap;

use self::bond::{Bond, Ends, Pull};
pub use self::model::BondModel;
use crate::common::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Bonds of a chunk that one thread computes.
const CHUNK: usize = 1024;

/// All bonds at one instant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bonds {
    /// In the order of their particles' numbers.
    bonds: Vec<Bond>,
    broken: BTreeMap<[u32; 2], Break>,
}

/// A bond that broke.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Break {
    /// When, in s.
    pub t_s: f64,
    /// The energy it had stored, in J.
    pub stored_j: f64,
}

/// What bonds did in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BondWork {
    /// Power lost to damping, in W.
    pub damping_w: f64,
    /// Energy stored in the bonds that broke, in J.
    pub broken_j: f64,
    /// Bonds that broke.
    pub broken: u32,
}

/// The particles that bonds act on, in any order in memory.
#[derive(Clone, Copy, Debug)]
pub struct Spheres<'a> {
    /// Number of the particle in each place; it stays with the particle.
    pub ids: &'a [u32],
    /// Place of each number; `u32::MAX`, or none, where the particle is gone.
    pub places: &'a [u32],
    /// r in m, by place.
    pub positions: &'a [Vec3],
    /// v in m/s.
    pub velocities: &'a [Vec3],
    /// ω in rad/s.
    pub spins: &'a [Vec3],
    /// Mean ω over the step that led here, in rad/s: that of the half step for Verlet, (1−φ) ω(t) + φ ω(t+Δt) for the
    /// trapezoidal rule.
    pub turning: &'a [Vec3],
    /// R in m; positive.
    pub radii: &'a [f64],
    /// m in kg; positive.
    pub masses: &'a [f64],
}

impl Spheres<'_> {
    fn ends(&self, [i, j]: [usize; 2]) -> Ends {
        Ends {
            between: self.positions[j] - self.positions[i],
            velocity: self.velocities[j] - self.velocities[i],
            spins: [self.spins[i], self.spins[j]],
            turning: [self.turning[i], self.turning[j]],
            radii: [self.radii[i], self.radii[j]],
            masses: [self.masses[i], self.masses[j]],
        }
    }

    /// Where the particles of a bond are; `None` where one is gone.
    fn find(&self, ids: [u32; 2]) -> Option<[usize; 2]> {
        let place = |id: u32| self.places.get(id as usize).filter(|&&place| place != u32::MAX);
        Some([*place(ids[0])? as usize, *place(ids[1])? as usize])
    }

    /// Places in the order of the particles' numbers, and these.
    fn in_order(&self, [a, b]: [u32; 2]) -> ([u32; 2], [usize; 2]) {
        let (a, b) = (a as usize, b as usize);
        let [i, j] = if self.ids[a] < self.ids[b] { [a, b] } else { [b, a] };
        ([self.ids[i], self.ids[j]], [i, j])
    }
}

impl Bonds {
    /// Bonds that hold.
    #[must_use]
    pub fn count(&self) -> usize {
        self.bonds.len()
    }

    /// Numbers of the particles that are bonded, in order.
    pub fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.bonds.iter().map(|bond| bond.ids)
    }

    /// Bonds that broke since the start, by the numbers of their particles.
    #[must_use]
    pub fn broken(&self) -> &BTreeMap<[u32; 2], Break> {
        &self.broken
    }
}

impl BondModel {
    /// The bonds at the start: between those of `pairs` (places in memory) whose gap is small enough, without forces.
    #[must_use]
    pub fn form(&self, spheres: &Spheres<'_>, pairs: impl Iterator<Item = [u32; 2]>) -> Bonds {
        let mut bonds = Bonds::default();
        if let Some(share) = self.settings.gap_share {
            self.bond(&mut bonds, spheres, pairs, |distance, [radius_i, radius_j]| {
                distance - (radius_i + radius_j) <= share * radius_i.min(radius_j)
            });
        }
        bonds
    }

    /// Bonds those of `pairs` (places in memory) that overlap by the strain E* or more and are not bonded yet, as they
    /// are, without forces; returns how many. A pair whose bond broke is not bonded again.
    pub fn sinter(&self, bonds: &mut Bonds, spheres: &Spheres<'_>, pairs: impl Iterator<Item = [u32; 2]>) -> usize {
        let Some(strain) = self.settings.strain else { return 0 };
        self.bond(bonds, spheres, pairs, |distance, [radius_i, radius_j]| {
            let sum = radius_i + radius_j;
            sum - distance >= strain * sum
        })
    }

    fn bond(
        &self,
        bonds: &mut Bonds,
        spheres: &Spheres<'_>,
        pairs: impl Iterator<Item = [u32; 2]>,
        close: impl Fn(f64, [f64; 2]) -> bool,
    ) -> usize {
        let before = bonds.bonds.len();
        for pair in pairs {
            let (ids, places) = spheres.in_order(pair);
            let ends = spheres.ends(places);
            let bonded = || bonds.bonds[..before].binary_search_by_key(&ids, |bond| bond.ids).is_ok();
            if close(ends.between.norm(), ends.radii) && !bonds.broken.contains_key(&ids) && !bonded() {
                bonds.bonds.extend(Bond::new(self, ids, &ends));
            }
        }
        bonds.bonds.sort_by_key(|bond| bond.ids);
        bonds.bonds.dedup_by_key(|bond| bond.ids);
        bonds.bonds.len() - before
    }

    /// Moves the bonds on by `step_s` to the time `t_s` and the particles as they are then, and adds their forces in N
    /// and moments in N m by place. A bond whose stress exceeds its strength, or whose particle is gone, breaks and
    /// pulls no more.
    ///
    /// From one committed state the call may be repeated (on a clone) with other particles at the step's end until these
    /// agree. With a step of zero and particles where they were it gives the forces of the state.
    pub fn advance(
        &self,
        bonds: &mut Bonds,
        spheres: &Spheres<'_>,
        t_s: f64,
        step_s: f64,
        force: &mut [Vec3],
        moment: &mut [Vec3],
    ) -> BondWork {
        let one = |bond: &mut Bond| -> Option<([usize; 2], Pull)> {
            let places = spheres.find(bond.ids)?;
            let pull = bond.advance(self, &spheres.ends(places), step_s);
            let [tensile, shear] = bond.stresses_pa(self);
            let holds = |stress: f64, strength: Option<f64>| strength.is_none_or(|strength| stress <= strength);
            let whole =
                holds(tensile, self.settings.tensile_strength_pa) && holds(shear, self.settings.shear_strength_pa);
            whole.then_some((places, pull))
        };
        let chunk = |bonds: &mut [Bond]| bonds.iter_mut().map(one).collect::<Vec<_>>();
        let pulls: Vec<Vec<_>> = if bonds.bonds.len() > CHUNK {
            bonds.bonds.par_chunks_mut(CHUNK).map(chunk).collect()
        } else {
            bonds.bonds.chunks_mut(CHUNK).map(chunk).collect()
        };
        let mut work = BondWork::default();
        for (bond, pull) in bonds.bonds.iter().zip(pulls.iter().flatten()) {
            match pull {
                Some(([i, j], pull)) => {
                    force[*i] += pull.force;
                    force[*j] -= pull.force;
                    moment[*i] += pull.moments[0];
                    moment[*j] += pull.moments[1];
                    work.damping_w += pull.damping_w;
                }
                None => {
                    let stored_j = bond.stored_j(self);
                    work.broken_j += stored_j;
                    work.broken += 1;
                    bonds.broken.insert(bond.ids, Break { t_s, stored_j });
                }
            }
        }
        if work.broken > 0 {
            let mut holds = pulls.iter().flatten().map(Option::is_some);
            bonds.bonds.retain(|_| holds.next().unwrap_or(true));
        }
        work
    }

    /// Elastic energy of all bonds, in J.
    #[must_use]
    pub fn stored_j(&self, bonds: &Bonds) -> f64 {
        bonds.bonds.iter().fold(0.0, |sum, bond| sum + bond.stored_j(self))
    }

    /// Upper bound of the angular frequency ω of all bonded particles' vibrations, in rad/s.
    ///
    /// Verlet's critical step is 2/ω; contacts that act beside the bonds come on top.
    #[must_use]
    pub fn rate_1_s(&self, bonds: &Bonds, spheres: &Spheres<'_>) -> f64 {
        let mut squared = vec![[0.0; 2]; spheres.positions.len()];
        for bond in &bonds.bonds {
            let Some(places) = spheres.find(bond.ids) else { continue };
            let ends = bond.rates_squared(self, &spheres.ends(places));
            for (place, [translation, rotation]) in places.into_iter().zip(ends) {
                squared[place][0] += translation;
                squared[place][1] += rotation;
            }
        }
        squared.into_iter().flatten().fold(0.0, f64::max).sqrt()
    }
}

#[cfg(test)]
mod tests;
