//! The files a scene names: beside it, or in a recording of it.

use std::path::Path;

use stagger_recordings::{Recording, RunInfo};
use stagger_solver::scene::{Problems, Scene};

/// Parses the scene in the file `scene`. Relative paths in it begin at its folder; what is not there is taken from
/// `recording`, where one is given.
///
/// # Errors
/// Every mistake in the scene, a file that cannot be read included.
pub fn parse(
    text: &str,
    scene: &Path,
    overrides: &[(String, String)],
    recording: Option<&Path>,
) -> Result<Scene, Problems> {
    let read = |path: &str| {
        let beside = std::fs::read(scene.parent().unwrap_or(Path::new("")).join(path));
        beside.or_else(|error| match recording.map(Recording::open) {
            None => Err(error.to_string()),
            Some(Ok(recording)) => kept(&recording.info, path).map_err(|also| format!("{error}, and {also}")),
            Some(Err(also)) => Err(format!("{error}, and {also}")),
        })
    };
    Scene::parse_with_files(text, &scene.display().to_string(), overrides, &read)
}

/// Parses the scene a recording holds, with the files it holds.
///
/// # Errors
/// Every mistake in the scene: a recording of an older program may have some.
pub fn recorded(info: &RunInfo) -> Result<Scene, Problems> {
    Scene::parse_with_files(&info.scene_text, &info.scene_file, &info.overrides, &|path| kept(info, path))
}

fn kept(info: &RunInfo, path: &str) -> Result<Vec<u8>, String> {
    info.files.get(path).map(|contents| contents.to_vec()).ok_or_else(|| "the recording does not hold it".into())
}
