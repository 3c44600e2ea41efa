//! The coordinator of a run: plan → controller → loop → supervision.
//!
//! [`Coordinator::run`] reads in this order. The nodes are [`Remote`], the ensemble of the run loop; who started them is a
//! [`Supervisor`]; whoever takes the run's messages is a [`Sink`](sinks::Sink).

pub mod backpressure;
mod checkpoints;
mod ensemble;
mod error;
mod events;
pub mod monitor;
mod remote;
pub mod sinks;
pub mod supervision;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, atomic::AtomicBool},
    time::{Duration, Instant},
};

use stagger_coupling::{COORDINATOR, CouplingController, End, Ensemble as _, RecordedSchedule, SolveError};
use stagger_messages::{Checkpoint, FieldSummary, Manifest, Plan, Ports};
use stagger_scene::Scene;

pub use error::RunError;
pub use remote::Remote;
pub use supervision::Supervisor;

use crate::{
    coordinator::{
        monitor::Monitor,
        sinks::Sinks,
        supervision::{Restart, Restarts, tell},
    },
    diagnostics,
    link::{Link, LinkError},
};

/// What a run is given beside its scene.
pub struct Conditions {
    /// Name of the run.
    pub run: String,
    /// Names of its nodes.
    pub nodes: BTreeSet<String>,
    /// How long nodes may take to announce themselves.
    pub patience: Duration,
    /// The checkpoint to go on from; `None` starts at t = 0.
    pub resume: Option<Checkpoint>,
    /// The steps and iterations to repeat, where recorded nodes take part.
    pub schedule: Option<Arc<RecordedSchedule>>,
    /// Ends the run after the current step.
    pub interrupted: Arc<AtomicBool>,
}

/// Has the nodes of a scene run to the end.
pub struct Coordinator<'a> {
    scene: &'a Scene,
    patience: Duration,
    schedule: Option<Arc<RecordedSchedule>>,
    nodes: Remote<'a>,
    monitor: Monitor,
    restarts: Restarts,
    sinks: Sinks<'a>,
}

/// How a run ended, and everything that is known of it then.
pub struct Ended {
    /// Whether it reached its end, or why not.
    pub result: Result<End, RunError>,
    /// Wall time from the first directive to the last reply, in s.
    pub wall_s: f64,
    /// Counts, energy and times.
    pub monitor: Monitor,
    /// What the fields held at the end, as the nodes reported.
    pub fields: Vec<FieldSummary>,
    /// Nodes that ended without a report about their fields.
    pub missing: Vec<String>,
    /// Messages the coordinator refused.
    pub refused: u64,
    /// Nodes that were started again.
    pub restarts: Vec<Restart>,
    /// How long the run waited for its recording.
    pub waited: Duration,
}

impl<'a> Coordinator<'a> {
    /// Listens for the nodes, which `supervisor` has started.
    ///
    /// # Errors
    /// The link fails.
    pub fn new(
        scene: &'a Scene,
        link: Link,
        supervisor: &'a mut dyn Supervisor,
        sinks: Sinks<'a>,
        conditions: Conditions,
    ) -> Result<Self, LinkError> {
        let Conditions { run, nodes, patience, resume, schedule, interrupted } = conditions;
        let mut monitor = Monitor::new(scene.duration_s, interrupted);
        monitor.rejections = scene.coupling.rejections;
        let hang = Duration::from_secs_f64(scene.recovery.hang_s);
        let nodes = Remote::new(link, &run, nodes, hang, resume, supervisor)?.with_backpressure(sinks.backpressure());
        Ok(Self { scene, patience, schedule, nodes, monitor, restarts: Restarts::allowed_by(scene), sinks })
    }

    /// Runs to the end. The sinks have been given every message when this returns.
    #[must_use]
    pub fn run(mut self) -> Ended {
        let result = self.conduct();
        let wall_s = self.monitor.finish();
        if let Err(error) = &result {
            // The nodes may be gone themselves; the error above is the one to tell.
            let _ = self.nodes.finish(None, false, &error.to_string());
        }
        let Self { nodes, monitor, restarts, .. } = self;
        Ended {
            result,
            wall_s,
            monitor,
            fields: nodes.final_fields(),
            missing: nodes.without_final_report(),
            refused: nodes.refused(),
            restarts: restarts.into_list(),
            waited: nodes.waited(),
        }
    }

    fn conduct(&mut self) -> Result<End, RunError> {
        let manifests = self.gather()?;
        self.sinks.manifests(&manifests);
        // Nodes that do not fit together make no run, and leave no recording of none.
        let mut plan = self.plan(&ports(&manifests))?;
        self.sinks.begin()?;
        loop {
            let mut controller = self.controller(&ports(&manifests), &mut plan)?;
            let steps = self.scene.recovery.checkpoint_steps;
            let ended = stagger_coupling::run_loop(&mut self.nodes, &plan, &mut controller, steps, &mut self.monitor);
            self.restarts.over(self.monitor.ready_at());
            match ended {
                Ok(end) => return Ok(end),
                Err(error) => self.recover(error, &manifests)?,
            }
        }
    }

    /// Waits for the nodes; one that ends before it has announced itself is started again.
    fn gather(&mut self) -> Result<BTreeMap<String, Manifest>, RunError> {
        loop {
            let begun = Instant::now();
            match self.nodes.gather(self.scene.hash, self.patience) {
                Err(RunError::Lost { node, at, why })
                    if self.restarts.are_left() && !self.nodes.is_hopeless(&node, true) =>
                {
                    tell(&node, &at, &why, "it is started again");
                    self.nodes.restart(&node)?;
                    self.restarts.in_start(node, at, begun.elapsed());
                }
                other => return other,
            }
        }
    }

    /// Who reads from whom.
    fn plan(&self, ports: &BTreeMap<String, Ports>) -> Result<Plan, RunError> {
        let written: BTreeSet<&str> =
            ports.values().flat_map(|ports| &ports.writes).map(|port| port.field.as_str()).collect();
        let kept = self.scene.record.fields.iter().flatten();
        for field in kept.filter(|field| !written.contains(field.as_str())) {
            let known = written.iter().copied().collect::<Vec<_>>().join(", ");
            diagnostics::warn(&format!("record.fields: no node writes `{field}`; fields are {known}"));
        }
        let plan = stagger_coupling::plan(ports, &self.scene.coupling)?;
        let warnings = stagger_coupling::out_of_reach(&plan, &self.scene.coupling);
        warnings.iter().for_each(|warning| diagnostics::warn(warning));
        Ok(plan)
    }

    /// What decides, from the last checkpoint or from the start; `plan` is told which.
    fn controller(&mut self, ports: &BTreeMap<String, Ports>, plan: &mut Plan) -> Result<CouplingController, RunError> {
        let measured = stagger_coupling::measured(ports, plan);
        let mut controller = CouplingController::new(&self.scene.coupling, plan, &measured, self.scene.duration_s);
        let mut saved = None;
        if let Some((version, checkpoint)) = self.nodes.last_checkpoint() {
            plan.from = Some(version);
            saved = Some(controller.restore(&checkpoint.coordinator)?);
            let committed = controller.control.committed();
            if committed != version {
                let contradiction =
                    format!("the checkpoint is of {version}, but the step control in it had reached {committed}");
                return Err(SolveError::Mismatch(contradiction).into());
            }
        }
        let failed = |source| SolveError::Snapshot { node: COORDINATOR.into(), what: "restored", source };
        self.monitor.restore(saved).map_err(failed)?;
        if let Some(schedule) = &self.schedule {
            controller.control.follow(Arc::clone(schedule));
        }
        Ok(controller)
    }

    /// Where a node has died or hangs, has it started again, so that the run can go on from the last checkpoint; any
    /// other error, or one death too many, ends the run.
    fn recover(&mut self, error: RunError, manifests: &BTreeMap<String, Manifest>) -> Result<(), RunError> {
        let (node, at, why) = match &error {
            RunError::Lost { node, at, why } => (node.clone(), at.clone(), why.clone()),
            RunError::Silent { node, at, patience } => {
                (node.clone(), at.clone(), format!("no answer for {} s", patience.as_secs_f64()))
            }
            _ => return Err(error),
        };
        if !self.restarts.are_left() || self.nodes.is_hopeless(&node, false) {
            return Err(error);
        }
        let from_step = self.nodes.last_checkpoint().map_or(0, |(version, _)| version.step);
        let steps_repeated = self.monitor.steps.accepted.saturating_sub(from_step);
        tell(&node, &at, &why, &format!("it is started again, and the run goes on from step {from_step}"));
        self.restarts.in_run(node.clone(), at, from_step, steps_repeated);
        self.nodes.restart(&node)?;
        let now = self.gather()?;
        let differs = |(node, known): &(&String, &Manifest)| now.get(*node).map(|it| &it.ports) != Some(&known.ports);
        if let Some((node, _)) = manifests.iter().find(differs) {
            let difference = "it was started again with other ports".into();
            return Err(RunError::Foreign { node: node.clone(), difference });
        }
        Ok(())
    }
}

/// Ports by node.
#[must_use]
pub fn ports(manifests: &BTreeMap<String, Manifest>) -> BTreeMap<String, Ports> {
    manifests.iter().map(|(node, manifest)| (node.clone(), manifest.ports.clone().unwrap_or_default())).collect()
}
