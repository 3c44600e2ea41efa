//! What is kept of a run while it goes on: its recording, and what a viewer is shown.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, OpenOptions},
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use stagger_messages::{Manifest, keys};
use stagger_recordings::{Exchange, Level, Recorder, RecorderOptions, RecordingError, RunInfo};
use stagger_scene::{self, Scene};

use crate::{
    coordinator::backpressure::Backpressure,
    diagnostics,
    link::{Declaration, Link, shared_memory},
    run::{
        Failed,
        outputs::{self, Draft, OutputError, Replace},
        scene_files::patiently,
        summary::Recorded,
        view,
    },
};

/// Names that are tried before all of them count as taken.
const NAMES: u32 = 1_000_000;

/// Where a run is to be recorded.
#[derive(Clone, Debug)]
pub struct Target {
    /// The file.
    pub path: PathBuf,
    /// What it may replace.
    pub replace: Replace,
    /// Whether a number is added to the name where it is taken.
    pub numbered: bool,
}

impl Target {
    /// The names to try, in their order: `quick.mcap`, `quick-2.mcap`, `quick-3.mcap`.
    fn names(&self) -> impl Iterator<Item = PathBuf> + '_ {
        let numbered = |number: u32| {
            let mut name = self.path.file_stem().unwrap_or_default().to_owned();
            name.push(format!("-{number}"));
            if let Some(extension) = self.path.extension() {
                name.push(".");
                name.push(extension);
            }
            self.path.with_file_name(name)
        };
        let last = if self.numbered { NAMES } else { 1 };
        std::iter::once(self.path.clone()).chain((2..=last).map(numbered))
    }
}

/// A recording under way.
struct Recording {
    target: Target,
    /// `None` where it is a stream, which has its name from the start.
    draft: Option<Draft>,
    /// The name it has; `None` for as long as it has none.
    path: Option<PathBuf>,
    recorder: Recorder,
}

impl Recording {
    fn start(
        target: &Target,
        info: &RunInfo,
        options: RecorderOptions,
        interrupted: &AtomicBool,
    ) -> Result<Self, Failed> {
        let path = &target.path;
        let failed = |source| OutputError::Io { path: path.clone(), source };
        target.replace.allows(path).or_else(|error| if target.numbered { Ok(()) } else { Err(error) })?;
        if outputs::is_stream(path) {
            let (stream, whom) = (path.clone(), format!("somebody to read {}", path.display()));
            let given_up = || interrupted.load(Ordering::Relaxed);
            let output = patiently(&whom, given_up, move || OpenOptions::new().write(true).open(stream));
            let recorder = Recorder::create(output.map_err(failed)?, info, options)?;
            return Ok(Self { target: target.clone(), draft: None, path: Some(path.clone()), recorder });
        }
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(failed)?;
        }
        outputs::sweep(path);
        let draft = Draft::beside(path)?;
        // The limit holds for files, not for pipes.
        let options = RecorderOptions { largest_bytes: shared_memory::largest_file_bytes(), ..options };
        let recorder = Recorder::create(draft.handle()?, info, options)?;
        Ok(Self { target: target.clone(), draft: Some(draft), path: None, recorder })
    }

    /// Gives it the first name that is free.
    fn place(&mut self) -> Result<(), OutputError> {
        let Some(mut draft) = self.draft.take() else { return Ok(()) };
        let mut names = self.target.names().peekable();
        while let Some(name) = names.next() {
            match draft.place(&name, self.target.replace) {
                Err(error) if !error.is_refusal() || names.peek().is_none() => return Err(error),
                Err(_) => {}
                Ok(()) => {
                    if name != self.target.path {
                        let (taken, name) = (self.target.path.display(), name.display());
                        diagnostics::note(&format!("{taken} exists already: this run is recorded in {name}"));
                    }
                    self.path = Some(name);
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

/// The recording of a run, and its stream to a viewer.
pub struct Records {
    recording: Option<Recording>,
    viewer: Option<view::Stream>,
    subscription: Option<Declaration>,
    run: String,
    /// The fields to keep, where they are named.
    fields: Vec<String>,
}

impl Records {
    /// Starts to record into `target` and to show the run in the bridge `viewer`. The recording has its name once it is
    /// [placed](Self::place).
    ///
    /// # Errors
    /// The file may not be replaced or cannot be written, the bridge cannot be started, or the link fails.
    pub fn start(
        link: &Link,
        info: &RunInfo,
        scene: &Scene,
        target: Option<&Target>,
        viewer: Option<&PathBuf>,
        interrupted: &AtomicBool,
    ) -> Result<Self, Failed> {
        let options = RecorderOptions {
            level: match scene.record.level {
                stagger_scene::Level::All => Level::All,
                stagger_scene::Level::Accepted => Level::Accepted,
            },
            every: scene.record.every,
            checkpoints: scene.recovery.checkpoint_steps > 0,
            fields: scene.record.fields.clone().map(BTreeSet::from_iter),
            frame_period_s: (scene.record.frames > 0).then(|| scene.duration_s / scene.record.frames as f64),
            queue_bytes: usize::try_from(scene.record.buffer_bytes).unwrap_or(usize::MAX),
            ..RecorderOptions::default()
        };
        let mut records = Self {
            recording: target.map(|target| Recording::start(target, info, options, interrupted)).transpose()?,
            viewer: viewer.map(|bridge| view::Stream::start(bridge, info, &[], false)).transpose()?,
            subscription: None,
            run: info.run.clone(),
            fields: scene.record.fields.clone().unwrap_or_default(),
        };
        let file = records.recording.as_ref().map(|recording| recording.recorder.sender());
        let viewer = records.viewer.as_ref().map(view::Stream::sender);
        if file.is_some() || viewer.is_some() {
            let behind = AtomicBool::new(false);
            records.subscription = Some(link.subscribe_first(&keys::all(&info.run), move |sample| {
                let topic = keys::topic(&sample.key);
                let Some(exchange) = Exchange::from_parts(topic, sample.attachment, sample.payload) else { return };
                // The run waits for its recording, but leaves a viewer behind.
                if let Some(viewer) = &viewer
                    && !behind.load(Ordering::Relaxed)
                    && (!viewer.has_room(&exchange) || viewer.push(exchange.clone()).is_err())
                {
                    behind.store(true, Ordering::Relaxed);
                    diagnostics::warn("the viewer has ended or cannot keep up: the run goes on without it");
                }
                // Transport threads must not wait: `Backpressure` does, and tells where the recording has ended.
                if let Some(file) = &file {
                    let _ = file.hand_over(exchange);
                }
            })?);
        }
        Ok(records)
    }

    /// What keeps the run from making more than is recorded; `None` where it is not.
    #[must_use]
    pub fn backpressure(&self) -> Option<Backpressure> {
        self.recording.as_ref().map(|recording| Backpressure::of(recording.recorder.sender()))
    }

    /// The name of the recording, once it has one.
    #[must_use]
    pub fn path(&self) -> Option<PathBuf> {
        self.recording.as_ref().and_then(|recording| recording.path.clone())
    }

    /// Gives the recording its name: its head is whole, and the run begins.
    ///
    /// # Errors
    /// Somebody has taken the name meanwhile, or the system refuses.
    pub fn place(&mut self) -> Result<(), OutputError> {
        self.recording.as_mut().map_or(Ok(()), Recording::place)
    }

    /// Records what the nodes have said of themselves.
    pub fn manifests(&mut self, manifests: &BTreeMap<String, Manifest>) {
        use prost::Message as _;
        let ports = manifests.values().filter_map(|manifest| manifest.ports.as_ref());
        let written: BTreeSet<&str> = ports.flat_map(|ports| &ports.writes).map(|port| port.field.as_str()).collect();
        for field in self.fields.iter().filter(|field| !written.contains(field.as_str())) {
            let known = written.iter().copied().collect::<Vec<_>>().join(", ");
            diagnostics::warn(&format!("record.fields: no node writes `{field}`; fields are {known}"));
        }
        for (node, manifest) in manifests {
            let key = keys::manifest(&self.run, node);
            let message = manifest.encode_to_vec().into();
            let Some(exchange) = Exchange::from_parts(keys::topic(&key), bytes::Bytes::new(), message) else {
                continue;
            };
            let file = self.recording.iter().map(|recording| recording.recorder.sender());
            for sender in file.chain(self.viewer.iter().map(view::Stream::sender)) {
                // As above: the recorder tells its own error.
                let _ = sender.push(exchange.clone());
            }
        }
    }

    /// Waits until everything is written. `None` where there is no recording, or none that was given a name.
    ///
    /// # Errors
    /// Something could not be written.
    pub fn finish(mut self, waited: Duration) -> Result<Option<Recorded>, RecordingError> {
        drop(self.subscription.take());
        match self.viewer.take().map(view::Stream::finish) {
            Some(Err(error)) => diagnostics::warn(&format!("the run was not shown to its end: {error}")),
            Some(Ok(status)) if !status.success() => {
                diagnostics::warn(&format!("the run was not shown to its end: stagger-view ended with {status}"));
            }
            Some(Ok(_)) | None => {}
        }
        let Some(Recording { path: Some(path), recorder, .. }) = self.recording.take() else { return Ok(None) };
        let recorded = recorder.finish()?;
        Ok(Some(Recorded {
            path: path.display().to_string(),
            messages: recorded.messages,
            bytes: recorded.file_bytes,
            lost: recorded.lost,
            waited_s: waited.as_secs_f64(),
        }))
    }
}
