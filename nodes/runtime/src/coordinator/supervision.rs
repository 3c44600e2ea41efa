//! Has the nodes run to the end, and starts again those that die on the way.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use serde::Serialize;
use stagger_coupling::{CouplingController, End, RecordedSchedule, SolveError, out_of_reach};
use stagger_messages::{Manifest, Plan};
use stagger_scene::Scene;

use crate::{
    coordinator::{Remote, RunError, monitor::Monitor, ports},
    diagnostics,
};

/// A node that died and was started again.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Restart {
    /// The node.
    pub node: String,
    /// What it was asked for when it died.
    pub at: String,
    /// Accepted step from which the run went on.
    pub from_step: u64,
    /// Accepted steps that were solved once more.
    pub steps_repeated: u64,
    /// Wall time until all nodes were ready again, in s; what is repeated after that comes on top.
    pub outage_s: f64,
}

/// Waits for the nodes; one that ends before it has announced itself is started again.
///
/// # Errors
/// Nodes do not come, or too many end.
pub fn gather(
    scene: &Scene,
    remote: &mut Remote<'_>,
    patience: Duration,
    restarts: &mut Vec<Restart>,
) -> Result<BTreeMap<String, Manifest>, RunError> {
    loop {
        let begun = Instant::now();
        match remote.gather(scene.hash, patience) {
            Err(RunError::Lost { node, at, why })
                if may_restart(scene, restarts) && !remote.is_hopeless(&node, true) =>
            {
                tell(&node, &at, &why, "it is started again");
                remote.restart(&node)?;
                let outage_s = begun.elapsed().as_secs_f64();
                restarts.push(Restart { node, at, from_step: 0, steps_repeated: 0, outage_s });
            }
            other => return other,
        }
    }
}

/// Runs a scene over nodes that are there, from its start or from the checkpoint `remote` holds, on the course of
/// `schedule` where there is one.
///
/// # Errors
/// A node fails, or dies more often than the scene allows; the step control gives up.
pub fn conduct(
    scene: &Scene,
    remote: &mut Remote<'_>,
    manifests: &BTreeMap<String, Manifest>,
    monitor: &mut Monitor,
    schedule: Option<&Arc<RecordedSchedule>>,
    patience: Duration,
    restarts: &mut Vec<Restart>,
) -> Result<End, RunError> {
    let ports = ports(manifests);
    let mut plan = stagger_coupling::plan(&ports, &scene.coupling)?;
    out_of_reach(&plan, &scene.coupling).iter().for_each(|warning| diagnostics::warn(warning));
    let steps = scene.recovery.checkpoint_steps;
    let mut since = None;
    loop {
        let mut controller = controller(scene, remote, &mut plan, manifests, monitor)?;
        if let Some(schedule) = schedule {
            controller.control.follow(Arc::clone(schedule));
        }
        let driven = stagger_coupling::run_loop(remote, &plan, &mut controller, steps, monitor);
        if let (Some(since), Some(ready_at), Some(restart)) = (since.take(), monitor.ready_at(), restarts.last_mut()) {
            restart.outage_s = ready_at.saturating_duration_since(since).as_secs_f64();
        }
        let error = match driven {
            Ok(end) => return Ok(end),
            Err(error) => error,
        };
        let (node, at, why) = match &error {
            RunError::Lost { node, at, why } => (node.clone(), at.clone(), why.clone()),
            RunError::Silent { node, at, patience } => {
                (node.clone(), at.clone(), format!("no answer for {} s", patience.as_secs_f64()))
            }
            _ => return Err(error),
        };
        if !may_restart(scene, restarts) || remote.is_hopeless(&node, false) {
            return Err(error);
        }
        since = Some(Instant::now());
        let from_step = remote.last_checkpoint().map_or(0, |(version, _)| version.step);
        let steps_repeated = monitor.steps.accepted.saturating_sub(from_step);
        tell(&node, &at, &why, &format!("it is started again, and the run goes on from step {from_step}"));
        restarts.push(Restart { node: node.clone(), at, from_step, steps_repeated, outage_s: 0.0 });
        remote.restart(&node)?;
        let now = gather(scene, remote, patience, restarts)?;
        if let Some((node, _)) =
            manifests.iter().find(|(node, known)| now.get(*node).map(|it| &it.ports) != Some(&known.ports))
        {
            let difference = "it was started again with other ports".into();
            return Err(RunError::Foreign { node: node.clone(), difference });
        }
    }
}

/// The controller from the last checkpoint, or from the start.
fn controller(
    scene: &Scene,
    remote: &Remote<'_>,
    plan: &mut Plan,
    manifests: &BTreeMap<String, Manifest>,
    monitor: &mut Monitor,
) -> Result<CouplingController, RunError> {
    let measured = stagger_coupling::measured(&ports(manifests), plan);
    let mut controller = CouplingController::new(&scene.coupling, plan, &measured, scene.duration_s);
    let failed = |source| SolveError::Snapshot { node: stagger_coupling::COORDINATOR.into(), what: "restored", source };
    let saved = match remote.last_checkpoint() {
        Some((version, checkpoint)) => {
            plan.from = Some(version);
            let saved = controller.restore(&checkpoint.coordinator)?;
            let committed = controller.control.committed();
            if committed != version {
                let contradiction =
                    format!("the checkpoint is of {version}, but the step control in it had reached {committed}");
                return Err(SolveError::Mismatch(contradiction).into());
            }
            Some(saved)
        }
        None => None,
    };
    monitor.restore(saved).map_err(failed)?;
    Ok(controller)
}

fn may_restart(scene: &Scene, restarts: &[Restart]) -> bool {
    scene.recovery.checkpoint_steps > 0 && restarts.len() < scene.recovery.restarts as usize
}

fn tell(node: &str, at: &str, why: &str, what: &str) {
    diagnostics::warn(&format!("node `{node}` is gone, in {at}: {why}; {what}"));
}
