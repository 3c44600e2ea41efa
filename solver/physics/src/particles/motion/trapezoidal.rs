//! The monograph's trapezoidal rule over the whole window, solved by fixed-point iteration (Zohdi 2018, eqs. 6.23–6.27).

use stagger_coupling::{NotConverged, SolveError, Window, math};

use super::{
    anderson::Anderson,
    force_controlled_walls::ForceControlledWalls,
    forces::{At, Evaluator},
    start_forces::start_forces,
    substep::walls_m_s,
};
use crate::{
    common::Vec3,
    particles::{
        exchange::external_fields::ExternalFields,
        model::{
            Model,
            state::{Dissipation, Forces, LARGEST_WAY, Motion, State, Trial},
        },
    },
};

/// Order of the fixed point's contraction in Δt for motion (Zohdi 2018, eq. 6.31: p = 2).
const ORDER: f64 = 2.0;

/// Why a window is not solved, where that is not the iteration.
const JUMPS: &str = "a particle, or a wall, moves more than a quarter of a radius in one step";

/// Weight, tolerance and bound of the fixed point.
#[derive(Clone, Copy)]
pub struct Trapezoidal {
    /// Weight φ of the window's end.
    pub phi: f64,
    /// Tolerance TOL of the change over the increment.
    pub tolerance: f64,
    /// Iterations K_d.
    pub iterations: u32,
    /// Differences that Anderson's mixing uses; 0 is the plain iteration.
    pub anderson_depth: u32,
}

impl Trapezoidal {
    /// Integrates `window` in one step.
    ///
    /// Starts from the forces at t. Beyond the critical step of the contacts the plain iteration does not contract, so that
    /// a smaller step is asked for at once, while mixed iterates may still converge; where K_d iterations do not reach
    /// the tolerance, the step factor is Λ = (TOL/ε^K)^{1/(p K_d)} (eqs. 6.31, 6.50 at K = K_d). The change is always that
    /// from the iterate asked for to the one it gives, and what is kept is the latter: mixing does not touch the result.
    pub fn advance(
        self,
        model: &Model,
        state: &State,
        external: &ExternalFields,
        window: Window,
    ) -> Result<Trial, SolveError> {
        let dt_s = window.dt_s;
        if self.anderson_depth == 0 && dt_s > state.critical_s {
            let step_factor = (state.critical_s / dt_s).clamp(0.1, 0.9);
            let reason =
                "the step is longer than the contacts' critical one, beyond which the plain iteration diverges";
            return Ok(Trial::NotConverged(NotConverged { reason, step_factor }));
        }
        let radii = &state.bodies.radii;
        let fastest_m_s = state.motion.velocities.iter().map(Vec3::norm).fold(0.0, f64::max);
        let during = [window.t_s, window.t_s + dt_s];
        let wall_way_m = walls_m_s(model, state, during, fastest_m_s * dt_s) * dt_s;
        let longest_m = LARGEST_WAY * radii.iter().copied().fold(f64::INFINITY, f64::min);
        if wall_way_m > longest_m {
            let step_factor = (longest_m / wall_way_m).clamp(0.1, 0.9);
            return Ok(Trial::NotConverged(NotConverged { reason: JUMPS, step_factor }));
        }
        let mut evaluator = Evaluator::new(model, state, external);
        let start = start_forces(model, state, &mut evaluator, window.t_s, dt_s)?;
        let mut end = start.clone();
        let mut motion = state.motion.clone();
        let mut turning = motion.spins.clone();
        // A piston's own motion is explicit: its mass is large against the particles'.
        let mut force_controlled_walls = ForceControlledWalls { model, walls: state.walls.clone(), lost_j: 0.0 };
        force_controlled_walls.drift(window.t_s, dt_s, &start.on_walls);
        self.kick(model, state, [&start, &end], dt_s, &mut motion);
        self.drift(state, dt_s, &mut motion);
        let mut before = motion.clone();
        let mut anderson = Anderson::new(&state.bodies, model.settings.spin, self.anderson_depth);
        let mut change = f64::INFINITY;
        for _ in 0..self.iterations {
            if let Some(ratio) = motion.jump(&state.motion.positions, radii) {
                let step_factor = if ratio.is_finite() { (1.0 / ratio).clamp(0.1, 0.9) } else { 0.5 };
                return Ok(Trial::NotConverged(NotConverged { reason: JUMPS, step_factor }));
            }
            motion.check_finite()?;
            before.clone_from(&motion);
            for ((mean, start), end) in turning.iter_mut().zip(&state.motion.spins).zip(&motion.spins) {
                *mean = start * (1.0 - self.phi) + end * self.phi;
            }
            let at = At {
                positions: &motion.positions,
                velocities: &motion.velocities,
                spins: &motion.spins,
                turning: &turning,
                walls: &force_controlled_walls.walls,
                t_s: window.t_s + dt_s,
                fraction: 1.0,
                step_s: dt_s,
            };
            evaluator.forget()?;
            evaluator.evaluate(at, &mut end)?;
            self.kick(model, state, [&start, &end], dt_s, &mut motion);
            self.drift(state, dt_s, &mut motion);
            change = relative_change(&motion.positions, &before.positions, &state.motion.positions);
            if change <= self.tolerance {
                break;
            }
            if let Some(anderson) = &mut anderson {
                motion.check_finite()?;
                anderson.mix(&before, &mut motion);
                self.drift(state, dt_s, &mut motion);
            }
        }
        motion.check_finite()?;
        if change > self.tolerance {
            let root = 1.0 / (ORDER * f64::from(self.iterations));
            let step_factor = math::powf(self.tolerance / change, root).clamp(0.1, 0.9);
            let reason = "integrator.iterations do not reach integrator.tolerance";
            return Ok(Trial::NotConverged(NotConverged { reason, step_factor }));
        }
        if let Some(ratio) = motion.jump(&state.motion.positions, radii) {
            let step_factor = (1.0 / ratio).clamp(0.1, 0.9);
            return Ok(Trial::NotConverged(NotConverged { reason: JUMPS, step_factor }));
        }
        force_controlled_walls.kick(window.t_s + dt_s, 0.5 * dt_s, &end.on_walls);
        evaluator.refresh(&motion.positions, &force_controlled_walls.walls, window.t_s + dt_s)?;
        let mut dissipated = Dissipation::over(&start.dissipation, &end.dissipation, dt_s);
        dissipated.force_controlled_walls = force_controlled_walls.lost_j;
        Ok(Trial::Converged(Box::new(evaluator.end(
            (motion, force_controlled_walls.walls),
            end,
            dissipated,
            (1, dt_s),
        ))))
    }

    /// Velocities and spins at the window's end from the forces at both ends (eqs. 6.23 and 6.2).
    fn kick(self, model: &Model, state: &State, [start, end]: [&Forces; 2], dt_s: f64, motion: &mut Motion) {
        let phi = self.phi;
        for i in 0..motion.positions.len() {
            let force = end.force[i] * phi + start.force[i] * (1.0 - phi);
            motion.velocities[i] = state.motion.velocities[i] + force * (dt_s / state.bodies.masses[i]);
            if model.settings.spin {
                let moment = end.moment[i] * phi + start.moment[i] * (1.0 - phi);
                motion.spins[i] = state.motion.spins[i] + moment * (dt_s / state.bodies.inertias[i]);
            }
        }
    }

    /// Positions at the window's end from the velocities at both ends (eq. 6.25).
    fn drift(self, state: &State, dt_s: f64, motion: &mut Motion) {
        let from = state.motion.positions.iter().zip(&state.motion.velocities);
        for ((position, velocity), (start, before)) in motion.positions.iter_mut().zip(&motion.velocities).zip(from) {
            *position = start + (velocity * self.phi + before * (1.0 - self.phi)) * dt_s;
        }
    }
}

/// A change of a position of at most this many times its largest coordinate is rounding: four to eight units of its last place,
/// which iterates that have converged keep jumping by, for particles at rest or far from the origin more than they move.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Σ‖r^K − r^{K−1}‖ / Σ‖r^K − r^L‖ (eq. 6.48); zero where nothing moved by more than rounding.
fn relative_change(now: &[Vec3], before: &[Vec3], start: &[Vec3]) -> f64 {
    let changes = now.iter().zip(before).map(|(now, before)| {
        let change = (now - before).norm();
        if change <= ROUNDING * now.amax() { 0.0 } else { change }
    });
    let change = changes.sum::<f64>();
    let increment: f64 = now.iter().zip(start).map(|(now, start)| (now - start).norm()).sum();
    if change > 0.0 && increment > 0.0 { change / increment } else { 0.0 }
}
