//! What a recording says about its run besides the messages.

use std::{collections::BTreeMap, sync::Arc};

use stagger_config::Problems;
use stagger_scene::Scene;

use crate::RecordingError;

/// What a recording says about its run besides the messages.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RunInfo {
    /// Name of the run.
    pub run: String,
    /// The scene's file name, as given by the user.
    pub scene_file: String,
    /// The scene's text, before overrides.
    pub scene_text: String,
    /// The files the scene names, by their paths as it writes them; left out where this is shown as JSON.
    #[serde(skip)]
    pub files: BTreeMap<String, Arc<[u8]>>,
    /// Hash of the scene with its overrides and files; all nodes and the coordinator agree on it.
    pub scene_hash: u64,
    /// Keys and values set on the command line.
    pub overrides: Vec<(String, String)>,
    /// Nodes that were not solved but answered as in a recording, and its file.
    #[serde(default)]
    pub replayed: BTreeMap<String, String>,
    /// Nodes whose own physics was replaced by a program, and its command line.
    #[serde(default)]
    pub commands: BTreeMap<String, String>,
    /// Seed of the run.
    pub seed: u64,
    /// Name and version of the program that recorded.
    pub program: String,
    /// Wall clock at the start, in ns since 1970.
    pub started_unix_ns: u64,
    /// What the run ran on: processor, threads, system.
    pub machine: BTreeMap<String, String>,
}

/// Key of the checksum of the others.
const CHECKSUM: &str = "checksum";

/// Of all keys and values but the checksum itself.
fn checksum(map: &BTreeMap<String, String>) -> String {
    let others = map.iter().filter(|(key, _)| *key != CHECKSUM);
    let bytes: Vec<u8> =
        others.flat_map(|(key, value)| [key.as_bytes(), b"\n", value.as_bytes(), b"\n"].concat()).collect();
    format!("{:016x}", stagger_messages::codec::hash(&bytes))
}

impl RunInfo {
    /// The scene that was recorded, with the files that were.
    ///
    /// # Errors
    /// Every mistake in the scene: a recording of an older program may have some.
    pub fn scene(&self) -> Result<Scene, Problems> {
        Scene::parse_with_files(&self.scene_text, &self.scene_file, &self.overrides, &|path| self.file(path))
    }

    /// The contents of a file the scene names, by its path as the scene writes it.
    ///
    /// # Errors
    /// It was not recorded, in words.
    pub fn file(&self, path: &str) -> Result<Vec<u8>, String> {
        self.files.get(path).map(|contents| contents.to_vec()).ok_or_else(|| "the recording does not hold it".into())
    }

    /// Everything but the scene's text and the contents of its files, as MCAP metadata.
    pub(crate) fn to_metadata(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::from([
            ("run".into(), self.run.clone()),
            ("scene_file".into(), self.scene_file.clone()),
            ("scene_hash".into(), format!("{:016x}", self.scene_hash)),
            ("seed".into(), self.seed.to_string()),
            ("program".into(), self.program.clone()),
            ("started_unix_ns".into(), self.started_unix_ns.to_string()),
        ]);
        for (number, (key, value)) in self.overrides.iter().enumerate() {
            // The number keeps the order, which matters where a key is set twice.
            map.insert(format!("override.{number:04}"), format!("{key}={value}"));
        }
        for (number, path) in self.files.keys().enumerate() {
            map.insert(format!("file.{number:04}"), path.clone());
        }
        map.extend(self.replayed.iter().map(|(node, file)| (format!("replayed.{node}"), file.clone())));
        map.extend(self.commands.iter().map(|(node, command)| (format!("command.{node}"), command.clone())));
        map.extend(self.machine.iter().map(|(key, value)| (format!("machine.{key}"), value.clone())));
        map.insert(CHECKSUM.into(), checksum(&map));
        map
    }

    /// The paths of the scene's files that metadata names.
    pub(crate) fn files_in(map: &BTreeMap<String, String>) -> impl Iterator<Item = &String> {
        map.iter().filter(|(key, _)| key.starts_with("file.")).map(|(_, path)| path)
    }

    /// Reads back what [`Self::to_metadata`] wrote.
    pub(crate) fn from_metadata(
        map: &BTreeMap<String, String>,
        scene_text: String,
        files: BTreeMap<String, Arc<[u8]>>,
    ) -> Result<Self, RecordingError> {
        let text = |key: &str| map.get(key).cloned().unwrap_or_default();
        // Metadata is read before any checksum of the container is known. Recordings of older programs have none.
        if map.get(CHECKSUM).is_some_and(|value| *value != checksum(map)) {
            return Err(RecordingError::BadRun { key: CHECKSUM.into(), value: text(CHECKSUM) });
        }
        let number = |key: &str, radix| {
            let value = text(key);
            u64::from_str_radix(&value, radix).map_err(|_| RecordingError::BadRun { key: key.into(), value })
        };
        let overrides = map.iter().filter(|(key, _)| key.starts_with("override."));
        let behind = |prefix: &str| -> BTreeMap<String, String> {
            map.iter().filter_map(|(key, value)| Some((key.strip_prefix(prefix)?.into(), value.clone()))).collect()
        };
        Ok(Self {
            run: text("run"),
            scene_file: text("scene_file"),
            scene_text,
            files,
            scene_hash: number("scene_hash", 16)?,
            overrides: overrides
                .filter_map(|(_, pair)| pair.split_once('='))
                .map(|(k, v)| (k.into(), v.into()))
                .collect(),
            seed: number("seed", 10)?,
            program: text("program"),
            started_unix_ns: number("started_unix_ns", 10)?,
            replayed: behind("replayed."),
            commands: behind("command."),
            machine: behind("machine."),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_keeps_everything_and_the_order_of_overrides() {
        let info = RunInfo {
            run: "r".into(),
            scene_text: "title = \"a\"\n".into(),
            scene_hash: u64::MAX - 1,
            files: [("bed.csv".to_owned(), b"x,y".as_slice().into())].into(),
            overrides: (0..12).map(|i| (format!("key{}", 11 - i), format!("a=b{i}"))).collect(),
            seed: 7,
            replayed: [("optics".to_owned(), "old=run.mcap".to_owned())].into(),
            commands: [("thermal".to_owned(), "python3 own.py".to_owned())].into(),
            machine: [("threads".to_owned(), "2".to_owned())].into(),
            ..RunInfo::default()
        };
        let map = info.to_metadata();
        assert!(RunInfo::files_in(&map).eq(info.files.keys()));
        assert_eq!(RunInfo::from_metadata(&map, info.scene_text.clone(), info.files.clone()).unwrap(), info);
    }

    #[test]
    fn damaged_numbers_are_named() {
        let mut map = RunInfo::default().to_metadata();
        map.insert("seed".into(), "seven".into());
        let refusal = |map: &BTreeMap<String, String>| {
            RunInfo::from_metadata(map, String::new(), BTreeMap::new()).unwrap_err().to_string()
        };
        assert!(refusal(&map).contains("`checksum` is"), "{}", refusal(&map));
        // As an older program wrote it.
        map.remove(CHECKSUM);
        assert!(refusal(&map).contains("`seed` is `seven`"), "{}", refusal(&map));
    }
}
