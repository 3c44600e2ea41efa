//! `--resume FILE[@STEP]`: what a run goes on from.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use stagger_messages::Checkpoint;
use stagger_recordings::{Recording, RecordingError};
use stagger_solver::scene::Scene;

/// Differing values that are told at most, and how much of each.
const MOST: usize = 3;
const SHOWN: usize = 60;

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
        "--resume {}: it was recorded from another scene or with other --set values ({recorded:016x}, this is {given:016x}){difference}: \
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
        /// The first values that differ, in words; empty where none are known.
        difference: String,
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

/// The first values in which two scenes differ, in words.
fn difference(recorded: &Scene, given: &Scene) -> String {
    let values = |scene: &Scene| -> BTreeMap<String, String> {
        scene.effective.iter().map(|value| (value.path.clone(), value.value.clone())).collect()
    };
    let (there, here) = (values(recorded), values(given));
    let keys: BTreeSet<&String> = there.keys().chain(here.keys()).collect();
    let differs = keys.into_iter().filter(|key| there.get(*key) != here.get(*key));
    let of = |value: Option<&String>| value.map_or("not there", String::as_str).chars().take(SHOWN).collect::<String>();
    let told = |key: &String| format!("{key} was {} and is {}", of(there.get(key)), of(here.get(key)));
    let told: Vec<_> = differs.take(MOST).map(told).collect();
    if told.is_empty() { String::new() } else { format!(", {}", told.join(", ")) }
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
    if recording.info.scene_hash != scene.hash {
        // An older program named scenes by their text.
        let recorded = recording.info.scene().ok();
        let (hash, given) = (recorded.as_ref().map_or(recording.info.scene_hash, |recorded| recorded.hash), scene.hash);
        if hash != given {
            let difference = recorded.map(|recorded| difference(&recorded, scene)).unwrap_or_default();
            return Err(ResumeError::Scene { file: file.into(), recorded: hash, given, difference });
        }
    }
    let checkpoint = recording.checkpoint(step).map_err(failed)?;
    let wanted = step.map_or("at all".to_owned(), |step| format!("at or before step {step}"));
    let checkpoint = checkpoint.ok_or(ResumeError::NoCheckpoint { file: file.into(), wanted })?;
    let step = checkpoint.version().step;
    Ok((checkpoint, step))
}
