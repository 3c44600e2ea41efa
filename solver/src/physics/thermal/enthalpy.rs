//! A window in enthalpy form: several materials, phases, tables of properties, an ambient.

use stagger_messages::Energy;

use super::{
    Ended, Enthalpy, Gone, Held, Inputs, NODE, Settings, Solver, State, Table,
    balance::{Balance, Solved},
    curve::Curve,
    figures,
    network::{Conductivities, Network},
    particles::Carried,
    settings::mass_kg,
    trapezoidal::not_converged,
};
use crate::{
    SolveError,
    physics::checks::{finite, positive},
};

/// The materials, prepared.
pub(super) struct Form {
    materials: Vec<Prepared>,
    /// K of the one material there is, where it is one number; in W/(m K).
    conductivity_w_m_k: Option<f64>,
    /// Shares of the mass that are molten and vapour at the start.
    pub(super) at_start: [f64; 2],
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
            material.conductivity_w_m_k.check("conductivity", |value| value >= 0.0, "at least 0 and finite")?;
            let curve = Curve::new(&material.heat_capacity_j_kg_k, material.phases.as_ref(), settings.temperature_k)?;
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

        let mut flow_w = vec![0.0; start_k.len()];
        let walls_at_start_w = at_start.heat_flow(&start_k, &mut flow_w);
        let lost_at_start_w = exchange.as_ref().map(|exchange| exchange.add(&start_k, &mut flow_w)).unwrap_or_default();
        let phi = settings.phi;
        let known_j = (0..start_k.len()).map(|i| {
            let power_w = power_w.map_or(0.0, |power_w| power_w[i]);
            masses_kg[i] * start_j_kg[i] + dt_s * ((1.0 - phi) * flow_w[i] + power_w)
        });
        let curves: Vec<&Curve> = self.materials.iter().map(|material| &material.curve).collect();
        let tables: Vec<&Table> = self.materials.iter().map(|material| &material.conductivity).collect();
        let varies = tables.iter().any(|table| !table.is_constant());
        let mut balance = Balance {
            masses_kg: &masses_kg,
            kinds: &kinds,
            curves: &curves,
            conductivities: varies.then_some(&tables),
            radii_m,
            known_j: known_j.collect(),
            weight_s: phi * dt_s,
            network: at_end,
            exchange: exchange.as_ref(),
        };
        let Solved { inserted, sweeps, linear, converged } =
            balance.solve(enthalpy.solver, &start_k, settings.tolerance, settings.iterations);
        finite(NODE, "temperature", 1, &inserted.temperatures_k)?;

        let mean = |start: f64, end: f64| dt_s * (phi * end + (1.0 - phi) * start);
        let mut exchanged = vec![Energy::lost("to_walls", mean(walls_at_start_w, inserted.to_walls_w))];
        if exchange.is_some() {
            let (start, end) = (lost_at_start_w, inserted.lost_w);
            exchanged.push(Energy::lost("convected", mean(start.convected, end.convected)));
            exchanged.push(Energy::lost("radiated", mean(start.radiated, end.radiated)));
        }
        if enthalpy.changes_phase() {
            exchanged.push(Energy::lost("vapour", vapour_j));
        }
        let enthalpies_j_kg: Vec<f64> =
            inserted.energies_j.iter().zip(&masses_kg).map(|(energy_j, mass_kg)| energy_j / mass_kg).collect();
        let (mut melted, mut vapourised) = (Vec::new(), Vec::new());
        let (mut heat_j, mut latent_j) = (0.0, 0.0);
        for (i, &enthalpy_j_kg) in enthalpies_j_kg.iter().enumerate() {
            let curve = balance.curve(i);
            let [molten, vapour] = curve.molten_and_vapour(enthalpy_j_kg);
            let latent = masses_kg[i] * (curve.latent([molten, vapour]) - curve.latent(self.at_start));
            latent_j += latent;
            heat_j += inserted.energies_j[i] - latent;
            melted.push(molten * (1.0 - vapour));
            vapourised.push(u8::from(vapour >= 1.0));
        }
        let mut stored = vec![Energy::stored("heat", heat_j)];
        if enthalpy.changes_phase() {
            stored.push(Energy::stored("latent", latent_j));
        }
        let not_converged = (!converged).then(|| not_converged(settings, inserted.change));
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
            poured_j,
            removed_j,
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
