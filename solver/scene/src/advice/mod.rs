//! Advice on a scene before it runs: the dimensionless numbers that decide which physics matter and which fidelity
//! suffices, each with what follows from it and a bound of what following it changes.
//!
//! One file a number, with its definition, source and the argument of its threshold. Nothing is run: numbers come from the
//! scene and its start configuration. What cannot be known before the run is replaced by a stated bound.

mod beam_sampling;
mod biot;
mod boiling_step;
mod charge_relaxation;
mod contact_duration;
mod facts;
mod fourier;
mod joule;
mod laser;
mod melting;
mod moving_spot;
mod optical_depth;
mod peclet;
mod radiation;
mod size_parameter;
mod spin;
mod stokes;
mod unread;

use serde::Serialize;
use stagger_coupling::SolveError;

use self::facts::Facts;
pub use self::{
    biot::lumped_error, charge_relaxation::charge_relaxation_s, optical_depth::absorbed_share,
    size_parameter::edge_share, stokes::drag_coefficient, stokes::drag_over_stokes, stokes::relaxation_s,
};
use crate::Scene;

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It can be left out.
    Drop,
    /// It matters.
    Keep,
    /// It is not in the scene, and matters.
    Add,
    /// This fidelity, or a cheaper one that the edit names, suffices.
    Suffices,
    /// A finer step or fidelity is needed.
    Refine,
    /// No setting of this program covers it: results are to be read with care.
    Beyond,
}

/// A result of a run that advice speaks about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Mean of the particles' temperatures at the end, in K; shares are of the temperature at the start.
    MeanTemperature,
    /// Highest temperature of a particle at the end, in K; shares are of the temperature at the start.
    PeakTemperature,
    /// Mean of the particles' positions at the end, in m; shares are of the way they go at their highest speed.
    MeanPosition,
    /// Energy absorbed from light over the run, in J; shares are of the energy the beams send.
    AbsorbedEnergy,
    /// Largest speed after an impact, in m/s; shares are of the speed of impact.
    ReboundSpeed,
}

impl Quantity {
    /// Its name in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MeanTemperature => "mean temperature",
            Self::PeakTemperature => "peak temperature",
            Self::MeanPosition => "mean position",
            Self::AbsorbedEnergy => "absorbed energy",
            Self::ReboundSpeed => "speed after an impact",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::MeanTemperature | Self::PeakTemperature => "K",
            Self::MeanPosition => "m",
            Self::AbsorbedEnergy => "J",
            Self::ReboundSpeed => "m/s",
        }
    }
}

/// Bound of what following an advice changes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// What changes.
    pub quantity: Quantity,
    /// By less than this, in SI units.
    pub at_most: f64,
    /// The same as a share; of what, [`Quantity`] says.
    pub share: f64,
}

/// A change of the scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edit {
    /// `--set KEY=VALUE`.
    Set {
        /// The key.
        key: String,
        /// The value as a scene writes it.
        value: String,
    },
    /// A key or table is taken out of the scene.
    Delete {
        /// The key.
        key: String,
    },
}

impl Edit {
    fn set(key: impl Into<String>, value: impl Into<String>) -> Self {
        Self::Set { key: key.into(), value: value.into() }
    }
}

/// One piece of advice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Advice {
    /// Key of the scene it is about.
    pub about: String,
    /// The number's name.
    pub number: &'static str,
    /// Its value; without unit unless `unit` names one.
    pub value: f64,
    /// Its unit; empty for a dimensionless number.
    pub unit: &'static str,
    /// What the number is.
    pub meaning: String,
    /// What to do.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub says: String,
    /// What following it changes at most; empty where it cannot be bounded.
    pub effects: Vec<Effect>,
    /// The change that follows it; empty where nothing is to be changed.
    pub edits: Vec<Edit>,
}

impl Advice {
    /// Advice without bounds and edits.
    fn new(about: &str, number: &'static str, value: f64, meaning: &str, verdict: Verdict, says: String) -> Self {
        let (about, meaning) = (about.to_owned(), meaning.to_owned());
        Self { about, number, value, unit: "", meaning, verdict, says, effects: Vec::new(), edits: Vec::new() }
    }
}

/// Advice on a scene, in the order of its physics; `within` is the relative change that counts as none, 0.01 for a percent.
///
/// # Errors
/// The particles of the scene cannot be placed.
pub fn advise(scene: &Scene, within: f64) -> Result<Vec<Advice>, SolveError> {
    let Some(facts) = Facts::of(scene, within)? else { return Ok(Vec::new()) };
    let rules: [fn(&Facts<'_>) -> Vec<Advice>; 17] = [
        unread::advise,
        contact_duration::advise,
        stokes::advise,
        spin::advise,
        fourier::advise,
        peclet::advise,
        biot::advise,
        radiation::advise,
        melting::advise,
        laser::advise,
        boiling_step::advise,
        optical_depth::advise,
        beam_sampling::advise,
        moving_spot::advise,
        size_parameter::advise,
        joule::advise,
        charge_relaxation::advise,
    ];
    Ok(rules.iter().flat_map(|rule| rule(&facts)).collect())
}
