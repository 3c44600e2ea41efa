//! Light absorbed by the particles from a laser beam.

mod beam;
mod beer_lambert;
mod beer_lambert_monograph;
mod energy_balance;
mod profile;
mod settings;

use std::{collections::BTreeMap, sync::Arc};

use beam::Frame;
use beer_lambert::Lines;
use serde::{Deserialize, Serialize};
pub use settings::*;
use stagger_messages::{Energy, Field, Fields, Measure, Port, Ports};

use crate::{
    SolveError,
    coupling::{Frozen, Physics, Reply, Window},
    physics::checks::{energy_j, field, positive, radii, setting, values},
};

const NODE: &str = "optics";

/// Power that each particle absorbs from a laser beam, by one of the [`Model`]s.
///
/// `absorbed_power` is the mean over the window: P̄ ½ (f(t) + f(t+Δt)). P̄ is the exact mean of the beam's power, and f
/// the share a particle takes with the geometry and the spot at the window's start and end; second order in Δt. The
/// share at a window's end is kept as the next one's start, so a window costs one evaluation of the geometry, and none
/// while the beam is off. Where particles came or went at the window's start, its geometry is that of others, and f is
/// the share at the end throughout.
///
/// The ledger's `passed` is `laser` − `absorbed`: what reaches the substrate. [`Model::BeerLambertMonograph`] may absorb
/// more than the beam carries, and then `passed` is negative; the figure `absorbed over laser` shows it. Hence
/// [`Model::BeerLambert`] is the form to prefer.
pub struct Optics {
    /// Number of particles at t = 0.
    count: usize,
    beam: Beam,
    frame: Frame,
    absorption: Absorption,
    written: Written,
}

/// A [`Model`] made ready.
enum Absorption {
    EnergyBalance,
    BeerLambert { absorption_1_m: f64, lines: Lines },
    BeerLambertMonograph { absorption_1_m: f64 },
}

struct Written {
    absorbed_power: Arc<Port>,
    beam_spot: Arc<Port>,
    beam_radius: Arc<Port>,
    beam_power: Arc<Port>,
}

/// What the next window starts with.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// Share of the beam's power that each particle takes at the end of the last window, where the beam was on in it.
    shares: Option<Shares>,
}

/// Share of the beam's power that each particle takes at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Shares {
    /// Revision of the particles they belong to.
    revision: u64,
    values: Arc<Vec<f64>>,
}

impl Optics {
    /// Checks the settings and lays out the lines that sample the beam.
    ///
    /// # Errors
    /// A setting is outside its range, or the lines are too many.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        settings.beam.check()?;
        let check = |a: f64| setting(NODE, "absorption", a, a.is_finite() && a >= 0.0, "finite and at least 0 /m");
        let Settings { count, model, beam } = settings;
        let absorption = match model {
            Model::EnergyBalance => Absorption::EnergyBalance,
            Model::BeerLambert { absorption_1_m, spacing_m } => {
                check(absorption_1_m)?;
                positive(NODE, "spacing of lines", spacing_m)?;
                Absorption::BeerLambert { absorption_1_m, lines: Lines::new(&beam.profile, spacing_m)? }
            }
            Model::BeerLambertMonograph { absorption_1_m } => {
                check(absorption_1_m)?;
                Absorption::BeerLambertMonograph { absorption_1_m }
            }
        };
        let frame = Frame::new(beam.direction);
        let written = Written {
            absorbed_power: Arc::new(Port::f64("absorbed_power", "W", "particles", 1, Measure::Magnitude)),
            beam_spot: Arc::new(Port::f64("beam_spot", "m", "beam", 3, Measure::None)),
            beam_radius: Arc::new(Port::f64("beam_radius", "m", "beam", 1, Measure::None)),
            beam_power: Arc::new(Port::f64("beam_power", "W", "beam", 1, Measure::None)),
        };
        Ok(Self { count, beam, frame, absorption, written })
    }

    /// Share of the beam's power that each particle takes at one instant.
    fn shares(&self, fields: &Fields, t_s: f64) -> Result<Shares, SolveError> {
        let radii_m = radii(NODE, fields)?;
        let positions_m = values(NODE, fields, "positions", radii_m.len(), "`radii`")?;
        let centres_m = || self.frame.centres_m(positions_m, self.beam.spot_m(t_s));
        let values = Arc::new(match self.absorption {
            Absorption::EnergyBalance => energy_balance::shares(radii_m),
            Absorption::BeerLambert { absorption_1_m, ref lines } => {
                lines.absorbed(absorption_1_m, &centres_m(), radii_m)
            }
            Absorption::BeerLambertMonograph { absorption_1_m } => {
                beer_lambert_monograph::absorbed(&self.beam.profile, absorption_1_m, &centres_m(), radii_m)
            }
        });
        Ok(Shares { revision: field(fields, "radii")?.support.revision, values })
    }

    /// `absorbed_w` belongs to the particles of `revision`.
    fn fields(&self, absorbed_w: Vec<f64>, revision: u64, mean_power_w: f64, t_s: f64) -> Result<Fields, SolveError> {
        let spot_m = self.beam.spot_m(t_s).as_slice().to_vec();
        let written = [
            Field::new(&self.written.absorbed_power, revision, absorbed_w)?,
            Field::new(&self.written.beam_spot, 0, spot_m)?,
            Field::new(&self.written.beam_radius, 0, vec![self.beam.profile.radius_m()])?,
            Field::new(&self.written.beam_power, 0, vec![mean_power_w])?,
        ];
        Ok(written.into_iter().map(|field| (field.name().to_owned(), field)).collect())
    }
}

impl Physics for Optics {
    type State = State;

    fn ports(&self) -> Ports {
        let Written { absorbed_power, beam_spot, beam_radius, beam_power } = &self.written;
        Ports {
            reads: vec![
                Port::f64("positions", "m", "particles", 3, Measure::None),
                Port::f64("radii", "m", "particles", 1, Measure::None),
            ],
            writes: [absorbed_power, beam_spot, beam_radius, beam_power].map(|port| (**port).clone()).into(),
        }
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let fields = self.fields(vec![0.0; self.count], 0, 0.0, 0.0)?;
        Ok((State::default(), Reply { fields, ..Reply::default() }))
    }

    fn solve(&self, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        let end_s = window.t_s + window.dt_s;
        let mean_power_w = self.beam.mean_power_w(window);
        let particles = &field(&frozen.end, "radii")?.support;
        let (absorbed_w, state) = if mean_power_w > 0.0 {
            let end = self.shares(&frozen.end, end_s)?;
            let kept = state.shares.clone().filter(|shares| shares.revision == particles.revision);
            let start = match kept {
                Some(shares) => shares,
                None if field(&frozen.start, "radii")?.support == *particles => {
                    self.shares(&frozen.start, window.t_s)?
                }
                None => end.clone(),
            };
            let both = start.values.iter().zip(end.values.iter());
            let mean_w = both.map(|(at_start, at_end)| mean_power_w * 0.5 * (at_start + at_end));
            (mean_w.collect(), State { shares: Some(end) })
        } else {
            (vec![0.0; field(&frozen.end, "radii")?.rows()], State::default())
        };

        let laser_j = mean_power_w * window.dt_s;
        let absorbed_j = energy_j(&absorbed_w, window.dt_s);
        let ledger = vec![
            Energy::gained("laser", laser_j),
            Energy::lost("absorbed", absorbed_j),
            Energy::lost("passed", laser_j - absorbed_j),
        ];
        let share = if laser_j > 0.0 { absorbed_j / laser_j } else { 0.0 };
        let mut figures = BTreeMap::from([("absorbed over laser".to_owned(), share)]);
        if let Absorption::BeerLambert { lines, .. } = &self.absorption {
            figures.insert("lines".to_owned(), lines.count as f64);
        }
        let fields = self.fields(absorbed_w, particles.revision, mean_power_w, end_s)?;
        Ok((state, Reply { fields, ledger, figures, ..Reply::default() }))
    }
}
