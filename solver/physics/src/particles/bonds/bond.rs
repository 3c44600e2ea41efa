//! One bond: a short elastic beam between two particles (Potyondy & Cundall 2004, sec. 2.2).

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use stagger_coupling::math;

use super::model::BondModel;
use crate::common::Vec3;

/// A bond and what it remembers.
///
/// The tension follows from the distance alone and cannot drift. Shear, bending and torsion are sums over the steps of
/// how the particles moved and turned against each other, taken midway through each step, and turn with the bond: errors
/// of second order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Bond {
    /// Numbers of its particles, ascending: they stay when particles move in memory.
    pub ids: [u32; 2],
    /// Distance of the centres without tension, in m.
    rest_m: f64,
    /// Radius of the cross-section, in m.
    radius_m: f64,
    /// From the first centre to the second, in m.
    between: Vec3,
    /// F_n in N, positive in tension.
    tension_n: f64,
    /// F_s on the first particle in N, across the normal.
    shear: Vec3,
    /// Bending moment on the first particle in N m, across the normal.
    bending: Vec3,
    /// Torsion of the first particle about the normal, in N m.
    torsion_n_m: f64,
}

/// The two particles of a bond, as they are now.
#[derive(Clone, Copy)]
pub(super) struct Ends {
    /// r_j − r_i in m.
    pub between: Vec3,
    /// v_j − v_i in m/s.
    pub velocity: Vec3,
    /// ω in rad/s.
    pub spins: [Vec3; 2],
    /// Mean ω over the step that led here, in rad/s.
    pub turning: [Vec3; 2],
    /// R in m.
    pub radii: [f64; 2],
    /// m in kg.
    pub masses: [f64; 2],
}

/// What a bond does to its particles.
#[derive(Clone, Copy)]
pub(super) struct Pull {
    /// Force on the first particle in N; the second feels the opposite.
    pub force: Vec3,
    /// Moments on both, in N m.
    pub moments: [Vec3; 2],
    /// Power lost to damping, in W.
    pub damping_w: f64,
}

/// Cross-section and stiffness: all a bond's constants.
struct Beam {
    /// k_n A and k_s A in N/m.
    stretching: f64,
    sliding: f64,
    /// k_n I and k_s J in N m.
    bending: f64,
    torsion: f64,
    area: f64,
    /// I/R and J/R in m³.
    modulus: f64,
    polar_modulus: f64,
}

impl Bond {
    /// A bond without forces; `None` where the centres coincide.
    pub fn new(model: &BondModel, ids: [u32; 2], ends: &Ends) -> Option<Self> {
        let rest_m = ends.between.norm();
        if rest_m <= 0.0 || !rest_m.is_finite() {
            return None;
        }
        Some(Self {
            ids,
            rest_m,
            radius_m: model.settings.radius_share * ends.radii[0].min(ends.radii[1]),
            between: ends.between,
            tension_n: 0.0,
            shear: Vec3::zeros(),
            bending: Vec3::zeros(),
            torsion_n_m: 0.0,
        })
    }

    fn beam(&self, model: &BondModel) -> Beam {
        let (normal, shear) = model.stiffness(self.rest_m);
        let radius = self.radius_m;
        let area = PI * radius * radius;
        // I = π R⁴/4, J = π R⁴/2.
        let second = 0.25 * area * radius * radius;
        Beam {
            stretching: normal * area,
            sliding: shear * area,
            bending: normal * second,
            torsion: shear * 2.0 * second,
            area,
            modulus: second / radius,
            polar_modulus: 2.0 * second / radius,
        }
    }

    /// Moves the bond on by `step_s` to where its particles are now.
    pub fn advance(&mut self, model: &BondModel, ends: &Ends, step_s: f64) -> Pull {
        let beam = self.beam(model);
        let middle = 0.5 * (self.between + ends.between);
        let distance = ends.between.norm();
        let before = direction(&self.between, &Vec3::x());
        let midway = direction(&middle, &before);
        let normal = direction(&ends.between, &midway);
        let [turn_i, turn_j] = ends.turning.map(|spin| spin * step_s);
        let [share_i, share_j] = ends.shares();

        // Displacement at the bond's middle: that of the centres less what the particles' own turning explains.
        let carried = share_i * chord(&turn_i) + share_j * chord(&turn_j);
        let sliding = ends.between - self.between - carried.cross(&middle);
        let turning = turn_j - turn_i;
        let roll = 0.25 * (turn_i + turn_j).dot(&midway);
        let first = Turn::new(&before, midway, roll);
        let second = Turn::new(&midway, normal, roll);
        let across = |vector: &Vec3| vector - vector.dot(&midway) * midway;
        self.tension_n = beam.stretching * (distance - self.rest_m);
        self.shear = second.carry(&(first.carry(&self.shear) + beam.sliding * across(&sliding)));
        self.bending = second.carry(&(first.carry(&self.bending) + beam.bending * across(&turning)));
        self.torsion_n_m += beam.torsion * turning.dot(&midway);
        // Centres that meet leave the bond its direction, by a length that is no displacement.
        self.between = if distance > 0.0 { ends.between } else { normal * (1e-12 * self.rest_m) };
        self.pull(model, &beam, ends, &normal, distance)
    }

    fn pull(&self, model: &BondModel, beam: &Beam, ends: &Ends, normal: &Vec3, distance: f64) -> Pull {
        let [arm_i, arm_j] = ends.arms(normal, distance);
        let mut pull =
            Pull { force: self.tension_n * normal + self.shear, moments: [Vec3::zeros(); 2], damping_w: 0.0 };
        let mut moment = self.bending + self.torsion_n_m * normal;
        if model.settings.damping > 0.0 {
            let [spin_i, spin_j] = ends.spins;
            let velocity = ends.velocity + spin_j.cross(&arm_j) - spin_i.cross(&arm_i);
            let turning = spin_j - spin_i;
            let along = |vector: &Vec3| vector.dot(normal) * normal;
            let [mass, inertia] = ends.reduced();
            let critical = |stiffness: f64, inertia: f64| 2.0 * (stiffness * inertia).sqrt();
            let damping = |[stretching, sliding]: [f64; 2], inertia: f64, rate: &Vec3| {
                let along = along(rate);
                let share = critical(stretching, inertia) * along + critical(sliding, inertia) * (rate - along);
                model.settings.damping * share
            };
            let force = damping([beam.stretching, beam.sliding], mass, &velocity);
            let couple = damping([beam.torsion, beam.bending], inertia, &turning);
            pull.force += force;
            moment += couple;
            pull.damping_w = force.dot(&velocity) + couple.dot(&turning);
        }
        pull.moments = [moment + arm_i.cross(&pull.force), -moment - arm_j.cross(&pull.force)];
        pull
    }

    /// Tensile stress F_n/A + ‖M_b‖ R/I and shear stress ‖F_s‖/A + |M_t| R/J at the edge, in Pa (their eqs. 14–15).
    pub fn stresses_pa(&self, model: &BondModel) -> [f64; 2] {
        let beam = self.beam(model);
        [
            self.tension_n / beam.area + self.bending.norm() / beam.modulus,
            self.shear.norm() / beam.area + self.torsion_n_m.abs() / beam.polar_modulus,
        ]
    }

    /// Elastic energy in J.
    pub fn stored_j(&self, model: &BondModel) -> f64 {
        let beam = self.beam(model);
        0.5 * (self.tension_n * self.tension_n / beam.stretching
            + self.shear.norm_squared() / beam.sliding
            + self.bending.norm_squared() / beam.bending
            + self.torsion_n_m * self.torsion_n_m / beam.torsion)
    }

    /// What the bond adds to the bounds of ω² in translation and rotation of either end, in 1/s².
    pub fn rates_squared(&self, model: &BondModel, ends: &Ends) -> [[f64; 2]; 2] {
        let beam = self.beam(model);
        let arms = ends.shares().map(|share| share * ends.between.norm());
        std::array::from_fn(|end| {
            let arm = arms[end] * arms[end];
            // The square of a sum of n terms is at most n times the sum of squares: two ends stretch, bend and twist a
            // bond, two ends and two arms shear it.
            let translation = (2.0 * beam.stretching).max(4.0 * beam.sliding) / ends.masses[end];
            let rotation = 4.0 * beam.sliding * arm + 2.0 * beam.bending.max(beam.torsion);
            [translation, rotation / ends.inertia(end)]
        })
    }
}

impl Ends {
    /// Shares of the distance on both sides of the bond's middle, which parts it like the radii.
    fn shares(&self) -> [f64; 2] {
        let [radius_i, radius_j] = self.radii;
        [radius_i / (radius_i + radius_j), radius_j / (radius_i + radius_j)]
    }

    /// Arms from the centres to the bond's middle.
    fn arms(&self, normal: &Vec3, distance: f64) -> [Vec3; 2] {
        let [share_i, share_j] = self.shares();
        [normal * (share_i * distance), normal * (-share_j * distance)]
    }

    /// Moment of inertia 2/5 m R² of an end, in kg m².
    fn inertia(&self, end: usize) -> f64 {
        0.4 * self.masses[end] * self.radii[end] * self.radii[end]
    }

    /// Reduced mass and moment of inertia.
    fn reduced(&self) -> [f64; 2] {
        let reduced = |[i, j]: [f64; 2]| i * j / (i + j);
        [reduced(self.masses), reduced([self.inertia(0), self.inertia(1)])]
    }
}

/// The direction of a vector; `otherwise` where it has none.
fn direction(vector: &Vec3, otherwise: &Vec3) -> Vec3 {
    let length = vector.norm();
    if length > 0.0 { vector / length } else { *otherwise }
}

/// The vector c of a rotation by θ with which Δb = c × b̄ holds for a vector b turned and its mean b̄ of before and after:
/// 2 tan(θ/2) along the axis, to fifth order.
fn chord(turn: &Vec3) -> Vec3 {
    turn * (1.0 + turn.norm_squared() / 12.0)
}

/// Turning of a bond in half a step: with its normal, and about it.
struct Turn {
    /// Cross product of the old normal and the new one, over 1 + their scalar product.
    tilt: Vec3,
    lean: f64,
    normal: Vec3,
    sine: f64,
    cosine: f64,
}

impl Turn {
    fn new(before: &Vec3, normal: Vec3, angle: f64) -> Self {
        let (sine, cosine) = math::sin_cos(angle);
        // A bond that is turned end over end in one step has no rotation of its own; the step is far too long by then.
        let lean = 1.0 / (1.0 + before.dot(&normal)).max(1e-6);
        Self { tilt: before.cross(&normal), lean, normal, sine, cosine }
    }

    /// A vector across the old normal, carried along and kept across the new one.
    fn carry(&self, vector: &Vec3) -> Vec3 {
        // Rodrigues' rotation by the angle between the normals, about their cross product.
        let tilted = self.tilt.cross(vector);
        let carried = vector + tilted + self.lean * self.tilt.cross(&tilted);
        let across = carried - carried.dot(&self.normal) * self.normal;
        self.cosine * across + self.sine * self.normal.cross(&across)
    }
}
