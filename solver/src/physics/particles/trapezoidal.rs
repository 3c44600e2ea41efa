//! The monograph's trapezoidal rule over the whole window, solved by fixed-point iteration (Zohdi 2018, eqs. 6.23–6.27).

use super::{
    Particles, Vec3,
    forces::{At, Evaluator, Heat},
    pistons::Pistons,
    state::{Dissipation, Forces, Motion, State, Trial},
};
use crate::{
    SolveError,
    coupling::{NotConverged, Window},
};

/// Order of the fixed point's contraction in Δt for motion (Zohdi 2018, eq. 6.31: p = 2).
const ORDER: f64 = 2.0;

/// Weight, tolerance and bound of the fixed point.
#[derive(Clone, Copy)]
pub(super) struct Trapezoidal {
    /// Weight φ of the window's end.
    pub phi: f64,
    /// Tolerance TOL of the change over the increment.
    pub tolerance: f64,
    /// Iterations K_d.
    pub iterations: u32,
}

impl Trapezoidal {
    /// Integrates `window` in one step.
    ///
    /// Starts from the forces at t. Beyond the critical step of the contacts the iteration does not contract, so that a
    /// smaller step is asked for at once; where K_d iterations do not reach the tolerance, the step factor is
    /// Λ = (TOL/ε^K)^{1/(p K_d)} (eqs. 6.31, 6.50 at K = K_d).
    pub fn advance(
        self,
        particles: &Particles,
        state: &State,
        heat: Option<&Heat>,
        window: Window,
    ) -> Result<Trial, SolveError> {
        let dt_s = window.dt_s;
        if dt_s > state.critical_s {
            let step_factor = (state.critical_s / dt_s).clamp(0.1, 0.9);
            return Ok(Trial::NotConverged(NotConverged { step_factor }));
        }
        let radii = &state.bodies.radii;
        let mut evaluator = Evaluator::new(particles, state, heat);
        let start = particles.start_forces(state, &mut evaluator, window.t_s, dt_s)?;
        let mut end = start.clone();
        let mut motion = state.motion.clone();
        let mut turning = motion.spins.clone();
        // A piston's own motion is explicit: its mass is large against the particles'.
        let mut pistons = Pistons { particles, walls: state.walls.clone(), lost_j: 0.0 };
        pistons.drift(window.t_s, dt_s, &start.on_walls);
        self.update(particles, state, &start, &end, dt_s, &mut motion);
        let mut before: Vec<Vec3> = motion.positions.clone();
        let mut change = f64::INFINITY;
        for _ in 0..self.iterations {
            if let Some(ratio) = motion.jump(&state.motion.positions, radii) {
                let step_factor = if ratio.is_finite() { (1.0 / ratio).clamp(0.1, 0.9) } else { 0.5 };
                return Ok(Trial::NotConverged(NotConverged { step_factor }));
            }
            motion.check_finite()?;
            before.copy_from_slice(&motion.positions);
            let at = At {
                positions: &motion.positions,
                velocities: &motion.velocities,
                spins: &motion.spins,
                turning: &turning,
                walls: &pistons.walls,
                t_s: window.t_s + dt_s,
                fraction: 1.0,
                step_s: dt_s,
            };
            evaluator.forget()?;
            evaluator.evaluate(at, &mut end)?;
            self.update(particles, state, &start, &end, dt_s, &mut motion);
            for ((mean, start), end) in turning.iter_mut().zip(&state.motion.spins).zip(&motion.spins) {
                *mean = start * (1.0 - self.phi) + end * self.phi;
            }
            change = relative_change(&motion.positions, &before, &state.motion.positions);
            if change <= self.tolerance {
                break;
            }
        }
        motion.check_finite()?;
        if change > self.tolerance {
            let root = 1.0 / (ORDER * f64::from(self.iterations));
            let step_factor = (self.tolerance / change).powf(root).clamp(0.1, 0.9);
            return Ok(Trial::NotConverged(NotConverged { step_factor }));
        }
        if let Some(ratio) = motion.jump(&state.motion.positions, radii) {
            return Ok(Trial::NotConverged(NotConverged { step_factor: (1.0 / ratio).clamp(0.1, 0.9) }));
        }
        pistons.kick(window.t_s + dt_s, 0.5 * dt_s, &end.on_walls);
        evaluator.refresh(&motion.positions, &pistons.walls, window.t_s + dt_s)?;
        let mut dissipated = Dissipation::over(&start.dissipation, &end.dissipation, dt_s);
        dissipated.pistons = pistons.lost_j;
        Ok(Trial::Converged(Box::new(evaluator.end((motion, pistons.walls), end, dissipated, (1, dt_s)))))
    }

    /// One iterate from the forces at both ends (eqs. 6.23–6.27, spin by 6.2).
    fn update(
        self,
        particles: &Particles,
        state: &State,
        start: &Forces,
        end: &Forces,
        dt_s: f64,
        motion: &mut Motion,
    ) {
        let phi = self.phi;
        for i in 0..motion.positions.len() {
            let velocity = state.motion.velocities[i];
            let force = end.force[i] * phi + start.force[i] * (1.0 - phi);
            motion.velocities[i] = velocity + force * (dt_s / state.bodies.masses[i]);
            let mean_velocity = motion.velocities[i] * phi + velocity * (1.0 - phi);
            motion.positions[i] = state.motion.positions[i] + mean_velocity * dt_s;
            if particles.settings.spin {
                let moment = end.moment[i] * phi + start.moment[i] * (1.0 - phi);
                motion.spins[i] = state.motion.spins[i] + moment * (dt_s / state.bodies.inertias[i]);
            }
        }
    }
}

/// Σ‖r^K − r^{K−1}‖ / Σ‖r^K − r^L‖ (eq. 6.48); zero where nothing moved.
fn relative_change(now: &[Vec3], before: &[Vec3], start: &[Vec3]) -> f64 {
    let sum = |from: &[Vec3]| now.iter().zip(from).map(|(a, b)| (a - b).norm()).sum::<f64>();
    let increment = sum(start);
    if increment > 0.0 { sum(before) / increment } else { 0.0 }
}
