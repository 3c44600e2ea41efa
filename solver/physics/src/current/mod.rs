//! Electrical current through the particles, and the heat it makes.

pub mod advice;
mod averaging;
mod conductivity;
mod graph;
mod jacobi;
pub mod keys;
mod network;
mod particles;
mod potential;
mod settings;
mod tradeoff;

use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use std::{collections::BTreeMap, sync::Arc};

use network::Terminal;
use particles::Particles;
use serde::{Deserialize, Serialize};
pub use settings::*;
use stagger_messages::{Energy, Field, Fields, Measure, Port, Ports, Support};

use crate::common::{
    PARTICLES,
    checks::{energy_j, positive, reached, setting},
};

const NODE: &str = "current";

/// Change of the particles' electric fields, over the largest, at which a conductivity that depends on them is settled: well
/// below the tolerances of any coupling.
const FIELD_TOLERANCE: f64 = 1e-9;
/// Times that it is computed anew before it is given up.
const FIELD_ITERATIONS: u32 = 100;

/// Steady electrical current from wall to wall through the contacts of the particles, by one of the [`Model`]s; charge relaxes
/// in far less than a step (Zohdi 2018, section 8.8).
///
/// `potential` (of [`Model::Potential`] only), `current_density`, `wall_current` and `wall_current_density` are those at the
/// window's end; the last two have a row for each electrified wall, in the order of the scene, and the last is over the area
/// of its contacts. `joule_power` is the mean over the window: s ½ (P(t) + P(t+Δt)), with the share s of it in which the
/// walls are electrified, and P with the contacts at the window's start and end; second order in Δt. P at a window's end is
/// kept as the next one's start. Where particles came or went at the window's start, P is that of the end throughout.
///
/// The ledger's `joule` is what becomes heat; `electrical`, the power the walls give, is computed apart from it, and the two
/// agree within the solver's tolerance.
///
/// Equations are solved from the values of the last window's end. A conductivity that depends on the field is iterated
/// with the current: every particle's field is J/σ.
pub struct Current {
    settings: Settings,
    electrodes: Vec<Electrode>,
    /// Which electrified wall each wall is.
    of_walls: Vec<Option<usize>>,
    written: Written,
}

/// A wall that is electrified in the model that runs.
struct Electrode {
    name: String,
    drive: Drive,
}

/// What an electrified wall is held at.
#[derive(Clone, Copy)]
enum Drive {
    /// In V.
    Potential(f64),
    /// Out of the wall, in A.
    Current(f64),
    /// In A/m².
    CurrentDensity(f64),
}

struct Written {
    joule_power: Arc<Port>,
    current_density: Arc<Port>,
    wall_current: Arc<Port>,
    wall_current_density: Arc<Port>,
    potential: Option<Arc<Port>>,
}

/// What the next window starts with.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// Who the particles of the last window's end are: their ids, or where nobody comes or goes, their radii.
    rows: Option<Field>,
    /// What flowed there, where the walls were electrified.
    last: Option<Arc<Last>>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Last {
    /// Unknowns of the equations: those of the particles, then those of the walls.
    values: Vec<f64>,
    joule_w: Vec<f64>,
    electrical_w: f64,
    /// Fields of the particles in V/m; empty where nothing depends on them.
    field_v_m: Vec<f64>,
}

/// The current at one instant.
struct Flow {
    /// Unknowns of the equations: those of the particles, then those of the walls.
    values: Vec<f64>,
    current_density_a_m2: Vec<f64>,
    joule_w: Vec<f64>,
    electrical_w: f64,
    terminals: Vec<Terminal>,
    iterations: u32,
    residual: f64,
    /// Particles that nothing connects to an electrified wall.
    floating: usize,
}

impl Current {
    /// Checks the settings.
    ///
    /// # Errors
    /// A setting is outside its range, or a wall is given both a potential and a current.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        let Conductivity { reference_s_m, by_temperature, by_field } = settings.conductivity;
        positive(NODE, "conductivity", reference_s_m)?;
        for (of, transition) in [("temperature", by_temperature), ("field", by_field)] {
            for (what, value) in
                transition.iter().flat_map(|t| [("gain", t.gain), ("rate", t.rate), ("reference", t.reference)])
            {
                setting(NODE, &format!("{what} of the conductivity by {of}"), value, value.is_finite(), "finite")?;
            }
        }
        positive(NODE, "least share of the reference conductivity", settings.conductivity.least_share())?;
        positive(NODE, "temperature", settings.temperature_k)?;
        positive(NODE, "tolerance", settings.solver.tolerance)?;
        positive(NODE, "limit of iterations", settings.solver.iterations.into())?;
        let Settings { starts_s, ends_s, .. } = settings;
        setting(NODE, "start of the current", starts_s, starts_s.is_finite(), "finite")?;
        setting(NODE, "end of the current", ends_s, ends_s > starts_s, "after its start")?;
        if let Model::Averaging { heat_share } = settings.model {
            setting(NODE, "share of heat", heat_share, (0.0..=1.0).contains(&heat_share), "from 0 to 1")?;
        }
        let mut electrodes = Vec::new();
        let mut of_walls = vec![None; settings.walls.len()];
        for (wall, of_wall) in settings.walls.iter().zip(&mut of_walls) {
            let electrode = &wall.electrode;
            let drive = match (settings.model, electrode.potential_v, electrode.current_a) {
                (Model::Averaging { .. }, ..) => electrode.current_density_a_m2.map(Drive::CurrentDensity),
                (_, Some(_), Some(_)) => {
                    let message =
                        format!("{NODE}: wall `{}` has a potential and a current, but can be given one", wall.name);
                    return Err(SolveError::Start(message));
                }
                (_, Some(volt), None) => Some(Drive::Potential(volt)),
                (_, None, ampere) => ampere.map(Drive::Current),
            };
            let Some(drive) = drive else { continue };
            let (Drive::Potential(given) | Drive::Current(given) | Drive::CurrentDensity(given)) = drive;
            setting(NODE, &format!("what wall `{}` is held at", wall.name), given, given.is_finite(), "finite")?;
            *of_wall = Some(electrodes.len());
            electrodes.push(Electrode { name: wall.name.clone(), drive });
        }
        let of = |name: &str, unit: &str, support: &str, measure| Arc::new(Port::f64(name, unit, support, 1, measure));
        let written = Written {
            joule_power: of("joule_power", "W", PARTICLES, Measure::Magnitude),
            current_density: of("current_density", "A/m^2", PARTICLES, Measure::None),
            wall_current: of("wall_current", "A", "electrodes", Measure::None),
            wall_current_density: of("wall_current_density", "A/m^2", "electrodes", Measure::None),
            potential: matches!(settings.model, Model::Potential { .. })
                .then(|| of("potential", "V", PARTICLES, Measure::None)),
        };
        Ok(Self { settings, electrodes, of_walls, written })
    }

    /// Share of a window in which the walls are electrified.
    fn on_share(&self, window: Window) -> f64 {
        let Settings { starts_s, ends_s, .. } = self.settings;
        let end_s = window.t_s + window.dt_s;
        let on_s = end_s.min(ends_s) - window.t_s.max(starts_s);
        if on_s >= window.dt_s { 1.0 } else { (on_s / window.dt_s).max(0.0) }
    }

    /// What flows at one instant. `before` are the rows that an older temperature may stand on, `last` is where the
    /// equations start from.
    fn flow(
        &self,
        fields: &Fields,
        particles: &Particles<'_>,
        before: [Option<&Field>; 2],
        last: &Last,
    ) -> Result<(Flow, Last), SolveError> {
        let radii_m = particles.radii_m;
        let temperatures_k = particles.temperatures_k(&self.settings, fields, before)?;
        let conductivity = &self.settings.conductivity;
        let count = radii_m.len();
        let mut field_v_m = if last.field_v_m.len() == count { last.field_v_m.clone() } else { vec![0.0; count] };
        let mut start = last.values.clone();
        let mut iterations = 0;
        for _ in 0..FIELD_ITERATIONS {
            let of_each = temperatures_k.iter().zip(&field_v_m);
            let sigma_s_m: Vec<f64> = of_each.map(|(&kelvin, &field)| conductivity.at(kelvin, field)).collect();
            let mut flow = match self.settings.model {
                Model::Averaging { heat_share } => self.averaged(heat_share, fields, radii_m, &sigma_s_m, &start),
                Model::Potential { conductance } => self.potentials(conductance, fields, radii_m, &sigma_s_m, &start),
            }?;
            iterations += flow.iterations;
            let (mut change, mut largest) = (0.0_f64, 0.0_f64);
            for (field, (density, sigma)) in field_v_m.iter_mut().zip(flow.current_density_a_m2.iter().zip(&sigma_s_m))
            {
                let new = density / sigma;
                change = change.max((new - *field).abs());
                largest = largest.max(new);
                *field = new;
            }
            if conductivity.by_field.is_none() || change <= FIELD_TOLERANCE * largest {
                flow.iterations = iterations;
                let field_v_m = conductivity.by_field.map_or_else(Vec::new, |_| field_v_m);
                let (values, joule_w) = (flow.values.clone(), flow.joule_w.clone());
                let last = Last { values, joule_w, electrical_w: flow.electrical_w, field_v_m };
                return Ok((flow, last));
            }
            start.clone_from(&flow.values);
        }
        Err(SolveError::Unsolved(format!(
            "{NODE}: the conductivity by the electric field has not settled in {FIELD_ITERATIONS} iterations, as it changes too \
             steeply with the field: expected a smaller `gain` or `rate` in [current.by-field]"
        )))
    }

    /// The last window's end on the rows of these particles; nothing where it is not known which is which.
    fn carried(&self, state: &State, particles: &Particles<'_>) -> Result<Last, SolveError> {
        let nothing = Last { values: Vec::new(), joule_w: Vec::new(), electrical_w: 0.0, field_v_m: Vec::new() };
        let (Some(rows), Some(last)) = (&state.rows, &state.last) else { return Ok(nothing) };
        let then = rows.rows();
        let (of_particles, of_walls) = last.values.split_at(then.min(last.values.len()));
        let Some(mut values) = particles.carry(rows, of_particles, 0.0)? else { return Ok(nothing) };
        values.extend_from_slice(of_walls);
        let field_v_m = if last.field_v_m.is_empty() {
            Vec::new()
        } else {
            particles.carry(rows, &last.field_v_m, 0.0)?.unwrap_or_default()
        };
        Ok(Last { values, field_v_m, ..nothing })
    }

    /// The written fields; `flow` is `None` where the walls are not electrified.
    fn fields(&self, rows: &Support, joule_w: Vec<f64>, flow: Option<&Flow>) -> Result<Fields, SolveError> {
        let count = joule_w.len();
        let on_particles =
            |port: &Arc<Port>, values: Vec<f64>| Field::with_support(Arc::clone(port), rows.clone(), values.into());
        let at_walls = |port: &Arc<Port>, value: fn(&Terminal) -> f64| {
            let zeros = || vec![0.0; self.electrodes.len()];
            Field::new(port, 0, flow.map_or_else(zeros, |flow| flow.terminals.iter().map(value).collect()))
        };
        let zeros = || vec![0.0; count];
        let mut written = vec![
            on_particles(&self.written.joule_power, joule_w)?,
            on_particles(
                &self.written.current_density,
                flow.map_or_else(zeros, |flow| flow.current_density_a_m2.clone()),
            )?,
            at_walls(&self.written.wall_current, |terminal| terminal.current_a)?,
            at_walls(&self.written.wall_current_density, Terminal::current_density_a_m2)?,
        ];
        if let Some(port) = &self.written.potential {
            written.push(on_particles(port, flow.map_or_else(zeros, |flow| flow.values[..count].to_vec()))?);
        }
        Ok(written.into_iter().map(|field| (field.name().to_owned(), field)).collect())
    }

    fn figures(&self, flow: &Flow) -> BTreeMap<String, f64> {
        let mut figures = BTreeMap::from([
            ("iterations".to_owned(), f64::from(flow.iterations)),
            ("residual".to_owned(), flow.residual),
            ("floating particles".to_owned(), flow.floating as f64),
        ]);
        for (electrode, terminal) in self.electrodes.iter().zip(&flow.terminals) {
            let name = &electrode.name;
            figures.insert(format!("current at {name} [A]"), terminal.current_a);
            figures.insert(format!("current density at {name} [A/m^2]"), terminal.current_density_a_m2());
            if self.written.potential.is_some() {
                figures.insert(format!("potential at {name} [V]"), terminal.potential_v);
            }
        }
        figures
    }
}

impl Physics for Current {
    type State = State;

    fn ports(&self) -> Ports {
        crate::Settings::ports(&self.settings)
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let rows = Support { name: PARTICLES.into(), count: self.settings.count as u64, revision: 0 };
        let fields = self.fields(&rows, vec![0.0; self.settings.count], None)?;
        Ok((State::default(), Reply { fields, ..Reply::default() }))
    }

    fn solve(&self, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        let now = Particles::read(&frozen.end)?;
        let rows = Some(now.rows.clone());
        let share = self.on_share(window);
        if share <= 0.0 {
            let fields = self.fields(&now.rows.support, vec![0.0; now.radii_m.len()], None)?;
            let ledger = vec![Energy::gained("electrical", 0.0), Energy::lost("joule", 0.0)];
            return Ok((State { rows, last: None }, Reply { fields, ledger, ..Reply::default() }));
        }

        let before = Particles::read(&frozen.start)?;
        let known = [Some(before.rows), state.rows.as_ref()];
        let last = self.carried(state, &now)?;
        let is_same = |rows: &Field| rows.support == now.rows.support;
        let kept = state.last.clone().filter(|_| state.rows.as_ref().is_some_and(is_same));
        let (at_start, iterations) = match kept {
            Some(kept) => (Some(kept), 0),
            None if is_same(before.rows) => {
                let (flow, at_start) = self.flow(&frozen.start, &before, known, &last)?;
                (Some(Arc::new(at_start)), flow.iterations)
            }
            None => (None, 0),
        };
        let (mut flow, at_end) = self.flow(&frozen.end, &now, known, at_start.as_deref().unwrap_or(&last))?;
        flow.iterations += iterations;

        let mean = |start: f64, end: f64| share * 0.5 * (start + end);
        let joule_w: Vec<f64> = match &at_start {
            Some(start) => start.joule_w.iter().zip(&flow.joule_w).map(|(start, end)| mean(*start, *end)).collect(),
            None => flow.joule_w.iter().map(|&end| mean(end, end)).collect(),
        };
        let electrical_w = mean(at_start.map_or(flow.electrical_w, |start| start.electrical_w), flow.electrical_w);
        let ledger = vec![
            Energy::gained("electrical", electrical_w * window.dt_s),
            Energy::lost("joule", energy_j(&joule_w, window.dt_s)),
        ];
        let figures = self.figures(&flow);
        // A window that ends with the current still has it at its end.
        let is_on = reached(self.settings.ends_s, window.t_s + window.dt_s);
        let fields = self.fields(&now.rows.support, joule_w, is_on.then_some(&flow))?;
        let state = State { rows, last: is_on.then(|| Arc::new(at_end)) };
        Ok((state, Reply { fields, ledger, figures, ..Reply::default() }))
    }
}
