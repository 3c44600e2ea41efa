//! Velocity Verlet with equal substeps (Verlet 1967; Swope et al. 1982).

use std::sync::Arc;

use super::{
    Particles,
    forces::{At, Evaluator, Heat},
    state::{Advanced, Dissipation, State, Trial, within},
};
use crate::{
    SolveError,
    coupling::{NotConverged, Window},
};

/// More substeps than this in one window are refused: the window is too long, not the machine too slow.
const SUBSTEPS_LIMIT: f64 = 1e6;

/// Integrates `window` with substeps of at most `bound_s`.
///
/// The half kick v(t+Δt/2) = v + Δt/2 Ψ(t)/m and the drift are the usual ones. Forces that depend on velocity see the
/// predicted v + Δt Ψ(t)/m (Groot & Warren 1997 with λ = 1), whose error is second order in Δt, as is then the scheme;
/// forces at the half-step velocity would make it first order.
pub(super) fn advance(
    particles: &Particles,
    state: &State,
    heat: Option<Heat<'_>>,
    window: Window,
    bound_s: f64,
) -> Result<Trial, SolveError> {
    // The margin keeps a window of exactly ten substeps from taking eleven.
    let count = (window.dt_s / bound_s - 1e-9).ceil().max(1.0);
    if count > SUBSTEPS_LIMIT {
        let step_factor = (SUBSTEPS_LIMIT / count).clamp(0.1, 0.9);
        return Ok(Trial::NotConverged(NotConverged { step_factor }));
    }
    let substep_s = window.dt_s / count;
    let half_over =
        |inertia: &Vec<f64>| -> Vec<f64> { inertia.iter().map(|inertia| 0.5 * substep_s / inertia).collect() };
    let kick_per_force = half_over(&particles.masses);
    let spin_per_moment = half_over(&particles.inertias);

    let mut motion = state.motion.clone();
    let mut velocities = motion.velocities.clone();
    let mut spins = motion.spins.clone();
    let mut evaluator = Evaluator::new(particles, heat, state.moduli.clone(), Arc::clone(&state.neighbours));
    let mut forces = particles.start_forces(state, &mut evaluator, substep_s);
    let mut dissipated = Dissipation::default();
    for substep in 1..=count as u32 {
        let mut jump = None;
        for i in 0..velocities.len() {
            let kick = forces.force[i] * kick_per_force[i];
            motion.velocities[i] += kick;
            velocities[i] = motion.velocities[i] + kick;
            let step = motion.velocities[i] * substep_s;
            motion.positions[i] += step;
            if !within(&step, particles.radii[i]) {
                jump = Some(step.norm() / particles.radii[i]);
            }
        }
        if particles.settings.spin {
            for i in 0..velocities.len() {
                let kick = forces.moment[i] * spin_per_moment[i];
                motion.spins[i] += kick;
                spins[i] = motion.spins[i] + kick;
            }
        }
        if let Some(ratio) = jump {
            motion.check_finite()?;
            return Ok(Trial::NotConverged(NotConverged { step_factor: (1.0 / (ratio * count)).clamp(0.1, 0.9) }));
        }
        let dissipation = forces.dissipation;
        let fraction = f64::from(substep) / count;
        let at =
            At { positions: &motion.positions, velocities: &velocities, spins: &spins, fraction, step_s: substep_s };
        evaluator.evaluate(at, &mut forces);
        for i in 0..velocities.len() {
            motion.velocities[i] += forces.force[i] * kick_per_force[i];
        }
        if particles.settings.spin {
            for i in 0..velocities.len() {
                motion.spins[i] += forces.moment[i] * spin_per_moment[i];
            }
        }
        dissipated += Dissipation::over(&dissipation, &forces.dissipation, substep_s);
    }
    motion.check_finite()?;
    Ok(Trial::Converged(Box::new(Advanced {
        motion,
        forces,
        moduli: evaluator.moduli,
        neighbours: evaluator.neighbours,
        dissipated,
        substeps: count as u32,
        substep_s,
        evaluations: evaluator.evaluations,
    })))
}
