//! Velocity Verlet with equal substeps (Verlet 1967; Swope et al. 1982).

use rayon::prelude::*;

use super::{
    Integrator, PARALLEL_PARTICLES, Particles, Vec3,
    blocks::BLOCK,
    bodies::Bodies,
    forces::{At, Evaluator},
    gyration::Gyration,
    outside::Outside,
    pistons::Pistons,
    state::{Advanced, Dissipation, Forces, Motion, State, Trial, within},
};
use crate::{
    SolveError,
    coupling::{NotConverged, Reply, Window},
};

/// More substeps than this in one window are refused: the window is too long, not the machine too slow.
const SUBSTEPS_LIMIT: f64 = 1e6;

/// Substeps to the critical step of the contacts at the window's start, where the scene sets none.
const SHARE_OF_CRITICAL: f64 = 0.2;

/// The same as a bound of the scene's own substep: beyond it Verlet still is stable, but a contact gains energy.
const LARGEST_SHARE_OF_CRITICAL: f64 = 0.5;

/// Share of the largest step at which damping and regularised friction are stable that a substep never exceeds; and the one
/// with which a window is repeated.
const LARGEST_SHARE_OF_STABLE: f64 = 0.5;
const SHARE_OF_STABLE: f64 = 0.4;

/// More substeps by which a window is solved again where a particle moved more than its radius in one, and how often.
const REFINEMENT: f64 = 8.0;
const REFINEMENTS: u32 = 2;

/// The state at the end of `window` and what is said about it; with finer substeps once more where its contacts turn out to
/// ask for them: those that arise within a window are not foreseen at its start.
pub(super) fn solve(
    particles: &Particles,
    state: &State,
    outside: &Outside,
    window: Window,
) -> Result<Result<(State, Reply), NotConverged>, SolveError> {
    let mut longest_s = f64::INFINITY;
    loop {
        let advanced = match advance(particles, state, outside, window, longest_s)? {
            Trial::Converged(advanced) => advanced,
            Trial::NotConverged(reason) => return Ok(Err(reason)),
        };
        let substep_s = advanced.substep_s;
        let (end, reply) = particles.finish(state, *advanced, outside, window.t_s + window.dt_s)?;
        if substep_s <= (LARGEST_SHARE_OF_CRITICAL * end.critical_s).min(LARGEST_SHARE_OF_STABLE * end.stable_s) {
            return Ok(Ok((end, reply)));
        }
        longest_s = (SHARE_OF_CRITICAL * end.critical_s).min(SHARE_OF_STABLE * end.stable_s);
    }
}

/// Integrates `window` with substeps of at most `longest_s`, the particles' own bound, and a share of the critical step of
/// the contacts.
///
/// The half kick v(t+Δt/2) = v + Δt/2 Ψ(t)/m and the drift are the usual ones. Forces that depend on velocity see the
/// predicted v + Δt Ψ(t)/m (Groot & Warren 1997 with λ = 1), whose error is second order in Δt, as is then the scheme;
/// forces at the half-step velocity would make it first order. A magnetic field is no force here: it turns velocities before
/// the first half kick and after the second (Boris 1970), which keeps their length whatever the substep.
fn advance(
    particles: &Particles,
    state: &State,
    outside: &Outside,
    window: Window,
    longest_s: f64,
) -> Result<Trial, SolveError> {
    let share = match particles.settings.integrator {
        Integrator::Verlet { substep_s: Some(_) } => LARGEST_SHARE_OF_CRITICAL,
        _ => SHARE_OF_CRITICAL,
    };
    let stable_s = (share * state.critical_s).min(LARGEST_SHARE_OF_STABLE * state.stable_s);
    let bound_s = longest_s.min(particles.substep_s).min(stable_s);
    // The margin keeps a window of exactly ten substeps from taking eleven.
    let mut count = (window.dt_s / bound_s - 1e-9).ceil().max(1.0);
    let mut jump = Ok(1.0);
    for _ in 0..=REFINEMENTS {
        if count > SUBSTEPS_LIMIT {
            let step_factor = (SUBSTEPS_LIMIT / count).clamp(0.1, 0.9);
            let reason = "forces, speeds or damping ask for more than a million substeps in one step";
            return Ok(Trial::NotConverged(NotConverged { reason, step_factor }));
        }
        match substeps(particles, state, outside, window, count)? {
            Course::Ended(advanced) => return Ok(Trial::Converged(advanced)),
            Course::Jumped(by) => jump = by,
        }
        count *= REFINEMENT;
    }
    let step_factor = (REFINEMENT / (jump? * count)).clamp(0.1, 0.9);
    let reason = "a particle moves more than its radius in each of 64 times the substeps foreseen";
    Ok(Trial::NotConverged(NotConverged { reason, step_factor }))
}

/// What becomes of a window with a given number of substeps.
enum Course {
    Ended(Box<Advanced>),
    /// A particle moved more than its radius in a substep: how many radii, or the value that is no number.
    Jumped(Result<f64, SolveError>),
}

/// Integrates `window` in `count` substeps.
fn substeps(
    particles: &Particles,
    state: &State,
    outside: &Outside,
    window: Window,
    count: f64,
) -> Result<Course, SolveError> {
    let substep_s = window.dt_s / count;
    let spin = particles.settings.spin;

    let mut motion = state.motion.clone();
    let mut velocities = motion.velocities.clone();
    let mut spins = motion.spins.clone();
    let mut evaluator = Evaluator::new(particles, state, outside);
    let mut forces = particles.start_forces(state, &mut evaluator, window.t_s, substep_s)?;
    let mut dissipated = Dissipation::default();
    let kicks = Kicks { bodies: &state.bodies, half_s: 0.5 * substep_s, spin };
    let gyration = Gyration::new(particles, &state.bodies, substep_s);
    let mut pistons = Pistons { particles, walls: state.walls.clone(), lost_j: 0.0 };
    for substep in 1..=count as u32 {
        let before_s = window.t_s + window.dt_s * f64::from(substep - 1) / count;
        if let Some(gyration) = &gyration {
            gyration.turn(before_s, &motion.positions, &mut motion.velocities);
        }
        if let Some(ratio) = kicks.drift(&forces, &mut motion, &mut velocities, &mut spins) {
            return Ok(Course::Jumped(motion.check_finite().map(|()| ratio)));
        }
        pistons.drift(before_s, substep_s, &forces.on_walls);
        let dissipation = forces.dissipation;
        let fraction = f64::from(substep) / count;
        let now_s = window.t_s + window.dt_s * fraction;
        if let Some(gyration) = &gyration {
            gyration.turn(now_s, &motion.positions, &mut velocities);
        }
        let at = At {
            positions: &motion.positions,
            velocities: &velocities,
            spins: &spins,
            turning: &motion.spins,
            walls: &pistons.walls,
            t_s: now_s,
            fraction,
            step_s: substep_s,
        };
        evaluator.evaluate(at, &mut forces)?;
        kicks.end(&forces, &mut motion);
        if let Some(gyration) = &gyration {
            gyration.turn(now_s, &motion.positions, &mut motion.velocities);
        }
        pistons.kick(now_s, 0.5 * substep_s, &forces.on_walls);
        dissipated += Dissipation::over(&dissipation, &forces.dissipation, substep_s);
    }
    motion.check_finite()?;
    dissipated.pistons += pistons.lost_j;
    let end = evaluator.end((motion, pistons.walls), forces, dissipated, (count as u32, substep_s));
    Ok(Course::Ended(Box::new(end)))
}

/// The same particles of two lists.
type Pair<'a> = (&'a mut [Vec3], &'a mut [Vec3]);

/// The two halves of a substep.
struct Kicks<'a> {
    bodies: &'a Bodies,
    /// Δt/2 in s.
    half_s: f64,
    spin: bool,
}

impl Kicks<'_> {
    /// Half kick, drift, and the velocities predicted for the substep's end. Returns how many times its radius a particle
    /// moved, where one moved more than that.
    fn drift(&self, forces: &Forces, motion: &mut Motion, velocities: &mut [Vec3], spins: &mut [Vec3]) -> Option<f64> {
        let chunk = |(chunk, ((positions, at), predicted)): (usize, (Pair<'_>, &mut [Vec3]))| {
            let mut jump: Option<f64> = None;
            for (k, i) in (chunk * BLOCK..chunk * BLOCK + positions.len()).enumerate() {
                let kick = forces.force[i] * (self.half_s / self.bodies.masses[i]);
                at[k] += kick;
                predicted[k] = at[k] + kick;
                let step = at[k] * (2.0 * self.half_s);
                positions[k] += step;
                if !within(&step, self.bodies.radii[i]) {
                    jump = Some(step.norm() / self.bodies.radii[i]);
                }
            }
            jump
        };
        let turn = |(chunk, (at, predicted)): (usize, Pair<'_>)| {
            for (k, i) in (chunk * BLOCK..chunk * BLOCK + at.len()).enumerate() {
                let kick = forces.moment[i] * (self.half_s / self.bodies.inertias[i]);
                at[k] += kick;
                predicted[k] = at[k] + kick;
            }
        };
        let Motion { positions, velocities: at, spins: turning } = motion;
        if positions.len() > PARALLEL_PARTICLES {
            if self.spin {
                turning.par_chunks_mut(BLOCK).zip(spins.par_chunks_mut(BLOCK)).enumerate().for_each(turn);
            }
            let chunks = positions.par_chunks_mut(BLOCK).zip(at.par_chunks_mut(BLOCK));
            let jumps: Vec<Option<f64>> = chunks.zip(velocities.par_chunks_mut(BLOCK)).enumerate().map(chunk).collect();
            jumps.into_iter().flatten().last()
        } else {
            if self.spin {
                turning.chunks_mut(BLOCK).zip(spins.chunks_mut(BLOCK)).enumerate().for_each(turn);
            }
            let chunks = positions.chunks_mut(BLOCK).zip(at.chunks_mut(BLOCK));
            chunks.zip(velocities.chunks_mut(BLOCK)).enumerate().filter_map(chunk).last()
        }
    }

    /// The second half kick.
    fn end(&self, forces: &Forces, motion: &mut Motion) {
        let kick = |(chunk, (velocities, spins)): (usize, Pair<'_>)| {
            for (k, i) in (chunk * BLOCK..chunk * BLOCK + velocities.len()).enumerate() {
                velocities[k] += forces.force[i] * (self.half_s / self.bodies.masses[i]);
                if self.spin {
                    spins[k] += forces.moment[i] * (self.half_s / self.bodies.inertias[i]);
                }
            }
        };
        let Motion { velocities, spins, .. } = motion;
        if velocities.len() > PARALLEL_PARTICLES {
            velocities.par_chunks_mut(BLOCK).zip(spins.par_chunks_mut(BLOCK)).enumerate().for_each(kick);
        } else {
            velocities.chunks_mut(BLOCK).zip(spins.chunks_mut(BLOCK)).enumerate().for_each(kick);
        }
    }
}
