//! A window in enthalpy form: several materials, phases, tables of properties, an ambient.

use std::borrow::Cow;

use stagger_coupling::SolveError;
use stagger_messages::Energy;

use super::{
    Ended, Enthalpy, Gone, Held, Inputs, NODE, Settings, Solver, Start, State, Table,
    ambient::Exchange,
    balance::{Balance, Solved},
    figures,
    network::{Conductivities, GivenToWalls, Network},
    overshoot::{AtStart, Holds, Weights, weights},
    particles::Carried,
    presence::{Boiling, Presence},
    settings::mass_kg,
    trapezoidal::not_converged,
};
use crate::common::{
    checks::{finite, positive},
    enthalpy_curve::Curve,
};

/// The materials, prepared.
pub(super) struct Form {
    materials: Vec<Prepared>,
    /// K of the one material there is, where it is one number; in W/(m K).
    conductivity_w_m_k: Option<f64>,
    /// Shares of the mass that are molten and vapour at the start.
    pub(super) at_start: [f64; 2],
}

/// What the particles' enthalpies tell.
#[derive(Default)]
pub(super) struct Told {
    pub(super) enthalpies_j_kg: Vec<f64>,
    /// Liquid share of what is not vapour.
    pub(super) melted: Vec<f64>,
    pub(super) vapourised: Vec<u8>,
    /// Sensible heat of all, in J.
    pub(super) heat_j: f64,
    /// Latent heat of all, in J, above that of the shares at the start.
    pub(super) latent_j: f64,
}

impl Told {
    /// Adds a particle of mass m and specific enthalpy h, with `energy_j` = m h.
    fn add(&mut self, curve: &Curve, at_start: [f64; 2], mass_kg: f64, enthalpy_j_kg: f64, energy_j: f64) {
        let shares = curve.molten_and_vapour(enthalpy_j_kg);
        let latent_j = mass_kg * (curve.latent(shares) - curve.latent(at_start));
        self.latent_j += latent_j;
        self.heat_j += energy_j - latent_j;
        self.enthalpies_j_kg.push(enthalpy_j_kg);
        self.melted.push(shares[0]);
        self.vapourised.push(u8::from(shares[1] >= 1.0));
    }
}

/// Particles that hold m h(θ).
struct Enthalpies<'a> {
    masses_kg: &'a [f64],
    start_j_kg: &'a [f64],
    kinds: &'a [u32],
    curves: &'a [&'a Curve],
}

impl Enthalpies<'_> {
    fn curve(&self, i: usize) -> &Curve {
        self.curves[self.kinds[i] as usize]
    }
}

impl Holds for Enthalpies<'_> {
    fn least_capacity_j_k(&self, i: usize) -> f64 {
        self.masses_kg[i] * self.curve(i).least_j_kg_k()
    }

    fn heat_to_j(&self, i: usize, temperature_k: f64) -> f64 {
        self.masses_kg[i] * (self.curve(i).enthalpy(temperature_k) - self.start_j_kg[i])
    }
}

struct Prepared {
    density_kg_m3: f64,
    curve: Curve,
    conductivity: Table,
}

impl Form {
    /// Prepares the materials.
    ///
    /// # Errors
    /// A setting is outside its range.
    pub(super) fn new(settings: &Settings, enthalpy: &Enthalpy) -> Result<Self, SolveError> {
        if let Some(ambient) = &enthalpy.ambient {
            ambient.check()?;
        }
        let prepare = |material: &super::Material| {
            positive(NODE, "density", material.density_kg_m3)?;
            material.conductivity_w_m_k.check(NODE, "conductivity", |value| value >= 0.0, "at least 0 and finite")?;
            let curve =
                Curve::new(NODE, &material.heat_capacity_j_kg_k, material.phases.as_ref(), settings.temperature_k)?;
            let (density_kg_m3, conductivity) = (material.density_kg_m3, material.conductivity_w_m_k.clone());
            Ok(Prepared { density_kg_m3, curve, conductivity })
        };
        let materials: Vec<Prepared> = enthalpy.materials.iter().map(prepare).collect::<Result<_, SolveError>>()?;
        let at_start = materials.first().map_or([0.0; 2], |material| material.curve.molten_and_vapour(0.0));
        let other = materials.iter().position(|material| material.curve.molten_and_vapour(0.0) != at_start);
        match (materials.as_slice(), other) {
            ([], _) => Err(SolveError::Start(format!("{NODE}: particles are made of a material, but none is given"))),
            (_, Some(other)) => Err(SolveError::Start(format!(
                "{NODE}: at the start, {} K, `{}` and `{}` are in different phases; let particles start where all are \
                 solid",
                settings.temperature_k, enthalpy.materials[0].name, enthalpy.materials[other].name
            ))),
            ([only], None) if only.conductivity.is_constant() => {
                let conductivity_w_m_k = Some(only.conductivity.at(settings.temperature_k));
                Ok(Self { materials, conductivity_w_m_k, at_start })
            }
            _ => Ok(Self { materials, conductivity_w_m_k: None, at_start }),
        }
    }

    /// What particles hold that do not start alike.
    ///
    /// # Errors
    /// A particle's material is not one of those there are.
    pub(super) fn begin(&self, start: &Start) -> Result<Told, SolveError> {
        let mut told = Told::default();
        for (row, (&temperature_k, &radius_m)) in start.temperatures_k.iter().zip(&start.radii_m).enumerate() {
            let place = start.materials.get(row).map_or(0, |&place| usize::from(place));
            let Some(material) = self.materials.get(place) else {
                let there = self.materials.len();
                return Err(SolveError::Start(format!(
                    "{NODE}: particle {row} is of material {place}, but there are {there}, counted from 0"
                )));
            };
            let mass_kg = mass_kg(material.density_kg_m3, radius_m);
            let melted = start.melted.get(row).copied().unwrap_or(0.0);
            let enthalpy_j_kg = material.curve.enthalpy_of(temperature_k, melted);
            told.add(&material.curve, self.at_start, mass_kg, enthalpy_j_kg, mass_kg * enthalpy_j_kg);
        }
        Ok(told)
    }

    /// Conductivities at temperatures in K; not looked at where one number holds for all.
    fn conductivities_w_m_k(&self, kinds: &[u32], temperatures_k: &[f64]) -> Vec<f64> {
        if self.conductivity_w_m_k.is_some() {
            return Vec::new();
        }
        let of = |(kind, &temperature_k): (&u32, &f64)| self.materials[*kind as usize].conductivity.at(temperature_k);
        kinds.iter().zip(temperatures_k).map(of).collect()
    }

    /// Advances the particles over a window.
    pub(super) fn advance(
        &self,
        settings: &Settings,
        enthalpy: &Enthalpy,
        inputs: Inputs<'_>,
        state: &State,
    ) -> Result<Ended, SolveError> {
        let Inputs { before, then, now, frozen, power_w, dt_s } = inputs;
        let radii_m = now.radii.f64()?;
        let kinds = now.kinds(self.materials.len())?;
        let of = |kind: u32| &self.materials[kind as usize];
        let masses_kg: Vec<f64> =
            kinds.iter().zip(radii_m).map(|(&kind, &radius_m)| mass_kg(of(kind).density_kg_m3, radius_m)).collect();

        let kinds_then = then.kinds(self.materials.len())?;
        let from_temperatures = || -> Result<Vec<f64>, SolveError> {
            let temperatures_k = state.temperature.f64()?.iter();
            Ok(kinds_then.iter().zip(temperatures_k).map(|(&kind, &at_k)| of(kind).curve.enthalpy(at_k)).collect())
        };
        let held_j_kg = match &state.enthalpies_j_kg {
            Some(held) => held.to_vec(),
            None => from_temperatures()?,
        };
        let poured_k = settings.pour_temperature_k.unwrap_or(settings.temperature_k);
        let carried = then.carry(&held_j_kg, now, |row| of(kinds[row]).curve.enthalpy(poured_k))?;
        let poured_j = carried.came.iter().fold(0.0, |sum, &row| sum + masses_kg[row] * carried.values[row]);
        let (removed_j, vapour_j, gone) = self.left(&carried, &held_j_kg, &kinds_then, then.radii.f64()?, state.gone);
        let start_j_kg = carried.values;
        let start_k: Vec<f64> = kinds
            .iter()
            .zip(&start_j_kg)
            .map(|(&kind, &enthalpy_j_kg)| of(kind).curve.place(enthalpy_j_kg).temperature_k)
            .collect();

        let each = self.conductivities_w_m_k(&kinds, &start_k);
        let conductivities = self.conductivity_w_m_k.map_or(Conductivities::Each(&each), Conductivities::All);
        let rows = before.rows(now)?;
        let at_start = Network::new(settings, conductivities, &frozen.start, radii_m, rows.as_deref())?;
        let at_end = Network::new(settings, conductivities, &frozen.end, radii_m, None)?;
        let exchange = enthalpy.ambient.map(|ambient| ambient.exchange(radii_m));

        let curves: Vec<&Curve> = self.materials.iter().map(|material| &material.curve).collect();
        let tables: Vec<&Table> = self.materials.iter().map(|material| &material.conductivity).collect();
        let varies = tables.iter().any(|table| !table.is_constant());
        let mut flow_w = vec![0.0; start_k.len()];
        let flow_at_start = |network: &Network, exchange: Option<&Exchange>, flow_w: &mut [f64]| {
            let to_walls = network.heat_flow(&start_k, flow_w);
            (to_walls, exchange.map(|exchange| exchange.add(&start_k, flow_w)).unwrap_or_default())
        };
        let (mut walls_at_start, mut lost_at_start_w) = flow_at_start(&at_start, exchange.as_ref(), &mut flow_w);
        let start =
            AtStart { network: &at_start, exchange: exchange.as_ref(), temperatures_k: &start_k, flow_w: &flow_w };
        let held = Enthalpies { masses_kg: &masses_kg, start_j_kg: &start_j_kg, kinds: &kinds, curves: &curves };
        let Weights { start: before_weight, end: end_weight, is_raised, not_converged: overshot } =
            weights(settings, dt_s, &start, &held)?;

        let curve = |i: usize| curves[kinds[i] as usize];
        let tolerance = settings.tolerance;
        let boiling = Boiling { masses_kg: &masses_kg, start_j_kg: &start_j_kg, tolerance, curve: &curve };
        let mut presence = Presence::at_start(&boiling);
        let mut guess_k = start_k.clone();
        let (mut sweeps, mut linear) = (0, 0);
        let (balance, solved) = loop {
            let mut network = Cow::Borrowed(&at_end);
            let mut exchange = exchange.as_ref().map(Cow::Borrowed);
            if let Some(shares) = presence.shares() {
                network = Cow::Owned(at_end.lasting(shares));
                exchange = exchange.map(|exchange| Cow::Owned(exchange.lasting(shares)));
                let lasting = at_start.lasting(shares);
                (walls_at_start, lost_at_start_w) = flow_at_start(&lasting, exchange.as_deref(), &mut flow_w);
            }
            let known_j = (0..start_k.len()).map(|i| {
                let power_w = power_w.map_or(0.0, |power_w| presence.of(i) * power_w[i]);
                masses_kg[i] * start_j_kg[i] + dt_s * (before_weight * flow_w[i] + power_w)
            });
            let mut balance = Balance {
                masses_kg: &masses_kg,
                kinds: &kinds,
                curves: &curves,
                conductivities: varies.then_some(&tables),
                radii_m,
                known_j: known_j.collect(),
                weight_s: end_weight * dt_s,
                network,
                exchange,
            };
            let solved = balance.solve(enthalpy.solver, &guess_k, settings.tolerance, settings.iterations);
            (sweeps, linear) = (sweeps + solved.sweeps, linear + solved.linear);
            if !solved.converged || !presence.improve(&boiling, &solved.inserted.energies_j) {
                break (balance, solved);
            }
            guess_k.clone_from(&solved.inserted.temperatures_k);
        };
        let Solved { inserted, converged, .. } = solved;
        finite(NODE, "temperature", 1, &inserted.temperatures_k)?;

        let mean = |start: f64, end: f64| dt_s * (end_weight * end + before_weight * start);
        let GivenToWalls { held_j, surface_j } =
            inserted.to_walls.over(end_weight * dt_s, &walls_at_start, before_weight * dt_s);
        let mut exchanged = vec![Energy::lost("to_walls", held_j)];
        if balance.exchange.is_some() {
            let (start, end) = (lost_at_start_w, inserted.lost_w);
            exchanged.push(Energy::lost("convected", mean(start.convected, end.convected)));
            exchanged.push(Energy::lost("radiated", mean(start.radiated, end.radiated)));
        }
        if enthalpy.changes_phase() {
            exchanged.push(Energy::lost("vapour", vapour_j));
        }
        let mut missed_j = 0.0;
        let mut told = Told::default();
        for (i, &found_j) in inserted.energies_j.iter().enumerate() {
            let (curve, mass_kg) = (balance.curve(i), masses_kg[i]);
            let energy_j = presence.kept_j(&boiling, i, found_j);
            let power_w = power_w.map_or(0.0, |power_w| power_w[i]);
            missed_j += dt_s * (1.0 - presence.of(i)) * power_w + (found_j - energy_j);
            // Exactly that of vapour where it is vapour, whatever rounding m h/m makes.
            let vapour_j_kg = curve.vapour().filter(|vapour_j_kg| energy_j >= mass_kg * vapour_j_kg);
            told.add(curve, self.at_start, mass_kg, vapour_j_kg.unwrap_or(energy_j / mass_kg), energy_j);
        }
        let Told { enthalpies_j_kg, melted, vapourised, heat_j, latent_j } = told;
        let mut stored = vec![Energy::stored("heat", heat_j)];
        if enthalpy.changes_phase() {
            stored.push(Energy::stored("latent", latent_j));
        }
        let not_converged = overshot.or_else(|| (!converged).then(|| not_converged(settings, inserted.change)));
        let mut figures = figures(sweeps, balance.network.biot);
        if enthalpy.solver == Solver::ConjugateGradient {
            figures.insert("linear iterations".to_owned(), f64::from(linear));
        }
        Ok(Ended {
            start_k,
            temperatures_k: inserted.temperatures_k,
            held: Some(Held { enthalpies_j_kg, melted, vapourised, gone }),
            stored,
            exchanged,
            surface_j,
            poured_j,
            removed_j,
            missed_j,
            is_raised,
            figures,
            not_converged,
        })
    }

    /// Heat that left with particles, in J: of those that were not vapour, of those that were; and all vapour so far.
    fn left(
        &self,
        carried: &Carried,
        held_j_kg: &[f64],
        kinds: &[u32],
        radii_m: &[f64],
        mut gone: Gone,
    ) -> (f64, f64, Gone) {
        let (mut removed_j, mut vapour_j) = (0.0, 0.0);
        for &row in &carried.went {
            let material = &self.materials[kinds[row] as usize];
            let mass_kg = mass_kg(material.density_kg_m3, radii_m[row]);
            let [_, vapour] = material.curve.molten_and_vapour(held_j_kg[row]);
            if vapour >= 1.0 {
                vapour_j += mass_kg * held_j_kg[row];
                gone.count += 1;
                gone.mass_kg += mass_kg;
            } else {
                removed_j += mass_kg * held_j_kg[row];
            }
        }
        (removed_j, vapour_j, gone)
    }
}
