//! Advice on a scene before it runs: what a piece of it is, and what a physics contributes.
//!
//! Each physics holds its own numbers in its folder, one file a number, with its definition, source and the argument of its
//! threshold. They rest on [`Facts`]: the scene, and what each physics tells of it in words that all share.

mod facts;
mod moving_spot;
mod told;

use std::fmt;

use serde::Serialize;
use stagger_coupling::SolveError;

pub use self::{
    facts::Facts,
    moving_spot::MOVING_SPOT,
    told::{BeamFacts, Body, BodyFacts, HeatFacts, LightFacts, Room},
};

/// What a physics contributes to advice.
pub struct Advisor {
    /// Adds what this physics alone knows of the scene. What the bodies are is told first; then the others follow in the order
    /// of the list of physics.
    pub tell: fn(&mut Facts<'_>) -> Result<(), SolveError>,
    /// Its numbers, in the order in which they are told.
    pub numbers: &'static [&'static Number],
}

impl fmt::Debug for Advisor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Advisor").field("numbers", &self.numbers.len()).finish_non_exhaustive()
    }
}

/// A number and what follows from it. One that several physics list is told once.
pub struct Number {
    /// Whether it asks what the scene lacks: it is told before all others.
    pub asks_for_more: bool,
    /// The advice; none where the number means nothing for the scene.
    pub advise: fn(&Facts<'_>) -> Vec<Advice>,
}

impl Number {
    /// A number on what a scene has.
    #[must_use]
    pub const fn of(advise: fn(&Facts<'_>) -> Vec<Advice>) -> Self {
        Self { asks_for_more: false, advise }
    }
}

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
    /// `--set KEY=VALUE`.
    #[must_use]
    pub fn set(key: impl Into<String>, value: impl Into<String>) -> Self {
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
    #[must_use]
    pub fn new(about: &str, number: &'static str, value: f64, meaning: &str, verdict: Verdict, says: String) -> Self {
        let (about, meaning) = (about.to_owned(), meaning.to_owned());
        Self { about, number, value, unit: "", meaning, verdict, says, effects: Vec::new(), edits: Vec::new() }
    }
}
