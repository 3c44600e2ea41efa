//! Temperature of a solid on a grid: the plate under the powder. Conduction, phases, faces, light, second sound.

mod balance;
mod explicit;
mod faces;
pub mod keys;
mod light;
mod matter;
mod relaxation;
mod settings;
mod track;
mod tradeoff;

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};
pub use settings::*;
use stagger_coupling::{Frozen, NotConverged, Physics, Reply, SolveError, Window};
use stagger_messages::{Energy, Field, Fields, Port};

use self::{
    balance::Balance,
    explicit::Explicit,
    faces::{Faces, Lost},
    light::{Layers, Lit},
    matter::Matter,
    relaxation::{Relaxation, add_fluxes},
    track::{Cooling, Sections},
};
use crate::common::{
    checks::{energy_j, finite, values},
    grid::conduction::Conduction,
};

const NODE: &str = "solid";

/// Temperature of a solid (Zohdi 2018, eq. 5.93 with the flux form of eqs. 5.19–5.28):
///
/// ρ C θ̇ = ∇·(K ∇θ) + H
///
/// on the cells of a grid, by finite volumes: second order in their width, and what leaves one cell enters its neighbour to the
/// last bit. The state is each cell's enthalpy, from which temperature and phase follow, so that melting and boiling are exact
/// for every step. [`Level::Implicit`] takes a window in one step, [`Level::Explicit`] in substeps below the explicit limit.
///
/// It reads, where somebody writes them, `surface_light` and `surface_heat` (W on the cells of the upper face across z) and
/// `solid_heat_source` (W in each cell), all as means over the window. A cell that boils stays, at its boiling point; what
/// holds a lit surface there in truth is evaporation, for which there is [`Evaporation`].
///
/// The ledger: `heat` and `latent` count from the start. Their change over a window is `surface_light` + `surface_heat` +
/// `solid_heat_source` + `entered` − `reflected` − `through` − `conducted` − `convected` − `radiated` − `evaporated` to rounding.
pub struct Solid {
    settings: Settings,
    matter: Matter,
    faces: Faces,
    layers: Layers,
    written: BTreeMap<String, Arc<Port>>,
}

/// What the cells hold; cloning shares it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State {
    /// Specific enthalpies above the start, in J/kg.
    enthalpies_j_kg: Arc<Vec<f64>>,
    temperatures_k: Arc<Vec<f64>>,
    /// Hottest that each cell has been, where a material melts.
    peaks_k: Arc<Vec<f64>>,
    cooling: Option<Arc<Cooling>>,
    /// Heat through the faces between cells, upwards along each axis, in W; with second sound only.
    fluxes_w: Option<Arc<[Vec<f64>; 3]>>,
    peak_k: f64,
}

/// Heat that enters from outside over a window.
#[derive(Default)]
struct Sources {
    /// Of each cell, in W; `None` where there is none at all.
    power_w: Option<Vec<f64>>,
    ledger: Vec<Energy>,
}

/// What a window ended with.
struct Ended {
    energies_j: Vec<f64>,
    temperatures_k: Vec<f64>,
    lost_j: Lost,
    fluxes_w: Option<[Vec<f64>; 3]>,
    figures: BTreeMap<String, f64>,
    not_converged: Option<NotConverged>,
}

impl Solid {
    /// Checks the settings and prepares the cells.
    ///
    /// # Errors
    /// A setting is outside its range.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        settings.check_all()?;
        let ports = crate::Settings::ports(&settings);
        let written = ports.writes.into_iter().map(|port| (port.field.clone(), Arc::new(port))).collect();
        let (matter, faces) = (Matter::new(&settings)?, Faces::new(&settings));
        let layers = Layers::new(&settings.grid, settings.light);
        Ok(Self { settings, matter, faces, layers, written })
    }

    /// The state in which the cells have the temperatures given, in K: where they do not start alike.
    ///
    /// # Errors
    /// Not one finite temperature for each cell.
    pub fn state(&self, temperatures_k: Vec<f64>) -> Result<State, SolveError> {
        let (found, cells) = (temperatures_k.len(), self.settings.grid.len());
        if found != cells {
            return Err(SolveError::Mismatch(format!("{NODE}: {found} temperatures are given for {cells} cells")));
        }
        finite(NODE, "temperature", 1, &temperatures_k)?;
        let enthalpies_j_kg = temperatures_k.iter().enumerate().map(|(row, &at_k)| self.matter.enthalpy(row, at_k));
        let enthalpies_j_kg: Vec<f64> = enthalpies_j_kg.collect();
        let peak_k = temperatures_k.iter().fold(0.0f64, |most, at_k| most.max(*at_k));
        let melts = self.settings.melts();
        let surface = self.settings.grid.layer(2, true).len();
        let cooling = self.settings.track.cooling_k.filter(|_| melts).map(|_| Arc::new(Cooling::new(surface)));
        let still = || [(); 3].map(|()| vec![0.0; cells]);
        Ok(State {
            enthalpies_j_kg: Arc::new(enthalpies_j_kg),
            peaks_k: Arc::new(if melts { temperatures_k.clone() } else { Vec::new() }),
            temperatures_k: Arc::new(temperatures_k),
            cooling,
            fluxes_w: (self.settings.relaxation_s > 0.0).then(|| Arc::new(still())),
            peak_k,
        })
    }

    /// Rows of the cells at the upper face across z.
    fn surface(&self) -> std::ops::Range<usize> {
        let (cells, surface) = (self.settings.grid.len(), self.settings.grid.layer(2, true).len());
        cells - surface..cells
    }

    fn sources(&self, frozen: &Frozen, dt_s: f64) -> Result<Sources, SolveError> {
        let mut sources = Sources::default();
        let surface = self.surface();
        let power = |name: &str, rows: usize| match frozen.end.contains_key(name) {
            true => values(NODE, &frozen.end, name, rows, "the grid").map(Some),
            false => Ok(None),
        };
        let cells = self.settings.grid.len();
        let mut gain = |name: &str, power_w: &[f64]| sources.ledger.push(Energy::gained(name, energy_j(power_w, dt_s)));
        let [light, heat, source] = [
            power("surface_light", surface.len())?,
            power("surface_heat", surface.len())?,
            power("solid_heat_source", cells)?,
        ];
        for (name, power_w) in [("surface_light", light), ("surface_heat", heat), ("solid_heat_source", source)] {
            if let Some(power_w) = power_w {
                gain(name, power_w);
            }
        }
        let is_some = [light, heat, source].iter().flatten().any(|power_w| power_w.iter().any(|power| *power != 0.0));
        if !is_some {
            return Ok(sources);
        }
        let mut power_w = source.map_or_else(|| vec![0.0; cells], <[f64]>::to_vec);
        if let Some(heat) = heat {
            power_w[surface].iter_mut().zip(heat).for_each(|(power_w, heat)| *power_w += heat);
        }
        if let Some(light) = light {
            let Lit { reflected_w, through_w } = self.layers.add(light, &mut power_w);
            sources.ledger.push(Energy::lost("reflected", reflected_w * dt_s));
            if self.settings.light.absorption_1_m.is_some() {
                sources.ledger.push(Energy::lost("through", through_w * dt_s));
            }
        }
        sources.power_w = Some(power_w);
        Ok(sources)
    }

    fn explicit(&self, share: f64, state: &State, power_w: Option<&[f64]>, dt_s: f64) -> Result<Ended, SolveError> {
        let explicit = Explicit {
            grid: &self.settings.grid,
            matter: &self.matter,
            faces: &self.faces,
            face_mean: self.settings.face_mean,
            share,
            power_w,
        };
        let energies_j = self.energies_j(&state.enthalpies_j_kg);
        let stepped = explicit.advance(energies_j, state.temperatures_k.to_vec(), dt_s);
        let Some(stepped) = stepped else {
            let reason = "an explicit [solid] takes more than 20 000 substeps";
            return Ok(Ended {
                energies_j: self.energies_j(&state.enthalpies_j_kg),
                temperatures_k: state.temperatures_k.to_vec(),
                lost_j: Lost::default(),
                fluxes_w: None,
                figures: BTreeMap::new(),
                not_converged: Some(NotConverged { reason, step_factor: 0.5 }),
            });
        };
        Ok(Ended {
            energies_j: stepped.energies_j,
            temperatures_k: stepped.temperatures_k,
            lost_j: stepped.lost_j,
            fluxes_w: None,
            figures: BTreeMap::from([("substeps".to_owned(), stepped.substeps as f64)]),
            not_converged: None,
        })
    }

    fn implicit(&self, phi: f64, state: &State, power_w: Option<&[f64]>, dt_s: f64) -> Result<Ended, SolveError> {
        let settings = &self.settings;
        let relaxation = Relaxation::new(settings.relaxation_s, dt_s);
        let start_k = &*state.temperatures_k;
        let mut known_j = self.energies_j(&state.enthalpies_j_kg);
        let mut flow_w = vec![0.0; known_j.len()];
        let mut lost_at_start_w = Lost::default();
        if phi < 1.0 {
            let mut each = Vec::new();
            let conductivities = self.matter.conductivities(start_k, &mut each);
            let conduction = Conduction::new(&settings.grid, conductivities, settings.face_mean);
            conduction.scaled(relaxation.instant).flow_into(start_k, &mut flow_w);
            lost_at_start_w = self.faces.add_flow(conductivities, start_k, &mut flow_w);
        }
        for (row, known_j) in known_j.iter_mut().enumerate() {
            *known_j += dt_s * ((1.0 - phi) * flow_w[row] + power_w.map_or(0.0, |power_w| power_w[row]));
        }
        if let Some(fluxes_w) = &state.fluxes_w {
            add_fluxes(self.strides(), dt_s * (1.0 - relaxation.instant), fluxes_w, &mut known_j);
        }
        let balance = Balance {
            grid: &settings.grid,
            matter: &self.matter,
            faces: &self.faces,
            face_mean: settings.face_mean,
            instant: relaxation.instant,
            known_j,
            weight_s: phi * dt_s,
        };
        let solved = balance.solve(start_k.clone(), settings.tolerance, settings.iterations);
        let fluxes_w = state.fluxes_w.as_ref().map(|fluxes_w| {
            let mut fluxes_w = (**fluxes_w).clone();
            let mean = |(end, start): (&f64, &f64)| phi * end + (1.0 - phi) * start;
            let between_k: Vec<f64> = solved.trial_k.iter().zip(start_k).map(mean).collect();
            let conduction = solved.conduction.scaled(relaxation.instant.recip());
            relaxation.advance(&conduction, &between_k, &mut fluxes_w);
            fluxes_w
        });
        let not_converged = (!solved.converged).then(|| {
            let reason = "solid.iterations do not reach solid.tolerance";
            NotConverged { reason, step_factor: 0.5 }
        });
        let figures = BTreeMap::from([
            ("newton iterations".to_owned(), f64::from(solved.newton)),
            ("linear iterations".to_owned(), f64::from(solved.linear)),
        ]);
        Ok(Ended {
            energies_j: solved.energies_j,
            temperatures_k: solved.temperatures_k,
            lost_j: solved.lost_w.mean(phi * dt_s, lost_at_start_w, (1.0 - phi) * dt_s),
            fluxes_w,
            figures,
            not_converged,
        })
    }

    fn energies_j(&self, enthalpies_j_kg: &[f64]) -> Vec<f64> {
        enthalpies_j_kg.iter().zip(&self.matter.masses_kg).map(|(enthalpy, mass)| enthalpy * mass).collect()
    }

    fn strides(&self) -> [usize; 3] {
        let [nx, ny, _] = self.settings.grid.counts();
        [1, nx, nx * ny]
    }

    /// What is held in a state.
    fn stored(&self, state: &State) -> Vec<Energy> {
        let held_j = self.energies_j(&state.enthalpies_j_kg);
        let total_j: f64 = held_j.iter().sum();
        if !self.settings.melts() {
            return vec![Energy::stored("heat", total_j)];
        }
        let mut latent_j = 0.0;
        for (row, &enthalpy_j_kg) in state.enthalpies_j_kg.iter().enumerate() {
            let at_start = self.matter.molten_and_vapour(row, 0.0);
            let shares = self.matter.molten_and_vapour(row, enthalpy_j_kg);
            if shares != at_start {
                latent_j += self.matter.latent_j(row, shares) - self.matter.latent_j(row, at_start);
            }
        }
        vec![Energy::stored("heat", total_j - latent_j), Energy::stored("latent", latent_j)]
    }

    fn fields(&self, state: &State) -> Result<Fields, SolveError> {
        let settings = &self.settings;
        let mut fields = Fields::new();
        let mut write = |name: &str, values: Vec<f64>| -> Result<(), SolveError> {
            if let Some(port) = self.written.get(name) {
                fields.insert(name.to_owned(), Field::new(port, 0, values)?);
            }
            Ok(())
        };
        write("solid_temperature", state.temperatures_k.to_vec())?;
        write("surface_temperature", state.temperatures_k[self.surface()].to_vec())?;
        write("solid_peak", vec![state.peak_k])?;
        if settings.melts() {
            let melted = state.enthalpies_j_kg.iter().enumerate();
            let melted = melted.map(|(row, &enthalpy)| self.matter.molten_and_vapour(row, enthalpy)[0]).collect();
            write("solid_melted", melted)?;
            write("solid_peak_temperature", state.peaks_k.to_vec())?;
            let sections = Sections::new(&settings.grid, settings.track);
            let pool = sections.extent(&state.temperatures_k);
            let [width_m, depth_m] = sections.mean(&state.peaks_k);
            for (name, value_m) in [
                ("pool_length", pool.length_m),
                ("pool_width", pool.width_m),
                ("pool_depth", pool.depth_m),
                ("track_width", width_m),
                ("track_depth", depth_m),
            ] {
                write(name, vec![value_m])?;
            }
            if let Some(cooling) = &state.cooling {
                write("surface_cooling_rate", cooling.rates_k_s.clone())?;
            }
        }
        Ok(fields)
    }
}

impl Physics for Solid {
    type State = State;

    fn ports(&self) -> stagger_messages::Ports {
        crate::Settings::ports(&self.settings)
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let state = self.state(vec![self.settings.temperature_k; self.settings.grid.len()])?;
        let reply = Reply { fields: self.fields(&state)?, ledger: self.stored(&state), ..Reply::default() };
        Ok((state, reply))
    }

    fn solve(&self, state: &State, frozen: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        let Sources { power_w, mut ledger } = self.sources(frozen, window.dt_s)?;
        let ended = match self.settings.level {
            Level::Implicit { phi } if phi > 0.0 => self.implicit(phi, state, power_w.as_deref(), window.dt_s)?,
            Level::Implicit { .. } => self.explicit(1.0, state, power_w.as_deref(), window.dt_s)?,
            Level::Explicit { share } => self.explicit(share, state, power_w.as_deref(), window.dt_s)?,
        };
        let Ended { energies_j, temperatures_k, lost_j, fluxes_w, figures, not_converged } = ended;
        finite(NODE, "solid_temperature", 1, &temperatures_k)?;
        let enthalpies_j_kg = energies_j.iter().zip(&self.matter.masses_kg).map(|(energy, mass)| energy / mass);
        let peaks_k = state.peaks_k.iter().zip(&temperatures_k).map(|(peak, at_k)| peak.max(*at_k));
        let cooling = state.cooling.as_ref().zip(self.settings.track.cooling_k).map(|(cooling, between_k)| {
            let mut cooling = (**cooling).clone();
            let surface = self.surface();
            cooling.follow(between_k, &state.temperatures_k[surface.clone()], &temperatures_k[surface], window);
            Arc::new(cooling)
        });
        let next = State {
            enthalpies_j_kg: Arc::new(enthalpies_j_kg.collect()),
            peaks_k: Arc::new(peaks_k.collect()),
            cooling,
            fluxes_w: fluxes_w.map(Arc::new),
            peak_k: temperatures_k.iter().fold(state.peak_k, |most, at_k| most.max(*at_k)),
            temperatures_k: Arc::new(temperatures_k),
        };
        ledger.extend(self.stored(&next));
        let Lost { conducted, convected, radiated, evaporated, entered } = lost_j;
        for (name, joule) in
            [("conducted", conducted), ("convected", convected), ("radiated", radiated), ("evaporated", evaporated)]
        {
            ledger.push(Energy::lost(name, joule));
        }
        ledger.push(Energy::gained("entered", entered));
        let reply = Reply { fields: self.fields(&next)?, ledger, figures, not_converged, ..Reply::default() };
        Ok((next, reply))
    }
}
