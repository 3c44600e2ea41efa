//! Velocity Verlet with equal substeps (Verlet 1967; Swope et al. 1982).

use rayon::prelude::*;
use stagger_coupling::{NotConverged, Reply, SolveError, Window};

use super::{
    finish::finish,
    force_controlled_walls::ForceControlledWalls,
    forces::{At, Evaluator},
    gyration::Gyration,
    start_forces::start_forces,
    substep::{stiffness_factor, time_scales, walls_m_s},
};
use crate::{
    common::Vec3,
    particles::{
        exchange::external_fields::ExternalFields,
        model::{
            Model,
            bodies::Bodies,
            state::{Advanced, Dissipation, Forces, LARGEST_WAY, Motion, State, within},
        },
        search::blocks::{BLOCK, PARALLEL_PARTICLES},
        settings::Integrator,
    },
};

/// More substeps than this in one window are refused: the window is too long, not the machine too slow.
const SUBSTEPS_LIMIT: f64 = 1e6;

/// And more than this, so that no particle moves farther than a share of its radius in one, are as well: fields are exchanged
/// once a window, in which it would move some thousand radii.
const WAYS_LIMIT: f64 = 1e4;

/// Substeps to the critical step of the contacts at the window's start, where the scene sets none.
const SHARE_OF_CRITICAL: f64 = 0.2;

/// The same as a bound of the scene's own substep: beyond it Verlet still is stable, but a contact gains energy.
const LARGEST_SHARE_OF_CRITICAL: f64 = 0.5;

/// Share of the largest step at which damping and regularised friction are stable that a substep never exceeds; and the one
/// with which a window is repeated.
const LARGEST_SHARE_OF_STABLE: f64 = 0.5;
const SHARE_OF_STABLE: f64 = 0.4;

/// How many times the substep that resolves the speeds there are may be exceeded before a window is solved again: the planned
/// one has 25 to the shortest contact, which then still has 23.
const SLACK: f64 = 1.1;

/// The slowest speed that a limit may be, in radii a substep; and the steps in which it is found, to 1e-3.
const SLOWEST: f64 = 1e-40;
const STEPS: u32 = 17;

/// Most of a substep with which a window is solved again.
const FINER: f64 = 0.5;

/// The state at the end of `window` and what is said about it.
///
/// The substep is that of the speeds and contacts there are at the window's start. What the window brings is not foreseen, but
/// seen while it is integrated: where speeds, ways or contacts arise that the substep does not resolve, the window is
/// solved again with finer ones, from its start. Each time they are at most half as long, so that it ends: at the limit a
/// shorter window is asked for.
pub fn solve(
    model: &Model,
    state: &State,
    external: &ExternalFields,
    window: Window,
) -> Result<Result<(State, Reply), NotConverged>, SolveError> {
    let mut plan = Plan::new(model, state, window);
    let mut again = 0.0;
    loop {
        // The margin keeps a window of exactly ten substeps from taking eleven.
        let count = (window.dt_s / plan.longest_s - 1e-9).ceil().max(1.0);
        let refused = |limit: f64, count: f64, reason| {
            Ok(Err(NotConverged { reason, step_factor: (limit / count).clamp(0.1, 0.9) }))
        };
        if count > SUBSTEPS_LIMIT {
            return refused(
                SUBSTEPS_LIMIT,
                count,
                "forces, speeds or damping ask for more than a million substeps in one step",
            );
        }
        let ways = window.dt_s / plan.way_s;
        if ways > WAYS_LIMIT {
            return refused(WAYS_LIMIT, ways, "a particle, or a wall, moves more than two thousand radii in one step");
        }
        let substep_s = window.dt_s / count;
        let advanced = match substeps(model, state, external, window, (count, plan.limits(substep_s)))? {
            Course::Ended(advanced) => advanced,
            Course::Unresolved(unresolved) => {
                plan.refine(substep_s, unresolved);
                again += 1.0;
                continue;
            }
        };
        let (end, mut reply) = finish(model, state, *advanced, external, window.t_s + window.dt_s)?;
        if substep_s <= (LARGEST_SHARE_OF_CRITICAL * end.critical_s).min(LARGEST_SHARE_OF_STABLE * end.stable_s) {
            if again > 0.0 {
                reply.figures.insert("times solved again".into(), again);
            }
            return Ok(Ok((end, reply)));
        }
        let asked_s = (SHARE_OF_CRITICAL * end.critical_s).min(SHARE_OF_STABLE * end.stable_s);
        again += 1.0;
        plan.longest_s = asked_s.min(SHARE_OF_STABLE / LARGEST_SHARE_OF_STABLE * substep_s);
    }
}

/// What the substeps of a window resolve.
struct Plan<'a> {
    model: &'a Model,
    /// Bound of the walls' speeds in the window, in m/s.
    walls_m_s: f64,
    /// Whether the scene leaves the substep to us.
    automatic: bool,
    /// Longest substep in s.
    longest_s: f64,
    /// The longest in which particles and walls move no farther than a share of a radius, at the largest speeds seen so far.
    way_s: f64,
    /// Of the smallest and the largest particle, in m.
    radii_m: [f64; 2],
}

/// What a substep may not exceed.
#[derive(Clone, Copy)]
struct Limits {
    /// Way of a particle in a substep, in m, beside a share of its radius.
    way_m: f64,
    /// Way of a wall, in m.
    wall_way_m: f64,
    /// Elastic force over overlap and reduced mass of a contact, in 1/s².
    rate_1_s2: f64,
}

/// What was not resolved.
#[derive(Clone, Copy)]
enum Unresolved {
    /// A particle moved at so many m/s, and has a radius of so many m.
    Speed { speed_m_s: f64, radius_m: f64 },
    /// A contact has so large an elastic force over overlap and reduced mass, in 1/s².
    Contact { rate_1_s2: f64 },
}

impl<'a> Plan<'a> {
    fn new(model: &'a Model, state: &State, window: Window) -> Self {
        let automatic = !matches!(model.settings.integrator, Integrator::Verlet { substep_s: Some(_) });
        let speeds = || state.motion.velocities.iter().map(Vec3::norm);
        let fastest_m_s = speeds().fold(0.0, f64::max);
        let walls_m_s = walls_m_s(model, state, [window.t_s, window.t_s + window.dt_s], fastest_m_s * window.dt_s);
        let radii = || state.bodies.radii.iter().copied();
        let radii_m = [radii().fold(f64::INFINITY, f64::min), radii().fold(0.0, f64::max)];
        let share = if automatic { SHARE_OF_CRITICAL } else { LARGEST_SHARE_OF_CRITICAL };
        let stable_s = (share * state.critical_s).min(LARGEST_SHARE_OF_STABLE * state.stable_s);
        // The shortest time in which a particle, or a wall, moves a radius.
        let radius_s = speeds().zip(radii()).map(|(speed, radius)| radius / speed);
        let radius_s = radius_s.fold(radii_m[0] / walls_m_s, f64::min);
        let way_s = LARGEST_WAY * radius_s;
        let mut plan = Self { model, walls_m_s, automatic, longest_s: f64::INFINITY, way_s, radii_m };
        let resolved_s = plan.resolving_s(fastest_m_s);
        // What was foreseen at the start stays as long as it does.
        let planned_s = if model.scales.substep_s <= SLACK * resolved_s { model.scales.substep_s } else { resolved_s };
        plan.longest_s = planned_s.min(model.scales.substep_s).min(stable_s).min(way_s);
        plan
    }

    /// The substep in s that resolves contacts of particles at a speed in m/s; infinite where the scene sets its own.
    fn resolving_s(&self, speed_m_s: f64) -> f64 {
        if self.automatic { time_scales(self.model, speed_m_s + self.walls_m_s).substep_s } else { f64::INFINITY }
    }

    /// What a substep in s resolves.
    fn limits(&self, substep_s: f64) -> Limits {
        let factor = stiffness_factor(self.model);
        // ω Δt ≤ 2 · share.
        let rate_1_s = 2.0 * LARGEST_SHARE_OF_CRITICAL / substep_s;
        let rate_1_s2 = rate_1_s * rate_1_s / factor;
        let [smallest_m, largest_m] = self.radii_m;
        let wall_way_m = LARGEST_WAY * smallest_m;
        let resolves = |speed_m_s: f64| substep_s <= SLACK * self.resolving_s(speed_m_s);
        // What moves by a radius in a substep is told by its way.
        let highest_m_s = largest_m / substep_s;
        if !self.automatic || largest_m == 0.0 || resolves(highest_m_s) {
            return Limits { way_m: f64::INFINITY, wall_way_m, rate_1_s2 };
        }
        // The largest speed that is resolved, by bisection of its logarithm.
        let [mut low, mut high] = [SLOWEST * highest_m_s, highest_m_s];
        for _ in 0..STEPS {
            let middle = low.sqrt() * high.sqrt();
            if resolves(middle) { low = middle } else { high = middle }
        }
        Limits { way_m: high * substep_s, wall_way_m, rate_1_s2 }
    }

    /// Asks for substeps that resolve what one of `substep_s` did not.
    fn refine(&mut self, substep_s: f64, unresolved: Unresolved) {
        let asked_s = match unresolved {
            // It may have begun to accelerate: twice as fast is resolved, too.
            Unresolved::Speed { speed_m_s, radius_m } => {
                self.way_s = self.way_s.min(0.5 * LARGEST_WAY * radius_m / speed_m_s);
                self.resolving_s(2.0 * speed_m_s).min(self.way_s)
            }
            Unresolved::Contact { rate_1_s2 } => {
                2.0 * SHARE_OF_CRITICAL / (stiffness_factor(self.model) * rate_1_s2).sqrt()
            }
        };
        self.longest_s = asked_s.min(FINER * substep_s);
    }
}

/// What becomes of a window with a given number of substeps.
enum Course {
    Ended(Box<Advanced>),
    Unresolved(Unresolved),
}

/// Integrates `window` in `count` substeps.
///
/// The half kick v(t+Δt/2) = v + Δt/2 Ψ(t)/m and the drift are the usual ones. Forces that depend on velocity see the
/// predicted v + Δt Ψ(t)/m (Groot & Warren 1997 with λ = 1), whose error is second order in Δt, as is then the scheme;
/// forces at the half-step velocity would make it first order. A magnetic field is no force here: it turns velocities before
/// the first half kick and after the second (Boris 1970), which keeps their length whatever the substep.
fn substeps(
    model: &Model,
    state: &State,
    external: &ExternalFields,
    window: Window,
    (count, limits): (f64, Limits),
) -> Result<Course, SolveError> {
    let substep_s = window.dt_s / count;
    let spin = model.settings.spin;

    let mut motion = state.motion.clone();
    let mut velocities = motion.velocities.clone();
    let mut spins = motion.spins.clone();
    let mut evaluator = Evaluator::new(model, state, external);
    let mut forces = start_forces(model, state, &mut evaluator, window.t_s, substep_s)?;
    let mut dissipated = Dissipation::default();
    let kicks = Kicks { bodies: &state.bodies, half_s: 0.5 * substep_s, way_m: limits.way_m, spin };
    let gyration = Gyration::new(model, &state.bodies, substep_s);
    let mut force_controlled_walls = ForceControlledWalls { model, walls: state.walls.clone(), lost_j: 0.0 };
    for substep in 1..=count as u32 {
        let before_s = window.t_s + window.dt_s * f64::from(substep - 1) / count;
        if let Some(gyration) = &gyration {
            gyration.turn(before_s, &motion.positions, &mut motion.velocities);
        }
        if let Some(unresolved) = kicks.drift(&forces, &mut motion, &mut velocities, &mut spins) {
            return motion.check_finite().map(|()| Course::Unresolved(unresolved));
        }
        force_controlled_walls.drift(before_s, substep_s, &forces.on_walls);
        let wall_m_s = force_controlled_walls.fastest_m_s();
        if wall_m_s * substep_s > limits.wall_way_m {
            let radius_m = limits.wall_way_m / LARGEST_WAY;
            return Ok(Course::Unresolved(Unresolved::Speed { speed_m_s: wall_m_s, radius_m }));
        }
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
            walls: &force_controlled_walls.walls,
            t_s: now_s,
            fraction,
            step_s: substep_s,
        };
        evaluator.evaluate(at, &mut forces)?;
        if evaluator.rate_1_s2() > limits.rate_1_s2 {
            return Ok(Course::Unresolved(Unresolved::Contact { rate_1_s2: evaluator.rate_1_s2() }));
        }
        kicks.end(&forces, &mut motion);
        if let Some(gyration) = &gyration {
            gyration.turn(now_s, &motion.positions, &mut motion.velocities);
        }
        force_controlled_walls.kick(now_s, 0.5 * substep_s, &forces.on_walls);
        dissipated += Dissipation::over(&dissipation, &forces.dissipation, substep_s);
    }
    motion.check_finite()?;
    dissipated.force_controlled_walls += force_controlled_walls.lost_j;
    let end = evaluator.end((motion, force_controlled_walls.walls), forces, dissipated, (count as u32, substep_s));
    Ok(Course::Ended(Box::new(end)))
}

/// The same particles of two lists.
type Pair<'a> = (&'a mut [Vec3], &'a mut [Vec3]);

/// The two halves of a substep.
struct Kicks<'a> {
    bodies: &'a Bodies,
    /// Δt/2 in s.
    half_s: f64,
    /// Longest way of a particle in a substep, in m, beside a share of its radius.
    way_m: f64,
    spin: bool,
}

impl Kicks<'_> {
    /// Half kick, drift, and the velocities predicted for the substep's end. Returns the speed of a particle that moved farther
    /// than the substep resolves.
    fn drift(
        &self,
        forces: &Forces,
        motion: &mut Motion,
        velocities: &mut [Vec3],
        spins: &mut [Vec3],
    ) -> Option<Unresolved> {
        let chunk = |(chunk, ((positions, at), predicted)): (usize, (Pair<'_>, &mut [Vec3]))| {
            let mut jump: Option<Unresolved> = None;
            for (k, i) in (chunk * BLOCK..chunk * BLOCK + positions.len()).enumerate() {
                let kick = forces.force[i] * (self.half_s / self.bodies.masses[i]);
                at[k] += kick;
                predicted[k] = at[k] + kick;
                let step = at[k] * (2.0 * self.half_s);
                positions[k] += step;
                let radius_m = self.bodies.radii[i];
                if !within(&step, (LARGEST_WAY * radius_m).min(self.way_m)) {
                    jump = Some(Unresolved::Speed { speed_m_s: at[k].norm(), radius_m });
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
            let jumps: Vec<Option<Unresolved>> =
                chunks.zip(velocities.par_chunks_mut(BLOCK)).enumerate().map(chunk).collect();
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
