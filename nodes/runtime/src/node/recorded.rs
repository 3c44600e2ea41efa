//! A recorded node in the place of a live one: it answers a trial with what it answered when it was recorded.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use stagger_coupling::{Answer, Frozen, Participant, RecordedSchedule, SolveError, Window};
use stagger_messages::{Directive, Fields, Ports, Ready, Source, Version};
use stagger_recordings::{Body, End, Recording, RecordingError, Replies, Reply};
use stagger_scene::Scene;

use crate::diagnostics;

/// What to do where a recording has no answer.
const ELSE: &str = "run more of the nodes live, or record again";

/// Why a recorded node cannot stand in for a live one.
#[derive(Debug, thiserror::Error)]
pub enum ReplayedError {
    /// Its recording cannot be read.
    #[error("--replayed {node}={}: {source}", .file.display())]
    Recording {
        /// The node.
        node: String,
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: Box<RecordingError>,
    },
    /// The recording has no node of that name.
    #[error("--replayed {node}={}: the recording has no node `{node}`: it has {}", .file.display(), .nodes.join(", "))]
    NoNode {
        /// The node.
        node: String,
        /// The file.
        file: PathBuf,
        /// Those it has.
        nodes: Vec<String>,
    },
    /// Two recordings that took other steps.
    #[error(
        "--replayed: {} and {} took other steps or iterations: give one recording for all nodes",
        .0.display(), .1.display()
    )]
    Schedules(PathBuf, PathBuf),
}

impl ReplayedError {
    fn recording(node: &str, file: &Path, source: RecordingError) -> Self {
        Self::Recording { node: node.into(), file: file.into(), source: Box::new(source) }
    }
}

/// The recorded nodes of a run.
#[derive(Clone, Debug, Default)]
pub struct Replays {
    /// Recording by node.
    pub files: BTreeMap<String, PathBuf>,
    /// The schedule all of them were recorded on; `None` where there are none.
    pub schedule: Option<Arc<RecordedSchedule>>,
}

impl Replays {
    /// Reads the schedule of the recordings, and finds out whether they have these nodes.
    ///
    /// # Errors
    /// A recording cannot be read, lacks the node, or took another schedule than the others.
    pub fn new(files: BTreeMap<String, PathBuf>, scene: &Scene) -> Result<Self, ReplayedError> {
        let mut schedules: Vec<(PathBuf, RecordedSchedule)> = Vec::new();
        for (node, file) in &files {
            let replayed = Replayed::open(file, node)?;
            if schedules.iter().any(|(other, _)| other == file) {
                continue;
            }
            if replayed.recording.info.scene_hash != scene.hash {
                let file = file.display();
                diagnostics::note(&format!(
                    "{file} is of another scene or other --set values: its nodes answer as then"
                ));
            }
            let failed = |source| ReplayedError::recording(node, file, source);
            let schedule = schedule(&replayed.recording).map_err(failed)?;
            if let Some((other, _)) = schedules.first().filter(|(_, known)| *known != schedule) {
                return Err(ReplayedError::Schedules(other.clone(), file.clone()));
            }
            schedules.push((file.clone(), schedule));
        }
        let schedule = schedules.into_iter().next().map(|(_, schedule)| Arc::new(schedule));
        Ok(Self { files, schedule })
    }
}

/// The schedule a recorded run took, up to where it can be read.
fn schedule(recording: &Recording) -> Result<RecordedSchedule, RecordingError> {
    let mut schedule = RecordedSchedule::default();
    for message in recording.control_messages()?.map_while(Result::ok) {
        if let Body::Directive(Directive { decision: Some(decision), .. }) = message.body {
            schedule.take(&decision);
        }
    }
    Ok(schedule)
}

/// A node as it was recorded. It computes nothing, and does not look at what it is given.
pub struct Replayed {
    node: String,
    recording: Recording,
    ports: Ports,
    replies: Replies,
    /// The reply given last, and the one behind it that nobody has asked for yet.
    last: Option<Reply>,
    ahead: Option<Reply>,
}

impl Replayed {
    /// The node `node` of the recording `file`.
    ///
    /// # Errors
    /// The recording cannot be read, or has no such node.
    pub fn open(file: &Path, node: &str) -> Result<Self, ReplayedError> {
        let failed = |source| ReplayedError::recording(node, file, source);
        let recording = Recording::open(file).map_err(failed)?;
        let replies = Replies::of(&recording, node).map_err(failed)?;
        let Some(ports) = replies.ports.get(node).cloned() else {
            let nodes = replies.ports.into_keys().collect();
            return Err(ReplayedError::NoNode { node: node.into(), file: file.into(), nodes });
        };
        Ok(Self { node: node.into(), recording, ports, replies, last: None, ahead: None })
    }

    /// The reply to a trial. Trials are asked for in their order, but where a run goes back to a checkpoint.
    fn reply(&mut self, version: Version) -> Result<Reply, SolveError> {
        let passed = self.last.as_ref().map_or(Version::INITIAL, |last| last.version);
        if version < passed {
            let replies = Replies::of(&self.recording, &self.node);
            self.replies = replies.map_err(|error| self.refuse(version, &error.to_string()))?;
            (self.last, self.ahead) = (None, None);
        }
        loop {
            if let Some(last) = self.last.as_ref().filter(|last| last.version == version) {
                return Ok(last.clone());
            }
            match self.ahead.take().or_else(|| self.replies.next()) {
                Some(reply) if reply.version > version => {
                    let why = format!("that run went on to {} instead; {ELSE}", reply.version);
                    self.ahead = Some(reply);
                    return Err(self.refuse(version, &why));
                }
                Some(reply) => self.last = Some(reply),
                None => return Err(self.refuse(version, &self.ended())),
            }
        }
    }

    /// How far the recording goes.
    fn ended(&self) -> String {
        let (version, t_s) = self.replies.reached();
        let how = match self.replies.end() {
            Some(End::CutOff) => "the recording is cut off".to_owned(),
            Some(End::Damaged(why)) => why.clone(),
            Some(End::Closed) | None => "the recording ends".to_owned(),
        };
        format!("{how} after {version}, at t = {t_s:e} s; shorten the duration, or {ELSE}")
    }

    fn refuse(&self, version: Version, why: &str) -> SolveError {
        let field = self.ports.writes.first().map_or("", |port| port.field.as_str());
        self.refuse_field(version, field, why)
    }

    fn refuse_field(&self, version: Version, field: &str, why: &str) -> SolveError {
        let file = self.recording.path().display();
        let message = format!("it is replayed from {file}, which holds no `{field}` of {version}: {why}");
        SolveError::Replayed { message, retry: false }
    }
}

impl Participant for Replayed {
    fn ports(&self) -> Ports {
        self.ports.clone()
    }

    fn initial(&mut self) -> Result<(Fields, Ready), SolveError> {
        let from = self.replies.from;
        if from != Version::INITIAL {
            let why =
                format!("that run began with the checkpoint of {from}; go on from there with --resume, or {ELSE}");
            return Err(self.refuse(Version::INITIAL, &why));
        }
        match self.ports.writes.iter().find(|port| !self.replies.initial.contains_key(&port.field)) {
            Some(port) => Err(self.refuse_field(Version::INITIAL, &port.field, &self.ended())),
            None => Ok((self.replies.initial.clone(), self.replies.ready.clone())),
        }
    }

    fn set_sources(&mut self, _sources: &[Source]) {}

    fn solve(&mut self, version: Version, window: Window, _frozen: &Frozen) -> Result<Answer, SolveError> {
        let reply = self.reply(version)?;
        let done = match reply.result {
            Ok(done) => done,
            Err(failure) => {
                let message = format!("when it was recorded: {}", failure.message);
                return Err(SolveError::Replayed { message, retry: failure.retry });
            }
        };
        if reply.window != window {
            let (then, now) = (reply.window, window);
            let why = format!(
                "its window was {:e} s from t = {:e} s, not {:e} s from t = {:e} s; keep the recorded duration and steps, {ELSE}",
                then.dt_s, then.t_s, now.dt_s, now.t_s
            );
            return Err(self.refuse(version, &why));
        }
        match self.ports.writes.iter().find(|port| !reply.fields.contains_key(&port.field)) {
            Some(port) => {
                let why =
                    "fields of this iteration were left out (record.level, record.every); record with level = \"all\"";
                Err(self.refuse_field(version, &port.field, why))
            }
            None => Ok(Answer { fields: reply.fields, done }),
        }
    }

    fn commit(&mut self, _version: Version) -> Result<(), SolveError> {
        Ok(())
    }

    fn snapshot(&self) -> Result<Vec<u8>, SolveError> {
        // All it knows is in its recording.
        Ok(Vec::new())
    }

    fn restore(&mut self, _state: &[u8], _fields: Fields) -> Result<(), SolveError> {
        Ok(())
    }
}
