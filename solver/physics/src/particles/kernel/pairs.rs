//! The contacts between particles of one block, as many at a time as the processor's registers hold.
//!
//! Contacts are gathered into columns, one a quantity, computed lane by lane, and added one by one in the order of the
//! list: the bits are the same for any width of the registers.

use pulp::{Simd, WithSimd};

use super::input::{Body, KernelInput, Task};
use crate::{
    common::{
        Vec3,
        simd::{LANES, Lanes, Real, Triple},
    },
    particles::{
        contact::{
            kinematics::{ContactKinematics, SAME_PLACE_M, pair_arms},
            normal::{Normal, reduced},
            pair_table::PairLaw,
            tangential::Tangential,
        },
        model::{bodies::sphere_inertia, state::Dissipation},
    },
};

/// Contacts a batch: its columns stay in the first-level cache.
const BATCH: usize = 64;
const _: () = assert!(BATCH.is_multiple_of(LANES));

/// One quantity of a batch.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Column([f64; BATCH]);

impl Column {
    const ZERO: Self = Self([0.0; BATCH]);
}

/// A vector of a batch.
type Columns = [Column; 3];
const ZEROS: Columns = [Column::ZERO; 3];

#[inline(always)]
fn put(columns: &mut Columns, lane: usize, vector: &Vec3) {
    let [x, y, z] = columns;
    (x.0[lane], y.0[lane], z.0[lane]) = (vector.x, vector.y, vector.z);
}

#[inline(always)]
fn take(columns: &Columns, lane: usize) -> Vec3 {
    let [x, y, z] = columns;
    Vec3::new(x.0[lane], y.0[lane], z.0[lane])
}

/// Reads and writes registers of columns.
#[derive(Clone, Copy)]
struct Register<S> {
    simd: S,
    index: usize,
}

impl<S: Simd> Register<S> {
    #[inline(always)]
    fn load(self, column: &Column) -> Lanes<S> {
        Lanes { simd: self.simd, values: S::as_simd_f64s(&column.0).0[self.index] }
    }

    #[inline(always)]
    fn load_all(self, [x, y, z]: &Columns) -> Triple<Lanes<S>> {
        Triple { x: self.load(x), y: self.load(y), z: self.load(z) }
    }

    #[inline(always)]
    fn store(self, column: &mut Column, lanes: Lanes<S>) {
        S::as_mut_simd_f64s(&mut column.0).0[self.index] = lanes.values;
    }

    #[inline(always)]
    fn store_all(self, [x, y, z]: &mut Columns, triple: Triple<Lanes<S>>) {
        self.store(x, triple.x);
        self.store(y, triple.y);
        self.store(z, triple.z);
    }
}

/// The columns of a batch.
struct Batch {
    between: Columns,
    radii: [Column; 2],
    masses: [Column; 2],
    moduli: [Column; 2],
    velocity: Columns,
    spins: [Columns; 2],
    arms: [Column; 2],
    inertias: [Column; 2],
    spring: Columns,
    law: PairLaw<Column>,
    force: Columns,
    couple: Columns,
    resistance: Columns,
    damping_w: Column,
    friction_w: Column,
    rolling_w: Column,
    rate_1_s2: Column,
}

/// The contact loop of one block for one pair of laws.
pub struct PairKernel<'a, 't, N, T> {
    pub input: KernelInput<'a>,
    pub law: N,
    pub tangential: T,
    pub task: &'a mut Task<'t>,
}

impl<N: Normal, T: Tangential> WithSimd for PairKernel<'_, '_, N, T> {
    type Output = Dissipation;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Dissipation {
        let (radius, Body { mass, modulus, .. }) = (self.input.places[0].radius, self.input.bodies[0]);
        let mut batch = Batch {
            between: ZEROS,
            // What is alike everywhere is put here once, what is not by each batch.
            radii: [Column([radius; BATCH]); 2],
            masses: [Column([mass; BATCH]); 2],
            moduli: [Column([modulus; BATCH]); 2],
            velocity: ZEROS,
            spins: [ZEROS; 2],
            arms: [Column::ZERO; 2],
            inertias: [Column::ZERO; 2],
            spring: ZEROS,
            law: PairLaw { has_impedance: true, ..PairLaw::default() }.map(|_: &f64| Column::ZERO),
            force: ZEROS,
            couple: ZEROS,
            resistance: ZEROS,
            damping_w: Column::ZERO,
            friction_w: Column::ZERO,
            rolling_w: Column::ZERO,
            rate_1_s2: Column::ZERO,
        };
        let mut lost = Dissipation::default();
        self.find();
        let count = self.task.touching.len();
        for from in (0..count).step_by(BATCH) {
            let until = (from + BATCH).min(count);
            self.gather(from, until, &mut batch);
            for index in 0..(until - from).div_ceil(S::F64_LANES) {
                self.compute(Register { simd, index }, &mut batch);
            }
            self.scatter(from, until, &batch, &mut lost);
        }
        lost
    }
}

impl<N: Normal, T: Tangential> PairKernel<'_, '_, N, T> {
    /// Finds the entries of the pairs that touch; the others forget. Without a branch on what touches, which no processor
    /// could foresee.
    #[inline(always)]
    fn find(&mut self) {
        let Task { block, contact_history, touching, .. } = &mut *self.task;
        let (own, places) = (&self.input.places[block.range()], self.input.places);
        touching.resize(block.partners.len(), 0);
        let entries = &mut touching[..];
        let mut count = 0usize;
        for (entry, (&owner, &partner)) in block.owners.iter().zip(&block.partners).enumerate() {
            let (here, there) = (&own[owner as usize], &places[partner as usize]);
            let sum = here.radius + there.radius;
            let touches = (there.position - here.position).norm_squared() < sum * sum;
            entries[count] = entry as u32;
            count += usize::from(touches);
        }
        touching.truncate(count);
        if T::REMEMBERS {
            contact_history.keep(touching);
        }
    }

    #[inline(always)]
    fn gather(&self, from: usize, until: usize, batch: &mut Batch) {
        let KernelInput { model, places, bodies, materials, alike, .. } = self.input;
        let block = self.task.block;
        let several = model.contact.table.only().is_none();
        for (lane, &entry) in self.task.touching[from..until].iter().enumerate() {
            let entry = entry as usize;
            let i = (block.first + block.owners[entry]) as usize;
            let j = block.partners[entry] as usize;
            let (here, there) = (&places[i], &places[j]);
            let (body, partner) = (&bodies[i], &bodies[j]);
            put(&mut batch.between, lane, &(there.position - here.position));
            if !alike {
                (batch.radii[0].0[lane], batch.radii[1].0[lane]) = (here.radius, there.radius);
                (batch.masses[0].0[lane], batch.masses[1].0[lane]) = (body.mass, partner.mass);
                (batch.moduli[0].0[lane], batch.moduli[1].0[lane]) = (body.modulus, partner.modulus);
            }
            put(&mut batch.velocity, lane, &(partner.velocity - body.velocity));
            if model.contact.surface.spin {
                put(&mut batch.spins[0], lane, &body.spin);
                put(&mut batch.spins[1], lane, &partner.spin);
            }
            if model.contact.surface.rolls {
                batch.inertias[0].0[lane] = sphere_inertia(body.mass, here.radius);
                batch.inertias[1].0[lane] = sphere_inertia(partner.mass, there.radius);
            }
            if T::REMEMBERS {
                put(&mut batch.spring, lane, self.task.contact_history.pair(entry));
            }
            if several {
                let mut pair = *model.contact.table.get(materials[i], materials[j]);
                for (column, value) in batch.law.coefficients_mut().into_iter().zip(pair.coefficients_mut()) {
                    column.0[lane] = *value;
                }
            }
        }
    }

    #[inline(always)]
    fn compute<S: Simd>(&self, register: Register<S>, batch: &mut Batch) {
        let KernelInput { model, step_s, stopping_share, touch_s, .. } = self.input;
        let between = register.load_all(&batch.between);
        let (radius_i, radius_j) = (register.load(&batch.radii[0]), register.load(&batch.radii[1]));
        let zero = radius_i.all(0.0);
        let one = radius_i.all(1.0);
        let sum = radius_i + radius_j;
        let distance = between.dot(between).sqrt();
        let overlap = sum - distance;
        // Particles at the same place have no direction, and are parted along z.
        let apart = zero.all(SAME_PLACE_M).below(distance);
        let inverse = Real::choose(apart, one / distance.most(zero.all(f64::MIN_POSITIVE)), zero);
        let direction = between * inverse;
        let pair = match model.contact.table.only() {
            Some(pair) => pair.map(|&value| zero.all(value)),
            None => batch.law.map(|column| register.load(column)),
        };
        let turns = model.contact.surface.rolls;
        let nothing = Triple::zero(zero);
        let [spin_i, spin_j] = if model.contact.surface.spin {
            [register.load_all(&batch.spins[0]), register.load_all(&batch.spins[1])]
        } else {
            [nothing; 2]
        };
        let [arm_i, arm_j] = pair_arms(model.contact.surface.arms_by_radius, distance, radius_i, radius_j);
        let stiffness = self.law.pair(overlap, distance, radius_i, radius_j);
        let kinematics = ContactKinematics {
            normal: Triple { z: Real::choose(apart, direction.z, one), ..direction },
            overlap,
            length: sum,
            patch_m2: stiffness.area_m2,
            stiffness,
            modulus: self.law.pair_modulus(register.load(&batch.moduli[0]), register.load(&batch.moduli[1])),
            reduced_mass: reduced(register.load(&batch.masses[0]), register.load(&batch.masses[1])),
            velocity: register.load_all(&batch.velocity),
            rolling: spin_i * arm_i + spin_j * arm_j,
            turning: spin_j - spin_i,
            reduced_inertia: if turns {
                reduced(register.load(&batch.inertias[0]), register.load(&batch.inertias[1]))
            } else {
                zero
            },
            spring: register.load_all(&batch.spring),
            step_s: zero.all(step_s),
            stopping_share: zero.all(stopping_share),
            touch_s: zero.all(touch_s),
        };
        let contact = model.contact.surface.contact_force(self.tangential, &pair, &kinematics);
        register.store_all(&mut batch.force, contact.force);
        register.store_all(&mut batch.couple, contact.couple);
        register.store(&mut batch.arms[0], arm_i);
        register.store(&mut batch.arms[1], arm_j);
        register.store(&mut batch.damping_w, contact.damping_w);
        register.store(&mut batch.friction_w, contact.friction_w);
        register.store(&mut batch.rate_1_s2, contact.rate_1_s2);
        if T::REMEMBERS {
            register.store_all(&mut batch.spring, contact.spring);
        }
        if turns {
            register.store_all(&mut batch.resistance, contact.resistance);
            register.store(&mut batch.rolling_w, contact.rolling_w);
        }
    }

    #[inline(always)]
    fn scatter(&mut self, from: usize, until: usize, batch: &Batch, lost: &mut Dissipation) {
        let Task { block, contact_history, loads, touching, rate_1_s2, .. } = &mut *self.task;
        let surface = &self.input.model.contact.surface;
        for (lane, &entry) in touching[from..until].iter().enumerate() {
            let entry = entry as usize;
            let force = take(&batch.force, lane);
            lost.contact_damping += batch.damping_w.0[lane];
            **rate_1_s2 = rate_1_s2.max(batch.rate_1_s2.0[lane]);
            if T::ACTS || surface.bond.is_some() {
                lost.friction += batch.friction_w.0[lane];
            }
            if T::REMEMBERS {
                *contact_history.pair_mut(entry) = take(&batch.spring, lane);
            }
            let own = &mut loads[block.owners[entry] as usize];
            own.force += force;
            if surface.spin {
                // Both particles are turned the same way: arm and force change sign together.
                let couple = take(&batch.couple, lane);
                own.moment += couple * batch.arms[0].0[lane];
                let other = &mut loads[block.slots[entry] as usize];
                other.force -= force;
                other.moment += couple * batch.arms[1].0[lane];
            } else {
                loads[block.slots[entry] as usize].force -= force;
            }
            if surface.rolls {
                let resistance = take(&batch.resistance, lane);
                loads[block.owners[entry] as usize].moment += resistance;
                loads[block.slots[entry] as usize].moment -= resistance;
                lost.rolling += batch.rolling_w.0[lane];
            }
        }
    }
}
