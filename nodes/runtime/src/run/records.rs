//! The recording of a run while it goes on: a draft until the nodes fit together, then a file with its name.

use std::{
    collections::BTreeSet,
    fs::{self, OpenOptions},
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use stagger_recordings::{Level, Recorder, RecorderOptions, RecorderSender, RecordingError, RunInfo};
use stagger_scene::{self, Scene};

use crate::{
    coordinator::sinks::Sink,
    diagnostics,
    link::shared_memory,
    run::{
        Failed,
        outputs::{self, Draft, OutputError, Replace},
        scene_files::patiently,
        summary::Recorded,
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
pub struct Recording {
    target: Target,
    /// `None` where it is a stream, which has its name from the start.
    draft: Option<Draft>,
    /// The name it has; `None` for as long as it has none.
    path: Option<PathBuf>,
    recorder: Recorder,
}

impl Recording {
    /// Starts to record into `target`, which has its name once the run [begins](Sink::begin).
    ///
    /// # Errors
    /// The file may not be replaced or cannot be written.
    pub fn start(target: &Target, info: &RunInfo, scene: &Scene, interrupted: &AtomicBool) -> Result<Self, Failed> {
        let options = options(scene);
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

    /// Its name, once it has one.
    #[must_use]
    pub fn path(&self) -> Option<&PathBuf> {
        self.path.as_ref()
    }

    /// Waits until everything is written, for a run that has `waited` for it so long. `None` where it was given no name.
    ///
    /// # Errors
    /// Something could not be written.
    pub fn finish(self, waited: Duration) -> Result<Option<Recorded>, RecordingError> {
        let Self { path: Some(path), recorder, .. } = self else { return Ok(None) };
        let recorded = recorder.finish()?;
        Ok(Some(Recorded {
            path: path.display().to_string(),
            messages: recorded.messages,
            bytes: recorded.file_bytes,
            lost: recorded.lost,
            waited_s: waited.as_secs_f64(),
        }))
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

impl Sink for Recording {
    fn sender(&self) -> RecorderSender {
        self.recorder.sender()
    }

    fn is_waited_for(&self) -> bool {
        true
    }

    fn begin(&mut self) -> Result<(), OutputError> {
        self.place()
    }
}

/// What a scene says of its recording.
fn options(scene: &Scene) -> RecorderOptions {
    RecorderOptions {
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
    }
}
