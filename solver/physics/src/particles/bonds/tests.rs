//! The bonds against closed solutions and conservation laws.

use std::f64::consts::PI;

use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use super::*;
use crate::{
    common::random::uniform,
    particles::settings::{BondSettings, BondStiffness},
};

const SETTINGS: BondSettings = BondSettings {
    stiffness: BondStiffness::PerArea { normal_n_m3: 1e6, shear_n_m3: 4e5 },
    radius_share: 0.5,
    gap_share: Some(0.1),
    strain: None,
    tensile_strength_pa: None,
    shear_strength_pa: None,
    damping: 0.0,
};

fn model(settings: BondSettings) -> BondModel {
    BondModel::new(settings).unwrap()
}

/// Spheres that own their values; place and number agree.
#[derive(Clone)]
struct Bed {
    ids: Vec<u32>,
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    spins: Vec<Vec3>,
    turning: Vec<Vec3>,
    radii: Vec<f64>,
    masses: Vec<f64>,
    forces: Vec<Vec3>,
    moments: Vec<Vec3>,
}

impl Bed {
    fn new(positions: Vec<Vec3>, radii: Vec<f64>, masses: Vec<f64>) -> Self {
        let none = vec![Vec3::zeros(); positions.len()];
        let ids = (0..positions.len() as u32).collect();
        let (velocities, spins, turning) = (none.clone(), none.clone(), none.clone());
        let (forces, moments) = (none.clone(), none);
        Self { ids, positions, velocities, spins, turning, radii, masses, forces, moments }
    }

    /// A chain along x of spheres of radius 1/2 m that touch, 1 kg each.
    fn chain(count: usize) -> Self {
        let positions = (0..count).map(|i| Vec3::x() * i as f64).collect();
        Self::new(positions, vec![0.5; count], vec![1.0; count])
    }

    /// A cube of touching spheres of different sizes, moving and spinning at random.
    fn cube(edge: usize) -> Self {
        let mut random = ChaCha8Rng::from_seed([9; 32]);
        let mut symmetric = || 2.0 * uniform(&mut random) - 1.0;
        let place = |i: usize| Vec3::new((i % edge) as f64, (i / edge % edge) as f64, (i / edge / edge) as f64);
        let count = edge * edge * edge;
        let positions = (0..count).map(|i| place(i) + 0.02 * Vec3::from_fn(|_, _| symmetric())).collect();
        let radii: Vec<f64> = (0..count).map(|_| 0.5 + 0.02 * symmetric()).collect();
        let mut bed = Self::new(positions, radii, (0..count).map(|_| 1.0 + 0.3 * symmetric()).collect());
        bed.velocities.iter_mut().for_each(|v| *v = 0.3 * Vec3::from_fn(|_, _| symmetric()));
        bed.spins.iter_mut().for_each(|w| *w = 0.3 * Vec3::from_fn(|_, _| symmetric()));
        bed
    }

    fn spheres(&self) -> Spheres<'_> {
        let Self { ids, positions, velocities, spins, turning, radii, masses, .. } = self;
        Spheres { ids, places: ids, positions, velocities, spins, turning, radii, masses }
    }

    fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let count = self.positions.len() as u32;
        (0..count).flat_map(move |i| (i + 1..count).map(move |j| [i, j]))
    }

    fn form(&self, model: &BondModel) -> Bonds {
        model.form(&self.spheres(), self.pairs())
    }

    fn advance(&mut self, model: &BondModel, bonds: &mut Bonds, t_s: f64, step_s: f64) -> BondWork {
        self.forces.fill(Vec3::zeros());
        self.moments.fill(Vec3::zeros());
        let (mut forces, mut moments) = (std::mem::take(&mut self.forces), std::mem::take(&mut self.moments));
        let work = model.advance(bonds, &self.spheres(), t_s, step_s, &mut forces, &mut moments);
        (self.forces, self.moments) = (forces, moments);
        work
    }

    fn inertia(&self, i: usize) -> f64 {
        0.4 * self.masses[i] * self.radii[i] * self.radii[i]
    }

    /// Velocity Verlet as the integrator of substeps does it: forces see predicted velocities and spins. `load` adds to
    /// the forces and holds what is held. Returns the energy lost to damping.
    fn integrate(
        &mut self,
        model: &BondModel,
        bonds: &mut Bonds,
        steps: u32,
        dt: f64,
        load: impl Fn(&mut Self),
    ) -> f64 {
        let mut lost = 0.0;
        let mut before = self.advance(model, bonds, 0.0, 0.0);
        load(self);
        for step in 1..=steps {
            let count = self.positions.len();
            let kicks: Vec<[Vec3; 2]> = (0..count)
                .map(|i| [self.forces[i] * (0.5 * dt / self.masses[i]), self.moments[i] * (0.5 * dt / self.inertia(i))])
                .collect();
            for i in 0..count {
                self.positions[i] += dt * (self.velocities[i] + kicks[i][0]);
                self.velocities[i] += 2.0 * kicks[i][0];
                self.turning[i] = self.spins[i] + kicks[i][1];
                self.spins[i] += 2.0 * kicks[i][1];
            }
            let now = self.advance(model, bonds, f64::from(step) * dt, dt);
            load(self);
            for i in 0..count {
                self.velocities[i] += self.forces[i] * (0.5 * dt / self.masses[i]) - kicks[i][0];
                let inertia = self.inertia(i);
                self.spins[i] += self.moments[i] * (0.5 * dt / inertia) - kicks[i][1];
            }
            lost += 0.5 * dt * (before.damping_w + now.damping_w);
            before = now;
        }
        lost
    }

    fn kinetic_j(&self) -> f64 {
        (0..self.positions.len())
            .map(|i| {
                0.5 * self.masses[i] * self.velocities[i].norm_squared()
                    + 0.5 * self.inertia(i) * self.spins[i].norm_squared()
            })
            .sum()
    }
}

#[test]
fn a_pulled_bond_is_a_spring_and_breaks_at_its_strength() {
    // σ = k_n Δ: the strength of 2e4 Pa is reached at a gap of 2 cm.
    let model = model(BondSettings { tensile_strength_pa: Some(2e4), ..SETTINGS });
    let mut bed = Bed::chain(2);
    let start = bed.form(&model);
    assert_eq!(start.pairs().collect::<Vec<_>>(), [[0, 1]]);
    let area = PI * 0.0625;
    for gap in [-0.01, 0.005, 0.02 - 1e-12] {
        let mut bonds = start.clone();
        bed.positions[1].x = 1.0 + gap;
        let work = bed.advance(&model, &mut bonds, 0.5, 0.1);
        let wanted = 1e6 * area * gap;
        assert!((bed.forces[0].x - wanted).abs() < 1e-14 * 1e6 * area, "{gap}: {} {wanted}", bed.forces[0].x);
        assert!((model.stored_j(&bonds) - 0.5 * wanted * gap).abs() < 1e-9, "{gap}");
        assert_eq!((work, bed.forces[1]), (BondWork::default(), -bed.forces[0]));
    }
    let mut bonds = start.clone();
    bed.positions[1].x = 1.0 + 0.02 + 1e-12;
    let work = bed.advance(&model, &mut bonds, 0.5, 0.1);
    assert_eq!((bed.forces[0], bonds.count(), work.broken), (Vec3::zeros(), 0, 1));
    let stored = 0.5 * 1e6 * area * 0.02 * 0.02;
    assert!((work.broken_j - stored).abs() < 1e-9 * stored);
    assert_eq!(bonds.broken().get(&[0, 1]), Some(&Break { t_s: 0.5, stored_j: work.broken_j }));
    assert_eq!(model.stored_j(&bonds).to_bits(), 0);
}

#[test]
fn bending_shear_and_torsion_are_those_of_a_beam_and_break_it() {
    let (area, second) = (PI * 0.0625, PI / 4.0 * 0.25f64.powi(4));
    // The second particle moves or turns against the first by 1e-6 in one step of 1 s.
    let off = 1e-6;
    let (none, z) = (Vec3::zeros(), 0.5 * off * Vec3::z());
    let cases = [
        ("torsion", none, [none, off * Vec3::x()], 4e5 * 2.0 * second * off, 0.0, 4e5 * 0.25 * off),
        // Opposite spins, so that the middle does not slide.
        ("bending", none, [-z, z], 1e6 * second * off, 0.0, 1e6 * 0.25 * off),
        ("shear", off * Vec3::y(), [none; 2], 0.5 * 4e5 * area * off, 4e5 * area * off, 4e5 * off),
    ];
    for (name, shift, turning, moment, force, stress) in cases {
        for (strength, holds) in [(stress * (1.0 + 1e-9), true), (stress * (1.0 - 1e-9), false)] {
            let strength = Some(strength);
            let (tensile_strength_pa, shear_strength_pa) =
                if name == "bending" { (strength, None) } else { (None, strength) };
            let model = model(BondSettings { tensile_strength_pa, shear_strength_pa, ..SETTINGS });
            let mut bed = Bed::chain(2);
            let mut bonds = bed.form(&model);
            bed.turning = turning.to_vec();
            bed.positions[1] += shift;
            bed.advance(&model, &mut bonds, 1.0, 1.0);
            assert_eq!(bonds.count() == 1, holds, "{name}");
            if holds {
                // The shift also stretches and tilts the bond, by the square of 1e-6 and by 1e-6 of its direction.
                let (couple, pull) = (bed.moments[0], bed.forces[0]);
                assert!((couple.norm() / moment - 1.0).abs() < 1e-9, "{name}: {couple:?} {moment}");
                assert!((pull.norm() - force).abs() <= 1e-9 * force, "{name}: {pull:?} {force}");
                // The first particle is dragged along with the second.
                assert!(couple.dot(&(turning[1] - turning[0])) >= 0.0 && pull.dot(&shift) >= 0.0, "{name}");
            }
        }
    }
}

#[test]
fn a_cantilever_bends_as_a_beam() {
    let (links, load) = (10usize, 1e-3);
    let (young, ratio) = (1e6, 2.5);
    let model = model(BondSettings {
        stiffness: BondStiffness::Beam { young_pa: young, ratio },
        radius_share: 1.0,
        damping: 0.3,
        ..SETTINGS
    });
    let mut bed = Bed::chain(links + 1);
    let mut bonds = bed.form(&model);
    assert_eq!(bonds.count(), links);
    let dt = 0.4 / model.rate_1_s(&bonds, &bed.spheres());
    let hold = |bed: &mut Bed| {
        bed.forces[links].y += load;
        // Drag brings the slow swinging to rest, near its critical damping; it does not change where that is.
        for i in 0..=links {
            bed.forces[i] -= 12.0 * bed.velocities[i];
        }
        (bed.forces[0], bed.moments[0]) = (Vec3::zeros(), Vec3::zeros());
    };
    bed.integrate(&model, &mut bonds, 30_000, dt, hold);
    assert!(bed.kinetic_j() < 1e-20, "it is not at rest: {} J", bed.kinetic_j());
    let (area, second) = (PI * 0.25, PI / 4.0 * 0.0625);
    let n = links as f64;
    let found = bed.positions[links].y;
    // Links of 1 m that bend in their middle: Σ P (n − k + ½)²/(E I) = P n³/(3 E I) (1 − 1/(4 n²)), and shear n P/(k_s A).
    let bending = load * n.powi(3) / (3.0 * young * second);
    let discrete = bending * (1.0 - 0.25 / (n * n)) + n * load * ratio / (young * area);
    assert!((found / discrete - 1.0).abs() < 1e-9, "{found} {discrete}");
    // Euler and Bernoulli leave out the shear: 3 ratio I/(A n²) = 0.5 % here; the links' −1/(4 n²) = −0.25 %.
    assert!((found / bending - 1.0).abs() < 3e-3, "{found} {bending}");
}

#[test]
fn momentum_and_angular_momentum_are_conserved() {
    let model = model(BondSettings { damping: 0.1, ..SETTINGS });
    let mut bed = Bed::cube(4);
    let mut bonds = bed.form(&model);
    // Bonds between faces, and none across diagonals: 3 · 4² · 3.
    assert_eq!(bonds.count(), 144);
    bed.integrate(&model, &mut bonds, 50, 1e-4, |_| {});
    bed.advance(&model, &mut bonds, 0.0, 1e-4);
    let size: f64 = bed.forces.iter().map(|force| force.norm()).sum();
    assert!(size > 1e3);
    let force: Vec3 = bed.forces.iter().sum();
    let moment: Vec3 = (0..64).map(|i| bed.positions[i].cross(&bed.forces[i]) + bed.moments[i]).sum();
    // Rounding of a few hundred terms, with arms of up to 6 m.
    assert!(force.norm() < 1e-14 * size && moment.norm() < 1e-13 * size, "{force:?} {moment:?} of {size}");
}

#[test]
fn energy_is_conserved_to_second_order() {
    let model = model(SETTINGS);
    let drift = |steps: u32| {
        let mut bed = Bed::cube(3);
        let mut bonds = bed.form(&model);
        let before = bed.kinetic_j();
        bed.integrate(&model, &mut bonds, steps, 0.02 / f64::from(steps), |_| {});
        let stored = model.stored_j(&bonds);
        assert!(stored > 0.2 * before, "the test needs energy in bonds: {stored} of {before}");
        (bed.kinetic_j() + stored) / before - 1.0
    };
    let (coarse, fine) = (drift(200), drift(400));
    let order = (coarse / fine).abs().log2();
    assert!(fine.abs() < 3e-4 && (order - 2.0).abs() < 0.1, "{coarse} {fine}, order {order}");
}

#[test]
fn what_damping_takes_is_booked() {
    let model = model(BondSettings { damping: 0.2, ..SETTINGS });
    let mut bed = Bed::cube(3);
    let mut bonds = bed.form(&model);
    let before = bed.kinetic_j();
    let lost = bed.integrate(&model, &mut bonds, 4000, 1e-5, |_| {});
    let after = bed.kinetic_j() + model.stored_j(&bonds);
    assert!(lost > 0.5 * before, "{lost} of {before}");
    // Second order in the step, which is 1/200 of the fastest vibration's radian.
    assert!((before - after - lost).abs() < 1e-4 * before, "{before} {after} {lost}");
}

#[test]
fn a_rigid_rotation_strains_nothing() {
    let model = model(SETTINGS);
    let (axis, centre) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.3, 2.0, -1.0));
    // Returns the shear of a bond that was strained first and then turned about an axis of its own, once.
    let turned = |steps: u32, strain: Vec3| {
        let mut bed = Bed::chain(2);
        let mut bonds = bed.form(&model);
        bed.positions[1] += strain;
        bed.turning[0] = strain;
        bed.advance(&model, &mut bonds, 0.0, 1.0);
        let start = bed.positions.clone();
        let pull = bed.forces[0];
        let place = |bed: &mut Bed, share: f64| {
            let turn = nalgebra::Rotation3::from_scaled_axis(2.0 * PI * share * axis);
            for i in 0..2 {
                let from = turn * (start[i] - centre);
                bed.positions[i] = centre + from;
                bed.turning[i] = 2.0 * PI * axis;
            }
        };
        for step in 1..=steps {
            place(&mut bed, f64::from(step) / f64::from(steps));
            bed.advance(&model, &mut bonds, 0.0, 1.0 / f64::from(steps));
        }
        (bed.forces[0] - pull).norm() / pull.norm().max(1.0)
    };
    // Without strain next to no force appears, against a stiffness of 8e4 N/m: 2π (2π/100)⁴/80 of a metre's.
    let none = turned(100, Vec3::zeros());
    assert!(none < 0.1, "{none}");
    // The forces of one that is strained turn with it: after a whole turn they are back, to second order.
    let strain = Vec3::new(0.0, 1e-3, 5e-4);
    let (coarse, fine) = (turned(100, strain), turned(200, strain));
    let order = (coarse / fine).log2();
    assert!(fine < 1e-3 && (order - 2.0).abs() < 0.1, "{coarse} {fine}, order {order}");
}

#[test]
fn neither_the_order_in_memory_nor_threads_nor_repetition_change_a_bit() {
    let model = model(BondSettings { damping: 0.1, tensile_strength_pa: Some(1e5), ..SETTINGS });
    let mut bed = Bed::cube(9);
    let committed = bed.form(&model);
    assert!(committed.count() > 2 * CHUNK / 2, "{} bonds share no threads", committed.count());
    bed.positions.iter_mut().for_each(|r| *r *= 1.0 + 0.05 * r.x);
    let mut trial = committed.clone();
    let work = bed.advance(&model, &mut trial, 1.0, 1e-4);
    assert!(work.broken > 0 && trial.count() > 0);
    assert_eq!(trial.count() + trial.broken().len(), committed.count());

    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (mut again, mut other) = (committed.clone(), bed.clone());
        assert_eq!(pool.install(|| other.advance(&model, &mut again, 1.0, 1e-4)), work);
        assert_eq!((again, other.forces, other.moments), (trial.clone(), bed.forces.clone(), bed.moments.clone()));
    }

    // Place k takes what was at 7 k mod 729.
    let order: Vec<usize> = (0..729).map(|k| 7 * k % 729).collect();
    let mut places = vec![0; 729];
    order.iter().zip(0..).for_each(|(&id, place)| places[id] = place);
    let take = |values: &[Vec3]| -> Vec<Vec3> { order.iter().map(|&from| values[from]).collect() };
    let take_numbers = |values: &[f64]| -> Vec<f64> { order.iter().map(|&from| values[from]).collect() };
    let ids: Vec<u32> = order.iter().map(|&id| id as u32).collect();
    let moved = Spheres {
        ids: &ids,
        places: &places,
        positions: &take(&bed.positions),
        velocities: &take(&bed.velocities),
        spins: &take(&bed.spins),
        turning: &take(&bed.turning),
        radii: &take_numbers(&bed.radii),
        masses: &take_numbers(&bed.masses),
    };
    let (mut again, mut forces, mut moments) = (committed, vec![Vec3::zeros(); 729], vec![Vec3::zeros(); 729]);
    assert_eq!(model.advance(&mut again, &moved, 1.0, 1e-4, &mut forces, &mut moments), work);
    assert_eq!(again, trial);
    assert_eq!((forces, moments), (take(&bed.forces), take(&bed.moments)));
}

#[test]
fn overlap_sinters_pairs_once() {
    let model = model(BondSettings { strain: Some(0.05), gap_share: None, shear_strength_pa: Some(1.0), ..SETTINGS });
    let mut bed = Bed::chain(3);
    let mut bonds = bed.form(&model);
    assert_eq!((bonds.count(), model.sinter(&mut bonds, &bed.spheres(), bed.pairs())), (0, 0));
    // E = 0.06 and 0.04.
    (bed.positions[1].x, bed.positions[2].x) = (0.94, 1.9);
    let twice = bed.pairs().chain(bed.pairs());
    assert_eq!(model.sinter(&mut bonds, &bed.spheres(), twice), 1);
    assert_eq!(bonds.pairs().collect::<Vec<_>>(), [[0, 1]]);
    assert_eq!(model.sinter(&mut bonds, &bed.spheres(), bed.pairs()), 0);
    bed.advance(&model, &mut bonds, 0.0, 0.1);
    assert_eq!(bed.forces[0], Vec3::zeros(), "a bond forms without forces");
    bed.positions[1].y = 1e-3;
    assert_eq!(bed.advance(&model, &mut bonds, 0.0, 0.1).broken, 1);
    assert_eq!(model.sinter(&mut bonds, &bed.spheres(), bed.pairs()), 0, "what broke stays broken");
}

#[test]
fn a_particle_that_is_gone_takes_its_bonds_along() {
    let model = model(SETTINGS);
    let mut bed = Bed::chain(4);
    let mut bonds = bed.form(&model);
    bed.positions[3].x += 0.01;
    bed.advance(&model, &mut bonds, 0.0, 0.1);
    let stored = model.stored_j(&bonds);
    assert!(stored > 0.0);
    // Number 3 is not in the map any more.
    let Spheres { ids, places, positions, velocities, spins, turning, radii, masses } = bed.spheres();
    let left = Spheres {
        ids: &ids[..3],
        places: &places[..3],
        positions: &positions[..3],
        velocities: &velocities[..3],
        spins: &spins[..3],
        turning: &turning[..3],
        radii: &radii[..3],
        masses: &masses[..3],
    };
    let (mut force, mut moment) = ([Vec3::zeros(); 3], [Vec3::zeros(); 3]);
    let work = model.advance(&mut bonds, &left, 0.0, 0.1, &mut force, &mut moment);
    assert_eq!((work.broken, bonds.count(), force), (1, 2, [Vec3::zeros(); 3]));
    assert!((work.broken_j - stored).abs() < 1e-12 * stored);
}

#[test]
fn centres_that_meet_and_ends_that_swap_stay_finite() {
    let model = model(SETTINGS);
    let mut bed = Bed::chain(2);
    let mut bonds = bed.form(&model);
    for x in [0.0, -1.0, 1e-200] {
        bed.positions[1].x = x;
        bed.advance(&model, &mut bonds, 0.0, 0.1);
        assert!(bed.forces.iter().chain(&bed.moments).all(|v| v.iter().all(|x| x.is_finite())), "{x}");
    }
    bed.positions[1] = bed.positions[0];
    assert_eq!(bed.form(&model).count(), 0, "there is no direction to bond along");
}

#[test]
fn the_rate_bounds_the_fastest_vibration() {
    let model = model(SETTINGS);
    let mut bed = Bed::cube(3);
    let mut bonds = bed.form(&model);
    let rate = model.rate_1_s(&bonds, &bed.spheres());
    // Verlet is stable below 2/ω: energy stays of its size over many periods.
    let before = bed.kinetic_j();
    bed.integrate(&model, &mut bonds, 2000, 0.7 / rate, |_| {});
    let after = bed.kinetic_j() + model.stored_j(&bonds);
    assert!(after < 2.0 * before, "{before} {after}");
    // Two masses on a spring: ω² = 2 k_n A/m, which the bound must hold.
    let pair = Bed::chain(2);
    let rate = model.rate_1_s(&pair.form(&model), &pair.spheres());
    assert!(rate * rate >= 2.0 * 1e6 * PI * 0.0625);
}

#[test]
fn a_state_is_stored_and_read_to_the_bit() {
    let model = model(BondSettings { tensile_strength_pa: Some(3e4), ..SETTINGS });
    let mut bed = Bed::cube(3);
    let mut bonds = bed.form(&model);
    bed.positions[0] -= Vec3::repeat(0.05);
    bed.advance(&model, &mut bonds, 0.0, 1e-3);
    assert!(!bonds.broken().is_empty());
    let bytes = postcard::to_allocvec(&bonds).unwrap();
    assert_eq!(postcard::from_bytes::<Bonds>(&bytes).unwrap(), bonds);
}

#[test]
fn settings_out_of_range_are_named() {
    let wrong = |change: &dyn Fn(&mut BondSettings)| {
        let mut settings = SETTINGS;
        change(&mut settings);
        BondModel::new(settings).unwrap_err().to_string()
    };
    assert!(wrong(&|s| s.radius_share = 1.1).contains("radius"));
    assert!(wrong(&|s| s.damping = -0.1).contains("damping"));
    assert!(wrong(&|s| s.tensile_strength_pa = Some(0.0)).contains("tensile"));
    assert!(wrong(&|s| s.stiffness = BondStiffness::Beam { young_pa: 1.0, ratio: 0.0 }).contains("ratio"));
}
