//! How two bodies that touch lie and move: overlap, direction, and the velocities of the contact points (Zohdi 2018, ch. 6).

use super::normal::NormalStiffness;
use crate::common::simd::{Real, Triple};

/// The arms at which tangential forces turn two bodies, from their centres along the line between them, in m.
///
/// The contact point lies in the plane of the lens that the spheres share, at L_i = ½(d + (R_i² − R_j²)/d) from the centre of
/// i (Zohdi 2018, eqs. 6.52–6.57) and at d − L_i from that of j: opposite forces there have no moment together, and angular
/// momentum is kept. A sphere whose centre lies beyond the plane is turned at no arm. With `by_radius` the arms are the radii,
/// the monograph's choice (eqs. 6.11–6.15), which makes angular momentum at δ/d of what friction transfers.
#[inline(always)]
pub fn pair_arms<R: Real>(by_radius: bool, distance: R, radius_i: R, radius_j: R) -> [R; 2] {
    if by_radius {
        return [radius_i, radius_j];
    }
    let zero = distance.all(0.0);
    let apart = distance.most(distance.all(SAME_PLACE_M));
    let lens = distance.all(0.5) * (distance + (radius_i - radius_j) * ((radius_i + radius_j) / apart));
    let arm = lens.most(zero).least(distance);
    [arm, distance - arm]
}

/// The arm of a particle whose centre is at the signed `distance` from a wall, likewise.
#[inline(always)]
pub fn wall_arm(by_radius: bool, distance: f64, radius: f64) -> f64 {
    if by_radius { radius } else { distance }
}

/// Distance in m at and below which two particles are at the same place: its square is hardly a number any more.
pub const SAME_PLACE_M: f64 = 1e-150;

/// Two bodies that touch; quantities are of the partner relative to i.
#[derive(Clone, Copy, Debug)]
pub struct ContactKinematics<R> {
    /// n, from i to its partner.
    pub normal: Triple<R>,
    /// δ in m.
    pub overlap: R,
    /// Overlap δ over overlap strain E, in m.
    pub length: R,
    /// Stiffness and area, both of them the contact's own share of its patch.
    pub stiffness: NormalStiffness<R>,
    /// Area of the whole patch in m².
    pub patch_m2: R,
    /// Pa, or N/m for the linear law.
    pub modulus: R,
    /// m* in kg.
    pub reduced_mass: R,
    /// v_j − v_i in m/s.
    pub velocity: Triple<R>,
    /// L_i ω_i + L_j ω_j in m/s, with the arms L of [`pair_arms`].
    pub rolling: Triple<R>,
    /// ω_j − ω_i in rad/s.
    pub turning: Triple<R>,
    /// Reduced moment of inertia, in kg m².
    pub reduced_inertia: R,
    /// Tangential spring, in m.
    pub spring: Triple<R>,
    /// Δt in s.
    pub step_s: R,
    /// As [`super::rolling::stopping_share`].
    pub stopping_share: R,
    /// Δt in s of a rule that sees a contact begin and end between two of its evaluations; 0 for others.
    pub touch_s: R,
}
