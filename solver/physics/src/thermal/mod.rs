//! Temperature of the particles: conduction through contacts, heat from absorbed light and from electrical current, phases.

pub mod advice;
mod ambient;
mod balance;
mod enthalpy;
pub mod keys;
mod network;
mod newton;
mod overshoot;
mod particles;
mod presence;
mod settings;
mod tradeoff;
mod trapezoidal;

use stagger_coupling::{Frozen, NotConverged, Physics, Reply, SolveError, Window};
use std::{borrow::Cow, collections::BTreeMap, sync::Arc};

pub use crate::common::Table;
use enthalpy::Form;
use network::{Conductivities, Network};
use particles::{Carried, Particles, Power};
use serde::{Deserialize, Serialize};
pub use settings::*;
use stagger_messages::{Energy, Field, Fields, Measure, Port, Ports, Values};

use crate::common::{
    PARTICLES,
    checks::{energy_j, finite, positive, setting},
    power_port,
};

const NODE: &str = "thermal";

/// Lumped temperature of every particle (Zohdi 2018, eqs. 6.35–6.37):
///
/// m_i C θ̇_i = Σ_j G_ij (θ_j − θ_i) + Σ_w G_iw (θ_w − θ_i) + H_i
///
/// with m_i = ρ 4/3 π R_i³, the contact conductances G of [`Conductance`], walls of given temperature θ_w (insulated
/// where they have none) and the power H_i of absorbed light and of electrical current. The trapezoidal rule with weight φ takes
/// it through a window; where that would carry a particle beyond all that surrounds it, [`Settings::overshoot`] says what is done,
/// and the figure `windows of raised phi` counts the windows in which it was.
///
/// Valid while a particle is nearly isothermal. The figure `largest Biot number` is Bi = G/(K R), the largest
/// conductance of one contact over that of the particle behind it (R the smaller radius): small against 1 it is valid,
/// from about 0.1 on the temperature inside a particle varies noticeably.
///
/// The ledger's `heat` counts from one temperature θ(0) of the start: Σ m_i C (θ_i − θ(0)), in J. It is 0 at t = 0, where
/// masses are not known yet, unless [`Settings::start`] tells what each particle has. Its change over a window is `absorbed` + `joule` − `to_walls` + `poured` − `removed` − `missed` to rounding.
/// `poured` and `removed` are the heat of particles that come and go, where `ids` tell. These do so at the window's start: a new
/// one begins with the temperature of what is poured, and contacts of one that is gone conduct nothing, at the start either.
/// `missed` is light and current meant for particles that were no longer there: gone since their writer last solved, or
/// vapour before the window's end; and the rounding of the moment at which they were. So `absorbed` and `joule` are what their writers say they gave. Radii do not change during a
/// run.
///
/// Where a wall is the upper face of a solid on a grid ([`Settings::solid`]), each contact with it takes the temperature of the
/// cell under it, `surface_temperature`, and gives it `surface_heat`, a power for each cell and the mean over the window.
///
/// With [`Settings::enthalpy`] the state is the enthalpy of each particle instead, from which temperature and phase follow:
/// several materials, heat capacities and conductivities that depend on temperature, melting and boiling, and an ambient.
/// Where a material changes phase, `melted` is the liquid share of what is not vapour in each particle, which stays 1 while it
/// boils, and `vapourised` is 1 where a particle is vapour; the particles' motion takes it out at the start of the next window.
/// From the moment it is vapour, which may be within a window, a particle takes no more heat and gives none: its temperature is
/// that at which boiling ends, and the rest of its light is `missed`. `heat` is then the sensible part, `latent` the other one,
/// and `vapour` what left with vapour.
pub struct Thermal {
    settings: Settings,
    form: Option<Form>,
    temperature: Arc<Port>,
    melted: Arc<Port>,
    vapourised: Arc<Port>,
    /// Where contacts with a wall rest on a solid.
    surface_heat: Option<Arc<Port>>,
}

/// The temperatures and, in enthalpy form, the enthalpies; cloning shares them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State {
    temperature: Field,
    /// `melted` and `vapourised`, where a material changes its phase.
    phases: Option<[Field; 2]>,
    /// Specific enthalpies above the start, in J/kg; `None` where the temperature tells them.
    enthalpies_j_kg: Option<Arc<Vec<f64>>>,
    /// Vapour that has left so far.
    gone: Gone,
    /// Windows so far whose end had more weight than φ.
    raised: u64,
    /// Whose they are; `None` until a window says it.
    particles: Option<Particles>,
}

/// Vapour that has left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Gone {
    /// Particles.
    count: u64,
    mass_kg: f64,
}

/// What a window starts from.
#[derive(Clone, Copy)]
struct Inputs<'f> {
    /// Particles at the window's start, of the state, and at the window's end.
    before: &'f Particles,
    then: &'f Particles,
    now: &'f Particles,
    frozen: &'f Frozen,
    /// Heat that enters from outside, in W.
    power_w: Option<&'f [f64]>,
    dt_s: f64,
}

/// What a window ended with.
struct Ended {
    /// At the window's start, on the rows of its end.
    start_k: Vec<f64>,
    temperatures_k: Vec<f64>,
    /// In enthalpy form.
    held: Option<Held>,
    stored: Vec<Energy>,
    exchanged: Vec<Energy>,
    /// To each cell of the solid's upper face, where there is one.
    surface_j: Vec<f64>,
    poured_j: f64,
    removed_j: f64,
    /// Of the power, for particles that were vapour before the window's end.
    missed_j: f64,
    /// Whether the window's end had more weight than φ.
    is_raised: bool,
    figures: BTreeMap<String, f64>,
    not_converged: Option<NotConverged>,
}

/// What particles hold beside their temperature.
struct Held {
    enthalpies_j_kg: Vec<f64>,
    /// Liquid share of each particle's mass, and whether it is vapour.
    melted: Vec<f64>,
    vapourised: Vec<u8>,
    gone: Gone,
}

impl Thermal {
    /// Checks the settings.
    ///
    /// # Errors
    /// A setting is outside its range.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        positive(NODE, "density", settings.density_kg_m3)?;
        positive(NODE, "heat capacity", settings.heat_capacity_j_kg_k)?;
        let conductivity = settings.conductivity_w_m_k;
        setting(
            NODE,
            "conductivity",
            conductivity,
            conductivity.is_finite() && conductivity >= 0.0,
            "at least 0 and finite",
        )?;
        positive(NODE, "tolerance", settings.tolerance)?;
        positive(NODE, "limit of iterations", settings.iterations.into())?;
        setting(NODE, "phi", settings.phi, (0.0..=1.0).contains(&settings.phi), "from 0 to 1")?;
        let poured = settings.pour_temperature_k.unwrap_or(settings.temperature_k);
        for (what, at) in [("initial temperature", settings.temperature_k), ("temperature of the poured", poured)] {
            setting(NODE, what, at, at.is_finite() && at >= 0.0, "at least 0 K")?;
        }
        for wall in &settings.walls {
            let at = wall.temperature_k.unwrap_or(0.0);
            let what = format!("temperature of wall `{}`", wall.name);
            setting(NODE, &what, at, at.is_finite() && at >= 0.0, "at least 0 K")?;
        }
        if let Some(start) = &settings.start {
            start.check(settings.count)?;
        }
        let form = settings.enthalpy.as_ref().map(|enthalpy| Form::new(&settings, enthalpy)).transpose()?;
        let surface_heat = settings.on_solid().map(|_| Arc::new(power_port("surface_heat")));
        let port = |name, unit, measure| Arc::new(Port::f64(name, unit, PARTICLES, 1, measure));
        Ok(Self {
            form,
            settings,
            temperature: port("temperature", "K", Measure::Magnitude),
            melted: port("melted", "1", Measure::None),
            vapourised: Arc::new(Port::u8("vapourised", PARTICLES, 1)),
            surface_heat,
        })
    }

    /// The state in which the particles have the temperatures given, in K: where they do not start alike.
    ///
    /// # Errors
    /// Not one finite temperature for each particle.
    pub fn state(&self, temperatures_k: Vec<f64>) -> Result<State, SolveError> {
        let (found, expected) = (temperatures_k.len(), self.settings.count);
        if found != expected {
            return Err(SolveError::Mismatch(format!(
                "{NODE}: {found} temperatures are given, but the scene has {expected} particles"
            )));
        }
        finite(NODE, "temperature", 1, &temperatures_k)?;
        let phases = match &self.form {
            Some(form) if self.changes_phase() => {
                let [molten, vapour] = form.at_start;
                Some([
                    Field::new(&self.melted, 0, vec![molten; found])?,
                    Field::new(&self.vapourised, 0, vec![u8::from(vapour >= 1.0); found])?,
                ])
            }
            _ => None,
        };
        let temperature = Field::new(&self.temperature, 0, temperatures_k)?;
        Ok(State { temperature, phases, enthalpies_j_kg: None, gone: Gone::default(), raised: 0, particles: None })
    }

    fn changes_phase(&self) -> bool {
        self.settings.enthalpy.as_ref().is_some_and(Enthalpy::changes_phase)
    }

    fn reply(&self, state: &State, ledger: Vec<Energy>) -> Reply {
        let written = [&state.temperature].into_iter().chain(state.phases.iter().flatten());
        let fields = written.map(|field| (field.name().to_owned(), field.clone())).collect();
        Reply { fields, ledger, ..Reply::default() }
    }

    /// Adds what the solid's upper face is given, in W on each cell, where there is one.
    fn write_surface(&self, surface_w: Vec<f64>, reply: &mut Reply) -> Result<(), SolveError> {
        if let Some(port) = &self.surface_heat {
            reply.fields.insert(port.field.clone(), Field::new(port, 0, surface_w)?);
        }
        Ok(())
    }

    /// A window in temperature form.
    fn advance(&self, inputs: Inputs<'_>, state: &State) -> Result<Ended, SolveError> {
        let Inputs { before, then, now, frozen, power_w, dt_s } = inputs;
        let settings = &self.settings;
        let radii_m = now.radii.f64()?;
        let capacities_j_k: Vec<f64> = radii_m.iter().map(|&radius_m| settings.capacity_j_k(radius_m)).collect();
        let conductivities = Conductivities::All(settings.conductivity_w_m_k);
        let rows = before.rows(now)?;
        let at_start = Network::new(settings, conductivities, &frozen.start, radii_m, rows.as_deref())?;
        let at_end = Network::new(settings, conductivities, &frozen.end, radii_m, None)?;

        let temperatures_k = state.temperature.f64()?;
        let poured_k = settings.pour_temperature_k.unwrap_or(settings.temperature_k);
        let Carried { values: start_k, came, went } = then.carry(temperatures_k, now, |_| poured_k)?;
        let above_k = |temperature_k: f64| temperature_k - settings.temperature_k;
        let poured_j = came.iter().fold(0.0, |sum, &row| sum + capacities_j_k[row] * above_k(poured_k));
        let radii_then_m = then.radii.f64()?;
        let removed_j = went
            .iter()
            .fold(0.0, |sum, &row| sum + settings.capacity_j_k(radii_then_m[row]) * above_k(temperatures_k[row]));

        let advanced = trapezoidal::advance(settings, &capacities_j_k, &start_k, [&at_start, &at_end], power_w, dt_s)?;
        let trapezoidal::Advanced { temperatures_k, to_walls, sweeps, not_converged, is_raised } = advanced;
        finite(NODE, "temperature", 1, &temperatures_k)?;
        let above_start_k = temperatures_k.iter().map(|&temperature_k| above_k(temperature_k));
        let heat_j =
            capacities_j_k.iter().zip(above_start_k).fold(0.0, |sum, (capacity, above)| sum + capacity * above);
        Ok(Ended {
            start_k,
            temperatures_k,
            held: None,
            stored: vec![Energy::stored("heat", heat_j)],
            exchanged: vec![Energy::lost("to_walls", to_walls.held_j)],
            surface_j: to_walls.surface_j,
            poured_j,
            removed_j,
            missed_j: 0.0,
            is_raised,
            figures: figures(sweeps, at_end.biot),
            not_converged,
        })
    }
}

impl Physics for Thermal {
    type State = State;

    fn ports(&self) -> Ports {
        crate::Settings::ports(&self.settings)
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let settings = &self.settings;
        let (mut heat_j, mut latent_j) = (0.0, 0.0);
        let mut state = self.state(match &settings.start {
            Some(start) => start.temperatures_k.clone(),
            None => vec![settings.temperature_k; settings.count],
        })?;
        match (&settings.start, &self.form) {
            (Some(start), Some(form)) => {
                let told = form.begin(start)?;
                (heat_j, latent_j) = (told.heat_j, told.latent_j);
                if self.changes_phase() {
                    state.phases = Some([
                        Field::new(&self.melted, 0, told.melted)?,
                        Field::new(&self.vapourised, 0, told.vapourised)?,
                    ]);
                }
                state.enthalpies_j_kg = Some(Arc::new(told.enthalpies_j_kg));
            }
            (Some(start), None) => {
                let of_all = start.temperatures_k.iter().zip(&start.radii_m);
                heat_j = of_all.fold(0.0, |sum, (temperature_k, &radius_m)| {
                    sum + settings.capacity_j_k(radius_m) * (temperature_k - settings.temperature_k)
                });
            }
            (None, _) => {}
        }
        let mut ledger = vec![Energy::stored("heat", heat_j)];
        if self.changes_phase() {
            ledger.push(Energy::stored("latent", latent_j));
        }
        let mut reply = self.reply(&state, ledger);
        let cold = settings.on_solid().map_or_else(Vec::new, |solid| vec![0.0; solid.len()]);
        self.write_surface(cold, &mut reply)?;
        Ok((state, reply))
    }

    fn solve(&self, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        let settings = &self.settings;
        let before = Particles::read(settings, &frozen.start)?;
        let mut now = Particles::read(settings, &frozen.end)?;
        let then = state.particles.as_ref().unwrap_or(&before);
        if then.radii.rows() != state.temperature.rows() {
            return Err(SolveError::Mismatch(format!(
                "{NODE}: field `radii` has {} rows at the start, but the scene has {} particles",
                then.radii.rows(),
                state.temperature.rows()
            )));
        }
        let mut power = |name: &str| {
            let is_written = frozen.end.contains_key(name);
            is_written.then(|| now.power(name, &frozen.end, [&before, then])).transpose()
        };
        let absorbed = power("absorbed_power")?;
        let joule = power("joule_power")?;
        let both = || [&absorbed, &joule].into_iter().flatten();
        let power_w = match (&absorbed, &joule) {
            (Some(light), Some(current)) => {
                let sums = light.on_rows_w.iter().zip(&*current.on_rows_w).map(|(light, current)| light + current);
                Some(Cow::Owned(sums.collect()))
            }
            (one, other) => one.as_ref().or(other.as_ref()).map(|only| Cow::Borrowed(&*only.on_rows_w)),
        };
        let power_w: Option<&[f64]> = power_w.as_deref();
        let inputs = Inputs { before: &before, then, now: &now, frozen, power_w, dt_s: window.dt_s };
        let given_j = |power: &Power<'_>| energy_j(power.given_w, window.dt_s);
        let (absorbed_j, joule_j) = (absorbed.as_ref().map_or(0.0, given_j), joule.as_ref().map(given_j));
        let missed_w = both().fold(0.0, |sum, power| sum + power.missed_w);
        let ended = match (&self.form, &settings.enthalpy) {
            (Some(form), Some(enthalpy)) => form.advance(settings, enthalpy, inputs, state)?,
            _ => self.advance(inputs, state)?,
        };

        let surface_w: Vec<f64> = ended.surface_j.iter().map(|joule| joule / window.dt_s).collect();
        let mut ledger = ended.stored;
        ledger.extend(settings.on_solid().map(|_| Energy::lost("surface_heat", energy_j(&surface_w, window.dt_s))));
        ledger.push(Energy::gained("absorbed", absorbed_j));
        ledger.extend(ended.exchanged);
        ledger.extend(joule_j.map(|joule_j| Energy::gained("joule", joule_j)));
        let come_and_go = frozen.end.contains_key("ids");
        if come_and_go {
            ledger.extend([Energy::gained("poured", ended.poured_j), Energy::lost("removed", ended.removed_j)]);
        }
        if come_and_go || self.changes_phase() {
            ledger.push(Energy::lost("missed", missed_w * window.dt_s + ended.missed_j));
        }
        let rows = &now.radii.support;
        let field = |port: &Arc<Port>, values: Values| Field::with_support(Arc::clone(port), rows.clone(), values);
        let mut start = Fields::new();
        if state.temperature.support != *rows {
            start.insert(self.temperature.field.clone(), field(&self.temperature, ended.start_k.into())?);
        }
        let temperature = field(&self.temperature, ended.temperatures_k.into())?;
        let mut figures = ended.figures;
        let raised = state.raised + u64::from(ended.is_raised);
        figures.insert("windows of raised phi".to_owned(), raised as f64);
        let (mut phases, mut enthalpies_j_kg, mut gone) = (None, None, state.gone);
        if let Some(held) = ended.held {
            enthalpies_j_kg = Some(Arc::new(held.enthalpies_j_kg));
            if self.changes_phase() {
                gone = held.gone;
                figures.insert("vapourised particles".to_owned(), gone.count as f64);
                figures.insert("vapourised mass [kg]".to_owned(), gone.mass_kg);
                phases =
                    Some([field(&self.melted, held.melted.into())?, field(&self.vapourised, held.vapourised.into())?]);
            }
        }
        let state = State { temperature, phases, enthalpies_j_kg, gone, raised, particles: Some(now) };
        let mut reply = Reply { start, not_converged: ended.not_converged, figures, ..self.reply(&state, ledger) };
        self.write_surface(surface_w, &mut reply)?;
        Ok((state, reply))
    }
}

fn figures(sweeps: u32, biot: f64) -> BTreeMap<String, f64> {
    BTreeMap::from([("iterations".to_owned(), f64::from(sweeps)), ("largest Biot number".to_owned(), biot)])
}
