//! Bounds of the particles' motion.

use crate::{
    common::advice::Facts,
    particles::{model::ports::PUSH, settings::Settings},
};

/// Whether forces act whose work is not known before the run.
pub fn has_unknown_work(facts: &Facts<'_>, settings: &Settings) -> bool {
    settings.fields.near_field.is_some() || settings.fields.magnetic.is_some() || facts.written.contains(PUSH)
}

/// Speed that no particle exceeds, in m/s; `None` where forces act whose work is not known before the run.
pub fn speed_m_s(facts: &Facts<'_>, settings: &Settings) -> Option<f64> {
    (!has_unknown_work(facts, settings)).then_some(facts.bodies.speed_m_s)
}

/// How long particles may move through the gas, in s: the run, or, where they fall onto something, twice the longest fall.
pub fn flight_s(facts: &Facts<'_>, settings: &Settings) -> f64 {
    let is_bounded = settings.fields.electromagnetic.is_none() && speed_m_s(facts, settings).is_some();
    let acceleration = facts.bodies.acceleration_m_s2;
    if is_bounded && !facts.walls.is_empty() && acceleration > 0.0 {
        facts.duration_s.min(2.0 * facts.bodies.speed_m_s / acceleration)
    } else {
        facts.duration_s
    }
}
