//! `--resume FILE[@STEP]`: what a run goes on from.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use stagger_messages::{Checkpoint, FieldMessage};
use stagger_recordings::{Recording, RecordingError};
use stagger_scene::Scene;

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
    /// Its checkpoint says two things of itself.
    #[error(
        "--resume {}: its checkpoint contradicts itself: {contradiction}; it was damaged or changed after it was recorded: \
         go on from an earlier one with --resume {}@STEP",
        .file.display(), .file.display()
    )]
    Contradiction {
        /// The file.
        file: PathBuf,
        /// What does not fit.
        contradiction: String,
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
    if let Some(contradiction) = contradiction(&checkpoint) {
        return Err(ResumeError::Contradiction { file: file.into(), contradiction });
    }
    let step = checkpoint.version().step;
    Ok((checkpoint, step))
}

/// What a checkpoint says that cannot be so beside the rest of it; nodes would wait for ever for what it promises.
fn contradiction(checkpoint: &Checkpoint) -> Option<String> {
    let Some(version) = checkpoint.envelope.as_ref().and_then(|envelope| envelope.version) else {
        return Some("it does not say which step it is of".into());
    };
    let mut names = BTreeSet::new();
    for snapshot in &checkpoint.nodes {
        let Some(envelope) = &snapshot.envelope else { return Some("a state in it is of no node".into()) };
        let node = &envelope.sender;
        if !names.insert(node) {
            return Some(format!("it has two states of `{node}`"));
        }
        if envelope.version != Some(version) {
            let at = envelope.version.map_or("no step".into(), |at| at.to_string());
            return Some(format!("it is of {version}, but the state of `{node}` is of {at}"));
        }
        let committed = snapshot.committed.unwrap_or_default();
        if committed > version {
            return Some(format!("it is of {version}, but `{node}` had committed {committed}"));
        }
        let at =
            |field: &FieldMessage| field.envelope.as_ref().and_then(|envelope| envelope.version).unwrap_or_default();
        if let Some(at) = snapshot.fields.iter().chain(&snapshot.frozen).map(at).find(|at| *at > version) {
            return Some(format!("it is of {version}, but `{node}` holds a field of {at}"));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use stagger_messages::{Envelope, Snapshot, Version};

    use super::*;

    fn about(sender: &str, step: u64) -> Option<Envelope> {
        Some(Envelope { sender: sender.into(), version: Some(Version::first(step)), ..Envelope::default() })
    }

    fn state(node: &str, step: u64, committed: u64) -> Snapshot {
        let field = FieldMessage { envelope: about(node, committed), ..FieldMessage::default() };
        let frozen = FieldMessage { envelope: about("other", 3), ..FieldMessage::default() };
        Snapshot {
            envelope: about(node, step),
            committed: Some(Version::first(committed)),
            state: Vec::new(),
            fields: vec![field],
            frozen: vec![frozen],
        }
    }

    #[test]
    fn a_checkpoint_that_contradicts_itself_is_told_from_one_with_a_slower_node() {
        let right = Checkpoint {
            envelope: about("coordinator", 10),
            coordinator: Vec::new(),
            nodes: vec![state("a", 10, 10), state("slower", 10, 8)],
        };
        assert_eq!(contradiction(&right), None);
        let told = |change: fn(&mut Checkpoint)| {
            let mut wrong = right.clone();
            change(&mut wrong);
            contradiction(&wrong).unwrap()
        };
        let of_many = told(|it| it.envelope = about("coordinator", 1_000_000));
        assert!(of_many.contains("step 1000000") && of_many.contains("the state of `a` is of step 10"), "{of_many}");
        assert!(told(|it| it.envelope = None).contains("does not say"));
        let attempt = |it: &mut Checkpoint| {
            it.nodes[0].committed = Some(Version { attempt: u32::MAX, ..Version::first(10) });
        };
        assert!(told(attempt).contains("`a` had committed"));
        assert!(told(|it| it.nodes[1] = state("a", 10, 10)).contains("two states of `a`"));
        assert!(told(|it| it.nodes[0].fields[0].envelope = about("a", 11)).contains("holds a field of step 11"));
        assert!(told(|it| it.nodes[0].frozen[0].envelope = about("a", 99)).contains("holds a field of step 99"));
        assert!(told(|it| it.nodes[0].envelope = None).contains("of no node"));
    }
}
