//! Light absorbed by the particles from a laser beam.

pub mod advice;
mod beer_lambert;
mod beer_lambert_monograph;
mod energy_balance;
pub mod keys;
mod rays;
mod settings;
mod tradeoff;

use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use std::{borrow::Cow, collections::BTreeMap, sync::Arc};

pub use beer_lambert::Lines;
use rays::Rays;
use serde::{Deserialize, Serialize};
pub use settings::*;
use stagger_messages::{Energy, Field, Fields, Measure, Port, Ports, Support};

use crate::common::{
    PARTICLES, SolidSurface,
    beam::{AtInstant, Frame, ends},
    checks::{energy_j, field, positive, radii, setting, values},
    power_port,
    rays::{Outcome, POINTS, SHOWN},
    rows::by_ids,
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
/// Over a solid on a grid, what the particles let pass arrives on its upper face as `surface_light`, a power for each cell there
/// and again the mean over the window. What the solid reflects does not come back.
///
/// The ledger's `passed` is `laser` − `absorbed` − `surface_light`: what reaches the substrate. [`Model::BeerLambertMonograph`] may absorb
/// more than the beam carries, and then `passed` is negative; the figure `absorbed over laser` shows it. Hence
/// [`Model::BeerLambert`] is the form to prefer. With [`Model::Rays`] all that the beam gave is counted where it ends: `passed`
/// met a plane wall, `escaped` left into the open, and `residual` is of rays that ended among the particles.
pub struct Optics {
    /// Number of particles at t = 0.
    count: usize,
    beam: Beam,
    frame: Frame,
    absorption: Absorption,
    solid: Option<SolidSurface>,
    written: Written,
    ports: Ports,
}

/// A [`Model`] made ready.
enum Absorption {
    EnergyBalance { capacities_j_m3_k: Vec<f64> },
    BeerLambert { absorption_1_m: f64, lines: Lines },
    BeerLambertMonograph { absorption_1_m: f64 },
    Rays(Rays),
}

struct Written {
    absorbed_power: Arc<Port>,
    surface_light: Option<Arc<Port>>,
    beam_spot: Arc<Port>,
    beam_radius: Arc<Port>,
    beam_power: Arc<Port>,
    /// With rays only.
    ray_paths: Option<Arc<Port>>,
}

/// What the next window starts with.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// Share of the beam's power that each particle takes at the end of the last window, where the beam was on in it.
    shares: Option<AtInstant<Share>>,
}

/// Share of the beam's power that each particle takes at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Share {
    /// Of each particle, then of each cell of the solid's upper face, where there is one: without a solid a checkpoint is that
    /// of a program that knew none.
    values: Vec<f64>,
    /// With rays, what became of the rest, and where some of them go.
    traced: Option<(Outcome, Vec<f64>)>,
}

impl Optics {
    /// Checks the settings and lays out the lines that sample the beam.
    ///
    /// # Errors
    /// A setting is outside its range, or the lines are too many.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        settings.beam.check(NODE)?;
        let check = |a: f64| setting(NODE, "absorption", a, a.is_finite() && a >= 0.0, "finite and at least 0 /m");
        let absorption = match settings.model {
            Model::EnergyBalance => {
                for &capacity in &settings.capacities_j_m3_k {
                    positive(NODE, "heat capacity of a material", capacity)?;
                }
                Absorption::EnergyBalance { capacities_j_m3_k: settings.capacities_j_m3_k.clone() }
            }
            Model::BeerLambert { absorption_1_m, spacing_m } => {
                check(absorption_1_m)?;
                positive(NODE, "spacing of lines", spacing_m)?;
                Absorption::BeerLambert { absorption_1_m, lines: Lines::new(&settings.beam.profile, spacing_m)? }
            }
            Model::BeerLambertMonograph { absorption_1_m } => {
                check(absorption_1_m)?;
                Absorption::BeerLambertMonograph { absorption_1_m }
            }
            Model::Rays { sampling, surface } => {
                sampling.check(NODE)?;
                surface.check()?;
                Absorption::Rays(Rays::new(&settings, sampling, surface))
            }
        };
        let frame = Frame::new(settings.beam.direction);
        let paths = || Arc::new(Port::f64("ray_paths", "m", "rays", 3 * POINTS as u32, Measure::None));
        let written = Written {
            absorbed_power: Arc::new(Port::f64("absorbed_power", "W", PARTICLES, 1, Measure::Magnitude)),
            surface_light: settings.solid.is_some().then(|| Arc::new(power_port("surface_light"))),
            beam_spot: Arc::new(Port::f64("beam_spot", "m", "beam", 3, Measure::None)),
            beam_radius: Arc::new(Port::f64("beam_radius", "m", "beam", 1, Measure::None)),
            beam_power: Arc::new(Port::f64("beam_power", "W", "beam", 1, Measure::None)),
            ray_paths: matches!(absorption, Absorption::Rays(_)).then(paths),
        };
        let ports = crate::Settings::ports(&settings);
        let Settings { count, beam, solid, .. } = settings;
        Ok(Self { count, beam, frame, absorption, solid, written, ports })
    }

    fn reads_melted(&self) -> bool {
        matches!(&self.absorption, Absorption::Rays(rays) if rays.may_melt())
    }

    fn reads_material(&self) -> bool {
        matches!(&self.absorption, Absorption::EnergyBalance { capacities_j_m3_k } if capacities_j_m3_k.len() > 1)
    }

    /// What the particles are made of, as places in the list of materials.
    fn kinds<'f>(&self, fields: &'f Fields) -> Result<&'f [u32], SolveError> {
        let (kinds, radii) = (field(fields, "material")?, field(fields, "radii")?);
        if kinds.support != radii.support {
            return Err(SolveError::Mismatch(format!(
                "{NODE}: field `material` is of {} particles at revision {}, but `radii` of {} at revision {}",
                kinds.support.count, kinds.support.revision, radii.support.count, radii.support.revision
            )));
        }
        Ok(kinds.u32()?)
    }

    /// The particles' liquid shares on the rows of `fields`. Those of a writer that has not seen yet who came or went follow
    /// the particles by their numbers; new ones are solid.
    fn melted<'f>(&self, frozen: &'f Frozen, fields: &'f Fields, rows: usize) -> Result<Cow<'f, [f64]>, SolveError> {
        let (melted, now) = (field(fields, "melted")?, &field(fields, "radii")?.support);
        if melted.support == *now {
            return values(NODE, fields, "melted", rows, "`radii`").map(Cow::Borrowed);
        }
        let ids = [&frozen.start, &frozen.end].into_iter().filter_map(|fields| fields.get("ids"));
        let of = |support: &Support| ids.clone().find(|ids| ids.support == *support);
        let (Some(then), Some(now)) = (of(&melted.support), of(now)) else {
            return Err(SolveError::Mismatch(format!(
                "{NODE}: field `melted` is of {} particles at revision {}, but `radii` of {} at revision {}, and no field \
                 `ids` says which is which",
                melted.support.count, melted.support.revision, now.count, now.revision
            )));
        };
        let shares = values(NODE, fields, "melted", melted.rows(), "it")?;
        by_ids(shares, then.u32()?, now.u32()?, 0.0).map(Cow::Owned)
    }

    /// What each particle takes of the beam's power at one instant.
    fn share(&self, frozen: &Frozen, fields: &Fields, t_s: f64) -> Result<Share, SolveError> {
        let (radii_m, positions_m) = if fields.contains_key("radii") {
            let radii_m = radii(NODE, fields)?;
            (radii_m, values(NODE, fields, "positions", radii_m.len(), "`radii`")?)
        } else {
            (&[][..], &[][..])
        };
        let spot_m = self.beam.spot_m(t_s);
        let centres_m = || self.frame.centres_m(positions_m, spot_m);
        let values = match &self.absorption {
            Absorption::EnergyBalance { capacities_j_m3_k } => {
                let kinds = self.reads_material().then(|| self.kinds(fields)).transpose()?;
                energy_balance::shares(radii_m, kinds, capacities_j_m3_k)?
            }
            Absorption::BeerLambert { absorption_1_m, lines } => {
                let (mut shares, left) = lines.absorbed(*absorption_1_m, &centres_m(), radii_m);
                if let Some(solid) = &self.solid {
                    shares.extend(lines.arrived(&left, &self.frame, spot_m, solid));
                }
                shares
            }
            Absorption::BeerLambertMonograph { absorption_1_m } => {
                beer_lambert_monograph::absorbed(&self.beam.profile, *absorption_1_m, &centres_m(), radii_m)
            }
            Absorption::Rays(rays) => {
                let melted = self.reads_melted().then(|| self.melted(frozen, fields, radii_m.len())).transpose()?;
                let solid = self.solid.as_ref();
                return Ok(rays.absorbed(&self.frame, spot_m, positions_m, radii_m, melted.as_deref(), solid));
            }
        };
        Ok(Share { values, traced: None })
    }

    /// `absorbed_w` belongs to the particles of `revision`; `end` is what was found at `t_s`, where the beam was on.
    fn fields(
        &self,
        [absorbed_w, arrived_w]: [Vec<f64>; 2],
        revision: u64,
        mean_power_w: f64,
        t_s: f64,
        end: Option<&Share>,
    ) -> Result<Fields, SolveError> {
        let spot_m = self.beam.spot_m(t_s);
        let mut written = vec![
            Field::new(&self.written.absorbed_power, revision, absorbed_w)?,
            Field::new(&self.written.beam_spot, 0, spot_m.as_slice().to_vec())?,
            Field::new(&self.written.beam_radius, 0, vec![self.beam.profile.radius_m()])?,
            Field::new(&self.written.beam_power, 0, vec![mean_power_w])?,
        ];
        if let Some(port) = &self.written.surface_light {
            written.push(Field::new(port, 0, arrived_w)?);
        }
        if let Some(port) = &self.written.ray_paths {
            let traced = end.and_then(|end| end.traced.as_ref());
            // Without light all of them are the spot.
            let paths_m = traced.map_or_else(|| spot_m.as_slice().repeat(SHOWN * POINTS), |(_, paths)| paths.clone());
            written.push(Field::new(port, 0, paths_m)?);
        }
        Ok(written.into_iter().map(|field| (field.name().to_owned(), field)).collect())
    }
}

impl Physics for Optics {
    type State = State;

    fn ports(&self) -> Ports {
        self.ports.clone()
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let dark = vec![0.0; self.solid.as_ref().map_or(0, SolidSurface::len)];
        let fields = self.fields([vec![0.0; self.count], dark], 0, 0.0, 0.0, None)?;
        Ok((State::default(), Reply { fields, ..Reply::default() }))
    }

    fn solve(&self, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        let end_s = window.t_s + window.dt_s;
        let mean_power_w = self.beam.mean_power_w(window);
        let particles = frozen.end.get("radii").map(|radii| &radii.support);
        let both = if mean_power_w > 0.0 {
            let share = |fields: &Fields, t_s| self.share(frozen, fields, t_s);
            Some(ends(state.shares.clone(), frozen, window, share)?)
        } else {
            None
        };
        let particles_count = frozen.end.get("radii").map_or(0, Field::rows);
        let mut absorbed_w: Vec<f64> = match &both {
            Some([start, end]) => {
                let both = start.values.values.iter().zip(&end.values.values);
                both.map(|(at_start, at_end)| mean_power_w * 0.5 * (at_start + at_end)).collect()
            }
            None => vec![0.0; particles_count + self.solid.as_ref().map_or(0, SolidSurface::len)],
        };
        let arrived_w = absorbed_w.split_off(particles_count);

        let laser_j = mean_power_w * window.dt_s;
        let absorbed_j = energy_j(&absorbed_w, window.dt_s);
        let mut ledger = vec![Energy::gained("laser", laser_j), Energy::lost("absorbed", absorbed_j)];
        let arrived_j = energy_j(&arrived_w, window.dt_s);
        ledger.extend(self.solid.is_some().then(|| Energy::lost("surface_light", arrived_j)));
        let share = if laser_j > 0.0 { absorbed_j / laser_j } else { 0.0 };
        let mut figures = BTreeMap::from([("absorbed over laser".to_owned(), share)]);
        match &self.absorption {
            Absorption::Rays(rays) => {
                let outcomes = both.as_ref().map(|both| {
                    let outcome = |end: &AtInstant<Share>| {
                        end.values.traced.as_ref().map_or_else(Outcome::default, |(outcome, _)| *outcome)
                    };
                    [outcome(&both[0]), outcome(&both[1])]
                });
                let [start, end] = outcomes.unwrap_or_default();
                let lost =
                    |name: &str, at_start: f64, at_end: f64| Energy::lost(name, laser_j * 0.5 * (at_start + at_end));
                ledger.push(lost("passed", start.passed, end.passed));
                ledger.push(lost("escaped", start.escaped, end.escaped));
                ledger.push(lost("residual", start.residual, end.residual));
                figures.insert("rays".to_owned(), rays.count() as f64);
                figures.insert("reflections".to_owned(), end.strikes as f64);
            }
            absorption => {
                ledger.push(Energy::lost("passed", laser_j - absorbed_j - arrived_j));
                if let Absorption::BeerLambert { lines, .. } = absorption {
                    figures.insert("lines".to_owned(), lines.count as f64);
                }
            }
        }
        let end = both.map(|[_, end]| end);
        let kept = end.as_ref().map(|end| &*end.values);
        let revision = particles.map_or(0, |particles| particles.revision);
        let fields = self.fields([absorbed_w, arrived_w], revision, mean_power_w, end_s, kept)?;
        Ok((State { shares: end }, Reply { fields, ledger, figures, ..Reply::default() }))
    }
}
