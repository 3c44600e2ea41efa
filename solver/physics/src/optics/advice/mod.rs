//! Advice on lasers and their fidelity, and what their light is to others' advice.

mod beam_sampling;
mod boiling_step;
mod laser;
mod light;
mod optical_depth;
mod size_parameter;

pub use self::{light::absorbed_share, size_parameter::edge_share};
use crate::common::advice::{Advisor, MOVING_SPOT};

/// What lasers contribute to advice.
pub static ADVISOR: Advisor = Advisor {
    tell: light::tell,
    numbers: &[
        &laser::LASER,
        &boiling_step::BOILING_STEP,
        &optical_depth::OPTICAL_DEPTH,
        &beam_sampling::BEAM_SAMPLING,
        &MOVING_SPOT,
        &size_parameter::SIZE_PARAMETER,
    ],
};
