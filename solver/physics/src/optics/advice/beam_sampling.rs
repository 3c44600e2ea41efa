//! Lines that sample a beam, over the beam and over the particles.

use stagger_coupling::math;

use super::light::lasers;
use crate::{
    common::advice::{Advice, Edit, Facts, Number, Verdict},
    optics::{beer_lambert::Lines, settings::Model},
};

/// Lines to the radius within which half of the power lies, below which a particle's share of the light is off by more than
/// about a percent of the power.
const TO_THE_BEAM: f64 = 4.0;
/// Spacing over the smallest radius above which the smallest particles lie between the lines as often as on one.
const TO_A_PARTICLE: f64 = 1.0;

/// Bound of the error of the share of the power on one side of an edge, at `lines` to the radius within which half of the
/// power lies: measured, 0.11 to 0.15/n^1.6 for a Gaussian, up to 0.25/n^1.6 for a top hat.
fn edge_error(lines: f64) -> f64 {
    (0.25 / math::powf(lines, 1.6)).min(0.5)
}

/// The lines of each laser with the fidelity beer-lambert: r/h with r the radius within which half of the power lies
/// and h their spacing.
pub static BEAM_SAMPLING: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let mut all = Vec::new();
    let smallest_m = facts.bodies.smallest_m();
    for laser in lasers(facts) {
        let Model::BeerLambert { spacing_m, .. } = laser.settings.model else { continue };
        let profile = &laser.settings.beam.profile;
        let lines = profile.quantile_m(0.5) / spacing_m;
        let (beam, particle) = (lines < TO_THE_BEAM, spacing_m > TO_A_PARTICLE * smallest_m);
        let wanted_m = if beam { profile.sampling_m() } else { spacing_m };
        let wanted_m = if particle { wanted_m.min(smallest_m / 2.0) } else { wanted_m };
        // Not more lines than can be laid out.
        let wanted_m = wanted_m.max(Lines::finest_m(profile)).min(spacing_m);
        let (verdict, says) = match (beam, particle) {
            (true, _) => {
                let share = 100.0 * edge_error(lines);
                let says = format!(
                    "the beam falls between its lines: what a particle at its edge takes may be off by {share:.0} % of the power; \
                     {wanted_m:.2e} m samples it"
                );
                (Verdict::Refine, says)
            }
            (false, true) => {
                let says = format!(
                    "the smallest particles, of {:.2e} m, lie between the lines: what one of them takes is a matter of chance, \
                     while the mean over many is right; {wanted_m:.2e} m samples them",
                    smallest_m
                );
                (Verdict::Refine, says)
            }
            (false, false) => (Verdict::Suffices, "lines sample the beam and the particles".to_owned()),
        };
        let meaning =
            format!("radius within which half of the power lies over the spacing of the lines, {spacing_m:.2e} m");
        let about = format!("{}.spacing", laser.light.table);
        let mut advice = Advice::new(&about, "lines to the beam", lines, &meaning, verdict, says);
        if verdict == Verdict::Refine {
            advice.edits = vec![Edit::set(about.clone(), format!("{wanted_m:.3e}"))];
        }
        all.push(advice);
    }
    all
}
