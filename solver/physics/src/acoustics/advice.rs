//! What a beam of sound is to advice: the way of its spot, and its pulses.

use stagger_coupling::SolveError;

use super::settings::Settings;
use crate::common::advice::{Advisor, BeamFacts, Facts, MOVING_SPOT};

/// What sound contributes to advice.
pub static ADVISOR: Advisor = Advisor { tell, numbers: &[&MOVING_SPOT] };

fn tell(facts: &mut Facts<'_>) -> Result<(), SolveError> {
    if let Some(Settings { beam, .. }) = facts.tables.main() {
        facts.beams.push(BeamFacts {
            table: super::NODE.to_owned(),
            // Of the same intensity all over: half of the power lies within 1/sqrt 2 of the radius.
            radius_m: beam.radius_m * 0.5f64.sqrt(),
            path: &beam.path,
            starts_s: beam.starts_s,
            ends_s: beam.ends_s,
            pulses: beam.pulses,
        });
    }
    Ok(())
}
