//! `--resume FILE[@STEP]`: what a run goes on from.

use std::path::{Path, PathBuf};

use stagger_messages::Checkpoint;
use stagger_recordings::{Recording, RecordingError};
use stagger_solver::scene::Scene;

/// Why a run cannot go on from a recording.
#[derive(Debug, thiserror::Error)]
pub enum ResumeError {
    /// Neither a file nor a file and a step.
    #[error("--resume {0}: expected a recording, or a recording and a step such as run.mcap@200")]
    Usage(String),
    /// It cannot be read.
    #[error("--resume {}: {source}", .file.display())]
    Recording {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: RecordingError,
    },
    /// It is of another scene.
    #[error(
        "--resume {}: it was recorded from another scene or with other --set values ({recorded:016x}, this is {given:016x}): \
         give the scene and the values it was recorded with",
        .file.display()
    )]
    Scene {
        /// The file.
        file: PathBuf,
        /// Hash of the scene it was recorded from.
        recorded: u64,
        /// Hash of the scene given.
        given: u64,
    },
    /// It has no checkpoint to go on from.
    #[error("--resume {}: it has no checkpoint {wanted}: recovery.checkpoint of the scene says how often one is taken", .file.display())]
    NoCheckpoint {
        /// The file.
        file: PathBuf,
        /// At or before what.
        wanted: String,
    },
}

/// The file and the step that `text`, `FILE[@STEP]`, names.
#[must_use]
pub fn parts(text: &str) -> (&str, Option<&str>) {
    match text.rsplit_once('@').filter(|_| !Path::new(text).exists()) {
        None => (text, None),
        Some((file, step)) => (file, Some(step)),
    }
}

/// Reads the checkpoint that `text`, `FILE[@STEP]`, names; returns it with its step.
///
/// # Errors
/// The file cannot be read, is of another scene, or has no such checkpoint.
pub fn resume(text: &str, scene: &Scene) -> Result<(Checkpoint, u64), ResumeError> {
    let (file, step) = parts(text);
    let step = step.map(|step| step.parse::<u64>().map_err(|_| ResumeError::Usage(text.into()))).transpose()?;
    let failed = |source| ResumeError::Recording { file: file.into(), source };
    let recording = Recording::open(file).map_err(failed)?;
    let (recorded, given) = (recording.info.scene_hash, scene.hash);
    if recorded != given {
        return Err(ResumeError::Scene { file: file.into(), recorded, given });
    }
    let checkpoint = recording.checkpoint(step).map_err(failed)?;
    let wanted = step.map_or("at all".to_owned(), |step| format!("at or before step {step}"));
    let checkpoint = checkpoint.ok_or(ResumeError::NoCheckpoint { file: file.into(), wanted })?;
    let step = checkpoint.version().step;
    Ok((checkpoint, step))
}
