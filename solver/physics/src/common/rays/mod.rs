//! Rays among spheres: straight between surfaces, specular at each, what a surface takes deposited there (Zohdi 2018,
//! ch. 10 for light, ch. 11 for sound). Traced exactly, by intersection, instead of by small steps in time.
//!
//! A ray ends where it leaves the spheres, where its power falls below a share of what it started with, or at a limit of
//! reflections; the last two are booked as residual. It so never runs for ever: its power falls by R at each surface, or, where
//! R is 1, the limit holds.

mod cross_section;
mod fresnel;
mod grid;
mod paths;
mod sphere;
mod trace;

use serde::Serialize;
use stagger_coupling::SolveError;

pub use self::{
    cross_section::points_m,
    fresnel::{RefractiveIndex, reflectance},
    grid::Grid,
    paths::{POINTS, SHOWN},
    sphere::{Ray, Sphere, spheres},
    trace::{Followed, Limits, Outcome, Strike, follow},
};
pub(crate) use self::{
    cross_section::starts,
    paths::paths_m,
    trace::{facing, trace, trace_onto},
};
use super::checks::setting;

type Vec3 = nalgebra::Vector3<f64>;

/// How a beam is sampled by rays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sampling {
    /// Number of rays N; each carries the N-th part of the beam's power.
    pub count: usize,
    /// Where they start over the beam's cross-section.
    pub pattern: Pattern,
    /// Where they end.
    pub limits: Limits,
}

/// Where rays start over a beam's cross-section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// Ray k of N on the circle within which (k + ½)/N of the power lies, each turned by the golden angle from the last.
    Stratified,
    /// Independently at random, by the power; the same for the whole run.
    Random {
        /// Seed.
        seed: u64,
    },
}

/// Rays of a beam at most: 16 million starting points are 256 MB.
const MOST_RAYS: f64 = 16_777_216.0;

impl Sampling {
    /// Refuses settings outside their range, as those of `node`.
    pub(crate) fn check(&self, node: &str) -> Result<(), SolveError> {
        let Self { count, limits: Limits { threshold, reflections }, .. } = *self;
        let count = count as f64;
        setting(node, "number of rays", count, (1.0..=MOST_RAYS).contains(&count), "from 1 to 16777216")?;
        setting(
            node,
            "threshold of a ray's power",
            threshold,
            (0.0..1.0).contains(&threshold),
            "at least 0 and below 1",
        )?;
        setting(node, "limit of reflections", reflections.into(), reflections >= 1, "at least 1")
    }
}
