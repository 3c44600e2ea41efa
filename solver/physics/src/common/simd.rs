//! Numbers that a contact law may be written in once: one at a time, or as many as the processor takes at a time.
//!
//! Every operation is the IEEE one on each lane, and none is fused, so that the bits do not depend on the processor.

use stagger_coupling::math;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use pulp::Simd;

/// A number, or a few side by side.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// What comparisons give.
    type Mask: Copy;

    /// The same number in each lane; `self` only says how many there are.
    fn all(self, value: f64) -> Self;
    fn sqrt(self) -> Self;
    /// |x|^p, lane by lane.
    fn power(self, exponent: f64) -> Self;
    /// Whether `self` < `other`.
    fn below(self, other: Self) -> Self::Mask;
    /// `yes` where the mask holds, else `no`.
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The smaller one; `other` where one is not a number.
    #[inline(always)]
    fn least(self, other: Self) -> Self {
        Self::choose(self.below(other), self, other)
    }

    /// The larger one; `other` where one is not a number.
    #[inline(always)]
    fn most(self, other: Self) -> Self {
        Self::choose(other.below(self), self, other)
    }
}

impl Real for f64 {
    type Mask = bool;

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }

    #[inline(always)]
    fn power(self, exponent: f64) -> Self {
        math::powf(self.abs(), exponent)
    }

    #[inline(always)]
    fn below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn choose(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

/// As many numbers as a register holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes<S: Simd> {
    pub simd: S,
    pub values: S::f64s,
}

macro_rules! operator {
    ($operator:ident, $method:ident, $of_simd:ident) => {
        impl<S: Simd> $operator for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { values: self.simd.$of_simd(self.values, other.values), ..self }
            }
        }
    };
}
operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { values: self.simd.neg_f64s(self.values), ..self }
    }
}

impl<S: Simd> Real for Lanes<S> {
    type Mask = (S, S::m64s);

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        Self { values: self.simd.splat_f64s(value), ..self }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { values: self.simd.sqrt_f64s(self.values), ..self }
    }

    #[inline(always)]
    fn power(self, exponent: f64) -> Self {
        let mut lanes = [0.0; LANES];
        self.simd.partial_store_f64s(&mut lanes, self.values);
        for lane in &mut lanes {
            *lane = math::powf(lane.abs(), exponent);
        }
        Self { values: self.simd.partial_load_f64s(&lanes[..S::F64_LANES]), ..self }
    }

    #[inline(always)]
    fn below(self, other: Self) -> Self::Mask {
        (self.simd, self.simd.less_than_f64s(self.values, other.values))
    }

    #[inline(always)]
    fn choose((simd, mask): Self::Mask, yes: Self, no: Self) -> Self {
        Self { simd, values: simd.select_f64s(mask, yes.values, no.values) }
    }
}

/// The most lanes of any processor known.
pub(crate) const LANES: usize = 8;

/// A vector of three components.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triple<R> {
    pub x: R,
    pub y: R,
    pub z: R,
}

impl<R: Real> Triple<R> {
    /// Zero.
    #[inline(always)]
    pub fn zero(like: R) -> Self {
        let zero = like.all(0.0);
        Self { x: zero, y: zero, z: zero }
    }

    #[inline(always)]
    pub fn dot(self, other: Self) -> R {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}

impl<R: Real> Add for Triple<R> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<R: Real> Sub for Triple<R> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<R: Real> Mul<R> for Triple<R> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: R) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

impl<R: Real> AddAssign for Triple<R> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl From<super::Vec3> for Triple<f64> {
    #[inline(always)]
    fn from(vector: super::Vec3) -> Self {
        Self { x: vector.x, y: vector.y, z: vector.z }
    }
}

impl From<Triple<f64>> for super::Vec3 {
    #[inline(always)]
    fn from(triple: Triple<f64>) -> Self {
        Self::new(triple.x, triple.y, triple.z)
    }
}
