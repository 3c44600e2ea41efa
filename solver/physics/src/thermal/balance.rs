//! The implicit equations of a window in enthalpy form, and the sweeps that solve them.

use std::borrow::Cow;

use super::{
    Solver, Table,
    ambient::{Exchange, Lost},
    network::{Network, ToWalls},
    newton,
};
use crate::common::enthalpy_curve::Curve;

/// The heat balance of every particle over a window, by the trapezoidal rule with weight φ (Zohdi 2018, eqs. 6.44, 10.30):
///
/// E(t+Δt) = E(t) + Δt \[ φ F(z) + (1 − φ) F(θ(t)) + H \],   z = θ(E(t+Δt))
///
/// with the enthalpy E of a particle, the temperature θ(E) that follows from it, and the heat flow F. What is iterated is z;
/// E is always its insertion on the right, so that heat in equals heat out to rounding whatever the tolerance, and whatever
/// changes of phase the window crosses. Conductivities that depend on temperature are taken at z.
pub(super) struct Balance<'a> {
    /// m in kg.
    pub(super) masses_kg: &'a [f64],
    /// What each particle is made of.
    pub(super) kinds: &'a [u32],
    pub(super) curves: &'a [&'a Curve],
    /// Conductivities of the materials, where one depends on temperature.
    pub(super) conductivities: Option<&'a [&'a Table]>,
    pub(super) radii_m: &'a [f64],
    /// E(t) + Δt \[ (1 − φ) F(θ(t)) + H \] in J.
    pub(super) known_j: Vec<f64>,
    /// Weight of the window's end times Δt, in s.
    pub(super) weight_s: f64,
    /// The contacts at the window's end.
    pub(super) network: Cow<'a, Network>,
    pub(super) exchange: Option<Cow<'a, Exchange>>,
}

/// Roundings that an insertion makes of the heat that passes a particle.
const ROUNDINGS: f64 = 8.0;

/// What z inserted on the right gives.
#[derive(Default)]
pub(super) struct Inserted {
    /// E in J.
    pub(super) energies_j: Vec<f64>,
    /// θ(E) in K.
    pub(super) temperatures_k: Vec<f64>,
    /// dθ/dE in K/J.
    pub(super) slopes_k_j: Vec<f64>,
    /// Largest |z − θ(E)| over the largest |θ|.
    pub(super) change: f64,
    /// The part of it that rounding makes: a step of s explicit limits passes s times what a particle holds.
    rounding: f64,
    /// Largest |θ| in K.
    pub(super) largest_k: f64,
    /// Heat flow to the walls.
    pub(super) to_walls: ToWalls,
    /// Heat flow to the ambient in W.
    pub(super) lost_w: Lost,
}

/// How a window ended.
pub(super) struct Solved {
    pub(super) inserted: Inserted,
    pub(super) sweeps: u32,
    /// Iterations of conjugate gradients.
    pub(super) linear: u32,
    pub(super) converged: bool,
}

impl Balance<'_> {
    /// Solves from `start_k` until insertion changes no temperature by more than `tolerance` of the largest, or than rounding.
    pub(super) fn solve(&mut self, solver: Solver, start_k: &[f64], tolerance: f64, iterations: u32) -> Solved {
        let mut trial_k = start_k.to_vec();
        let mut inserted = Inserted::default();
        let mut flow_w = vec![0.0; start_k.len()];
        let (mut sweeps, mut linear) = (0, 0);
        loop {
            sweeps += 1;
            self.insert(&trial_k, &mut flow_w, &mut inserted);
            let reachable = tolerance.max(inserted.rounding);
            // With φ = 0 nothing on the right is unknown.
            let converged = self.weight_s == 0.0 || inserted.change <= reachable;
            if converged || sweeps >= iterations {
                return Solved { inserted, sweeps, linear, converged };
            }
            match solver {
                Solver::FixedPoint => self.sweep(&inserted, &mut trial_k),
                Solver::ConjugateGradient => linear += newton::improve(self, &inserted, reachable, &mut trial_k),
            }
        }
    }

    /// The curve of particle `i`.
    pub(super) fn curve(&self, i: usize) -> &Curve {
        self.curves[self.kinds[i] as usize]
    }

    fn insert(&mut self, trial_k: &[f64], flow_w: &mut [f64], inserted: &mut Inserted) {
        if let Some(tables) = self.conductivities {
            let of = |(kind, &temperature_k): (&u32, &f64)| tables[*kind as usize].at(temperature_k);
            let each: Vec<f64> = self.kinds.iter().zip(trial_k).map(of).collect();
            self.network.to_mut().conduct_with(&each, self.radii_m);
        }
        inserted.to_walls = self.network.heat_flow(trial_k, flow_w);
        inserted.lost_w = self.exchange.as_ref().map_or_else(Lost::default, |exchange| exchange.add(trial_k, flow_w));
        inserted.energies_j.clear();
        inserted.temperatures_k.clear();
        inserted.slopes_k_j.clear();
        let (mut change_k, mut largest_k, mut stiffness) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (i, &trial_k) in trial_k.iter().enumerate() {
            let energy_j = self.known_j[i] + self.weight_s * flow_w[i];
            let place = self.curve(i).place(energy_j / self.masses_kg[i]);
            change_k = change_k.max((trial_k - place.temperature_k).abs());
            largest_k = largest_k.max(place.temperature_k.abs());
            let slope_k_j = place.slope / self.masses_kg[i];
            stiffness = stiffness.max(self.outflow_j_k(i, trial_k) * slope_k_j);
            inserted.energies_j.push(energy_j);
            inserted.temperatures_k.push(place.temperature_k);
            inserted.slopes_k_j.push(slope_k_j);
        }
        inserted.largest_k = largest_k;
        inserted.rounding = ROUNDINGS * f64::EPSILON * stiffness;
        inserted.change = if largest_k > 0.0 { change_k / largest_k } else { 0.0 };
    }

    /// What particle `i` loses more over the window for each kelvin it is hotter at its end, in J/K.
    pub(super) fn outflow_j_k(&self, i: usize, temperature_k: f64) -> f64 {
        let ambient_w_k = self.exchange.as_ref().map_or(0.0, |exchange| exchange.slope(i, temperature_k));
        self.weight_s * (self.network.at_particle_w_k[i] + ambient_w_k)
    }

    /// One Jacobi sweep: every particle takes the temperature that balances its own heat with those of the others as they
    /// are. As enthalpy rises with temperature, it contracts for every Δt.
    fn sweep(&self, inserted: &Inserted, trial_k: &mut [f64]) {
        for (i, trial_k) in trial_k.iter_mut().enumerate() {
            let (outflow_j_k, mass_kg) = (self.outflow_j_k(i, *trial_k), self.masses_kg[i]);
            let total_j = inserted.energies_j[i] + outflow_j_k * *trial_k;
            *trial_k = self.curve(i).balance(total_j / mass_kg, outflow_j_k / mass_kg).temperature_k;
        }
    }
}
