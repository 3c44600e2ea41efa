//! A program of its own in the place of a recorded node: it is told over Zenoh what that node was told, and answers.

use stagger_runtime::launch::roster::Runs;
use std::time::Duration;

use stagger_messages::{Directive, Field, Fields, Manifest, Plan, Port, SCHEMA_VERSION, Snapshot, Version};
use stagger_recordings::Recording;
use stagger_scene::Scene;

use crate::conformance::{Bench, heard::Fault, session::Session};

/// The process of a node, and its half of the recorded run.
pub(super) struct Plugged {
    session: Session,
}

impl Plugged {
    /// Starts `command` as `node` of a run of its own.
    ///
    /// # Errors
    /// It does not start, or does not announce itself as that node of that scene.
    pub fn start(recording: &Recording, scene: Scene, node: &str, command: Vec<String>) -> Result<Self, Fault> {
        let patience = Duration::from_secs_f64(scene.recovery.hang_s.max(scene.recovery.start_s));
        let bench = Bench {
            scene,
            scene_file: None,
            files: Some(std::path::absolute(recording.path()).unwrap_or_else(|_| recording.path().into())),
            node: node.into(),
            runs: Runs::Command(command),
            run: format!("{}-verify-{}", recording.info.run, std::process::id()),
            patience,
        };
        let session = Session::start(&bench)?;
        let Manifest { schema, scene_hash, .. } = session.manifest;
        if (schema, scene_hash) != (SCHEMA_VERSION, bench.scene.hash) {
            return Err(Fault::new(
                format!("schema {SCHEMA_VERSION} and the hash {:016x} of the recorded scene", bench.scene.hash),
                format!("schema {schema} and the hash {scene_hash:016x}"),
            ));
        }
        Ok(Self { session })
    }

    /// Tells it who reads from whom, and the snapshot the recorded run went on from.
    pub fn plan(&mut self, plan: &Plan, snapshot: Option<&Snapshot>) -> Result<(), Fault> {
        if let Some(snapshot) = snapshot {
            self.session.offer(snapshot)?;
        }
        self.session.plan(plan)
    }

    /// Waits until it holds all it starts from, at `from`; what it published at `version`, which it committed last.
    pub fn ready(&mut self, from: Version, version: Version) -> Result<Fields, Fault> {
        self.session.ready(0, from)?;
        self.session.published(version, 0)
    }

    /// Gives it a recorded field of another node.
    pub fn give(&mut self, sender: &str, version: Version, field: &Field) -> Result<(), Fault> {
        self.session.put(sender, field, version, None)
    }

    /// Tells it what the recorded node was told.
    pub fn direct(&mut self, directive: &Directive) -> Result<(), Fault> {
        self.session.pass_on(directive)
    }

    /// Fields it writes.
    pub fn writes(&self) -> Vec<Port> {
        self.session.ports().writes
    }

    /// Waits for its answer to a trial.
    pub fn answer(&mut self, version: Version) -> Result<Fields, Fault> {
        Ok(self.session.answer(version, 0)?.fields)
    }

    /// The run accepted `version`: what came before it is forgotten.
    pub fn accepted(&mut self, version: Version) {
        self.session.forget(version);
    }
}

impl Drop for Plugged {
    fn drop(&mut self) {
        self.session.dismiss();
    }
}
