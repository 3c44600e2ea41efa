//! The trapezoidal rule for temperatures, solved by fixed-point sweeps (Zohdi 2018, eqs. 6.44 and 10.30).

use super::{
    Settings,
    network::{GivenToWalls, Network},
    overshoot::{AtStart, Holds, Weights, weights},
};
use stagger_coupling::{NotConverged, SolveError, math};

/// Temperatures at a window's end and what it took to get there.
pub(super) struct Advanced {
    pub(super) temperatures_k: Vec<f64>,
    /// Heat given to the walls during the window.
    pub(super) to_walls: GivenToWalls,
    pub(super) sweeps: u32,
    pub(super) not_converged: Option<NotConverged>,
    /// Whether the window's end had more weight than φ.
    pub(super) is_raised: bool,
}

/// Particles that hold m C θ.
struct Constant<'a> {
    capacities_j_k: &'a [f64],
    start_k: &'a [f64],
}

impl Holds for Constant<'_> {
    fn least_capacity_j_k(&self, i: usize) -> f64 {
        self.capacities_j_k[i]
    }

    fn heat_to_j(&self, i: usize, temperature_k: f64) -> f64 {
        self.capacities_j_k[i] * (temperature_k - self.start_k[i])
    }
}

/// One window of the trapezoidal rule with weight φ (Zohdi 2018, eqs. 6.44, 10.30):
///
/// θ(t+Δt) = θ(t) + Δt/(m C) \[ φ F(θ(t+Δt)) + (1 − φ) F(θ(t)) + H \]
///
/// F is the heat flow through the contacts at the end and at the start, H the mean power of the window.
/// φ = ½ is second order in Δt, every other weight first; φ ≥ ½ is stable for every Δt. Where a window would carry a particle
/// beyond all that surrounds it, [`weights`] raises φ, or asks for what the scene wants instead.
///
/// The monograph inserts the last iterate on the right, which contracts only while φ Δt ΣG/(m C) is small. Here each
/// sweep also takes the particle's own temperature at its new value (Jacobi), which contracts for every Δt. A window
/// has converged when the last iterate, inserted on the right, changes by at most `tolerance` relative to the largest
/// temperature; the result is then within twice that of the solution, as no row of I + φ Δt L/(m C) sums to less
/// than 1. The result is that insertion itself, so that no heat appears or vanishes whatever the tolerance.
pub(super) fn advance(
    settings: &Settings,
    capacities_j_k: &[f64],
    start_k: &[f64],
    [at_start, at_end]: [&Network; 2],
    power_w: Option<&[f64]>,
    dt_s: f64,
) -> Result<Advanced, SolveError> {
    let mut flow_w = vec![0.0; start_k.len()];
    let start_to_walls = at_start.heat_flow(start_k, &mut flow_w);
    let start = AtStart { network: at_start, exchange: None, temperatures_k: start_k, flow_w: &flow_w };
    let Weights { start: before, end: phi, is_raised, not_converged: overshot } =
        weights(settings, dt_s, &start, &Constant { capacities_j_k, start_k })?;
    let known_j: Vec<f64> =
        (0..start_k.len()).map(|i| dt_s * (before * flow_w[i] + power_w.map_or(0.0, |power_w| power_w[i]))).collect();

    let mut iterate_k = start_k.to_vec();
    let mut temperatures_k = vec![0.0; start_k.len()];
    let mut sweeps = 0;
    loop {
        sweeps += 1;
        let end_to_walls = at_end.heat_flow(&iterate_k, &mut flow_w);
        let (mut change_k, mut largest_k) = (0.0_f64, 0.0_f64);
        for i in 0..start_k.len() {
            temperatures_k[i] = start_k[i] + (known_j[i] + phi * dt_s * flow_w[i]) / capacities_j_k[i];
            let residual_k = temperatures_k[i] - iterate_k[i];
            change_k = change_k.max(residual_k.abs());
            largest_k = largest_k.max(temperatures_k[i].abs());
            iterate_k[i] += residual_k / (1.0 + phi * dt_s * at_end.at_particle_w_k[i] / capacities_j_k[i]);
        }
        let change = if largest_k > 0.0 { change_k / largest_k } else { 0.0 };
        // With φ = 0 nothing on the right is unknown.
        let converged = phi == 0.0 || change <= settings.tolerance;
        if converged || sweeps >= settings.iterations {
            let to_walls = end_to_walls.over(phi * dt_s, &start_to_walls, before * dt_s);
            let not_converged = overshot.or_else(|| (!converged).then(|| not_converged(settings, change)));
            return Ok(Advanced { temperatures_k, to_walls, sweeps, not_converged, is_raised });
        }
    }
}

/// What is answered where the sweeps allowed left a change above the tolerance.
pub(super) fn not_converged(settings: &Settings, change: f64) -> NotConverged {
    let reason = "thermal.iterations do not reach thermal.tolerance";
    NotConverged { reason, step_factor: step_factor(settings, change) }
}

/// Factor Λ on Δt that would have converged within the sweeps allowed (Zohdi 2018, eq. 6.50 with p = 1), in [0.1, 0.9].
///
/// At K = K_d the change of the first sweep cancels from the equation.
fn step_factor(settings: &Settings, change: f64) -> f64 {
    let factor = math::powf(settings.tolerance / change, 1.0 / f64::from(settings.iterations));
    if factor.is_finite() { factor.clamp(0.1, 0.9) } else { 0.5 }
}
