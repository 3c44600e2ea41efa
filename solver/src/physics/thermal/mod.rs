//! Temperature of the particles: conduction through contacts, heat from absorbed light and from electrical current.

mod conductance;
mod network;
mod particles;
mod settings;
mod trapezoidal;

use std::{borrow::Cow, collections::BTreeMap, sync::Arc};

use network::Network;
use particles::{Carried, Particles};
use serde::{Deserialize, Serialize};
pub use settings::*;
use stagger_messages::{Energy, Field, Fields, Measure, Port, Ports};

use crate::{
    SolveError,
    coupling::{Frozen, Physics, Reply, Window},
    physics::checks::{energy_j, finite, positive, setting},
};

const NODE: &str = "thermal";

/// Lumped temperature of every particle (Zohdi 2018, eqs. 6.35–6.37):
///
/// m_i C θ̇_i = Σ_j G_ij (θ_j − θ_i) + Σ_w G_iw (θ_w − θ_i) + H_i
///
/// with m_i = ρ 4/3 π R_i³, the contact conductances G of [`Conductance`], walls of given temperature θ_w (insulated
/// where they have none) and the power H_i of absorbed light and of electrical current. The trapezoidal rule with weight φ takes it through a window.
///
/// Valid while a particle is nearly isothermal. The figure `largest Biot number` is Bi = G/(K R), the largest
/// conductance of one contact over that of the particle behind it (R the smaller radius): small against 1 it is valid,
/// from about 0.1 on the temperature inside a particle varies noticeably.
///
/// The ledger's `heat` counts from the start: Σ m_i C (θ_i − θ(0)), in J, so that it is 0 at t = 0, where masses are
/// not known yet. Its change over a window is `absorbed` + `joule` − `to_walls` + `poured` − `removed` to rounding; the last
/// two are the heat of particles that come and go, where `ids` tell. These do so at the window's start: a new one begins with the
/// temperature of what is poured, and contacts of one that is gone conduct nothing, at the start either. Radii do not
/// change during a run.
pub struct Thermal {
    settings: Settings,
    temperature: Arc<Port>,
}

/// The temperatures; cloning shares them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State {
    temperature: Field,
    /// Whose they are; `None` until a window says it.
    particles: Option<Particles>,
}

impl Thermal {
    /// Checks the settings.
    ///
    /// # Errors
    /// A setting is outside its range.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        positive(NODE, "density", settings.density_kg_m3)?;
        positive(NODE, "heat capacity", settings.heat_capacity_j_kg_k)?;
        positive(NODE, "conductivity", settings.conductivity_w_m_k)?;
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
        let temperature = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude));
        Ok(Self { settings, temperature })
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
        Ok(State { temperature: Field::new(&self.temperature, 0, temperatures_k)?, particles: None })
    }

    fn reply(&self, state: &State, ledger: Vec<Energy>) -> Reply {
        let fields = [(state.temperature.name().to_owned(), state.temperature.clone())].into();
        Reply { fields, ledger, ..Reply::default() }
    }
}

impl Physics for Thermal {
    type State = State;

    fn ports(&self) -> Ports {
        let mut reads = vec![
            Port::f64("radii", "m", "particles", 1, Measure::None),
            Port::u32("contact_pairs", "contacts", 2),
            Port::f64("contact_area", "m^2", "contacts", 1, Measure::None),
            Port::f64("contact_distance", "m", "contacts", 1, Measure::None),
            Port::u32("wall_contact_pairs", "wall-contacts", 2),
            Port::f64("wall_contact_area", "m^2", "wall-contacts", 1, Measure::None),
            Port::f64("wall_contact_distance", "m", "wall-contacts", 1, Measure::None),
        ];
        if self.settings.reads_absorbed_power {
            reads.push(Port::f64("absorbed_power", "W", "particles", 1, Measure::None).as_sum());
        }
        if self.settings.reads_joule_power {
            reads.push(Port::f64("joule_power", "W", "particles", 1, Measure::None).as_sum());
        }
        if self.settings.reads_ids {
            reads.push(Port::u32("ids", "particles", 1));
        }
        Ports { reads, writes: vec![(*self.temperature).clone()] }
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let state = self.state(vec![self.settings.temperature_k; self.settings.count])?;
        let reply = self.reply(&state, vec![Energy::stored("heat", 0.0)]);
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
        let mut power = |reads: bool, name: &str| {
            reads.then(|| now.power(name, &frozen.end, [&before, then])).transpose()
        };
        let absorbed_w = power(settings.reads_absorbed_power, "absorbed_power")?;
        let joule_w = power(settings.reads_joule_power, "joule_power")?;
        let power_w = match (&absorbed_w, &joule_w) {
            (Some(light), Some(current)) => Some(Cow::Owned(light.iter().zip(&**current).map(|(a, b)| a + b).collect())),
            (one, other) => one.as_deref().or(other.as_deref()).map(Cow::Borrowed),
        };
        let power_w: Option<&[f64]> = power_w.as_deref();
        let radii_m = now.radii.f64()?;
        let capacities_j_k: Vec<f64> = radii_m.iter().map(|&radius_m| settings.capacity_j_k(radius_m)).collect();
        let at_start = Network::new(settings, &frozen.start, radii_m, before.rows(&now)?.as_deref())?;
        let at_end = Network::new(settings, &frozen.end, radii_m, None)?;

        let Carried { temperatures_k: start_k, poured_j, removed_j } =
            then.carry(settings, state.temperature.f64()?, &now)?;
        let networks = [&at_start, &at_end];
        let advanced = trapezoidal::advance(settings, &capacities_j_k, &start_k, networks, power_w, window.dt_s);
        finite(NODE, "temperature", 1, &advanced.temperatures_k)?;

        let above_start_k = advanced.temperatures_k.iter().map(|temperature| temperature - settings.temperature_k);
        let heat_j =
            capacities_j_k.iter().zip(above_start_k).fold(0.0, |sum, (capacity, above)| sum + capacity * above);
        let mut ledger = vec![
            Energy::stored("heat", heat_j),
            Energy::gained("absorbed", absorbed_w.map_or(0.0, |power_w| energy_j(&power_w, window.dt_s))),
            Energy::lost("to_walls", advanced.to_walls_j),
        ];
        if let Some(power_w) = joule_w {
            ledger.push(Energy::gained("joule", energy_j(&power_w, window.dt_s)));
        }
        if settings.reads_ids {
            ledger.extend([Energy::gained("poured", poured_j), Energy::lost("removed", removed_j)]);
        }
        let on_rows = |temperatures_k: Vec<f64>| {
            let rows = now.radii.support.clone();
            Field::with_support(Arc::clone(&self.temperature), rows, temperatures_k.into())
        };
        let mut start = Fields::new();
        if state.temperature.support != now.radii.support {
            start.insert(self.temperature.field.clone(), on_rows(start_k)?);
        }
        let temperature = on_rows(advanced.temperatures_k)?;
        let state = State { temperature, particles: Some(now) };
        let figures = BTreeMap::from([
            ("iterations".to_owned(), f64::from(advanced.sweeps)),
            ("largest Biot number".to_owned(), at_end.biot),
        ]);
        let reply = Reply { start, not_converged: advanced.not_converged, figures, ..self.reply(&state, ledger) };
        Ok((state, reply))
    }
}
