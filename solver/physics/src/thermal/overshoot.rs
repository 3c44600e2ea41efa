//! The weight of a window's start that lets nothing leave what surrounds it.

use super::{NODE, Overshoot, Settings, ambient::Exchange, network::Network};
use stagger_coupling::{NotConverged, SolveError};
use stagger_messages::Shown;

/// Share of the step that would just do which a smaller step is asked for, so that it does.
const MARGIN: f64 = 0.99;

/// Heat flow at a window's start.
pub(super) struct AtStart<'a> {
    pub(super) network: &'a Network,
    pub(super) exchange: Option<&'a Exchange>,
    pub(super) temperatures_k: &'a [f64],
    /// Into each particle, in W.
    pub(super) flow_w: &'a [f64],
}

/// What a particle can hold.
pub(super) trait Holds {
    /// Least m C of particle `i` at any temperature, in J/K.
    fn least_capacity_j_k(&self, i: usize) -> f64;

    /// Heat that takes particle `i` from the window's start to this temperature, in J; negative where it cools.
    fn heat_to_j(&self, i: usize, temperature_k: f64) -> f64;
}

/// Weights of a window's two ends; they add up to 1.
pub(super) struct Weights {
    pub(super) start: f64,
    pub(super) end: f64,
    /// Whether `end` is more than φ.
    pub(super) is_raised: bool,
    /// Where the scene wants a smaller step instead.
    pub(super) not_converged: Option<NotConverged>,
}

/// Weights for a window of `dt_s`: φ at the end and 1 − φ at the start, unless the start's share would carry a particle beyond
/// all that it exchanges heat with.
///
/// The flow at the start moves a particle by Δt (1 − φ) G (θ' − θ), with the sum G of its conductances and a mean θ' of what
/// surrounds it. This stays between θ and θ' for certain while
///
/// Δt ≤ m C/(G (1 − φ))
///
/// the bound under which the trapezoidal rule is monotone; φ = 1 has none (Hundsdorfer & Verwer 2003, *Numerical Solution of
/// Time-Dependent Advection-Diffusion-Reaction Equations*, §I.7.3). Beyond it the particle is measured by what surrounds it: it
/// may take as much heat as brings it to the hottest of its partners, or lose as much as brings it to the coldest. The part of
/// the window's end moves nothing beyond what there is then, whatever Δt. So neither does the whole window, heat from outside
/// excepted.
///
/// The weight is one for all particles, so that what one partner of a contact gains the other loses. It depends on the state at
/// the window's start alone, and so is the same in each iteration of the coupling.
///
/// # Errors
/// The scene wants such a window refused.
pub(super) fn weights(
    settings: &Settings,
    dt_s: f64,
    start: &AtStart<'_>,
    holds: &impl Holds,
) -> Result<Weights, SolveError> {
    let phi = settings.phi;
    let wanted = 1.0 - phi;
    let as_asked = Weights { start: wanted, end: phi, is_raised: false, not_converged: None };
    let monotone = |i: usize| {
        let ambient_w_k = start.exchange.map_or(0.0, |exchange| exchange.secant(i, start.temperatures_k[i]));
        let conductance_w_k = start.network.at_particle_w_k[i] + ambient_w_k;
        let taken_j_k = dt_s * conductance_w_k;
        if taken_j_k > 0.0 { holds.least_capacity_j_k(i) / taken_j_k } else { f64::INFINITY }
    };
    if (0..start.temperatures_k.len()).all(|i| monotone(i) >= wanted) {
        return Ok(as_asked);
    }
    let [coldest_k, hottest_k] = surroundings_k(start);
    let (mut allowed, mut worst) = (wanted, 0);
    for i in 0..start.temperatures_k.len() {
        let bound = monotone(i);
        if bound >= wanted {
            continue;
        }
        let moved_j = dt_s * start.flow_w[i];
        let until_k = if moved_j > 0.0 { hottest_k[i] } else { coldest_k[i] };
        let room = holds.heat_to_j(i, until_k) / moved_j;
        // Where little is left on either side, the ratio is one of roundings; the bound holds whatever they are.
        let weight = if room.is_finite() { room.max(bound) } else { bound };
        // Nothing flows: nothing moves.
        if moved_j != 0.0 && weight < allowed {
            (allowed, worst) = (weight, i);
        }
    }
    if allowed >= wanted {
        return Ok(as_asked);
    }
    let longest_s = dt_s * allowed / wanted;
    let mut weights = Weights { start: allowed, end: 1.0 - allowed, is_raised: true, not_converged: None };
    match settings.overshoot {
        Overshoot::Implicit => {}
        Overshoot::SmallerStep => {
            let reason =
                "a particle would leave the temperatures around it, and thermal.overshoot asks for a smaller step";
            weights.not_converged = Some(NotConverged { reason, step_factor: MARGIN * (longest_s / dt_s) });
        }
        Overshoot::Refuse => {
            let [own_k, coldest_k, hottest_k] =
                [start.temperatures_k[worst], coldest_k[worst], hottest_k[worst]].map(Shown);
            return Err(SolveError::Unsolved(format!(
                "{NODE}: in a step of {:e} s with phi = {phi} the particle in row {worst}, at {own_k} K, would leave the \
                 temperatures around it, {coldest_k} to {hottest_k} K: expected a step of at most {:e} s, a larger thermal.phi, \
                 or thermal.overshoot = \"implicit\" or \"smaller-step\"",
                Shown(dt_s),
                Shown(longest_s)
            )));
        }
    }
    Ok(weights)
}

/// The coldest and the hottest that each particle exchanges heat with, itself included, in K.
fn surroundings_k(start: &AtStart<'_>) -> [Vec<f64>; 2] {
    let own_k = start.temperatures_k;
    let [mut coldest_k, mut hottest_k] = [own_k.to_vec(), own_k.to_vec()];
    let mut meet = |i: usize, other_k: f64| {
        coldest_k[i] = coldest_k[i].min(other_k);
        hottest_k[i] = hottest_k[i].max(other_k);
    };
    for (i, j, _) in start.network.between_particles() {
        let (i, j) = (i as usize, j as usize);
        meet(i, own_k[j]);
        meet(j, own_k[i]);
    }
    for (i, wall_k) in start.network.with_walls() {
        meet(i, wall_k);
    }
    if let Some(exchange) = start.exchange {
        (0..own_k.len()).for_each(|i| meet(i, exchange.temperature_k()));
    }
    [coldest_k, hottest_k]
}
